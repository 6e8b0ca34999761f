"""What a joint fit leaves, explained by further parameters: ways in which residuals may move beside the payload.

Of residuals e_i (T, 6) of robot i, e_i = sum_c columns_c theta_c + what any motion of the payload makes of all robots +
noise. Sums over stretches of the rows are kept apart, so that the scatter of their scores tells standard deviations
that hold for slow noise, too.
Source: own; sandwich covariance as in `poses.covariance`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.team.definite import shown_axes

# Directions of scaled parameters with less than this share of the information are open: they stay at zero.
OPEN = 1e-9


@dataclass(frozen=True, eq=False)
class Scores:
    """Scores (B, C) of parameters and what they are known by (B, C, C), by stretches."""

    pull: Array
    information: Array

    @classmethod
    def of(cls, apart: Array, columns: Array, robot: Integers, J: Array, W: Array, stretches: int) -> Scores:
        """Return the sums over rows.

        apart  (T, N, 6) residuals of each grasp in its own axes     columns  (T, C, 6) and whose they are, robot (C,)
        J      (N, 6, 6) residuals per motion of the payload         W        (N, 6) their weights
        """
        # The sum over robots of J^T W J is what a row tells of the motion: L L^T is its inverse.
        root = np.linalg.cholesky(np.linalg.inv(np.einsum("nka,nk,nkb->ab", J, W, J)))
        rows, pairs = len(apart), np.argwhere(robot[:, None] == robot)
        sizes = np.full(stretches, rows // stretches) + (np.arange(stretches) < rows % stretches)
        first = np.concatenate([[0], np.cumsum(sizes)])
        pull, information, taken = _gathered(apart, columns, robot, pairs, J @ root, W, first)
        for k in range(stretches):
            shared = taken[:, first[k] : first[k + 1]].reshape(len(robot), -1)
            information[k] -= shared @ shared.T
        return cls(pull, information)

    def solved(self, held: Array | None = None) -> tuple[Array, tuple[Array, Array]]:
        """Return parameters (C,) and their covariances (C, C) by the scatter of the scores and for white noise.

        held  (C, C) information from elsewhere
        """
        H = self.information.sum(0) + (0.0 if held is None else held)
        root, values = shown_axes(H, OPEN)
        inverse = (root / values) @ root.T
        size = inverse @ self.pull.sum(0)
        # With the parameters taken out: what is explained is no noise.
        left = self.pull - self.information @ size
        spread = left.T @ left * (len(left) / (len(left) - 2))
        return size, (inverse @ spread @ inverse, inverse)


@numba.njit(cache=True, error_model="numpy")
def _gathered(
    apart: Array, columns: Array, robot: Integers, pairs: Integers, lever: Array, W: Array, first: Integers
) -> tuple[Array, Array, Array]:
    """Return scores (B, C), their information (B, C, C) were the motion known, and what it takes up (C, T, 6).

    pairs (P, 2) of columns of one robot    lever (N, 6, 6) of the motion in units of what a row tells of it
    first (B + 1,) rows of the stretches
    """
    T, C = columns.shape[:2]
    pull, information = np.zeros((len(first) - 1, C)), np.zeros((len(first) - 1, C, C))
    taken, pushed = np.empty((C, T, 6)), np.empty((C, 6))
    for k in range(len(first) - 1):
        for t in range(first[k], first[k + 1]):
            for c in range(C):
                i = robot[c]
                for a in range(6):
                    pushed[c, a] = columns[t, c, a] * W[i, a]
                    pull[k, c] += pushed[c, a] * apart[t, i, a]
                for m in range(6):
                    total = 0.0
                    for a in range(6):
                        total += pushed[c, a] * lever[i, a, m]
                    taken[c, t, m] = total
            for p in range(len(pairs)):
                c, d = pairs[p]
                for a in range(6):
                    information[k, c, d] += pushed[c, a] * columns[t, d, a]
    return pull, information, taken
