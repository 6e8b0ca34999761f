"""A hose, cable or spring that hangs on what is held: it pulls harder the farther it is drawn out.

At p the robot bears f = f0 + K (p - p0) in W against it, with p the point of the load that it hangs on, p0 the middle
of the motion, and K symmetric, no axis of which a spring has below zero. What of f0 points up is weight to all poses;
acceleration alone tells it from mass, and how stiffly it is held says how large it may be.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.identify.room_bias import OF_ACCELERATION
from steelyard.inertia import forms
from steelyard.logs.alignment import Aligned
from steelyard.logs.log import MotionLog
from steelyard.sanity.after import position_of, rotation_of
from steelyard.sanity.fitted.biases import room_fit
from steelyard.sanity.fitted.full_fit import CALM, NOISE, FullFit, Rows, moves, noise_share
from steelyard.sanity.fitted.gravity import fitted_gravity
from steelyard.sanity.fitted.misplaced import misplaced
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix
from steelyard.sanity.words import axis_words, shortly
from steelyard.spatial import cross_matrix

# Its point is sought from so many standard deviations on, by leaving out stretches: of its stiffness, added up over the
# axes, or of its pull across gravity.
FIRST = 2.0


class Asked(NamedTuple):
    """What a tether must show.

    stiff   beyond how many standard deviations its stiffness must be, what share of what lasts a second it may leave
    steady  the same of the pull of one whose stiffness does not show
    better  what share it may leave of what lasts beside tilted gravity, or a bias in the room: they have fewer numbers
    """

    stiff: tuple[float, float]
    steady: tuple[float, float]
    better: float


# Made logs without one keep 0.51 of what lasts and more, but for tilted ones.
SURELY = Asked((5.0, 0.5), (5.0, 0.5), 0.8)
# A weak one leaves nearly all that lasts beside noise. But of sound made logs none shows more than 3.2 standard
# deviations of a stiffness that pushes nowhere, and none keeps less than 0.66 of what lasts beside a pull.
MAYBE = Asked((4.0, 1.0), (5.0, 0.6), 0.95)
# No axis may be pushed away by more than this share of how the stiffest is drawn back: errors of a sensor or an arm
# that come back with the pose have either sign.
PUSHED = 0.2
# [m] Nothing hangs farther from the sensor. How far it may be drawn out, where nothing else tells its pull.
FARTHEST, DRAWN = 1.0, 1.0
# So many times as hard as across gravity one may pull along it whose stiffness does not show: most hang from above.
ABOVE = 2.0
# Combinations that a body and a bias mimic to this share of their squares are not told.
TOLD = 1e-5
# The point is sought anew by at most so much at once [m], until it moves by less.
ROUNDS, STEP, SETTLED = 10, 0.05, 1e-3
# Symmetric matrices (6, 3, 3).
_STIFFNESSES = forms.inertia_matrix(np.eye(10)[4:])
_REMEDY = (
    "Take the hose or cable off, or fix it to the arm before the sensor, and record again; else weigh a known mass in "
    "the same motion."
)
_TOO_HARD = (
    "Something hangs on the load and pulls, as a hose, a cable or a spring balancer does, so hard that the sign of the "
    "wrench does not show: taken for that of a weight, it would push away what it hangs on. Take it off, or fix it to "
    "the arm before the sensor, and record again; say the sign of the wrench in the description."
)


@dataclass(frozen=True, eq=False)
class Tether:
    """What a log shows of a tether.

    steady     (3,) [N] what the robot bears against it at the middle, in W
    doubt      [N] standard deviation of that along gravity
    stiffness  (3, 3) [N/m] in W
    point      (3,) [m] in S, where it pulls
    middle     (3,) [m] of the positions of S in W
    up         (3,) against gravity in W
    moved      (10, 10) columns: by how much how well it is known may move the parameters
    """

    steady: Array
    doubt: float
    stiffness: Array
    point: Array
    middle: Array
    up: Array
    moved: Array

    def put_right(self, log: MotionLog, aligned: Aligned) -> MotionLog:
        """Return a log that holds rows of `aligned` without its pull."""
        rotation, position = rotation_of(log, aligned), position_of(log, aligned)
        if rotation is None or position is None:
            return log
        place = position - self.middle + rotation @ self.point
        return self._without(log, rotation, self.steady + place @ self.stiffness)

    def doubted(self, log: MotionLog, rotation: Array, share: float) -> MotionLog:
        """Return the log without so much of one standard deviation of its pull along gravity."""
        return self._without(log, rotation, np.broadcast_to(share * self.doubt * self.up, (len(log), 3)))

    def _without(self, log: MotionLog, rotation: Array, force: Array) -> MotionLog:
        in_sensor = np.einsum("nji,nj->ni", rotation, force)
        return replace(log, wrench=log.wrench - np.concatenate([np.cross(self.point, in_sensor), in_sensor], 1))

    @property
    def note(self) -> str:
        """Say of one that is likely only what it may do."""
        size = float(np.hypot(np.linalg.norm(self.steady), self.doubt))
        return f"a hose or a cable may pull at the load, by some {size:.1g} N: the bars hold what that would do"

    @property
    def finding(self) -> Finding:
        """What is said of it."""
        at, pull = f"at ({shortly(1e3 * self.point)}) mm in S", shortly(0.0 - self.steady)
        text = (
            f"Something hangs on what is held and {self._pulls} {at}, and in the middle of the motion with ({pull}) N "
            "along x, y, z of W. The answer is without it. Acceleration alone tells its force along gravity from "
            f"weight: {self.doubt:.2g} N of doubt are in the bar of the mass."
        )
        return Finding("contact", text, _REMEDY)

    @property
    def _pulls(self) -> str:
        """Say how it pulls."""
        if not self.stiffness.any():
            return "pulls in one direction of the room, as a hose, a cable or a spring does:"
        values, axes = np.linalg.eigh(self.stiffness)
        soft, middle, stiff = (f"{value:.2g}" for value in np.maximum(values, 0.0))
        across = soft if soft == middle else f"{soft} to {middle}"
        return (
            "pulls harder the farther it is drawn out, as a hose, a cable or a spring does: by "
            f"{stiff} N/m along ({axis_words(axes[:, 2])}) of W and {across} N/m across that,"
        )


def examine_tether(
    log: MotionLog, aligned: Aligned, gravity: Array, turned: bool, drift: bool, asked: Asked = SURELY
) -> Tether | None:
    """Return the tether that a log shows as is asked, and that explains more than any other cause; else None.

    aligned  of which the log holds rows     gravity  (3,) [m/s^2] in W     drift  whether the bias may grow with time
    turned   whether the sign of the wrench was chosen so that the mass is above zero

    Raises CannotAnswer where that sign is wrong since a tether pulls the load up harder than it weighs.
    """
    rotation, position, source = rotation_of(log, aligned), position_of(log, aligned), aligned.acceleration_from
    rows, pick = Rows.of(log, drift)
    if rotation is None or position is None or not rows.split:
        return None
    middle, size = position.mean(0), float(np.linalg.norm(gravity))
    up, level = -gravity / size, np.linalg.svd(gravity[None])[2][1:].T
    # What pulls along gravity is weight without inertia: a log that moves calmly enough tells it apart.
    noise = noise_share(log) if log.noise is not None and moves(log) else np.inf
    ways = np.column_stack([level, up]) if noise < CALM else level
    found = _sought(rows, rotation[pick], position[pick] - middle, ways, asked)
    if found is None or not _best(found, log, rotation, gravity, source, drift, asked.better):
        return None
    if np.trace(found.stiffness) < 0:
        if turned:
            raise CannotAnswer(_TOO_HARD)
        return None
    # Beforehand it pulls along gravity as hard as to either side, and as where it is drawn out by so much.
    across = level @ level.T @ found.steady
    aside, drawn = float(np.linalg.norm(across)), float(DRAWN * up @ found.stiffness @ up)
    usual = np.hypot(aside / np.sqrt(2), drawn) if found.stiffness.any() else ABOVE * aside
    std, moved = found.upward(size * (OF_ACCELERATION + NOISE * noise) * found.fit.phi[0])
    share = 1 / (1 + (usual / std) ** 2)  # of what is known beforehand
    steady = across + (1 - share) * (up @ found.steady) * up
    return Tether(steady, float(np.sqrt(share)) * usual, found.stiffness, found.point, middle, up, moved)


@dataclass(frozen=True, eq=False)
class _Sought:
    """What fits best: steady force (3,), stiffness (3, 3) and point (3,) as of a `Tether`.

    fit     the fit of those combinations of its numbers that are told
    along   (k,) what they make of the force along gravity; None where no acceleration tells that
    left    squared residual beside that without a tether
    slowly  the same of means over a second
    """

    steady: Array
    stiffness: Array
    point: Array
    fit: FullFit
    along: Array | None
    left: float
    slowly: float

    def upward(self, doubted: float) -> tuple[float, Array]:
        """Return the standard deviation [N] of the force along gravity, infinite where no acceleration tells it, and
        in columns (10, 10) by how much all else that is known of the tether may move the parameters.

        doubted  [N] by how much accelerations may be wrong about it
        """
        own, covariance, std = self.fit.own, self.fit.covariance[:10, :10], np.inf
        if self.along is not None:
            variance = max(float(self.along @ self.fit.extra_covariance @ self.along), 1e-300)
            follow = self.fit.covariance[:10, own:] @ self.along
            covariance, std = (
                covariance - np.outer(follow, follow) / variance,
                float(np.hypot(np.sqrt(variance), doubted)),
            )
        values, axes = np.linalg.eigh(covariance)
        return std, axes * np.sqrt(np.maximum(values, 0.0))


def _best(
    found: _Sought, log: MotionLog, rotation: Array, gravity: Array, source: str, drift: bool, better: float
) -> bool:
    """Tell whether a tether leaves less than a turned sensor, unlike gains or another point.

    Tilted gravity, and a bias that keeps its direction in the room, have fewer numbers: of what these leave of what
    lasts it must leave a share below `better`.
    """
    room, tilted = room_fit(log, rotation, gravity, drift), fitted_gravity(log, rotation, gravity, source)
    others = sensor_matrix(log, drift), misplaced(log, drift), room
    best = all(other is None or found.left < other.left for other in others)
    return best and all(other is None or found.slowly < better * other.slowly for other in (room, tilted))


def _sought(rows: Rows, R: Array, p: Array, ways: Array, asked: Asked) -> _Sought | None:
    """Return the tether that fits best; None where none shows as is asked.

    Where the sensor turns in place, its point shows by a steady pull first; how stiff it is may not show there.

    R, p  (N, 3, 3) S to W and (N, 3) [m] from the middle at the rows
    ways  (3, k) axes in W along which a steady force is told
    """
    stiff = _settled(rows, R, p, ways, _STIFFNESSES, np.zeros(3), asked)
    if stiff is not None:
        return stiff
    # Stiffness that does not show would pass for a pull along gravity in what moves: of a weak one that is not told.
    told = ways if asked is SURELY else ways[:, :2]
    steady = _settled(rows, R, p, told, _STIFFNESSES[:0], np.zeros(3), asked)
    return None if steady is None else _settled(rows, R, p, ways, _STIFFNESSES, steady.point, asked) or steady


def _settled(rows: Rows, R: Array, p: Array, ways: Array, kinds: Array, point: Array, asked: Asked) -> _Sought | None:
    """Return the tether that fits best from a first point (3,) [m] on; None where it does not show as is asked.

    kinds  (j, 3, 3) symmetric matrices that its stiffness is made of; without any it pulls steadily across gravity
    """
    once, count = rows.solve(), ways.shape[1]
    times, most = asked.stiff if len(kinds) else asked.steady
    numbers, slow = np.concatenate([np.zeros(count + len(kinds)), point]), rows.slowly(once)
    for turn in range(ROUNDS):
        columns, offset = _linear(numbers, R, p, ways, kinds)
        if not turn:
            columns = columns[:, :, :-3]  # with no force yet no point is told
        told = rows.told(columns, TOLD)
        if not told.size or not slow:
            return None
        columns, shifted = columns @ told, replace(rows, values=rows.values - offset)
        fit, told = shifted.solve(columns, jackknife=True), np.pad(told, ((0, len(numbers) - len(told)), (0, 0)))
        before, numbers = numbers, told @ fit.extra
        counts = _counts(numbers, kinds)
        spread = float(np.sqrt(counts @ told @ fit.extra_covariance @ told.T @ counts))
        shown = abs(counts @ numbers) / max(spread, 1e-300)
        if shown < FIRST:
            return None
        step = numbers[-3:] - before[-3:]
        numbers[-3:] = before[-3:] + np.clip(step, -STEP, STEP)
        if turn and np.linalg.norm(step) < SETTLED:
            break
    steady, stiffness, point = _apart(numbers, ways, kinds)
    values = np.linalg.eigvalsh(stiffness * np.sign(np.trace(stiffness)))
    pushes, far = values[0] < -PUSHED * values[2], np.linalg.norm(point) > FARTHEST
    slowly = shifted.slowly(fit, columns) / slow
    if shown < times or pushes or far or slowly > most:
        return None
    along = told[2] if count == 3 and told.shape == (len(numbers), len(numbers)) else None
    return _Sought(steady, stiffness, point, fit, along, fit.beside(once), slowly)


def _counts(numbers: Array, kinds: Array) -> Array:
    """Return by which combination of its numbers (n,) a tether counts: its stiffness over the axes, or its pull."""
    counts = np.zeros(len(numbers))
    if len(kinds):
        counts[-9:-3] = np.einsum("kii->k", kinds)
    else:
        counts[:2] = numbers[:2] / max(float(np.linalg.norm(numbers[:2])), 1e-300)
    return counts


def _apart(numbers: Array, ways: Array, kinds: Array) -> tuple[Array, Array, Array]:
    """Return steady force (3,), stiffness (3, 3) and point (3,) of the numbers (k + j + 3,) of a tether."""
    count = ways.shape[1]
    return ways @ numbers[:count], np.einsum("k,kij->ij", numbers[count:-3], kinds), numbers[-3:]


def _linear(numbers: Array, R: Array, p: Array, ways: Array, kinds: Array) -> tuple[Array, Array]:
    """Return columns (N, 6, k + j + 3) and offset (N, 6) of the wrench of a tether about its numbers (k + j + 3,)."""
    steady, stiffness, point = _apart(numbers, ways, kinds)
    at, back, lever = p + R @ point, np.swapaxes(R, 1, 2), cross_matrix(point)
    force = np.einsum("nij,nj->ni", back, steady + at @ stiffness)
    drawn = np.einsum("nij,kjl,nl->nik", back, kinds, at, optimize=True)
    of_force = np.concatenate([back @ ways, drawn, back @ stiffness @ R], 2)
    of_torque = lever @ of_force
    of_torque[:, :, -3:] -= cross_matrix(force)
    columns = np.concatenate([of_torque, of_force], 1)
    return columns, np.concatenate([np.cross(point, force), force], 1) - columns @ numbers
