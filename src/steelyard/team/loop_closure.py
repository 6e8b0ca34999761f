"""Loop closure: all grasps refined together from the twists of every pair of robots.

The unknowns are the N - 1 poses in the reference grasp, so that every closed loop T_ij T_jk T_ki = 1 holds exactly,
whatever weight it would have been given; the cost is the weighted sum of squares of all N (N - 1) / 2 pairs. It depends
on the twists through their second moments only.
Source: "Cooperative Payload Estimation by a Team of Mocobots", III-B2, which minimises pairs and loops by BFGS and
gives no weights; here every residual is weighed by the inverse variance that the star of pairs leaves, and each pair
counts as seen from both of its grasps, so that the answer does not depend on the order of the robots.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import permutations

import numpy as np

from steelyard.check import Array, Mask
from steelyard.spatial import Pose, Rotation
from steelyard.spatial.screws import exp_pose
from steelyard.team.adjoint import BRACKETS, adjoint
from steelyard.team.grasp_kinematics import Pair

_POLISH = 60  # secant steps at most; three robots take some ten until rounding stops them
_SERIES = 8  # terms of the right Jacobian: corrections are a few degrees at most


@dataclass(frozen=True, eq=False)
class _Moments:
    """Second moments (P, 6, 6) of the twists of each ordered pair (i, j), over the rows that both measured."""

    first: np.ndarray[tuple[int], np.dtype[np.int64]]
    second: np.ndarray[tuple[int], np.dtype[np.int64]]
    ii: Array
    ij: Array
    jj: Array

    @classmethod
    def of(cls, twists: Array, measured: Mask) -> _Moments:
        pairs = np.array(list(permutations(range(len(twists)), 2)), np.int64)
        seen = [measured[i] & measured[j] for i, j in pairs]
        rows = [(twists[i, m], twists[j, m]) for (i, j), m in zip(pairs, seen, strict=True)]
        return cls(
            pairs[:, 0],
            pairs[:, 1],
            np.array([a.T @ a for a, _ in rows]),
            np.array([a.T @ b for a, b in rows]),
            np.array([b.T @ b for _, b in rows]),
        )


def refine(names: Sequence[str], grasps: Pose, pairs: Mapping[str, Pair], twists: Array, measured: Mask) -> Pose:
    """Return the grasps (N,) that fit the twists of all pairs of robots best, starting from those of the star.

    pairs     of the reference with every other robot, for the weights and the scale of the unknowns
    twists    (N, T, 6) at the grasps in the order of `names`; measured (N, T) which rows are true
    """
    from scipy.optimize import minimize

    moments = _Moments.of(twists, measured)
    left = np.mean([p.residual**2 for p in pairs.values()], axis=0)
    spread = np.repeat([left[:3].mean(), left[3:].mean()], 3)
    if not (spread > 0).all():
        return grasps  # nothing is left to refine
    free = [i for i, name in enumerate(names) if name in pairs]
    # The star's own covariance scales the unknowns, its error in the reference's axes carried to the grasp's.
    found = [pairs[names[i]] for i in free]
    back = [np.kron(np.eye(2), each.pose.rotation.inverse().matrix) for each in found]
    scale = np.array([turn @ each.covariance @ turn.T for turn, each in zip(back, found, strict=True)])
    factor = np.linalg.cholesky(scale)

    def cost(s: Array) -> tuple[float, Array]:
        xi = np.einsum("nab,nb->na", factor, s.reshape(-1, 6))
        value, slope = _pair_cost(_moved(grasps, free, xi), moments, 1 / spread)
        inner = np.einsum("nba,nb->na", _right_jacobian(xi), slope[free])
        return value, np.einsum("nab,na->nb", factor, inner).ravel()

    best = minimize(cost, np.zeros(6 * len(free)), jac=True, method="BFGS", options={"gtol": 1e-6})
    at = _polished(lambda s: cost(s)[1], best.x, best.hess_inv)
    xi = np.einsum("nab,nb->na", factor, at.reshape(-1, 6))
    return _moved(grasps, free, xi)


def _polished(slope: Callable[[Array], Array], s: Array, inverse: Array) -> Array:
    """Return where the slope vanishes, near `s`, by secant steps from the inverse of the Hessian that BFGS ends with.

    BFGS compares costs, whose rounding ends it where the order of the robots still decides the seventh digit. Slopes
    are good to more. Source: Broyden 1965, the good update of the inverse.
    """
    here = slope(s)
    for _ in range(_POLISH):
        step = -inverse @ here
        there = slope(s + step)
        if np.linalg.norm(there) >= np.linalg.norm(here):
            break
        turned = inverse @ (there - here)
        inverse = inverse + np.outer(step - turned, step @ inverse) / float(step @ turned)
        s, here = s + step, there
    return s


def _pair_cost(poses: Pose, moments: _Moments, weight: Array) -> tuple[float, Array]:
    """Return half the weighted sum of squares and its slope (N, 6) against body screws of the grasps.

    With A = Ad(T_ij) and r = V_i - A V_j, a screw of grasp j changes r by A ad(V_j), one of grasp i by -ad(A V_j).
    """
    i, j = moments.first, moments.second
    A = adjoint(poses[i].inverse() @ poses[j])
    At = np.swapaxes(A, -1, -2)
    crossed = np.swapaxes(moments.ij, -1, -2) - moments.jj @ At  # sum V_j r^T
    squares = moments.ii - moments.ij @ At - A @ crossed
    value = 0.5 * float((np.einsum("paa->pa", squares) * weight).sum())
    weighed = crossed * weight
    slope = np.zeros((len(poses.position), 6))
    np.add.at(slope, j, np.einsum("pab,abc->pc", weighed @ A, BRACKETS))
    np.add.at(slope, i, -np.einsum("pab,abc->pc", A @ weighed, BRACKETS))
    return value, slope


def _moved(poses: Pose, free: list[int], xi: Array) -> Pose:
    """Return the poses, those in `free` moved by body screws `xi` (len(free), 6)."""
    step = exp_pose(xi)
    turn, place = poses.rotation.matrix.copy(), poses.position.copy()
    moved = poses[free] @ step
    turn[free], place[free] = moved.rotation.matrix, moved.position
    return Pose(Rotation(turn), place)


def _right_jacobian(xi: Array) -> Array:
    """Return J (n, 6, 6): exp(xi + d) = exp(xi) exp(J d) to first order, by its series sum (-ad)^k / (k + 1)!."""
    ad = -np.einsum("na,abc->nbc", xi, BRACKETS)
    term = np.broadcast_to(np.eye(6), ad.shape)
    total = term.copy()
    for k in range(1, _SERIES):
        term = term @ ad / (k + 1)
        total += term
    return total
