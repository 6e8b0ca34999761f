"""Checks of arrays at the public boundary: each returns a read-only float64 array or raises BadValue."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from steelyard.errors import BadValue, CannotAnswer

Array = NDArray[np.float64]
Integers = NDArray[np.int64]
Mask = NDArray[np.bool_]
# What NumPy and Python raise where numbers degenerate: a fit that has diverged, or data of no body.
BREAKDOWNS = (np.linalg.LinAlgError, ZeroDivisionError)
# What a fit raises that comes to nothing.
FAILURES = (BadValue, CannotAnswer, *BREAKDOWNS)
_IDENTITY = np.eye(3)
_LARGEST_WHOLE = 2.0**53  # beyond it float64 holds no longer every integer
# [s] Rows of a force-torque log are not closer or further apart than this; else the unit of time is another one.
_CLOSEST, _FURTHEST = 1e-7, 3600.0
_ORTHONORMAL = 1e-6  # how far R^T R of a rotation may be from the identity, entry by entry


def frozen(values: Any) -> Array:
    """Return a read-only, contiguous float64 array of the same shape; uncopied if it was one already."""
    array = np.asarray(values, dtype=np.float64, order="C")
    if array.flags.writeable:
        if array is values or array.base is not None:
            array = array.copy()
        array.flags.writeable = False
    return array


def sealed(values: Array) -> Array:
    """Return a read-only view, contiguous: a kernel that is handed one kind of array alone is compiled once."""
    view = np.ascontiguousarray(values, dtype=np.float64).view()
    view.flags.writeable = False
    return view


def finite(name: str, values: ArrayLike) -> Array:
    """Return `values` frozen, or say how many entries are NaN or infinite and where the first one is."""
    if is_complex(values):
        raise BadValue(f"{name} must be real numbers; these are complex.")
    try:
        array = frozen(values)
    except (TypeError, ValueError) as error:
        raise BadValue(f"{name} must be numbers; got {type(values).__name__} ({error}).") from None
    good = np.isfinite(array)
    if not good.all():
        bad = np.argwhere(~good)
        where = tuple(int(i) for i in bad[0])
        many = "1 entry is" if len(bad) == 1 else f"{len(bad)} entries are"
        raise BadValue(f"{name} must be finite; {many} not, the first at index {where}.")
    return array


def is_complex(values: Any) -> bool:
    """Return whether an array is of complex numbers, of which NumPy drops the imaginary part with a mere warning."""
    return isinstance(values, np.ndarray) and values.dtype.kind == "c"


def whole(name: str, values: ArrayLike) -> Integers:
    """Return `values` as read-only int64 of the same shape, or say which would lose its fraction."""
    array = np.asarray(values)
    if array.dtype.kind not in "iub":
        numbers = finite(name, values)
        bad = (numbers != np.rint(numbers)) | (np.abs(numbers) > _LARGEST_WHOLE)
        if bad.any():
            raise BadValue(f"{name} must be whole numbers; got {numbers[bad].flat[0]:g}.")
    out = np.array(array, dtype=np.int64)
    out.flags.writeable = False
    return out


def vectors(name: str, values: ArrayLike, size: int = 3) -> Array:
    """Return `values` as finite vectors of shape (..., size)."""
    array = finite(name, values)
    if array.ndim < 1 or array.shape[-1] != size:
        raise BadValue(f"{name} must have shape (..., {size}); got {array.shape}.")
    return array


def rows(name: str, values: ArrayLike, size: int = 3, of: tuple[str, Array] | None = None) -> Array:
    """Return `values` as finite rows (T, size), as many as those `of` another name has, where that is given."""
    array = finite(name, values)
    if array.ndim != 2 or array.shape[1] != size:
        raise BadValue(f"{name} must have shape (T, {size}), one row per sample; got {array.shape}.")
    if of is not None and len(array) != len(of[1]):
        raise BadValue(f"{name} has {len(array)} rows, {of[0]} has {len(of[1])}; they must agree.")
    return array


def matrices(name: str, values: ArrayLike, rows: int = 3, columns: int = 3) -> Array:
    """Return `values` as finite matrices of shape (..., rows, columns)."""
    array = finite(name, values)
    if array.ndim < 2 or array.shape[-2:] != (rows, columns):
        raise BadValue(f"{name} must have shape (..., {rows}, {columns}); got {array.shape}.")
    return array


def likely_step(step: float, where: str) -> None:
    """Raise BadValue where rows `step` [s] apart show that the unit of time is another one."""
    if not _CLOSEST <= step <= _FURTHEST:
        raise BadValue(
            f"{where}: rows are {step:.2g} s apart, which no force-torque log is. Correct the unit of time "
            "(s, ms, us, ns; arrays are in s: of nanoseconds give (ns - first) * 1e-9, one `first` for all), the "
            "column or the rate."
        )


def positive(name: str, value: float) -> float:
    """Return `value` as a float above zero."""
    given = number(name, value)
    if not 0 < given < float("inf"):
        raise BadValue(f"{name} must be a finite number above zero; got {given:g}.")
    return given


def not_negative(name: str, value: float) -> float:
    """Return `value` as a float that is zero or above."""
    given = number(name, value)
    if not 0 <= given < float("inf"):
        raise BadValue(f"{name} must be a finite number, zero or above; got {given:g}.")
    return given


def number(name: str, value: float) -> float:
    """Return `value` as a float."""
    try:
        return float(value)
    except (TypeError, ValueError):
        raise BadValue(f"{name} must be a number; got {value!r}.") from None


def rotations(name: str, values: ArrayLike) -> Array:
    """Return `values` as rotation matrices (..., 3, 3), or name the worst one and how far off it is."""
    array = matrices(name, values)
    # Entries as nine long rows: products of many small matrices cost ten times as much.
    a, b, c, d, e, f, g, h, i = np.ascontiguousarray(array.reshape(-1, 9).T)
    gram = a * a + d * d + g * g, b * b + e * e + h * h, c * c + f * f + i * i
    mixed = a * b + d * e + g * h, a * c + d * f + g * i, b * c + e * f + h * i
    far = max(max(np.abs(x - 1).max(initial=0) for x in gram), max(np.abs(x).max(initial=0) for x in mixed))
    if far > _ORTHONORMAL:
        error = np.abs(np.swapaxes(array, -1, -2) @ array - _IDENTITY)
        worst = tuple(int(i) for i in np.unravel_index(int(error.argmax()), error.shape)[:-2])
        raise BadValue(
            f"{name} must be orthonormal; {f'entry {worst}' if worst else 'it'} is off by {error.max():.2g} "
            f"in R^T R (tolerance {_ORTHONORMAL:g})."
        )
    if (a * (e * i - f * h) - b * (d * i - f * g) + c * (d * h - e * g)).min(initial=1) < 0:
        raise BadValue(f"{name} must be right-handed; at least one has determinant -1 (a mirror image).")
    return array
