"""Load change: from some time on, the robot holds another body, or the same one elsewhere; the bias stays.

A small slip, of a few millimetres, does not stand out of the tolerance for hands, but rows that were fitted as one body
show it: from one time on a first moment of its own takes much of the residual away. Errors of calibration hang on
orientation and not on time; a step in time takes little of theirs, and not the same where stretches are left out.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import RANK, Rows
from steelyard.sanity.holding.consensus import Slices, solve, sums

# Times tried on a first grid, and the time around a change in which hands may be at work [s].
GRID, HANDS = 60, 0.5
# Either side must last this long [s].
SHORTEST = 1.0
# A change below this share of the mass, or of this many standard deviations, is none.
SHARE, DEVIATIONS = 0.08, 6.0
# Another body must explain this much (chi-square) beyond what a jump of the bias would; and no lever beyond 1 m.
BEYOND_BIAS, LONGEST_LEVER = 40.0, 1.0
# A body of the same mass has slipped where its centre of mass moved further than this [m].
SLIP = 0.003
SLIPPED = "Grip the object tighter, or cut the log where it slipped."

# Either side of a small slip must hold this many rows.
SLIP_ROWS = 12
# Of the squared residual of one body with a drift, a slip leaves no more than this share, and takes so many times as
# much away as a bias that jumps at that time, and as a gravity that is tilted.
SLIP_LEFT, BESIDE_JUMP, BESIDE_TILT = 0.9, 1.5, 2.0
# A bias that jumps as well takes no more beyond it than this share of what it takes: 0.015 beside slips, from 0.15 on
# beside what only looks like one.
JUMP_TOO = 0.1
# It must be this sure by leaving out stretches, no less, and no more: who loses an object has not slipped [m].
SLIP_SURE, SMALLEST, LARGEST = 12.0, 1e-3, 0.1
# Not a slip but a change of load: a mass that changes as well, by this share or more, leaves less than this of what a
# slip leaves.
LEAST_CHANGE, MASS_LEFT = 0.01, 0.9
_FIRST, _MASS_TOO = slice(1, 4), slice(0, 4)  # where phi and the rows have the first moment, and the mass before it


@dataclass(frozen=True, eq=False)
class LoadChange:
    """At `time` [s] the mass went from `before` to `after` [kg], or the body slipped.

    residual, load  (F, 6) what both bodies and the bias leave of the wrench, and what the bodies make of it
    slip            [m] how far the centre of mass moved at the same mass, 0 where the mass changed
    also            in words, another change before or after it
    """

    time: float
    before: float
    after: float
    residual: Array
    load: Array
    slip: float = 0.0
    also: str = ""

    @property
    def loaded_before(self) -> bool | None:
        """Whether the load was held before, where nothing is held on one side of the change; None where both hold."""
        if min(self.before, self.after) > SHARE * max(self.before, self.after):
            return None
        return self.before > self.after

    @property
    def words(self) -> str:
        """What happened, in words."""
        if self.slip:
            return slip_words(self.slip)
        if abs(self.after - self.before) <= SHARE * self.before:
            return f"the load of {self.after:.3g} kg was gripped elsewhere{self.also}"
        if self.loaded_before is None:
            return change_words(self.before, self.after) + self.also
        done = "put down or lost" if self.loaded_before else "picked up"
        return f"the load of {max(self.before, self.after):.3g} kg was {done}{self.also}"


@dataclass(frozen=True, eq=False)
class _Running:
    """Running sums of H (F + 1, p, p) and g (F + 1, p), and the sum of c."""

    H: Array
    g: Array
    c: float
    ridge: Array

    def normal(self, j: int, columns: slice) -> tuple[Array, Array]:
        """Return the normal equations H (p + q, p + q) and g where the q `columns` are anew from slice j on."""
        H, g = self.H[-1], self.g[-1]
        normal, right = _anew(H, g, H - self.H[j], g - self.g[j], columns)
        return normal + np.diag(np.append(self.ridge, self.ridge[columns])), right

    def cost(self, j: int, columns: slice) -> float:
        """Return the least squared residual where `columns` are anew from slice j on."""
        H, g = self.normal(j, columns)
        return self.c - float(g @ solve(H, g))


def _anew(H: Array, g: Array, late: Array, late_g: Array, columns: slice) -> tuple[Array, Array]:
    """Return normal equations H (p + q, p + q) and g where the q `columns` are anew in the rows that `late` sums."""
    out = np.block([[H, late[:, columns]], [late[columns], late[columns, columns]]])
    return out, np.append(g, late_g[columns])


def kept_side(time: Array, at: float, what: str, slipped: bool, early: bool | None = None) -> tuple[Mask, Finding]:
    """Return the rows (N,) of one side of a change at a time [s], away from hands, and what is to be said.

    early  whether the side before is kept; None = the longer one
    """
    early = at - time[0] >= time[-1] - at if early is None else early
    side = time < at - HANDS / 2 if early else time > at + HANDS / 2
    text = (
        f"At {at:.1f} s {what}; only the time {'before' if early else 'after'} it was used "
        f"({100 * (1 - side.mean()):.0f} % of the rows were left out)."
    )
    finding = Finding.of("load-changed", text)
    return side, replace(finding, remedy=SLIPPED) if slipped else finding


def change_words(before: float, after: float) -> str:
    """Say that the mass changed [kg]."""
    return f"the load changed from {before:.3g} to {after:.3g} kg"


def slip_words(moved: float) -> str:
    """Say that the object slipped by so much [m]."""
    return f"the object slipped: its centre of mass moved by {1e3 * moved:.2g} mm at the same mass"


def find_change(slices: Slices, tolerance: Array, memory: float) -> LoadChange | None:
    """Return the one change of load that explains the slices best, if a change of bias does not do as well.

    tolerance (F, 6) of each slice's wrench; memory slices in a row carry one independent residual.
    """
    level = np.broadcast_to(np.median(tolerance, axis=0), tolerance.shape)
    tolerance = np.maximum(tolerance, level)
    H, g, c = sums(slices, tolerance)
    run = _Running(_running(H), _running(g), float(c.sum()), slices.ridge)
    j = first_after(slices.time, lambda j: run.cost(j, slice(0, 10)))
    if j is None:
        return None
    normal, right = run.normal(j, slice(0, 10))
    x = solve(normal, right)
    before, change = x[:10], x[-10:]
    first = len(run.ridge)
    covariance = memory * np.linalg.inv(normal)[first : first + 4, first : first + 4]
    slip = _slip(before, change, np.asarray(covariance, dtype=np.float64))
    real = slip > 0 or abs(change[0]) > max(SHARE * before[0], DEVIATIONS * float(np.sqrt(covariance[0, 0])))
    masses = before[0], before[0] + change[0]
    # Who holds nothing may weigh a little less than that.
    possible = max(masses) > 0 and min(masses) > -SHARE * max(masses)
    possible = possible and np.linalg.norm(change[1:4]) < LONGEST_LEVER * (before[0] if slip else abs(change[0]))
    if len(run.ridge) > 10:
        jump = run.cost(j, slice(10, 16)) - run.cost(j, slice(0, 10))
        possible = possible and jump / memory > BEYOND_BIAS
    if not (real and possible):
        return None
    load = slices.A[:, :, :10] @ before
    load[j:] += slices.A[j:, :, :10] @ change
    residual = slices.y - load - slices.A[:, :, 10:] @ x[10 : len(run.ridge)]
    time = float(slices.time[j - 1] + slices.time[j]) / 2
    return LoadChange(time, float(before[0]), float(before[0] + change[0]), residual, load, slip)


def _slip(before: Array, change: Array, covariance: Array) -> float:
    """Return how far the centre of mass moved [m] where that is sure and the mass stayed, else 0."""
    if before[0] <= 0 or abs(change[0]) > SHARE * before[0]:
        return 0.0
    moved = change[1:4]
    sure = float(moved @ np.linalg.solve(covariance[1:, 1:], moved)) > DEVIATIONS**2
    shift = float(np.linalg.norm((before[1:4] + moved) / (before[0] + change[0]) - before[1:4] / before[0]))
    return shift if sure and shift > SLIP else 0.0


def _running(values: Array) -> Array:
    return np.concatenate([np.zeros((1, *values.shape[1:])), np.cumsum(values, axis=0)])


def first_after(time: Array, cost: Callable[[int], float], ends: int = 0) -> int | None:
    """Return the first row after a change, where `cost` is least: on a grid, then around its best; None of too few.

    time  (N,) [s] of the rows; either side has more than `ends` of them
    """
    inside = np.flatnonzero((time > time[0] + SHORTEST) & (time < time[-1] - SHORTEST))
    inside = inside[(inside >= ends) & (inside < len(time) - ends)]
    if not len(inside):
        return None
    step = max(len(inside) // GRID, 1)
    first = min(inside[::step].tolist(), key=cost)
    near = inside[np.abs(inside - first) <= step].tolist()
    return int(min(near[:: max(len(near) // GRID, 1)], key=cost))


@dataclass(frozen=True, eq=False)
class Slip:
    """At `time` [s] the centre of mass moved by `moved` (3,) [m], `std` (3,) [m] by leaving out stretches.

    masses  [kg] before and after, where it is the mass that changed: its first moment changes with it
    """

    time: float
    moved: Array
    std: Array
    masses: tuple[float, float] | None = None

    def longer_side(self, log: MotionLog) -> tuple[Mask, Finding]:
        """Return the rows (N,) of the longer part of the log, and what is to be said."""
        time = np.zeros(0) if log.time is None else log.time
        what = change_words(*self.masses) if self.masses else slip_words(float(np.linalg.norm(self.moved)))
        return kept_side(time, self.time, what, slipped=self.masses is None)


def small_slip(log: MotionLog, rotation: Array | None = None, gravity: Array | None = None) -> Slip | None:
    """Return the slip that explains much of what one body leaves of a log, and no rival does; None where there is none.

    log       the rows that would be fitted, in order of time
    rotation  (N, 3, 3) S to W at the rows, and gravity (3,) [m/s^2] in W, where they are known
    """
    time = log.time
    if time is None or len(log) < 2 * SLIP_ROWS or time[-1] - time[0] < 2 * SHORTEST or (np.diff(time) < 0).any():
        return None
    rows, pick = Rows.of(log, drift=True)
    when = _best(rows)
    if when is None:
        return None
    late = (np.asarray(rows.log.time) > when)[:, None, None]
    jump, moment = np.broadcast_to(late * np.eye(6), (len(late), 6, 6)), rows.columns[:, :, _FIRST] * late
    steady, jumped = rows.solve(), rows.solve(jump)
    found = rows.solve(moment, jackknife=True)
    taken = steady.left - found.left
    if found.left > SLIP_LEFT * steady.left or taken < BESIDE_JUMP * (steady.left - jumped.left) or found.phi[0] <= 0:
        return None
    if found.left - rows.solve(np.concatenate([moment, jump], 2)).left > JUMP_TOO * taken:
        return None
    if rotation is not None and gravity is not None:
        tilted = rows.solve(rows.tilting(steady.phi, rotation[pick], gravity))
        if taken < BESIDE_TILT * (steady.left - tilted.left):
            return None
    moved, std = found.extra / found.phi[0], found.extra_std / found.phi[0]
    sure = bool((np.abs(moved) > SLIP_SURE * std).any())
    if not sure or not SMALLEST < np.linalg.norm(moved) < LARGEST:
        return None
    return Slip(when, moved, std, _masses(rows, late, found.left))


def _masses(rows: Rows, late: Mask, left: float) -> tuple[float, float] | None:
    """Return the mass [kg] before and after, where one that changes leaves far less than the `left` of a slip.

    late  (N, 1, 1) the rows after the change
    """
    found = rows.solve(rows.columns[:, :, _MASS_TOO] * late, jackknife=True)
    mass, change = float(found.phi[0]), float(found.extra[0])
    sure = abs(change) > max(LEAST_CHANGE * mass, SLIP_SURE * float(found.extra_std[0]))
    return (mass, mass + change) if sure and found.left < MASS_LEFT * left else None


def _best(rows: Rows) -> float | None:
    """Return the time [s] from which a first moment of its own leaves least."""
    time = np.asarray(rows.log.time)
    both = np.concatenate([rows.columns, rows.values[:, :, None]], 2) * np.sqrt(rows.weights)[:, :, None]
    # Row j of `after` sums over rows j and on: with it, the equations of a step at any row are known.
    after = np.cumsum((np.swapaxes(both, 1, 2) @ both)[::-1], axis=0)[::-1]

    j = first_after(time, lambda j: _left(after[0], after[j]), SLIP_ROWS)
    return None if j is None else float(time[j - 1] + time[j]) / 2


def _left(whole: Array, late: Array) -> float:
    """Return the weighted squared residual with first moments anew in the rows summed in `late` (p + 1, p + 1)."""
    p = len(whole) - 1
    H, g = _anew(whole[:p, :p], whole[:p, p], late[:p, :p], late[:p, p], _FIRST)
    return float(whole[p, p] - g @ inverse_scaled(H, RANK) @ g)
