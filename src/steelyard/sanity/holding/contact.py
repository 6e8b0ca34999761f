"""Contact and load change: time in which the wrench is not that of one body held by the robot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Mask
from steelyard.findings import Finding
from steelyard.logs.clock import median_step
from steelyard.logs.log import MotionLog
from steelyard.logs.runs import runs
from steelyard.sanity.holding import consensus
from steelyard.sanity.holding.consensus import Consensus, Slices
from steelyard.sanity.holding.load_change import HANDS, SHARE, SHORTEST, LoadChange, find_change, kept_side
from steelyard.sanity.holding.touch import (
    FEWEST_SLICES,
    Touch,
    apart,
    away,
    large,
    memory_of,
    possible,
    slices_of,
    stands_out,
    touches_of,
)

# What is left alone must be this share of the log.
LEAST_LEFT = 0.22
# Touches are alike where one body explains this share of them, with a tolerance no looser than by e^LOOSER.
ALIKE, LOOSER = 0.9, 0.3
# A touched time that a jump of bias explains to this squared misfit might as well be the untouched one.
SAME = 2.0
# More of the log than this, or more of the motion than that, is likelier misread than touched. It is left out if it
# stands out: the times that happen to agree beside errors that vary with the pose give a worse answer than all.
MUCH, MOVING = 0.4, 0.8
ALL_ELSE = (
    "Check what spoils a whole log first: time unit, clocks, axes and signs of the wrench, how the sensor is mounted, "
    "a payload that the controller compensates, a bias that rises and falls. If all are right, "
    "keep hands and fixtures off the object."
)
TARED = "If the sensor was tared within the log, cut the log there and identify each piece with its own bias. Else:"


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
    sliced = slices_of(log, with_bias)
    if sliced is None:
        return np.ones(len(log), np.bool_)
    slices, row = sliced
    found = consensus.largest(slices)
    rest = consensus.fit(slices, ~found.kept, found.tolerance)
    empty = abs(found.x[0]) < SHARE * rest[0] and (~found.kept).mean() > LEAST_LEFT
    return np.asarray(found.kept != empty)[row]


def _in_order(log: MotionLog, with_bias: bool) -> tuple[Mask, tuple[Finding, ...]]:
    """Return what `untouched` returns for rows that are in order of time."""
    everything, sliced = np.ones(len(log), np.bool_), slices_of(log, with_bias)
    if sliced is None:
        return everything, ()
    slices, row = sliced
    found = consensus.largest(slices)
    memory = memory_of(found)
    touches = touches_of(slices, found, memory)
    if not touches:
        return everything, ()
    change = _explained(slices, found, touches, memory)
    if change is None and (second := _one_of_two(slices, found, touches)) is not None:
        return _after_change(log, with_bias, second, touches[0].first > 0)
    # Small errors of model or calibration look like a small slip.
    if change is not None and (not change.slip or any(large(found.x, t) for t in touches)):
        return _after_change(log, with_bias, change, change.loaded_before)
    found = _likelier(slices, found, touches)
    touches = touches_of(slices, found, memory)
    touches = [t for t in touches if large(found.x, t) or apart(slices, found, t)]
    guarded = away(touches, len(slices.y), guarded=True)
    if not touches or not possible(found.x, touches) or guarded.mean() < LEAST_LEFT:
        return everything, ()
    moving = np.bincount(row, ~log.still) > 0.5 * np.bincount(row)
    finding = _contact(slices, found, touches, guarded, _unlike_hands(guarded, moving))
    return (guarded[row] if _left_out(found, touches, guarded) else everything), (finding,)


def _after_change(
    log: MotionLog, with_bias: bool, change: LoadChange, early: bool | None
) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the earlier, later or longer side of a change, less the time of hands, searched for contact in turn."""
    side, finding = kept_side(np.asarray(log.time), change.time, change.words, change.slip > 0, early)
    kept, more = untouched(log.rows(side), with_bias)
    mask = side.copy()
    mask[side] = kept
    return mask, (finding, *more)


def _left_out(found: Consensus, touches: Sequence[Touch], kept: Mask) -> bool:
    """Whether the touches are to be left out: not much of the log, or far beyond what the rest leaves of the wrench."""
    return bool(kept.mean() >= 1 - MUCH) or any(stands_out(found, t) for t in touches)


def _explained(slices: Slices, found: Consensus, touches: Sequence[Touch], memory: float) -> LoadChange | None:
    """Return the load change that leaves nothing of the touches, if there is one."""
    change = find_change(slices, found.tolerance, memory)
    if change is None:
        return None
    # Of a heavier body than the one that was kept, errors of the model are larger, too.
    tolerance = np.maximum(found.tolerance, consensus.share_of(change.load))
    square = ((change.residual / tolerance) ** 2).mean(1)
    clear = np.abs(slices.time - change.time) > HANDS
    parts = [square[t.first : t.last][clear[t.first : t.last]] for t in touches]
    quiet = all(part.mean() < SAME for part in parts if len(part)) and square[found.kept & clear].mean() < SAME
    lasting = max(map(len, parts)) * median_step(slices.time) > SHORTEST / 2
    return change if quiet and lasting else None


def _one_of_two(slices: Slices, found: Consensus, touches: Sequence[Touch]) -> LoadChange | None:
    """Return the change next to what was kept, where all else, up to an end of the log, is two loads with one change.

    So it is where one object was put down and another picked up.
    """
    if len(touches) != 1:
        return None
    first, last = touches[0].first, touches[0].last
    if last - first < FEWEST_SLICES or (first == 0) == (last == len(slices.y)):
        return None
    rest, mass = slices.part(slice(first, last)), float(found.x[0])
    inner = consensus.largest(rest)
    memory = memory_of(inner)
    others = touches_of(rest, inner, memory)
    change = _explained(rest, inner, others, memory) if others else None
    if change is None:
        return None
    edge = last if first == 0 else first
    before, after = (change.after, mass) if first == 0 else (mass, change.before)
    if min(before, after) < -SHARE * max(before, after):
        return None
    return replace(
        change,
        time=float(slices.time[edge - 1] + slices.time[edge]) / 2,
        before=before,
        after=after,
        slip=0.0,
        also=f" (and at {change.time:.1f} s {change.words})",
    )


def _likelier(slices: Slices, found: Consensus, touches: Sequence[Touch]) -> Consensus:
    """Return the consensus of the times before and after what was kept, where one body explains both of them.

    Two touches that happen to press alike are less likely than one touch between them, even a longer one.
    """
    out = ~away(touches, len(slices.y))
    if len(touches) < 2 or len(runs(found.kept)) > 1:
        return found
    other = consensus.refine(slices, consensus.fit(slices, out, found.tolerance), out)
    if other is None or (other.kept & out).sum() < ALIKE * out.sum():
        return found
    looser = float(np.log(other.tolerance / found.tolerance).mean())
    return other if looser < LOOSER and len(runs(~other.kept)) == 1 else found


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
    out = ~away(touches, len(slices.y))
    if slices.weight[out].sum() < 0.5 * slices.weight[found.kept].sum():
        return False
    rest = (found.residual[out] - np.median(found.residual[out], axis=0)) / found.tolerance[out]
    return bool(np.median((rest**2).mean(1)) < SAME)
