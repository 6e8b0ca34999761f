"""What a motion and a body leave of sums over the robots' pushes, from sums of products."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.team.payload.model import Group


def scatter(groups: Sequence[Group]) -> Array:
    """Return the scatter of all recordings and bands."""
    return np.asarray(sum(part.scatter.sum(0) for group in groups for part in group.parts))


def centred(S: Array) -> Array:
    """Return a scatter with its constant left out."""
    return S - np.outer(S[-1], S[-1]) / max(float(S[-1, -1]), 1e-300)


def pseudoinverse(G: Array) -> Array:
    """Return the pseudoinverse of normal equations, which may not show everything."""
    values, axes = np.linalg.eigh(G)
    kept = values > 1e-9 * values[-1]
    return np.asarray((axes[:, kept] / values[kept]) @ axes[:, kept].T)


def unexplained(K: Array, E: Array, S: Array) -> float:
    """Return what the motion and a constant leave of rows K (k, 6 N) of the pushes.

    E  (p, k, 12) is what parameters make of the motion, or (12, 12): any motion explains any row
    """
    S = centred(S)
    pushed = K @ S[12:-1, 12:-1] @ K.T
    seen = K @ S[12:-1, :12]
    if E.ndim == 2:
        return float(np.trace(pushed - seen @ pseudoinverse(S[:12, :12]) @ seen.T))
    G = np.einsum("pix,xy,qiy->pq", E, S[:12, :12], E, optimize=True)
    along = np.tensordot(E, seen, ([1, 2], [0, 1]))
    return float(np.trace(pushed) - along @ pseudoinverse(G) @ along)
