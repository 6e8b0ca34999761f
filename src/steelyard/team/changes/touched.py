"""Stretches of a moving recording in which a hand, or a fixture, pushes the payload: told by what no payload needs.

What the fit leaves of the sum of wrenches is noise and slow errors, much the same throughout; a hand that comes and
goes leaves many times as much while it is there. The motion is measured all the same, so that only wrenches are lost.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import binary_dilation

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.logs.log import Mask
from steelyard.team.payload.body_rows import BodyRows, Run, averaged
from steelyard.team.payload.model import weight

# What is left is averaged over MEAN_S. It counts where it is so many times the usual (median) and this share of the
# weight; rows within MARGIN_S [s] of that are left out, too.
MEAN_S, MARGIN_S = 0.5, 0.75
TIMES, SHARE = 8.0, 0.03
# Where more of a recording is touched, it is left out if there are others. What is usual in it is at most so many times
# what it is in another.
MOST, UNLIKE = 0.4, 2.0


@dataclass(frozen=True)
class Touched:
    """How long [s] a recording was touched, and with how much at most [N]."""

    recording: str
    seconds: float
    newtons: float

    def finding(self) -> Finding:
        """Return what is said of it."""
        return Finding.of(
            "contact",
            f"For {self.seconds:.1f} s of '{self.recording}' robots push up to {self.newtons:.2g} N that the payload "
            "does not need, as where a hand pushes it; its wrenches were left out meanwhile.",
        )


def without_touched(
    rows: Sequence[tuple[BodyRows, Array]], phi: Array, D: Array, size: float, highest_hz: float
) -> tuple[list[tuple[BodyRows, Array]], tuple[Touched, ...]]:
    """Return recordings without the rows in which the payload was touched, and what was found.

    rows  recordings beside residuals of their poses     phi  (10,) of the payload in B     D  (6, 6 N) as in `normal`
    size  of the team [m], by which moments are compared with forces     highest_hz  of the band that is used
    """
    pushes = [[] if body.still else [_unneeded(run, phi, D, size) for run in body.runs] for body, _ in rows]
    sizes = [np.linalg.norm(np.concatenate(each), axis=1) if each else np.zeros(0) for each in pushes]
    usual = [float(np.median(each)) if len(each) else np.inf for each in sizes]
    out, found = list(rows), list[Touched]()
    for k, (body, left) in enumerate(rows):
        if not pushes[k]:
            continue
        others = min(usual[:k] + usual[k + 1 :], default=np.inf)
        least = max(TIMES * min(usual[k], UNLIKE * others), SHARE * weight(phi))
        touched = [
            around(_inner(np.linalg.norm(push, axis=1) > least, run.rate), run.rate)
            for push, run in zip(pushes[k], body.runs, strict=True)
        ]
        share = float(np.concatenate(touched).mean())
        if not share or (share > MOST and not np.isfinite(others)):
            continue
        if share > MOST:
            touched = [np.ones_like(each) for each in touched]
        out[k] = (body.without(touched, highest_hz), left)
        newtons = max(float(np.linalg.norm(push[:, 3:], axis=1).max()) for push in pushes[k])
        found.append(Touched(body.name, body.seconds(touched), newtons))
    return out, tuple(found)


def together(touched: Sequence[Touched]) -> tuple[Touched, ...]:
    """Return what was found with one word on each recording."""
    out = dict[str, Touched]()
    for one in touched:
        was = out.get(one.recording, Touched(one.recording, 0.0, 0.0))
        out[one.recording] = Touched(one.recording, was.seconds + one.seconds, max(was.newtons, one.newtons))
    return tuple(out.values())


def _unneeded(run: Run, phi: Array, D: Array, size: float) -> Array:
    """Return what is pushed (T, 6) and not needed, averaged over MEAN_S and less a constant [N, moments over size]."""
    left = (run.pushed @ D.T - run.motion @ motion_map(phi).T) / np.repeat([size, 1.0], 3)
    smooth = averaged(left, MEAN_S, run.rate)
    return np.asarray(smooth - np.median(smooth, axis=0))


def _inner(rows: Mask, rate: float) -> Mask:
    """Return rows (T,) but for those at the ends, whose accelerations are told from one side: these say nothing."""
    edge, inner = round(MEAN_S * rate), rows.copy()
    inner[:edge] = inner[len(rows) - edge :] = False
    return inner


def around(rows: Mask, rate: float) -> Mask:
    """Return rows (T,) with those within MARGIN_S."""
    return np.asarray(binary_dilation(rows, iterations=max(1, round(MARGIN_S * rate)))) if rows.any() else rows
