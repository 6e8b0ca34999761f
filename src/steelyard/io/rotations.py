"""Rotations as files write them: matrices row by row, quaternions in both orders, roll pitch yaw, rotation vectors,
and angles about z, y, z."""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.spatial import Rotation

# Forms whose numbers have a unit, and what reads them in radians.
ANGULAR = {"rpy": Rotation.from_rpy, "rotation-vector": Rotation.exp, "zyz": Rotation.from_zyz}
FORMS: dict[str, int] = {"matrix": 9, "quaternion-wxyz": 4, "quaternion-xyzw": 4, **dict.fromkeys(ANGULAR, 3)}

ROUNDING = 5e-3  # how far R^T R may be from 1: a matrix written with three digits after the point
NORM = 0.05  # how far the length of a quaternion may be from 1
_ZERO = 1e-12
TURNS = 4 * np.pi  # [rad] two turns: more than a wrist makes, less than degrees of a log for identification are


def rotation_of(values: Array, form: str, angle: float = 1.0, unit_key: str = "unit") -> Rotation:
    """Return the rotations (...) that `values` (..., k) write in `form`; `angle` turns those of angles into rad.

    unit_key  what the description calls the unit of angles, for the remedy

    Written digits are rounded, so a matrix within `ROUNDING` of a rotation becomes the nearest one.
    Raises BadValue naming the worst row.
    """
    if form in ANGULAR:
        _check_angles(values * angle, form, unit_key)
        return ANGULAR[form](values * angle)
    if form == "matrix":
        return _of_matrix(values.reshape(*values.shape[:-1], 3, 3))
    _check_norm(values)
    return Rotation.from_quaternion_wxyz(np.roll(values, 1, -1) if form == "quaternion-xyzw" else values)


def _of_matrix(matrix: Array) -> Rotation:
    error = np.abs(_excess(matrix)).max((-1, -2))
    if error.size and float(error.max()) > ROUNDING:
        raise BadValue(
            f"the rotation is not orthonormal: {_worst(error, ROUNDING, ', the worst is row {}, where ')}R^T R is "
            f"off by {float(error.max()):.3g} (allowed {ROUNDING:g}). "
            f"Check the order and the number of digits of the nine {_cells(error)}."
        )
    mirrored = np.linalg.det(matrix) < 0
    if mirrored.any():
        raise BadValue(
            f"the rotation is a mirror image (determinant -1){_first(mirrored)}. "
            f"Check the order and the signs of the nine {_cells(mirrored)}."
        )
    for _ in range(3):  # Newton-Schulz: squares the error and keeps the polar factor, much faster than an SVD
        matrix = matrix - 0.5 * matrix @ _excess(matrix)
    return Rotation(matrix)


def matrix_order(sixteen: Array) -> Integers | None:
    """Return which of sixteen numbers (N, 16) is where in a 4 x 4 matrix (4, 4); None where they hold no poses.

    Its last row shows whether they go row by row or column by column.
    """
    grid = np.arange(16).reshape(4, 4)
    for order in (grid, grid.T):
        last, turn = sixteen[:, order[3]], sixteen[:, order[:3, :3]]
        moves = np.abs(sixteen[:, order[:3, 3]]).max(initial=0.0) > 0
        if moves and np.abs(last - [0, 0, 0, 1]).max() < ROUNDING and np.abs(_excess(turn)).max() < ROUNDING:
            return order
    return None


def _excess(matrix: Array) -> Array:
    """Return R^T R - 1 (..., 3, 3)."""
    return np.asarray(np.swapaxes(matrix, -1, -2) @ matrix - np.eye(3))


def _check_norm(quaternion: Array) -> None:
    norm = np.linalg.norm(quaternion, axis=-1)
    zero = norm < _ZERO
    if zero.any():
        remedy = "Delete the rows where the pose was not known." if zero.ndim else "No rotation has four zeros."
        raise BadValue(f"the quaternion has norm zero{_first(zero)}. {remedy}")
    error = np.abs(norm - 1)
    if error.size and float(error.max()) > NORM:
        length = float(norm.flat[int(error.argmax())])
        raise BadValue(
            f"the quaternion must have norm 1: {_worst(error, NORM, ' are off, the worst is row {} with ')}norm "
            f"{length:.4g}. "
            f"Check the four {_cells(norm)}."
        )


def _check_angles(angles: Array, form: str, unit_key: str) -> None:
    """Raise BadValue where a wrist would have turned round more often than any does: degrees read as radians."""
    most = float(np.nanmax(np.abs(angles), initial=0.0))
    if most > TURNS:
        what = {"rpy": "roll, pitch or yaw", "zyz": "an angle about z or y"}.get(form, "the rotation vector")
        raise BadValue(
            f"{what} reaches {most:.4g} rad, which is {most / (2 * np.pi):.1f} turns: it looks like "
            f'degrees. Set {unit_key} = "deg".'
        )


def _worst(error: Array, allowed: float, words: str) -> str:
    """Say how many rows are off, and in `words` which is the worst; "" where there is one rotation."""
    return f"{_count(error > allowed)}{words.format(int(error.argmax()) + 1)}" if error.ndim else ""


def _first(bad: np.ndarray[Any, np.dtype[np.bool_]]) -> str:
    """Say how many rows are bad and which is the first; "" where there is one rotation."""
    return f": {_count(bad)}, first row {int(bad.argmax()) + 1}" if bad.ndim else ""


def _cells(of: np.ndarray[Any, Any]) -> str:
    """Say what a rotation is written in: columns of a file, or the numbers of a description."""
    return "columns" if of.ndim else "numbers"


def _count(bad: np.ndarray[Any, np.dtype[np.bool_]]) -> str:
    return f"{int(bad.sum())} of {bad.size} rows"
