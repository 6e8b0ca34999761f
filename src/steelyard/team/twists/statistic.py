"""All that twists of N grasps say about where the grasps are: one scatter matrix, whatever the length of the log.

With y (6 N,) the body twists of all grasps at one time, the joint likelihood of the grasps under white noise depends on
sum y y^T alone. Scatters of time windows add; those of different robots do not, since rows mix them. With the twists
goes their rate of change, from which late clocks are found.
Source: own; the paper fits pairs of twists (eq. 1-8).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers, Mask
from steelyard.logs.runs import distinct_rows
from steelyard.team.twists.rows import TwistStretch, slope_shares

# Windows that a log is cut into, so that correlated noise is noticed; fewer where their scatters have more numbers.
WINDOWS, FEWEST, NUMBERS = 40, 8, 4e6


@dataclass(frozen=True, eq=False)
class TwistScatter:
    """Scatters of windows and patterns of robots.

    scatter  (B, 12 N, 12 N) of [y, dy/dt], zero for robots that did not speak     rows (B,)
    spoke    (B, N) which robots did     window (B,) number of the window
    """

    scatter: Array
    rows: Array
    spoke: Mask
    window: Integers

    @classmethod
    def of(cls, parts: tuple[TwistStretch, ...]) -> TwistScatter:
        """Return the statistic of recordings in motion; those at rest say nothing of where the grasps are."""
        moving = [part for part in parts if part.rows.kind != "still"] or list(parts)
        total = sum(len(part.rows) for part in moving)
        found: list[tuple[Array, int, Mask, int]] = []
        number, width = 0, 12 * moving[0].twist.shape[1]
        windows = min(WINDOWS, max(FEWEST, NUMBERS / width**2))
        for part in moving:
            pieces = max(1, round(windows * len(part.rows) / total))
            change = rates_of_change(part)
            for rows in np.array_split(np.arange(len(part.rows)), pieces):
                here = slice(int(rows[0]), int(rows[-1]) + 1)
                patterns, which = distinct_rows(part.seen[here])
                for k, spoke in enumerate(patterns):
                    if spoke.sum() < 2:
                        continue
                    chosen = which == k
                    both = [x[here][chosen] * spoke[:, None] for x in (part.twist, change)]
                    y = np.concatenate([x.reshape(len(x), -1) for x in both], axis=1)
                    found.append((y.T @ y, len(y), spoke, number))
                number += 1
        if not found:
            robots = moving[0].twist.shape[1]
            return cls(np.zeros((0, width, width)), np.zeros(0), np.zeros((0, robots), np.bool_), np.zeros(0, np.int64))
        scatter, count, spoke, window = zip(*found, strict=True)
        return cls(np.stack(scatter), np.array(count, float), np.stack(spoke), np.array(window))

    @property
    def count(self) -> int:
        """Number of robots."""
        return int(self.spoke.shape[1])

    def merged(self) -> TwistScatter:
        """Return one scatter per pattern of robots."""
        patterns, which = distinct_rows(self.spoke)
        scatter = np.zeros((len(patterns), *self.scatter.shape[1:]))
        rows = np.zeros(len(patterns))
        for k, S, count in zip(which, self.scatter, self.rows, strict=True):
            scatter[k] += S
            rows[k] += count
        return TwistScatter(scatter, rows, patterns, np.zeros(len(patterns), np.int64))

    def pair(self, i: int, j: int) -> Array:
        """Return the scatter (12, 12) of the twists of two robots over rows in which both spoke."""
        both = self.spoke[:, i] & self.spoke[:, j]
        place = np.concatenate([6 * i + np.arange(6), 6 * j + np.arange(6)])
        out = np.zeros((12, 12))
        for k in np.flatnonzero(both):
            out += self.scatter[k][np.ix_(place, place)]
        return out


def rates_of_change(part: TwistStretch) -> Array:
    """Return the slopes (T, N, 6) of all twists, zero in rows around which one that speaks there is not seen.

    A difference of next rows would be mostly noise: clocks that it is compared with seem too near.
    """
    shares = slope_shares(part.rows.rate)
    half, rows = len(shares), len(part.rows)
    out = np.zeros_like(part.twist)
    if rows <= 2 * half:
        return out
    for k, share in enumerate(shares, start=1):
        before, after = part.twist[half - k : rows - half - k], part.twist[half + k : rows - half + k]
        out[half : rows - half] += share * (after - before)
    whole = np.zeros(part.seen.shape, np.bool_)
    whole[half : rows - half] = np.lib.stride_tricks.sliding_window_view(part.seen, 2 * half + 1, axis=0).all(-1)
    told: Mask = np.asarray((whole | ~part.seen).all(1))
    return out * told[:, None, None]
