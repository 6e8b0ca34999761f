"""Checks of arrays at the public boundary: each returns a read-only float64 array or raises BadValue."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from steelyard.errors import BadValue

Array = NDArray[np.float64]


def frozen(values: Any) -> Array:
    """Return a read-only, contiguous float64 array; a read-only float64 array passes through uncopied."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if array.flags.writeable:
        if array is values or array.base is not None:
            array = array.copy()
        array.flags.writeable = False
    return array


def finite(name: str, values: ArrayLike) -> Array:
    """Return `values` frozen, or say how many entries are NaN or infinite and where the first one is."""
    try:
        array = frozen(values)
    except (TypeError, ValueError) as error:
        raise BadValue(f"{name} must be numbers; got {type(values).__name__} ({error}).") from None
    bad = ~np.isfinite(array)
    if bad.any():
        where = tuple(int(i) for i in np.argwhere(bad)[0])
        raise BadValue(f"{name} must be finite; {int(bad.sum())} entries are not, the first at index {where}.")
    return array


def vectors(name: str, values: ArrayLike, size: int = 3) -> Array:
    """Return `values` as finite vectors of shape (..., size)."""
    array = finite(name, values)
    if array.ndim < 1 or array.shape[-1] != size:
        raise BadValue(f"{name} must have shape (..., {size}); got {array.shape}.")
    return array


def matrices(name: str, values: ArrayLike, rows: int = 3, columns: int = 3) -> Array:
    """Return `values` as finite matrices of shape (..., rows, columns)."""
    array = finite(name, values)
    if array.ndim < 2 or array.shape[-2:] != (rows, columns):
        raise BadValue(f"{name} must have shape (..., {rows}, {columns}); got {array.shape}.")
    return array


def positive(name: str, value: float) -> float:
    """Return `value` as a float above zero."""
    number = float(value)
    if not (np.isfinite(number) and number > 0):
        raise BadValue(f"{name} must be a finite number above zero; got {number}.")
    return number


def rotations(name: str, values: ArrayLike, tolerance: float = 1e-6) -> Array:
    """Return `values` as rotation matrices (..., 3, 3), or name the worst one and how far off it is."""
    array = matrices(name, values)
    error = np.abs(np.einsum("...ji,...jk->...ik", array, array) - np.eye(3)).max(axis=(-1, -2))
    if error.size and float(error.max()) > tolerance:
        worst = np.unravel_index(int(np.argmax(error)), error.shape) if error.ndim else ()
        raise BadValue(
            f"{name} must be orthonormal; entry {tuple(int(i) for i in worst)} is off by {float(error.max()):.2g} "
            f"in R^T R (tolerance {tolerance:g})."
        )
    if array.size and float(np.linalg.det(array).min()) < 0:
        raise BadValue(f"{name} must be right-handed; at least one has determinant -1 (a mirror image).")
    return array
