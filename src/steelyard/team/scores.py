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
    def of(
        cls, apart: Array, columns: Array, robot: Integers, J: Array, W: Array, stretches: int,
        powers: Array | None = None,
    ) -> Scores:  # fmt: skip
        """Return the sums over rows.

        apart  (T, N, 6) residuals of each grasp in its own axes     columns  (T, C, 6) and whose they are, robot (C,)
        J      (N, 6, 6) residuals per motion of the payload         W        (N, 6) their weights
        powers (T, P) by which columns also count, all by the first, then by the next: there are P C parameters
        """
        # The sum over robots of J^T W J is what a row tells of the motion: L L^T is its inverse.
        root = np.linalg.cholesky(np.linalg.inv(np.einsum("nka,nk,nkb->ab", J, W, J)))
        rows, pairs = len(apart), np.argwhere(robot[:, None] == robot)
        powers = np.ones((rows, 1)) if powers is None else powers
        sizes = np.full(stretches, rows // stretches) + (np.arange(stretches) < rows % stretches)
        first = np.concatenate([[0], np.cumsum(sizes)])
        pull, information, taken = _gathered(apart, columns, powers, robot, pairs, J @ root, W, first)
        for k in range(stretches):
            shared = taken[:, first[k] : first[k + 1]].reshape(len(taken), -1)
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
    apart: Array, columns: Array, powers: Array, robot: Integers, pairs: Integers, lever: Array, W: Array,
    first: Integers,
) -> tuple[Array, Array, Array]:  # fmt: skip
    """Return scores (B, P C), information (B, P C, P C) were the motion known, and what it takes up (P C, T, 6).

    pairs (K, 2) of columns of one robot    lever (N, 6, 6) of the motion in units of what a row tells of it
    first (B + 1,) rows of the stretches
    """
    T, C = columns.shape[:2]
    P, B = powers.shape[1], len(first) - 1
    pull, information = np.zeros((B, P * C)), np.zeros((B, P * C, P * C))
    taken, pushed, moved = np.empty((P * C, T, 6)), np.empty((C, 6)), np.empty(6)
    for k in range(B):
        for t in range(first[k], first[k + 1]):
            for c in range(C):
                i, score = robot[c], 0.0
                moved[:] = 0.0
                for a in range(6):
                    push = columns[t, c, a] * W[i, a]
                    score += push * apart[t, i, a]
                    for m in range(6):
                        moved[m] += push * lever[i, a, m]
                    pushed[c, a] = push
                for q in range(P):
                    pull[k, q * C + c] += powers[t, q] * score
                    for m in range(6):
                        taken[q * C + c, t, m] = powers[t, q] * moved[m]
            for p in range(len(pairs)):
                c, d = pairs[p]
                total = 0.0
                for a in range(6):
                    total += pushed[c, a] * columns[t, d, a]
                for q in range(P):
                    for r in range(P):
                        information[k, q * C + c, r * C + d] += powers[t, q] * powers[t, r] * total
    return pull, information, taken
