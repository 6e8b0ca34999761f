"""Jumps of a clock too small to show in how fast robots turn: steps of how late a fit finds its stamps.

Beside an offset and a rate of every clock, one that steps at some time explains what the fit leaves by so many standard
deviations. These hold for slow noise, since they are those of long stretches. Where it stepped, short ones tell.
Source: own.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array

# A clock steps by so much [s] at least, and beyond so many standard deviations; this share of what is known of it comes
# from either side: of rests, noise alone tells, and amiss.
LEAST_S, BEYOND, EITHER = 5e-4, 8.0, 0.08


@dataclass(frozen=True)
class Step:
    """Stamps of `name` in one recording (its number) that are later by `size` [s] from `at` [s] on."""

    recording: int
    name: str
    at: float
    size: float


@dataclass(frozen=True)
class Best:
    """The clearest step: of which robot, from which stretch on, its size [s], and its share of its own noise."""

    robot: int
    first: int
    size: float
    score: float

    @property
    def sure(self) -> bool:
        """Whether it is no noise."""
        return abs(self.size) > LEAST_S and self.score > BEYOND


def clearest(pull: Array, information: Array, at: Array, held: Array) -> Best:
    """Return the clearest step of one clock beside offsets and rates of all.

    pull         (B, n) scores of how late each of n robots is, by stretches in order
    information  (B, n, n) theirs
    at           (B,) the stretches' times, -1 to 1
    held         (n, n) information on what all have in common, which nothing shows
    """
    count = pull.shape[1]
    powers = np.stack([np.ones_like(at), at], axis=1)
    # Columns of offset and rate by robots: (B, n, 2 n).
    beside = (information[:, :, None] * powers[:, None, :, None]).reshape(len(at), count, -1)
    H = np.einsum("bp,bic->pic", powers, beside).reshape(2 * count, -1) + np.kron(np.eye(2), held)
    inverse = np.linalg.pinv(H, rcond=1e-12, hermitian=True)
    left = pull - beside @ (inverse @ (powers.T @ pull).ravel())
    # A step from every stretch on: (B, n, ...), the first being an offset.
    after = [np.cumsum(x[::-1], axis=0)[::-1][1:] for x in (left, beside, np.einsum("bii->bi", information))]
    known = after[2] - ((after[1] @ inverse) * after[1]).sum(-1)
    share = after[2] / np.maximum(np.einsum("bii->i", information), 1e-300)
    known = np.where((share > EITHER) & (share < 1 - EITHER) & (known > 1e-9 * after[2]), known, np.inf)
    k, i = np.unravel_index(int(np.argmax(after[0] ** 2 / known)), known.shape)
    size = float(after[0][k, i] / known[k, i])
    own = information[:, :, i] * (np.arange(len(at)) > k)[:, None] - beside @ (inverse @ after[1][k, i])
    left = left - size * own
    noise = np.einsum("bi,bi->i", left, left)[i] / max(float(np.einsum("bii->bi", information)[:, i].sum()), 1e-300)
    score = abs(size) * float(np.sqrt(known[k, i] / max(noise, 1.0))) if np.isfinite(known[k, i]) else 0.0
    return Best(int(i), int(k) + 1, size, score)
