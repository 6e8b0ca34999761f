"""LeastSquares: ordinary, weighted and total least squares on the statistic (the OLS baseline).

Source: Atkeson, An, Hollerbach 1986, eq. 6-12 (ordinary); Van Huffel and Vandewalle 1991, section 3.5 (total, some
columns exact). None of the three keeps the answer a rigid body: `Estimate.parameters.validity()` says when it is not.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from scipy.linalg import eigh

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.identify.cost.linear import solve_scaled
from steelyard.identify.cost.noise_cost import weight
from steelyard.identify.fit import Bias, Estimator
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution

# A column with less than this share of its size beside the bias is not excited.
UNSEEN = 1e-14
KINDS = ("ordinary", "weighted", "total")


@dataclass(frozen=True)
class LeastSquares(Estimator):
    """Options of linear least squares.

    kind   "ordinary": every row and axis alike, N and N m mixed; "weighted": by the wrench noise; "total": noise in the
           accelerations too, one common scale free (the noise-aware cost with a fixed weight)
    bias   "free" or "none"
    """

    method = "least-squares"

    kind: Literal["ordinary", "weighted", "total"] = "weighted"
    bias: Bias | str = "free"

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise BadValue(f"kind must be one of {', '.join(KINDS)}; got {self.kind!r}.")

    def solution(self, problem: Problem) -> Solution:
        """Return the solution of a problem."""
        if self.kind == "total":
            return Solution.unconstrained(_total(problem))
        if self.kind == "weighted":
            weights = problem.wrench_weights
        else:
            weights = np.broadcast_to(np.eye(6), (len(problem.scatter), 6, 6)).copy()
        return Solution.unconstrained(solve_scaled(*problem.normal_equations(weights)), weights)


def _total(problem: Problem) -> Array:
    """Return the total least squares solution: the smallest generalised eigenvector of data against noise.

    With K = sum_p x_p T_p + [0, 1, 0] both sum r^T W r and its expectation under noise alone are quadratic in (x, 1);
    the ratio of the two is least at the answer. Bias columns are exact and are projected out first.
    """
    linear = problem.reweighted(2)
    K = problem.residual_map(linear)
    unit = np.zeros((1, *problem.T.shape[1:]))
    unit[0, :, 12:18] = np.eye(6)
    T = np.concatenate([problem.T[:10], unit, problem.T[10:]])
    data, noise = np.zeros((len(T), len(T))), np.zeros((11, 11))
    for S, Sa, Sw in zip(problem.scatter, problem.acceleration, problem.wrench, strict=True):
        W = weight(K, Sa, Sw)
        data += np.einsum("pij,qij->pq", W @ T @ S, T)
        noise[:10, :10] += S[18, 18] * np.einsum("pij,qij->pq", (W @ T[:10, :, :6]) * Sa, T[:10, :, :6])
        noise[10, 10] += S[18, 18] * float(np.diag(W) @ Sw)
    corner = np.linalg.pinv(data[11:, 11:], hermitian=True)
    reduced = data[:11, :11] - data[:11, 11:] @ corner @ data[11:, :11]
    # Columns that the log does not excite at all stay at zero.
    seen = np.diag(reduced) > UNSEEN * np.diag(data)[:11]
    scale = np.where(seen, 1 / np.sqrt(np.where(seen, np.diag(reduced), 1.0)), 0.0)
    # Noise against data, so that the matrix to factor is positive definite even where columns carry no noise; a log
    # without any noise leaves the answer's own direction at zero, or below by rounding.
    scaled = reduced * np.outer(scale, scale)
    ridge = max(1e-13, -2 * float(np.linalg.eigvalsh(scaled)[0]))
    regular = scaled + np.where(seen, ridge, 1.0) * np.eye(11)
    _, vectors = eigh(noise * np.outer(scale, scale), regular, check_finite=False)
    x = scale * vectors[:, -1]
    x = x / x[10]
    return np.concatenate([x[:10], -corner @ data[11:, :11] @ x])
