"""Rows of a stream that miss a number: left out and told, or, where they are many, refused.

A sensor that skips a sample now and then costs nothing. Where more than a tenth of the rows are missing, the sensor or
its driver failed, and mostly not at random (at high loads, in one pose): what is left is then no fair sample.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard.check import Mask
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.io.streams.channels import known_rows, rows_text, unfit_text
from steelyard.io.streams.entries import StreamSpec
from steelyard.logs.recording import Stream

MOST_MISSING = 0.1


def without_missing(
    specs: Sequence[StreamSpec], streams: Sequence[Stream]
) -> tuple[tuple[Stream, ...], tuple[Finding, ...]]:
    """Return the streams without rows that hold NaN, and a finding for each that had some.

    Each stream with a clock loses its own rows; those without one belong together row by row and lose them together.
    Raises BadValue where more than a tenth of the rows would be lost.
    """
    whole = [_whole(stream) for stream in streams]
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


def _whole(stream: Stream) -> Mask:
    """Return which rows (N,) hold a number everywhere."""
    columns = [*stream.channels.values(), *(() if stream.time is None else (stream.time,))]
    return np.asarray(np.logical_and.reduce([known_rows(column) for column in columns]))


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
    with_others = ", with the same rows of the other streams" if others and stream.time is None else ""
    message = (
        f"{len(missing)} of {len(rows)} rows of '{stream.name}' miss a number in {', '.join(named)}: "
        f"{rows_text(missing)}{_cut(missing, len(rows))}. {'They were' if len(missing) > 1 else 'It was'} left out"
        f"{with_others}."
    )
    return Finding.of("rows-missing", message)


def _cut(missing: np.ndarray[Any, np.dtype[np.int64]], count: int) -> str:
    return " (the last)" if missing[-1] == count - 1 else ""
