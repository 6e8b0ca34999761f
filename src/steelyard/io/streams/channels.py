"""Columns of numbers become the channels of a stream: checked, in SI, read-only."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.io.rotations import rotation_of
from steelyard.io.streams.entries import QuantitySpec
from steelyard.io.units import ANGLE, factor

_SHOWN = 5
_LARGEST = 1e9  # in SI: nothing that a robot feels or does is as large


def channel(spec: QuantitySpec, columns: Sequence[Array], gravity: Array) -> Array:
    """Return a quantity as (N, 3) in SI, or (N, 3, 3) for rotation, from its columns, each (N,).

    `gravity` (3,) [m/s^2] says what one g is. Raises BadValue naming the rows that are wrong.
    """
    _require_one_length(spec, columns)
    values = np.stack(columns, -1)
    require_finite(values, spec.where)
    if spec.form is None:
        values = values * factor(spec.name, spec.unit, gravity)
        _require_likely(values, spec.where)
        return check.frozen(values)
    try:
        return rotation_of(values, spec.form, ANGLE[spec.unit]).matrix
    except BadValue as error:
        raise BadValue(f"{spec.where}: {error}") from None


def channel_with_gaps(spec: QuantitySpec, columns: Sequence[Array], gravity: Array) -> Array:
    """Return a quantity like `channel`, with NaN in rows that miss a number; raises BadValue where all do."""
    _require_one_length(spec, columns)
    values = np.stack(columns, -1)
    good = known_rows(values)
    if good.all() or not good.any():
        return channel(spec, columns, gravity)
    out = np.array(channel(spec, list(np.where(good[:, None], values, values[good.argmax()]).T), gravity))
    out[~good] = np.nan
    return check.frozen(out)


def known_rows(values: Array) -> np.ndarray[Any, np.dtype[np.bool_]]:
    """Return which rows of (N, ..) hold numbers; a sum that is one shows at once that all do."""
    with np.errstate(over="ignore", invalid="ignore"):
        if np.isfinite(values.sum()):
            return np.ones(len(values), np.bool_)
    return np.asarray(np.isfinite(values.reshape(len(values), -1)).all(1))


def require_finite(values: Array, where: str) -> None:
    """Raise BadValue saying how many rows of (N, k) or (N,) hold NaN or infinity, and which."""
    good = np.isfinite(values)
    rows = np.flatnonzero(~(good if good.ndim == 1 else good.all(-1)))
    if len(rows):
        raise BadValue(unfit_text(rows, len(values), where))


def unfit_text(rows: np.ndarray[Any, np.dtype[np.int64]], count: int, where: str) -> str:
    """Return the error for `rows`, of `count`, that hold no number."""
    if len(rows) == count:
        return (
            f"{where}: all {count} rows are NaN, infinite or empty: there are no data. Check the driver and the "
            "columns, or record again."
        )
    return (
        f"{where}: {len(rows)} of {count} rows are NaN, infinite or empty: {rows_text(rows)}. "
        "Record again, or delete those rows if they are missing by chance."
    )


def _require_likely(values: Array, where: str) -> None:
    """Raise BadValue naming the rows of (N, 3) that hold numbers beyond any sensor."""
    rows = np.flatnonzero((np.abs(values) > _LARGEST).any(-1))
    if len(rows):
        raise BadValue(
            f"{where}: {len(rows)} of {len(values)} rows hold impossible numbers, up to {np.abs(values).max():.2g}: "
            f"{rows_text(rows)}. Delete those rows, or correct the columns and units."
        )


def rows_text(rows: np.ndarray[Any, np.dtype[np.int64]]) -> str:
    """Return 'row 3' or 'rows 3, 7, 9, ..', counted from 1 without the header."""
    shown = ", ".join(str(row + 1) for row in rows[:_SHOWN])
    return f"row{'s' if len(rows) > 1 else ''} {shown}{', ..' if len(rows) > _SHOWN else ''}"


def _require_one_length(spec: QuantitySpec, columns: Sequence[Array]) -> None:
    lengths = {len(column) for column in columns}
    if len(lengths) > 1:
        raise BadValue(
            f"{spec.where}: its columns have different lengths: {', '.join(map(str, sorted(lengths)))} rows."
        )


def require_one_length(lengths: Mapping[str, int], where: str) -> None:
    """Raise BadValue where the quantities of one stream have different numbers of rows."""
    if len(set(lengths.values())) > 1:
        shown = ", ".join(f"{name} {length}" for name, length in lengths.items())
        raise BadValue(
            f"{where}: the lengths differ: {shown} rows. Each quantity of a stream must have one row per sample."
        )
