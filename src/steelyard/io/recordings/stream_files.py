"""The streams of a description opened and read: columns, channels in SI, seconds on one origin, names.

Of topics joined by time in one table (an outer join, as PlotJuggler and pandas write it) a row belongs to the streams
that it holds numbers of: where one has a sample, the cells of the others are empty.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io.entries import listed
from steelyard.io.rotations import ANGULAR
from steelyard.io.streams.channels import channel_with_gaps, require_one_length
from steelyard.io.streams.clocks import Clock, common_origin, one_column
from steelyard.io.streams.entries import QuantitySpec, StreamSpec
from steelyard.io.tables.files import TEXT, Columns, Table, choose_columns, find_file
from steelyard.io.units import ANGLE, TIME, UNITS, spelled
from steelyard.logs.recording import Stream

# Units that may stand over a column, by what it holds; of rotations by their form.
_KNOWN = {what: tuple(units) for what, units in {**UNITS, **dict.fromkeys(ANGULAR, ANGLE)}.items()} | {
    "time": tuple(TIME)
}
_KINDS = ".csv, .tsv, .txt (also .gz), .npz, .parquet, and bags: .mcap, .db3, .bag"


def open_table(path: Path, topic: str | None = None, frames: tuple[str, str] | None = None) -> Table:
    """Look at the head of a data file and return its table; raises BadFile.

    topic   that of a bag
    frames  of a topic of transforms: the pose of the second in the first
    """
    from steelyard.io import bags
    from steelyard.io.tables import array_table, bag_table, parquet_table, text_table, transform_table

    suffix = (Path(path.stem) if path.suffix.lower() == ".gz" else path).suffix.lower()
    if bags.is_bag(path):
        if topic is not None and frames is not None:
            return transform_table.TransformTable.open(path, topic, frames)
        return bag_table.BagTable.open(path, topic)
    if path.is_dir() and (inside := bags.bag_in(path)):
        raise BadFile(f"{path}: the folder of a bag, without its metadata.yaml. Name the file in it: {inside.name}")
    if topic is not None:
        raise BadDescription(f'{path}: "topic" belongs to a bag ({", ".join(bags.SUFFIXES)}, or the folder of one).')
    if path.is_dir():
        raise BadFile(f"{path}: this is a folder, not a file of data. Name the file in it.")
    if suffix not in (*TEXT, ".npz", ".parquet"):
        raise BadFile(f'{path}: unknown kind of data file "{suffix or path.name}". Readable are {_KINDS}.')
    if path.stat().st_size == 0:
        raise BadFile(f"{path}: the file is empty (0 bytes). Record again, or correct the path.")
    if suffix == ".npz":
        return array_table.ArrayTable.open(path)
    if suffix == ".parquet":
        return parquet_table.ParquetTable.open(path)
    return text_table.TextTable.open(path)


def open_tables(specs: Sequence[StreamSpec], folder: Path, data: Path | None) -> list[Table]:
    """Return the table of every stream; a file, or topic of a bag, that is named twice is opened once."""
    opened: dict[tuple[object, ...], Table] = {}
    for spec in specs:
        if spec.source not in opened:
            path = find_file(spec.path, folder, data, spec.where)
            opened[spec.source] = open_table(path, spec.topic, spec.frames)
    return [opened[spec.source] for spec in specs]


def read_cells(specs: Sequence[StreamSpec], tables: Sequence[Table]) -> list[Columns]:
    """Return the cells of every stream's own columns; each file is read once, whatever number of streams share it."""
    own: list[set[int]] = []
    wanted: dict[int, set[int]] = {}
    exact: dict[int, set[int]] = {}
    for spec, table in zip(specs, tables, strict=True):
        stamps = time_columns(spec, table)
        own.append({*_chosen(spec, table, stamps), *stamps})
        _require_units_of_file(spec, table, stamps)
        wanted.setdefault(id(table), set()).update(own[-1])
        exact.setdefault(id(table), set()).update(stamps)
    cells: dict[int, Columns] = {}
    for table in tables:
        if id(table) not in cells:
            cells[id(table)] = table.read(sorted(wanted[id(table)]), sorted(exact[id(table)]))
    return [{n: cells[id(table)][n] for n in mine} for table, mine in zip(tables, own, strict=True)]


def _chosen(spec: StreamSpec, table: Table, stamps: Sequence[int]) -> list[int]:
    """Return the columns of all quantities; raises BadDescription where one is named for two things."""
    user = dict.fromkeys(stamps, "time")
    chosen = []
    for quantity in spec.quantities:
        for n in _numbers(quantity, table):
            if n in user:
                called = f'"{table.header.names[n]}"' if table.header.names else str(n)
                both = f"{user[n]} and {quantity.name}" if user[n] != quantity.name else f"two axes of {user[n]}"
                raise BadDescription(
                    f"{spec.where}: column {called} is given for {both}. Each needs columns of its own; "
                    f"columns in {table.path.name}: {listed(table.header.shown() or range(table.header.count))}."
                )
            user[n] = quantity.name
            chosen.append(n)
    return chosen


def _require_units_of_file(spec: StreamSpec, table: Table, stamps: Sequence[int]) -> None:
    """Raise BadDescription where a column's name, or a row of units, says another unit than the description."""
    time = spec.time
    told = [("time", time.where, n, unit) for n, unit in zip(stamps, time.units, strict=False)] if time else []
    for q in spec.quantities:
        told += [(q.form or q.name, q.where, n, q.unit) for n in _numbers(q, table)]
    for what, where, n, unit in told:
        said = spelled(what, table.header.unit(n))
        if said in _KNOWN.get(what, ()) and said != unit and n not in table.header.dates:
            raise BadDescription(
                f'{where}: over column {n} the file says {said}, and the description {unit}. Write unit = "{said}", or '
                "correct the file."
            )


def _numbers(spec: QuantitySpec, table: Table) -> tuple[int, ...]:
    return choose_columns(table.header, spec.columns, spec.count, spec.where)


def time_columns(spec: StreamSpec, table: Table) -> tuple[int, ...]:
    """Return the columns of the clock, none where the stream has no stamps."""
    if spec.time is None or not spec.time.columns:
        return ()
    return choose_columns(table.header, spec.time.columns, len(spec.time.units), spec.time.where)


def streams_of(
    specs: Sequence[StreamSpec], tables: Sequence[Table], cells: Sequence[Columns], gravity: Sequence[Array], gaps: bool
) -> list[Stream]:
    """Return the streams in SI units, their clocks from one origin; rows that miss a number are NaN.

    gravity  (3,) [m/s^2] of every stream: what one g is
    gaps     whether stamps may be missing, too
    """
    channels = [_channels(*each) for each in zip(specs, tables, cells, gravity, strict=True)]
    times = _seconds(specs, tables, cells, [len(next(iter(c.values()))) for c in channels], gaps)
    return [
        Stream(
            name,
            values,
            time,
            {q.name: "W" for q in spec.quantities if q.frame == "W"},
            spec.delay,
            spec.mount,
            spec.poses,
            "s" if spec.time is None else spec.time.unit,
        )
        for name, spec, values, time in zip(_names(specs), specs, channels, times, strict=True)
    ]


def _channels(spec: StreamSpec, table: Table, cells: Columns, gravity: Array) -> dict[str, Array]:
    """Return quantity -> channel in SI; rows that miss a number are NaN, unless all do."""
    out: dict[str, Array] = {}
    for quantity in spec.quantities:
        columns = [cells[n].astype(np.float64, copy=False) for n in _numbers(quantity, table)]
        values = channel_with_gaps(quantity, columns, gravity)
        out[quantity.name] = values
        if quantity.name in ("force", "torque") and len(values) and not np.nan_to_num(values).any():
            passive = ' or say torque = "zero" if the wrist passes no moment' if quantity.name == "torque" else ""
            raise BadValue(
                f"{spec.where}: {quantity.name} is zero in every row. Give the columns that hold it{passive}."
            )
    if spec.zero_torque:
        if "force" not in out:
            raise BadDescription(f'{spec.where}: torque = "zero" belongs in the stream that holds "force".')
        out["torque"] = check.frozen(np.zeros_like(out["force"]))
    lengths = {name: len(values) for name, values in out.items()}
    stamps = [len(cells[n]) for n in time_columns(spec, table)]
    require_one_length(lengths | dict(zip(("time", "its second column"), stamps, strict=False)), spec.where)
    if not next(iter(lengths.values())):
        raise BadValue(f"{spec.where}: the log is empty: it has no rows. Record again, or correct the path.")
    return out


def _seconds(
    specs: Sequence[StreamSpec], tables: Sequence[Table], cells: Sequence[Columns], rows: Sequence[int], gaps: bool
) -> list[Array | None]:
    """Return seconds after one common origin; a stream with only a rate starts with the earliest clock.

    With `gaps`, stamps that are missing stay NaN, else they are an error.
    """
    clocks: dict[int, Clock] = {}
    for i, (spec, table, mine) in enumerate(zip(specs, tables, cells, strict=True)):
        columns = [mine[number] for number in time_columns(spec, table)]
        if spec.time is not None and columns:
            stamps = one_column(columns, spec.time.units, spec.time.where)
            clocks[i] = Clock.of(stamps, spec.time.unit, spec.time.where, gaps)
    origin = common_origin(list(clocks.values()))
    seconds: list[Array | None] = [clocks[i].seconds_after(origin) if i in clocks else None for i in range(len(specs))]
    start = min((float(np.nanmin(s)) for s in seconds if s is not None), default=0.0)
    for i, spec in enumerate(specs):
        if spec.time is not None and not spec.time.columns:
            check.likely_step(1 / spec.time.rate, spec.time.where)
            seconds[i] = check.frozen(start + np.arange(rows[i]) / spec.time.rate)
    return seconds


def _names(specs: Sequence[StreamSpec]) -> list[str]:
    """Return one name per stream: its path and topic, with #2, #3 .. behind where one serves several streams."""
    names: list[str] = []
    called = [spec.path if spec.topic is None else f"{spec.path}:{spec.topic}" for spec in specs]
    for i, name in enumerate(called):
        before = called[:i].count(name)
        names.append(f"{name}#{before + 1}" if before else name)
    return names


def own_rows(specs: Sequence[StreamSpec], tables: Sequence[Table], cells: Sequence[Columns]) -> list[Columns]:
    """Return the cells of every stream without rows in which all its quantities are empty, where others share its file.

    Streams without stamps keep all: their rows belong to those of the others by number.
    """
    shared = [id(table) for table in tables]
    stamps = [time_columns(spec, table) for spec, table in zip(specs, tables, strict=True)]
    return [
        _own(mine, clock) if clock and shared.count(table) > 1 else mine
        for mine, clock, table in zip(cells, stamps, shared, strict=True)
    ]


def _own(cells: Columns, clock: Sequence[int]) -> Columns:
    """Return the rows that hold a quantity; all where none does, or where lengths differ, which others refuse."""
    if len({len(column) for column in cells.values()}) > 1:
        return cells
    empty: Mask = np.logical_and.reduce([np.isnan(column) for n, column in cells.items() if n not in clock])
    return cells if empty.all() or not empty.any() else {n: column[~empty] for n, column in cells.items()}
