"""Does the load move as its poses say? One body has one mass and one centre, and makes a wrench by its motion alone.

The mass that is accelerated stands beside the mass that is weighed: a controller that takes a payload away leaves less
weight than inertia. Poses of another point than S, in another unit of length or time, or a force behind a slow filter
give accelerations that the load does not feel.

Of a body, force and torque follow the accelerations by mass, first moment and inertia alone. What is left by them and
goes with accelerations all the same no body makes: then joints were accelerated more, or less, than poses say, each by
a factor of its own. Noise does not go with them in stretches of the log that were left out.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.logs.alignment_findings import planar_finding
from steelyard.logs.log import MotionLog
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import CALM, FEWEST_BLOCKS, NOISE, Rows, at_rest, moves, noise_share
from steelyard.sanity.fitted.yielding import taken_away
from steelyard.sanity.readings.static_fit import compensated, stamp_words
from steelyard.spatial import cross_matrix

# They differ where that is so many standard deviations, by leaving out stretches, beyond this share of the mass or this
# distance [m], and explains so many times what it leaves (`Rows.clear`): a controller did 0.5 in a log with 2 Hz noise,
# else 2.4 and more, one per cent of hysteresis 0.28 at most.
SURE, SHARE, APART, CLEAR = 5.0, 0.1, 0.02, 0.4
# A cable pulls back in the rhythm of a motion, as a mass that is not weighed would: a controller is blamed beyond so
# many, and beyond this share, which a scale of lengths or clocks may make of accelerations.
TAKEN, SCALED = 8.0, 0.02
# An arm that bends, or poses through a filter, are told by what goes with the square of the frequency, as of a filter
# of this delay [s].
BENDING = 0.005
# No tool's tip is farther [m] from the sensor.
FARTHEST = 5.0
# Below this share a controller has not only taken a weight away.
TOO_MUCH = -0.7

# It is said where accelerations explain so much of what is left, in stretches that were left out, and that is so much
# of what accelerations make of the wrench. A real arm's vibration reached 0.15, sound made logs nothing.
EXPLAINED, SHARE_MADE = 0.25, 0.1
_FEWEST_ROWS = 100
_REMEDY = (
    "Check the stamps, filters and smoothing of poses and wrench. In a simulator that damps joints implicitly "
    "(MuJoCo), take the wrench of the acceleration that the step made."
)
_KINDS = {"torque": slice(0, 3), "force": slice(3, 6)}


@dataclass(frozen=True, eq=False)
class TwoMasses:
    """What a log says of mass and first moment by acceleration and by weight.

    mass, first_moment    [kg], (3,) [kg m] by acceleration
    less, less_std        (4,) [kg, kg m] how much less of them is weighed, with standard deviations
    left                  squared residual beside that with one mass
    clear                 how many times as much both explain of what lasts as they leave, see `Rows.clear`
    noise                 share of noise in the squared acceleration of the rows
    """

    mass: float
    first_moment: Array
    less: Array
    less_std: Array
    left: float
    clear: float
    noise: float

    @property
    def weighed(self) -> float:
        """Mass [kg] by weight."""
        return self.mass - float(self.less[0])

    @property
    def apart(self) -> Array:
        """How far (3,) [m] what is accelerated lies from what is weighed, as far as a mass as weighed tells."""
        return np.asarray(self.less[1:] - self.less[0] * self.first_moment / self.mass) / self.weighed


def two_masses(log: MotionLog, bending: bool = False) -> TwoMasses | None:
    """Return both masses; None for too few moving rows or channels that do not measure.

    bending  whether quick accelerations may be larger or smaller than was read
    """
    if log.noise is None or not moves(log):
        return None
    rows, pick = Rows.of(log)
    once, extra = rows.solve(), _weight(rows.log.gravity)
    if bending and log.time is not None:
        still = at_rest(log)
        made = replace(still, acceleration=log.acceleration).predicted(once.phi) - still.predicted(once.phi)
        extra = np.concatenate([extra, taken_away(log.time, made, BENDING)[pick, :, None]], 2)
    fit = rows.solve(extra, jackknife=True)
    phi, left, clear = fit.phi, fit.beside(once), rows.clear(once, fit, extra)
    return TwoMasses(float(phi[0]), phi[1:4], fit.extra[:4], fit.extra_std[:4], left, clear, noise_share(log))


def _weight(gravity: Array) -> Array:
    """Return what a mass and a first moment that are not weighed leave out (N, 6, 4): m g, and h x g about S."""
    out = np.zeros((len(gravity), 6, 4))
    out[:, 3:, 0] = gravity
    out[:, :3, 1:] = -cross_matrix(gravity)
    return out


def examine_masses(log: MotionLog, known: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """Return `weight-compensated` or `motion-mismatch` where a log weighs another body than it accelerates."""
    if stands_aside("two masses", known):
        return ()
    found = two_masses(log)
    if found is None or found.clear < CLEAR or min(found.mass, found.weighed) <= TOO_MUCH * abs(found.mass):
        return ()
    short, spread = float(found.less[0]), float(found.less_std[0])
    both = (
        f"The force follows the acceleration as that of {found.mass:.3g} ± {spread:.2g} kg, but the direction of "
        f"gravity as that of {found.weighed:.3g} kg: "
    )
    # About one axis a lever passes for a mass, and noise of either draws both.
    least = SHARE + NOISE * found.noise if planar_finding(log.gravity) else SCALED
    if _taken_away(found, least) and _taken_away(two_masses(log, bending=True), least):
        return (compensated(both, stamp_words(found.mass, found.weighed)),)
    if -short > max(SURE * spread, (SHARE + NOISE * found.noise) * abs(found.weighed)):
        other = stamp_words(found.mass, found.weighed)
        text = f"{both}the load was not accelerated as the poses say.{f' {other}.' if other else ''}"
        return (Finding.of("motion-mismatch", text),)
    far, where = np.abs(found.apart), found.less_std[1:] / max(found.weighed, 1e-9)
    if found.noise < CALM and far.max() < FARTHEST and (far > np.maximum(SURE * where, APART)).any():
        shown = ", ".join(f"{1e3 * v:.0f}" for v in found.apart + 0.0)
        text = (
            f"What is accelerated lies ({shown}) ± {1e3 * float(np.linalg.norm(where)):.1g} mm from what is weighed: "
            "the load was not accelerated as the poses say."
        )
        return (Finding.of("motion-mismatch", text),)
    return ()


def least_shown(log: MotionLog) -> float:
    """Return from which mass [kg] on the log shows a weight that is taken away; infinite where nothing moves enough."""
    found = two_masses(log)
    return np.inf if found is None else TAKEN * float(found.less_std[0])


def _taken_away(found: TwoMasses | None, least: float) -> bool:
    """Tell whether less is weighed than is accelerated beyond doubt, and by more than this share of the mass."""
    if found is None:
        return False
    return float(found.less[0]) > max(TAKEN * float(found.less_std[0]), least * abs(found.mass))


def examine_motion(log: MotionLog, known: tuple[Finding, ...]) -> tuple[Finding, ...]:
    """Return `motion-mismatch` where what a body leaves of force or torque follows the accelerations."""
    if stands_aside("motion", known) or log.noise is None or log.dead.any() or noise_share(log) > CALM:
        return ()
    followed = following(log)
    if not followed:
        return ()
    kind = max(followed, key=lambda k: followed[k])
    text = (
        f"What a body leaves of the {kind} follows the accelerations as that of no body does: they explain "
        f"{100 * followed[kind]:.0f} % of it in stretches that were left out. The load was not accelerated as the "
        "poses say, and the inertia does not hold."
    )
    return (Finding("motion-mismatch", text, _REMEDY),)


def following(log: MotionLog) -> dict[str, float]:
    """Return of "torque" and "force" what share of the residual follows the accelerations, where that is much."""
    rows, _ = Rows.of(log)
    moving = ~rows.log.still
    block = rows.block[moving]
    if moving.sum() < _FEWEST_ROWS or len(np.unique(block)) < FEWEST_BLOCKS:
        return {}
    fit = rows.solve()
    left = (rows.values - rows.columns @ fit.solution)[moving]
    motion = np.concatenate([rows.log.angular_acceleration, rows.log.acceleration], 1)[moving]
    predicted = _unseen(np.concatenate([motion, np.ones((len(motion), 1))], 1), left, block)
    made = (rows.log.predicted(fit.phi) - at_rest(rows.log).predicted(fit.phi))[moving]
    out = {}
    for kind, part in _KINDS.items():
        before, after = _square(left[:, part]), _square(left[:, part] - predicted[:, part])
        much = _square(predicted[:, part]) > SHARE_MADE**2 * _square(made[:, part])
        if much and after < (1 - EXPLAINED) * before:
            out[kind] = 1 - after / before
    return out


def _unseen(features: Array, values: Array, block: Integers) -> Array:
    """Return values (N, 6) as features (N, k) explain them, each block by what all others tell."""
    out = np.zeros_like(values)
    for b in np.unique(block):
        here = block == b
        out[here] = features[here] @ np.linalg.lstsq(features[~here], values[~here], rcond=None)[0]
    return out


def _square(values: Array) -> float:
    """Return the sum of squares about the mean."""
    return float(((values - values.mean(0)) ** 2).sum())
