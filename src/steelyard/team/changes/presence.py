"""Who carries when: robots that let go or join during a log, told from robots whose data are merely missing.

A robot that pushes with next to nothing for a while may have let go. Whether it has, motion tells: a grasp that holds
nothing does not go where the others say it must. Missing rows are no sign of either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from scipy.ndimage import uniform_filter1d

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.log import Mask
from steelyard.logs.runs import runs
from steelyard.team.stacked import Stretch

# A push below this share of the robot's usual one is idle where it stays so for IDLE_S [s]; forces are averaged over
# MEAN_S. What happens within EDGE_S of a change is used for nothing.
SHARE, IDLE_S, MEAN_S, EDGE_S = 0.1, 1.0, 0.2, 0.4
# An idle grasp is off the payload where it is so many times its noise from where the others say it must be.
OFF = 5.0


def idle(parts: Sequence[Stretch]) -> list[Mask]:
    """Return the rows (T, N) of every recording in which a robot pushes with next to nothing."""
    sizes = [_smoothed(part) for part in parts]
    count = parts[0].seen.shape[1]
    usual = np.zeros(count)
    for i in range(count):
        felt = np.concatenate([size[part.felt[:, i], i] for size, part in zip(sizes, parts, strict=True)])
        usual[i] = np.quantile(felt, 0.9) if len(felt) else 0.0
    out = []
    for size, part in zip(sizes, parts, strict=True):
        small = (size < SHARE * usual) & part.felt & part.carries
        out.append(np.stack([_long(small[:, i], IDLE_S * part.rate) for i in range(count)], axis=1))
    return out


def _smoothed(part: Stretch) -> Array:
    """Return the size (T, N) [N] of the force averaged over MEAN_S."""
    width = max(1, round(MEAN_S * part.rate))
    mean = uniform_filter1d(part.wrench[..., 3:], width, axis=0, mode="nearest")
    return np.asarray(np.sqrt(mean[..., 0] ** 2 + mean[..., 1] ** 2 + mean[..., 2] ** 2))


def _long(rows: Mask, least: float) -> Mask:
    """Return the runs of rows that last at least so many."""
    out = np.zeros_like(rows)
    for start, stop in runs(rows):
        if stop - start >= least:
            out[start:stop] = True
    return out


def as_long(values: Any, rows: int) -> Any:
    """Return values (T, ...) cut to `rows`, or the last one repeated: a corrected clock gains or loses a few rows."""
    return values[np.minimum(np.arange(rows), len(values) - 1)]


def let_go(part: Stretch, idle_rows: Mask, off: Array) -> Stretch:
    """Return the recording with robots that are idle and `off` (T, N) by more than OFF times their noise let go.

    Their rows tell neither motion nor wrench; around a change nobody's wrench is used, since the sum is in doubt.
    """
    idle_rows, off = as_long(idle_rows, len(part)), as_long(off, len(part))
    carries, seen, felt = part.carries.copy(), part.seen.copy(), part.felt.copy()
    for i in range(idle_rows.shape[1]):
        for start, stop in runs(idle_rows[:, i]):
            there = part.seen[start:stop, i]
            # What stands still beside a payload at rest cannot be told from what holds it.
            if not there.any() or np.sqrt((off[start:stop, i][there] ** 2).mean()) < OFF:
                continue
            edge = int(np.ceil(EDGE_S * part.rate))
            carries[start:stop, i] = False
            seen[max(0, start - edge) : stop + edge, i] = False
            for k in (start, stop):
                if 0 < k < len(part):
                    felt[max(0, k - edge) : k + edge] = False
    return replace(part, carries=carries, seen=seen, felt=felt)


def presence_findings(before: Sequence[Stretch], after: Sequence[Stretch], names: Sequence[str]) -> list[Finding]:
    """Return robot-left and robot-joined with times, for every change that was found."""
    out = []
    for was, now in zip(before, after, strict=True):
        for i, name in enumerate(names):
            for start, stop in runs(was.carries[:, i] & ~now.carries[:, i]):
                if start > 0:
                    text = f"'{name}' let go of the payload at {was.time[start]:.2f} s of '{was.name}'"
                    out.append(Finding.of("robot-left", f"{text}; from then on the others carry it."))
                if stop < len(was):
                    text = f"'{name}' took hold of the payload at {was.time[stop]:.2f} s of '{was.name}'"
                    out.append(Finding.of("robot-joined", f"{text}; until then the others carried it."))
                if start == 0 and stop == len(was):
                    text = f"'{name}' held nothing during all of '{was.name}'"
                    out.append(Finding.of("robot-left", f"{text}; the others carry it."))
    return out
