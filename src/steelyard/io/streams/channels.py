"""Columns of numbers become the channels of a stream: checked, in SI, read-only; rows that miss a number go.

A sensor that skips a sample now and then costs nothing: such rows are left out and told. Where more than a tenth of
them are missing, the sensor or its driver failed, and mostly not at random (at high loads, in one pose): what is left
is then no fair sample, and is refused.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.io.rotations import rotation_of
from steelyard.io.streams.entries import QuantitySpec, StreamSpec
from steelyard.io.units import ANGLE, factor
from steelyard.logs.recording import Stream, known_rows

_SHOWN = 5
_LARGEST = 1e9  # in SI: nothing that a robot feels or does is as large

MOST_MISSING = 0.1


def channel_with_gaps(spec: QuantitySpec, columns: Sequence[Array], gravity: Array) -> Array:
    """Return a quantity as (N, 3) in SI, or (N, 3, 3) for rotation, from its columns, each (N,).

    `gravity` (3,) [m/s^2] says what one g is. Rows that miss a number are NaN. Raises BadValue where all do, and naming
    the rows that are wrong.
    """
    _require_one_length(spec, columns)
    values = np.stack(columns, -1)
    good = known_rows(values)
    if good.all():
        return _in_si(spec, values, gravity)
    if not good.any():
        require_finite(values, spec.where)
    out = np.array(_in_si(spec, np.where(good[:, None], values, values[good.argmax()]), gravity))
    out[~good] = np.nan
    return check.frozen(out)


def _in_si(spec: QuantitySpec, values: Array, gravity: Array) -> Array:
    """Return the numbers (N, k) of a quantity in SI, rotations as matrices; raises BadValue naming the wrong rows."""
    if spec.form is None:
        values = values * factor(spec.name, spec.unit, gravity)
        _require_likely(values, spec.where)
        return check.frozen(values)
    try:
        return rotation_of(values, spec.form, ANGLE[spec.unit]).matrix
    except BadValue as error:
        raise BadValue(f"{spec.where}: {error}") from None


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


def without_missing(
    specs: Sequence[StreamSpec], streams: Sequence[Stream]
) -> tuple[tuple[Stream, ...], tuple[Finding, ...]]:
    """Return the streams without rows that hold NaN, and a finding for each that had some.

    Each stream with a clock loses its own rows; those without one belong together row by row and lose them together.
    Raises BadValue where more than a tenth of the rows would be lost.
    """
    whole = [stream.known for stream in streams]
    if all(rows.all() for rows in whole):
        return tuple(streams), ()
    findings = [
        _told(stream, rows, len(streams) > 1) for stream, rows in zip(streams, whole, strict=True) if not rows.all()
    ]
    for spec, stream, rows in zip(specs, streams, whole, strict=True):
        _require_most(spec, stream, rows)
    if all(stream.time is None for stream in streams):
        together = np.logical_and.reduce(whole)
        _refuse_many(together, ", ".join(f'"{stream.name}"' for stream in streams))
        whole = [together] * len(streams)
    kept = (s if rows.all() else s.rows(rows) for s, rows in zip(streams, whole, strict=True))
    return tuple(kept), tuple(findings)


def _require_most(spec: StreamSpec, stream: Stream, rows: Mask) -> None:
    """Raise BadValue at the first quantity that misses too many rows, then where all of them together do."""
    _refuse_joined(spec, stream)
    for quantity in spec.quantities:
        _refuse_many(known_rows(stream.channels[quantity.name]), quantity.where)
    if spec.time is not None and stream.time is not None:
        _refuse_many(known_rows(stream.time), spec.time.where)
    _refuse_many(rows, spec.where)


def _refuse_joined(spec: StreamSpec, stream: Stream) -> None:
    """Raise BadValue where quantities stand in rows of their own: topics that were joined by time in one table."""
    known = {q.name: known_rows(stream.channels[q.name]) for q in spec.quantities}
    first = next(iter(known), "")
    for name, rows in known.items():
        if stream.time is not None and stand_apart(rows, known[first]):
            raise BadValue(
                f"{spec.where}: {first} and {name} stand in different rows, as where topics are joined by time. "
                "Describe each topic as a [[stream]] of its own, with the same path."
            )


def stand_apart(one: Mask, other: Mask) -> bool:
    """Tell whether two quantities, known in rows (N,), are of topics joined by time: each is often there alone."""
    alone = min(np.count_nonzero(one & ~other), np.count_nonzero(other & ~one))
    return bool(alone > MOST_MISSING * len(one))


def _refuse_many(known: Mask, where: str) -> None:
    if np.count_nonzero(~known) > MOST_MISSING * len(known):
        raise BadValue(unfit_text(np.flatnonzero(~known), len(known), where))


def _told(stream: Stream, rows: Mask, others: bool) -> Finding:
    """Return the finding: how many rows, where, and in what."""
    missing = np.flatnonzero(~rows)
    named = [name for name, values in stream.channels.items() if not known_rows(values).all()]
    named += ["time"] if stream.time is not None and not known_rows(stream.time).all() else []
    last = "" if rows[-1] else " (the last)"
    with_others = ", with the same rows of the other streams" if others and stream.time is None else ""
    message = (
        f"{len(missing)} of {len(rows)} rows of '{stream.name}' miss a number in {', '.join(named)}: "
        f"{rows_text(missing)}{last}. {'They were' if len(missing) > 1 else 'It was'} left out"
        f"{with_others}."
    )
    return Finding.of("rows-missing", message)
