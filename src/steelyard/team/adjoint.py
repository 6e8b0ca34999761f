"""Small motions of poses: the adjoint, and rotation vector and position as one six-vector, angular first."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.spatial import Pose, Rotation, cross_matrix


def adjoint(X_AB: Pose) -> Array:
    """Return Ad (..., 6, 6): it turns twists of a body seen in B into A (Lynch and Park)."""
    R = X_AB.rotation.matrix
    out = np.zeros((*R.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = R
    out[..., 3:, :3] = cross_matrix(X_AB.position) @ R
    return out


def adjoint_inverse(X_AB: Pose) -> Array:
    """Return Ad of the inverse pose (..., 6, 6)."""
    R = np.swapaxes(X_AB.rotation.matrix, -1, -2)
    out = np.zeros((*R.shape[:-2], 6, 6))
    out[..., :3, :3] = out[..., 3:, 3:] = R
    out[..., 3:, :3] = -R @ cross_matrix(X_AB.position)
    return out


def _brackets() -> Array:
    """Return C (6, 6, 6), so that ad_V = sum_a V_a C_a: [ad_V U] is the Lie bracket of twists, angular part first."""
    out = np.zeros((6, 6, 6))
    for a in range(3):
        out[a, :3, :3] = out[a, 3:, 3:] = out[3 + a, 3:, :3] = cross_matrix(np.eye(3)[a])
    return out


BRACKETS = _brackets()


def exp(step: Array) -> Pose:
    """Return the pose of a small step (..., 6): rotation vector [rad] and position [m].

    It agrees with the exponential of SE(3) to first order, which is all that a settled Gauss-Newton needs.
    """
    return Pose(Rotation.exp(step[..., :3]), step[..., 3:])


def log(poses: Pose) -> Array:
    """Return rotation vector and position (..., 6), the inverse of `exp`."""
    return np.concatenate([poses.rotation.log(), poses.position], axis=-1)
