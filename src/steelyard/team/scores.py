"""What a joint fit leaves, explained by further parameters: ways in which residuals may move beside the payload.

Of residuals e_i (T, 6) of robot i, e_i = sum_c columns_c theta_c + what any motion of the payload makes of all robots +
noise. Sums over stretches of the rows are kept apart, so that the scatter of their scores tells standard deviations
that hold for slow noise, too.
Source: own; sandwich covariance as in `poses.covariance`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers

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
        pushed = columns * W[robot]
        taken = np.matmul(pushed.swapaxes(0, 1), (J @ root)[robot])
        pull = np.einsum("tck,tck->tc", pushed, apart[:, robot])
        pulls, informations = [], []
        for rows in np.array_split(np.arange(len(apart)), stretches):
            some, own = (_flat(x[rows].swapaxes(0, 1)) for x in (pushed, columns))
            shared = _flat(taken[:, rows])
            informations.append(np.where(robot[:, None] == robot, some @ own.T, 0.0) - shared @ shared.T)
            pulls.append(pull[rows].sum(0))
        return cls(np.array(pulls), np.array(informations))

    def solved(self, held: Array | None = None) -> tuple[Array, tuple[Array, Array]]:
        """Return parameters (C,) and their covariances (C, C) by the scatter of the scores and for white noise.

        held  (C, C) information from elsewhere
        """
        H = self.information.sum(0) + (0.0 if held is None else held)
        scale = 1 / np.sqrt(np.maximum(np.diag(H), 1e-300))
        inverse = np.linalg.pinv(H * np.outer(scale, scale), rcond=OPEN, hermitian=True) * np.outer(scale, scale)
        size = inverse @ self.pull.sum(0)
        # With the parameters taken out: what is explained is no noise.
        left = self.pull - self.information @ size
        spread = left.T @ left * (len(left) / (len(left) - 2))
        return size, (inverse @ spread @ inverse, inverse)


def _flat(parts: Array) -> Array:
    return parts.reshape(len(parts), -1)
