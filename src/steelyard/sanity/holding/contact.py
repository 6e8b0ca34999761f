"""Contact and load change: time in which the wrench is not that of one body held by the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import chdtrc

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
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
from steelyard.sanity.holding.load_change import (
    HANDS,
    LONGEST_LEVER,
    SHARE,
    SHORTEST,
    LoadChange,
    find_change,
    kept_side,
)

# Slices last this long [s] or hold this many rows; a log of fewer slices is not judged.
SLICE, FEWEST_ROWS, MOST_SLICES, FEWEST_SLICES = 0.1, 4, 3000, 20
# Contact: less likely than 10^-SURPRISE by chance, a squared misfit above RATIO, and above these [N m, N].
SURPRISE, RATIO, SMALLEST_TORQUE, SMALLEST_FORCE = 10.0, 2.0, 0.05, 0.5
# ... and above this share of the weight: a base tilted by 2 degrees or 3 % of cross-talk look like less.
LEAST_SHARE = 0.12
# ... unless it is short and stands out so far from all other times, of which some have gravity as near [rad] to where it
# has it: errors that hang on the pose would show in those as well.
SHORT, NEAR = 0.25, np.radians(20.0)
# A push has no longer lever than this [m], beside a twist of the hand [N m]; and leaves this share of the log alone.
LONGEST_PUSH, LARGEST_TWIST, LEAST_LEFT = 2.0, 3.0, 0.22
# A touch begins and ends gently: this share of its length is left out on either side, one to LONGEST_GUARD slices.
GUARD, LONGEST_GUARD = 0.05, 10
# Touches are alike where one body explains this share of them, with a tolerance no looser than by e^LOOSER.
ALIKE, LOOSER = 0.9, 0.3
# A touched time that a jump of bias explains to this squared misfit might as well be the untouched one.
SAME = 2.0
# More of the log than this, or more of the motion than that, is more likely misread than touched.
MUCH, MOVING = 0.4, 0.8
# Where it is more than that, it is left out only if the extra force or torque is so many times what the rest leaves:
# errors that vary with the pose are everywhere, and the times that happen to agree give a worse answer than all.
STANDS_OUT = 15.0
# Time constants, as shares of the log, that make up a drift which settles.
PACES = (1 / 16, 1 / 5)
ALL_ELSE = (
    "Check what spoils a whole log first: time unit, clocks, axes and signs of the wrench, how the sensor is mounted, "
    "a payload that the controller compensates, a bias that rises and falls. If all are right, "
    "keep hands and fixtures off the object."
)
TARED = "If the sensor was tared within the log, cut the log there and identify each piece with its own bias. Else:"


@dataclass(frozen=True, eq=False)
class Touch:
    """Slices first..last - 1, and the largest extra force [N] and torque [N m] in them."""

    first: int
    last: int
    force: float
    torque: float


def untouched(log: MotionLog, with_bias: bool) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the rows (N,) in which the robot alone held one body, and what was found in the others.

    The rows kept are the largest set of stretches of time that one body and one bias explain; hand contact may cover
    more than half of the log. Where the load changed, the longer part is kept. A log without time keeps all its rows.

    log        in S, wrench as applied to the object; its declared noise is not used
    with_bias  whether a constant wrench bias is free
    """
    mask = np.ones(len(log), np.bool_)
    if log.time is None:
        return mask, ()
    order = np.argsort(log.time, kind="stable")
    mask[order], findings = _in_order(log.rows(order), with_bias)
    return mask, findings


def agreeing(log: MotionLog, with_bias: bool) -> Mask:
    """Return the rows (N,), in order of time, that one body explains best, be the others touched or not.

    Unlike `untouched` it asks nothing of the rest: clocks that are late may be what spoils it. Time in which nothing is
    held fits any clock: then it is the rest.
    """
    sliced = _slices(log, with_bias)
    if sliced is None:
        return np.ones(len(log), np.bool_)
    slices, row = sliced
    found = consensus.largest(slices)
    rest = consensus.fit(slices, ~found.kept, found.tolerance)
    empty = abs(found.x[0]) < SHARE * rest[0] and (~found.kept).mean() > LEAST_LEFT
    return np.asarray(found.kept != empty)[row]


def _in_order(log: MotionLog, with_bias: bool) -> tuple[Mask, tuple[Finding, ...]]:
    """Return what `untouched` returns for rows that are in order of time."""
    everything, sliced = np.ones(len(log), np.bool_), _slices(log, with_bias)
    if sliced is None:
        return everything, ()
    slices, row = sliced
    found = consensus.largest(slices)
    memory = correlation_time(np.where(found.kept[:, None], found.residual, 0.0), len(found.kept) / 8, power=2)
    touches = _touches(slices, found, memory)
    if not touches:
        return everything, ()
    change = _explained(slices, found, touches, memory)
    # Small errors of model or calibration look like a small slip.
    if change is not None and (not change.slip or any(_large(found.x, t) for t in touches)):
        return _after_change(log, with_bias, change)
    found = _likelier(slices, found, touches)
    touches = _touches(slices, found, memory)
    touches = [t for t in touches if _large(found.x, t) or _apart(slices, found, t)]
    guarded = _away(touches, len(slices.y), guarded=True)
    if not touches or not _possible(found.x, touches) or guarded.mean() < LEAST_LEFT:
        return everything, ()
    moving = np.bincount(row, ~log.still) > 0.5 * np.bincount(row)
    finding = _contact(slices, found, touches, guarded, _unlike_hands(guarded, moving))
    return (guarded[row] if _left_out(found, touches, guarded) else everything), (finding,)


def _after_change(log: MotionLog, with_bias: bool, change: LoadChange) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the longer or only loaded side of a change, less the time of hands, searched for contact in its turn."""
    side, finding = kept_side(np.asarray(log.time), change.time, change.words, change.slip > 0, change.loaded_before)
    kept, more = untouched(log.rows(side), with_bias)
    mask = side.copy()
    mask[side] = kept
    return mask, (finding, *more)


def _slices(log: MotionLog, with_bias: bool) -> tuple[Slices, Integers] | None:
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


def _touches(slices: Slices, found: Consensus, memory: float) -> list[Touch]:
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


def _large(x: Array, touch: Touch) -> bool:
    """Whether the extra wrench is more than small errors of model, base and calibration may leave on the body x."""
    weight = ROUNDED_GRAVITY * abs(float(x[0]))
    lever = LEVER + float(np.linalg.norm(x[1:4])) / max(abs(float(x[0])), 1e-9)
    least_force = max(SMALLEST_FORCE, LEAST_SHARE * weight)
    return touch.force > least_force or touch.torque > max(SMALLEST_TORQUE, LEAST_SHARE * weight * lever)


def _apart(slices: Slices, found: Consensus, touch: Touch) -> bool:
    """Whether a short touch stands out from what is kept, in which gravity lies as it does in the touch."""
    kept = found.kept
    if touch.last - touch.first > SHORT * len(kept) or kept.mean() < 1 - SHORT or not _stands_out(found, touch):
        return False
    felt = slices.A[:, 3:, 0]  # the force of a kilogram: along gravity but for accelerations
    up = felt / np.linalg.norm(felt, axis=1, keepdims=True)
    nearest = (up[touch.first : touch.last] @ up[kept].T).max(1)
    return bool((nearest > np.cos(NEAR)).all())


def _stands_out(found: Consensus, touch: Touch) -> bool:
    """Whether the extra force or torque is far beyond what the rest leaves of the wrench."""
    torque, force = np.sqrt((found.residual[found.kept].reshape(-1, 2, 3) ** 2).sum(2).mean(0))
    return bool(touch.force > STANDS_OUT * force or touch.torque > STANDS_OUT * torque)


def _possible(x: Array, touches: Sequence[Touch]) -> bool:
    """Whether a robot may hold the body x and a hand may push so; if not, units or frames are wrong."""
    body = x[0] > 0 and np.linalg.norm(x[1:4]) < LONGEST_LEVER * x[0]
    return bool(body and all(t.torque < LONGEST_PUSH * t.force + LARGEST_TWIST for t in touches))


def _left_out(found: Consensus, touches: Sequence[Touch], kept: Mask) -> bool:
    """Whether the touches are to be left out: not much of the log, or far beyond what the rest leaves of the wrench."""
    return bool(kept.mean() >= 1 - MUCH) or any(_stands_out(found, t) for t in touches)


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


def _explained(slices: Slices, found: Consensus, touches: Sequence[Touch], memory: float) -> LoadChange | None:
    """Return the load change that leaves nothing of the touches, if there is one."""
    change = find_change(slices, found.tolerance, memory)
    if change is None:
        return None
    # Of a heavier body than the one that was kept, errors of the model are larger, too.
    tolerance = np.maximum(found.tolerance, consensus.share_of(change.load))
    square = ((change.residual / tolerance) ** 2).mean(1)
    away = np.abs(slices.time - change.time) > HANDS
    parts = [square[t.first : t.last][away[t.first : t.last]] for t in touches]
    quiet = all(part.mean() < SAME for part in parts if len(part)) and square[found.kept & away].mean() < SAME
    lasting = max(map(len, parts)) * median_step(slices.time) > SHORTEST / 2
    return change if quiet and lasting else None


def _likelier(slices: Slices, found: Consensus, touches: Sequence[Touch]) -> Consensus:
    """Return the consensus of the times before and after what was kept, where one body explains both of them.

    Two touches that happen to press alike are less likely than one touch between them, even a longer one.
    """
    out = ~_away(touches, len(slices.y))
    if len(touches) < 2 or len(runs(found.kept)) > 1:
        return found
    other = consensus.refine(slices, consensus.fit(slices, out, found.tolerance), out)
    if other is None or (other.kept & out).sum() < ALIKE * out.sum():
        return found
    looser = float(np.log(other.tolerance / found.tolerance).mean())
    return other if looser < LOOSER and len(runs(~other.kept)) == 1 else found


def _away(touches: Sequence[Touch], count: int, guarded: bool = False) -> Mask:
    """Return the slices (F,) outside every touch, or well away from each where they are `guarded`."""
    kept = np.ones(count, np.bool_)
    for t in touches:
        margin = min(1 + int(np.ceil(GUARD * (t.last - t.first))), LONGEST_GUARD) if guarded else 0
        kept[max(t.first - margin, 0) : t.last + margin] = False
    return kept


def _contact(slices: Slices, found: Consensus, touches: Sequence[Touch], kept: Mask, unlike_hands: bool) -> Finding:
    """Return the finding with the times, their share and the size of the extra wrench.

    unlike_hands  whether the words leave open why the wrench does not fit one body
    """
    half = median_step(slices.time) / 2
    spans = [(slices.time[a] - half, slices.time[b - 1] + half) for a, b in runs(~kept)]
    named = ", ".join(f"{a:.1f} to {b:.1f}" for a, b in spans[:5]) + (
        f" and {len(spans) - 5} more" if len(spans) > 5 else ""
    )
    share = f"{100 * (1 - kept.mean()):.0f} % of the time"
    what, left_out = "Something else than the robot touched the object", share
    if unlike_hands:
        what, left_out = f"The wrench does not fit one body in {share},", "that time"
    end = f"{left_out} was left out"
    if not _left_out(found, touches, kept):
        end = "the rest fits hardly better, so nothing was left out"
    text = (
        f"{what} at {named} s, with up to {max(t.force for t in touches):.2g} N and "
        f"{max(t.torque for t in touches):.2g} N m; {end}."
    )
    tared = False
    if _swappable(slices, found, touches):
        text += (
            " A constant wrench fits as well, so it may be these times that were free and the others that were touched;"
            " mass and centre of mass are the same either way, the bias is not."
        )
        tared = len(touches) == 1 and (touches[0].first == 0 or touches[0].last == len(slices.y))
        if tared:
            text += " It reaches an end of the log, as where the sensor was tared in between."
    finding = Finding.of("contact", text)
    finding = replace(finding, remedy=ALL_ELSE) if unlike_hands else finding
    return replace(finding, remedy=f"{TARED} {finding.remedy}") if tared else finding


def _unlike_hands(kept: Mask, moving: Mask) -> bool:
    """Whether what was left out is too much of the log, or too exactly the time in motion, for a hand to be likely."""
    out = ~kept
    together = (out & moving).sum()
    in_motion = 0 < moving.mean() < 1 and together > MOVING * moving.sum() and together > 0.5 * out.sum()
    return bool(out.mean() > MUCH or in_motion)


def _swappable(slices: Slices, found: Consensus, touches: Sequence[Touch]) -> bool:
    """Whether one constant wrench explains the touches, and they last at least half as long as what was kept."""
    out = ~_away(touches, len(slices.y))
    if slices.weight[out].sum() < 0.5 * slices.weight[found.kept].sum():
        return False
    rest = (found.residual[out] - np.median(found.residual[out], axis=0)) / found.tolerance[out]
    return bool(np.median((rest**2).mean(1)) < SAME)
