"""A log description, or a bare data file with usual names, becomes a Recording."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io import guess
from steelyard.io.channels import channel, require_one_length
from steelyard.io.clocks import Clock, common_origin, require_likely_step, steady
from steelyard.io.description import Description, read_description
from steelyard.io.requirements import require_answerable, require_matched_rows
from steelyard.io.rotations import FORMS
from steelyard.io.stream_entries import QuantitySpec, StreamSpec
from steelyard.io.tables import Table, choose_columns, find_file, open_table
from steelyard.io.units import TIME
from steelyard.logs.recording import QUANTITIES, Recording, Stream

Cells = dict[int, np.ndarray[Any, np.dtype[Any]]]


def read_recording(path: Path | str, data: Path | str | None = None) -> Recording:
    """Read a log.

    path  a description (.toml), or a bare data file (.csv .tsv .txt, .gz of these, .npz, .parquet)
    data  folder in which relative paths are sought first; then $STEELYARD_DATA, then beside the description

    Returns the streams in SI, each on its own clock; all clocks count from one common origin.
    Raises BadFile, BadDescription or BadValue: what was expected, what was found, where, and what to do.
    """
    try:
        return _read(Path(path), None if data is None else Path(data))
    except OSError as error:
        raise BadFile(f"{error.filename or path}: cannot be read ({error.strerror or error}).") from None


def _read(path: Path, data: Path | None) -> Recording:
    if not path.exists():
        path = find_file(str(path), Path.cwd(), data)
    if path.suffix.lower() != ".toml":
        table = open_table(path)
        description, cells = guess.describe(table)
        return _recording(description, [table], [cells], path)
    description = read_description(path)
    tables = _open_all(description.streams, path.parent, data)
    return _recording(description, tables, _read_all(description.streams, tables), path, data)


def _open_all(specs: Sequence[StreamSpec], folder: Path, data: Path | None) -> list[Table]:
    """Return the table of every stream; a file named twice is opened once."""
    opened: dict[str, Table] = {}
    for spec in specs:
        if spec.topic is not None:
            raise BadFile(
                f'{spec.where}: "topic" belongs to bags, which are not supported yet. Export the topic to CSV.'
            )
        if spec.path not in opened:
            opened[spec.path] = open_table(find_file(spec.path, folder, data))
    return [opened[spec.path] for spec in specs]


def _read_all(specs: Sequence[StreamSpec], tables: Sequence[Table]) -> list[Cells]:
    """Return the cells of every stream; each file is read once, whatever number of streams share it."""
    wanted: dict[Path, set[int]] = {}
    exact: dict[Path, set[int]] = {}
    for spec, table in zip(specs, tables, strict=True):
        stamps = _time_column(spec, table)
        chosen = [n for quantity in spec.quantities for n in _numbers(quantity, table)]
        wanted.setdefault(table.path, set()).update(chosen, stamps)
        exact.setdefault(table.path, set()).update(stamps)
    cells: dict[Path, Cells] = {}
    for table in tables:
        if table.path not in cells:
            cells[table.path] = table.read(sorted(wanted[table.path]), sorted(exact[table.path]))
    return [cells[table.path] for table in tables]


def _numbers(spec: QuantitySpec, table: Table) -> tuple[int, ...]:
    count = FORMS[spec.form] if spec.form else QUANTITIES[spec.name]
    return choose_columns(table.header, spec.columns, count, spec.where)


def _time_column(spec: StreamSpec, table: Table) -> tuple[int, ...]:
    if spec.time is None or spec.time.column is None:
        return ()
    return choose_columns(table.header, (spec.time.column,), 1, spec.time.where)


def _recording(
    description: Description,
    tables: Sequence[Table],
    cells: Sequence[Cells],
    path: Path,
    data: Path | None = None,
) -> Recording:
    specs = description.streams
    require_answerable(specs, path.name)
    channels = [_channels(*each, description.gravity) for each in zip(specs, tables, cells, strict=True)]
    times = _times(specs, tables, cells, [len(next(iter(c.values()))) for c in channels])
    names = _names(specs)
    streams = tuple(
        Stream(
            name,
            values,
            time,
            {q.name: "W" for q in spec.quantities if q.frame == "W"},
            spec.delay,
            spec.mount,
            spec.poses,
        )
        for name, spec, values, time in zip(names, specs, channels, times, strict=True)
    )
    require_matched_rows(streams, path.name)
    tool = None if description.tool is None else str(find_file(description.tool, path.parent, data))
    placed = description.placed
    return Recording(
        streams,
        gravity=check.frozen(description.gravity),
        wrench_sign=description.wrench_sign,
        noise=description.noise,
        tool=tool,
        object_pose=None if placed is None else placed.pose,
        object_pose_std=None if placed is None else placed.std,
        name=path.stem,
    )


def _channels(spec: StreamSpec, table: Table, cells: Cells, gravity: Array) -> dict[str, Array]:
    out: dict[str, Array] = {}
    for quantity in spec.quantities:
        columns = [cells[n].astype(np.float64, copy=False) for n in _numbers(quantity, table)]
        out[quantity.name] = channel(quantity, columns, gravity)
        if quantity.name in ("force", "torque") and len(out[quantity.name]) > 1 and not out[quantity.name].any():
            passive = ' or say torque = "zero" if the wrist passes no moment' if quantity.name == "torque" else ""
            raise BadValue(
                f"{spec.where}: {quantity.name} is zero in every row. Give the columns that hold it{passive}."
            )
    if spec.zero_torque:
        if "force" not in out:
            raise BadDescription(f'{spec.where}: torque = "zero" belongs in the stream that holds "force".')
        out["torque"] = check.frozen(np.zeros_like(out["force"]))
    lengths = {name: len(values) for name, values in out.items()}
    stamps = [len(cells[n]) for n in _time_column(spec, table)]
    require_one_length(lengths | ({"time": stamps[0]} if stamps else {}), spec.where)
    if not next(iter(lengths.values())):
        raise BadValue(f"{spec.where}: the log is empty: it has no rows. Record again, or correct the path.")
    return out


def _times(
    specs: Sequence[StreamSpec], tables: Sequence[Table], cells: Sequence[Cells], rows: Sequence[int]
) -> list[Array | None]:
    """Return seconds after one common origin; a stream with only a rate starts with the earliest clock."""
    clocks: dict[int, Clock] = {}
    for i, (spec, table, mine) in enumerate(zip(specs, tables, cells, strict=True)):
        for number in _time_column(spec, table):
            if spec.time is not None:
                clocks[i] = Clock(mine[number], TIME[spec.time.unit], spec.time.where)
    origin = common_origin(list(clocks.values()))
    seconds: list[Array | None] = [clocks[i].seconds_after(origin) if i in clocks else None for i in range(len(specs))]
    start = min((float(s[0]) for s in seconds if s is not None), default=0.0)
    for i, spec in enumerate(specs):
        if spec.time is not None and spec.time.column is None:
            require_likely_step(1 / spec.time.rate, spec.time.where)
            seconds[i] = steady(spec.time.rate, rows[i], start)
    return seconds


def _names(specs: Sequence[StreamSpec]) -> list[str]:
    """Return one name per stream: its path, with #2, #3 .. behind it where a file serves several streams."""
    names: list[str] = []
    for i, spec in enumerate(specs):
        before = sum(other.path == spec.path for other in specs[:i])
        names.append(f"{spec.path}#{before + 1}" if before else spec.path)
    return names
