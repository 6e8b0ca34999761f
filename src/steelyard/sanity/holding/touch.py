"""A touch: time whose wrench no one body, bias and slow drift explain together with the rest of the log."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import chdtrc

from steelyard.check import Array, Integers, Mask
from steelyard.inertia.regressor import design
from steelyard.logs.autocorrelation import correlation_time
from steelyard.logs.clock import median_step
from steelyard.logs.drift import STEADILY, settled_course
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import features
from steelyard.logs.recording import ROUNDED_GRAVITY
from steelyard.logs.runs import runs
from steelyard.sanity.holding import consensus
from steelyard.sanity.holding.consensus import LEVER, Consensus, Slices
from steelyard.sanity.holding.load_change import LONGEST_LEVER

# Slices last this long [s] or hold this many rows; a log of fewer slices is not judged.
SLICE, FEWEST_ROWS, MOST_SLICES, FEWEST_SLICES = 0.1, 4, 3000, 20
# Contact: less likely than 10^-SURPRISE by chance, a squared misfit above RATIO, and above these [N m, N].
SURPRISE, RATIO, SMALLEST_TORQUE, SMALLEST_FORCE = 10.0, 2.0, 0.05, 0.5
# ... and above this share of the weight: a base tilted by 2 degrees or 3 % of cross-talk look like less.
LEAST_SHARE = 0.12
# ... unless it is short and stands out so far from all other times, of which some have gravity this near [rad] to where
# it is then: errors that hang on the pose would show in those as well.
SHORT, NEAR = 0.25, np.radians(20.0)
STANDS_OUT = 15.0
# A push has no longer lever than this [m], beside a twist of the hand [N m].
LONGEST_PUSH, LARGEST_TWIST = 2.0, 3.0
# A touch begins and ends gently: this share of its length is left out on either side, one to LONGEST_GUARD slices.
GUARD, LONGEST_GUARD = 0.05, 10
# Time constants, as shares of the log, that make up a drift which settles.
PACES = (1 / 16, 1 / 5)


@dataclass(frozen=True, eq=False)
class Touch:
    """Slices first..last - 1, and the largest extra force [N] and torque [N m] in them."""

    first: int
    last: int
    force: float
    torque: float


def slices_of(log: MotionLog, with_bias: bool) -> tuple[Slices, Integers] | None:
    """Return the slices of an ordered log and the slice of each row (N,); None without a clock, or of too few."""
    time = log.time
    if time is None or len(log) < FEWEST_SLICES * FEWEST_ROWS:
        return None
    width = max(SLICE, FEWEST_ROWS * median_step(time), float(time[-1] - time[0]) / MOST_SLICES)
    number = ((time - time[0]) / width).astype(np.int64)
    edges = np.flatnonzero(np.diff(number, prepend=-1))
    if len(edges) < FEWEST_SLICES:
        return None
    counts = np.diff(np.append(edges, len(log)))
    z = np.add.reduceat(features(log), edges, axis=0) / counts[:, None]
    T = design(with_bias)
    wrench = np.where(log.dead, 0.0, z[:, 12:18])
    weight = np.minimum(counts / np.median(counts), 1.0)
    mass = np.linalg.norm(wrench[:, 3:] - np.median(wrench[:, 3:], axis=0), axis=1).max() / 9.8 + 0.1
    size = mass * np.repeat([1e3, 1e1, 1e-1, 1e3], [1, 3, 6, 6])[: len(T)]
    slices = Slices(
        -np.tensordot(z, T, axes=(1, 2)).swapaxes(1, 2) * ~log.dead[:, None],
        wrench,
        time[0] + width * (number[edges] + 0.5),
        weight,
        size**-2,
    )
    return slices, np.repeat(np.arange(len(edges)), counts)


def memory_of(found: Consensus) -> float:
    """Return how many slices in a row carry one independent residual."""
    return correlation_time(np.where(found.kept[:, None], found.residual, 0.0), len(found.kept) / 8, power=2)


def touches_of(slices: Slices, found: Consensus, memory: float) -> list[Touch]:
    """Return the stretches left out that no one body, bias and slow drift explains together with what was kept."""
    slices = _with_drift(slices, found.late)
    H, g, c = consensus.sums(slices, found.tolerance)
    base = _least(slices, H, g, c, found.kept)
    out = []
    for a, b in runs(~found.kept).tolist():
        both = found.kept.copy()
        both[a:b] = True
        gain = max(_least(slices, H, g, c, both) - base, 0.0)
        freedom = 6 * float(slices.weight[a:b].sum())
        surprise = -np.log10(max(float(chdtrc(freedom / memory, gain / memory)), 1e-300))
        extra = np.linalg.norm(found.residual[a:b].reshape(-1, 2, 3), axis=2).max(0)
        if surprise > SURPRISE and gain > RATIO * freedom:
            out.append(Touch(a, b, float(extra[1]), float(extra[0])))
    return out


def large(x: Array, touch: Touch) -> bool:
    """Whether the extra wrench is more than small errors of model, base and calibration may leave on the body x."""
    weight = ROUNDED_GRAVITY * abs(float(x[0]))
    lever = LEVER + float(np.linalg.norm(x[1:4])) / max(abs(float(x[0])), 1e-9)
    least_force = max(SMALLEST_FORCE, LEAST_SHARE * weight)
    return touch.force > least_force or touch.torque > max(SMALLEST_TORQUE, LEAST_SHARE * weight * lever)


def apart(slices: Slices, found: Consensus, touch: Touch) -> bool:
    """Whether a short touch stands out from what is kept, in which gravity lies as it does in the touch."""
    kept = found.kept
    if touch.last - touch.first > SHORT * len(kept) or kept.mean() < 1 - SHORT or not stands_out(found, touch):
        return False
    felt = slices.A[:, 3:, 0]  # the force of a kilogram: along gravity but for accelerations
    up = felt / np.linalg.norm(felt, axis=1, keepdims=True)
    nearest = (up[touch.first : touch.last] @ up[kept].T).max(1)
    return bool((nearest > np.cos(NEAR)).all())


def stands_out(found: Consensus, touch: Touch) -> bool:
    """Whether the extra force or torque is far beyond what the rest leaves of the wrench."""
    torque, force = np.sqrt((found.residual[found.kept].reshape(-1, 2, 3) ** 2).sum(2).mean(0))
    return bool(touch.force > STANDS_OUT * force or touch.torque > STANDS_OUT * torque)


def possible(x: Array, touches: Sequence[Touch]) -> bool:
    """Whether a robot may hold the body x and a hand may push so; if not, units or frames are wrong."""
    body = x[0] > 0 and np.linalg.norm(x[1:4]) < LONGEST_LEVER * x[0]
    return bool(body and all(t.torque < LONGEST_PUSH * t.force + LARGEST_TWIST for t in touches))


def away(touches: Sequence[Touch], count: int, guarded: bool = False) -> Mask:
    """Return the slices (F,) outside every touch, or well away from each where they are `guarded`."""
    kept = np.ones(count, np.bool_)
    for t in touches:
        margin = min(1 + int(np.ceil(GUARD * (t.last - t.first))), LONGEST_GUARD) if guarded else 0
        kept[max(t.first - margin, 0) : t.last + margin] = False
    return kept


def _with_drift(slices: Slices, late: Array) -> Slices:
    """Return the slices less the late wrench; a bias, where there is none, and its drift are more parameters.

    A drift goes in a line, or settles at any pace.
    """
    span = float(np.ptp(slices.time))
    courses = [settled_course(slices.time, settling) for settling in (STEADILY, *(span * share for share in PACES))]
    courses += [np.ones(len(slices.time))] * (slices.A.shape[2] == 10)
    columns = [course[:, None, None] * np.eye(6) for course in courses]
    ridge = np.append(slices.ridge, np.full(6 * len(courses), slices.ridge.min()))
    return Slices(np.concatenate([slices.A, *columns], 2), slices.y - late, slices.time, slices.weight, ridge)


def _least(slices: Slices, H: Array, g: Array, c: Array, mask: Mask) -> float:
    """Return the least squared residual of the slices in `mask`."""
    right = g[mask].sum(0)
    x = consensus.solve(H[mask].sum(0) + np.diag(slices.ridge), right)
    return float(c[mask].sum() - right @ x)
