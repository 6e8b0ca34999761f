"""Does what a body leaves of the wrench still follow the motion? Then the motion is not that of the wrench.

Of a body, force and torque follow the accelerations by mass, first moment and inertia alone. What is left by them and
goes with accelerations all the same no body makes: then joints were accelerated more, or less, than poses say, each by
a factor of its own. Noise does not go with them in stretches of the log that were left out.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.logs.log import MotionLog
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import FEWEST_BLOCKS, Rows
from steelyard.sanity.fitted.seen_motion import CALM, at_rest, noise_share

# It is said where accelerations explain so much of what is left, in stretches that were left out, and that is so much
# of what accelerations make of the wrench. A real arm's vibration reached 0.15, sound made logs nothing.
EXPLAINED, SHARE = 0.25, 0.1
_FEWEST_ROWS = 100
_REMEDY = (
    "Check the stamps, filters and smoothing of poses and wrench. In a simulator that damps joints implicitly "
    "(MuJoCo), take the wrench of the acceleration that the step made."
)
_KINDS = {"torque": slice(0, 3), "force": slice(3, 6)}


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
        much = _square(predicted[:, part]) > SHARE**2 * _square(made[:, part])
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
