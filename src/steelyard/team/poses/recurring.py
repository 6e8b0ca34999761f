"""Errors of poses that are not drawn anew in every row: they come back with the pose, or last for a rest.

To first order an error that comes back with the pose, as of an arm that is not well calibrated, is linear in where the
payload is. What of it looks like grasps, homes and clocks that are a little elsewhere leaves no residual, however long
the log; the rest does. All coefficients of one kind (of turns, of places) are taken to be drawn alike, over robots,
axes and directions, so that those that show tell how large those are that do not.

Encoders in steps, eccentric joints and bent arms err alike in all rows of a rest, and anew in each row of a motion: a
second at rest counted as a hundred rows pulls grasps to its own error. How much alike is seen in what a fit leaves:
means over rests against means over as many rows of motion.
Source: own; a random-effects model whose variances are found by moments.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.autocorrelation import correlation_time
from steelyard.team.poses.fit import PoseFit, Rows
from steelyard.team.poses.solver import OWN
from steelyard.team.stacked import Stretch, with_rows

# Rows that are enough for what is slow, and the least there must be.
ROWS, FEWEST = 400, 40
# Coefficients must be so many times as large, in squares, as noise makes them.
SEEN = 4.0
# The payload must move by so many times the noise of a row along a direction.
MOVED = 5.0
# Rows that a rest must have, and rests and windows of motion that must be there to be compared.
REST_ROWS, RESTS, WINDOWS = 10, 2, 4
# Rests that would count more than this are left as they are: chance.
LESS = 0.5


@dataclass(frozen=True, eq=False)
class Recurring:
    """Errors that come back with the pose.

    size    (2,) rms along an axis over the motion, of turn [rad] and place [m]
    scores  (M, 13 N) of one standard deviation of every coefficient
    """

    size: Array
    scores: Array


def recurring(fit: PoseFit) -> Recurring | None:
    """Return the errors that residuals show to come back with the pose; None where there are none."""
    thin, share = _thinned(fit)
    features = _features(thin, fit.noise, share)
    if features is None:
        return None
    count, shown = thin.data.count, features.shape[1]
    found = np.einsum("tk,t,tna->kna", features, share, thin.apart)
    left = thin.apart - np.einsum("tk,kna->tna", features, found)
    variance = np.einsum("t,tna->na", share, left**2) * correlation_time(left, len(left) / 4) / len(left)
    square, noise = (found**2).reshape(-1, 2, 3).sum((0, 2)), shown * variance.reshape(-1, 2, 3).sum((0, 2))
    # The payload's motion takes up what all have in common, homes what turns with the pose.
    visible = 1 - (6 * shown + 6 * (count - 1)) / (6 * shown * count)
    if visible <= 0 or not (square > SEEN * noise).any():
        return None
    # Where one kind shows, the other may hide in the noise: none is taken off.
    spread = np.sqrt(square / (3 * shown * count * visible))
    # What an error is in the middle of the motion shows nowhere: it is taken to be as large as what varies.
    every = np.column_stack([np.ones(len(features)), features])
    return Recurring(np.sqrt(shown) * spread, _scores(fit, thin, every * spread.repeat(3)[:, None, None]))


def _thinned(fit: PoseFit) -> tuple[Rows, Array]:
    """Return some of the rows in which all robots have poses, and how much each counts (T,), one in all."""
    whole = np.flatnonzero(fit.rows.data.complete)
    chosen = whole[:: -(-len(whole) // ROWS)] if len(whole) else whole
    team = replace(fit.team, motion=fit.team.motion[chosen])
    rows = Rows(fit.rows.data.rows(chosen), team, fit.rows.apart[chosen])
    share = rows.data.shares
    return rows, share / max(float(share.sum()), 1e-300)


def _features(rows: Rows, noise: Array, share: Array) -> Array | None:
    """Return where the payload is (T, K), of mean zero, uncorrelated, of unit size; None where it hardly moves."""
    if len(share) < FEWEST:
        return None
    X = rows.team.motion
    turn = (X.rotation[0].inverse() @ X.rotation).log()
    quiet = np.repeat(noise.max(0), 3)
    moved = np.concatenate([turn, X.position], axis=1) / quiet
    moved = np.sqrt(share)[:, None] * (moved - share @ moved)
    U, size, _ = np.linalg.svd(moved, full_matrices=False)
    plain = size > MOVED
    return U[:, plain] / np.sqrt(np.maximum(share, 1e-300))[:, None] if plain.any() else None


def _scores(fit: PoseFit, rows: Rows, sized: Array) -> Array:
    """Return the scores (M, 13 N) of errors along each axis of each robot's poses, `sized` (6, T, K)."""
    weight = float(fit.rows.data.shares.sum() / rows.data.shares.sum())
    out = []
    for robot in range(rows.data.count):
        for axis in range(6):
            for error in sized[axis].T:
                apart = np.zeros_like(rows.apart)
                apart[:, robot, axis] = error
                out.append(weight * replace(rows, apart=apart).pull(fit.noise))
    return np.array(out).reshape(-1, OWN * rows.data.count)


def shares_at_rest(parts: Sequence[Stretch], fit: PoseFit) -> Array | None:
    """Return how much each row (T,) counts, below one at rest; None where all count alike."""
    rest = [part.kind == "still" for part in parts]
    sizes = [len(part) for part in parts]
    rows = round(np.median([n for n, still in zip(sizes, rest, strict=True) if still] or [0]))
    if rows < REST_ROWS or all(rest):
        return None
    resting, moving = list[float](), list[float]()
    for (part, own), still in zip(with_rows(parts), rest, strict=True):
        left = (fit.rows.residual[own] / np.repeat(fit.noise, 3, axis=1))[part.seen.all(1)]
        if len(left) >= rows / 2:
            pieces = 1 if still else max(1, len(left) // rows)
            means = [(piece.mean(0) ** 2).mean() for piece in np.array_split(left, pieces)]
            (resting if still else moving).extend(means)
    if len(resting) < RESTS or len(moving) < WINDOWS:
        return None
    share = max(float(np.mean(moving)) / max(float(np.mean(resting)), 1e-300), 1 / rows)
    return np.repeat(np.where(rest, share, 1.0), sizes) if share < LESS else None
