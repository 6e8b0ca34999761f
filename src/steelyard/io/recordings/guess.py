"""A bare data file becomes a description when its column names are the usual ones.

A unit in brackets is taken, or in a row under the header; a vector whose meaning its numbers leave open (gx may be a
gyro) is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.io.entries import listed
from steelyard.io.recordings.counted import counted, part_names
from steelyard.io.recordings.description import ASSUMED, Description, default_gravity
from steelyard.io.recordings.not_told import (
    cannot_tell,
    left_out,
    numbered_lines,
    own_lines,
    require_told,
    turns_each_row,
)
from steelyard.io.streams.channels import channel_with_gaps, stand_apart
from steelyard.io.streams.entries import QuantitySpec, StreamSpec, TimeSpec
from steelyard.io.streams.usual_names import STEMS, Names, compared
from steelyard.io.tables.files import Columns, Table
from steelyard.io.units import SLOWEST, UNITS, apart, converted, median_size, stamp_unit, unit_by_size
from steelyard.logs.recording import ASSUMED_GRAVITY_STD

_NO_UNIT = {"", "-", "–"}  # what a row of units holds where there is none


def describe(table: Table) -> tuple[Description, Columns]:
    """Return what the names in the file say, and its cells; raises BadDescription with an example."""
    names = _simplified(table)
    vectors = {quantity: found for quantity in STEMS if (found := names.vector(quantity))}
    rotation = names.rotation()
    stamps = next(names.time_columns(), ())
    require_told(table, names, [*vectors, *(["rotation"] if rotation else [])])
    wanted = {n for numbers in vectors.values() for n in numbers} | set(rotation.columns if rotation else ())
    cells = table.read(sorted({*map(int, wanted), *stamps}), stamps)
    if stamps and stamps == names.clock_by_unit() and not _rises(cells[stamps[0]]):
        stamps = ()
    specs = [spec for q, numbers in vectors.items() if (spec := _vector_spec(table, names, q, numbers, cells))]
    specs += [rotation] if rotation else []
    require_told(table, names, [spec.name for spec in specs])
    time = None
    if stamps:
        units = ("s", "ns") if len(stamps) > 1 else (_time_unit(table, names, stamps[0], cells),)
        time = TimeSpec(stamps, units, 0.0, "time")
    gravity, notes = _gravity(specs, cells)
    poses = time is None and _each_row_is_a_pose(specs, cells, gravity)
    where = table.path.name
    located = [QuantitySpec(s.name, s.columns, s.unit, f"{where}, {s.name}", s.form, s.frame) for s in specs]
    time = time and replace(time, where=f"{where}, time")
    streams = [StreamSpec(where, topic, where, time, poses) for topic in _topics(located, cells, time)]
    assumed = ASSUMED_GRAVITY_STD if notes else 0.0
    notes += _of_parts(table, names, located) + (() if rotation else left_out(table, names))
    return Description(tuple(streams), gravity, notes=notes, gravity_std=assumed), cells


def _rises(column: np.ndarray[Any, np.dtype[Any]]) -> bool:
    """Whether a column counts up, as a clock does."""
    known = column[~np.isnan(column)]
    return bool(len(known)) and bool((known[1:] >= known[:-1]).all()) and bool(known[-1] > known[0])


def _topics(specs: Sequence[QuantitySpec], cells: Columns, time: TimeSpec | None) -> list[tuple[QuantitySpec, ...]]:
    """Return the quantities of each stream: all in one, or those of each topic where topics were joined by time."""
    if time is None:
        return [tuple(specs)]
    topics: list[tuple[Mask, list[QuantitySpec]]] = []
    for spec in specs:
        held = np.logical_and.reduce([~np.isnan(cells[int(n)]) for n in spec.columns])
        mine = next((group for rows, group in topics if not stand_apart(rows, held)), None)
        if mine is None:
            topics.append((held, [spec]))
        else:
            mine.append(spec)
    return [tuple(group) for _, group in topics]


def _of_parts(table: Table, names: Names, specs: Sequence[QuantitySpec]) -> tuple[str, ...]:
    """Return notes on counted columns whose parts were taken by their number."""
    used = {spec.name: set(spec.columns) for spec in specs}
    out = []
    for run in names.counted.values():
        name = (table.header.names or ())[run[0]].removesuffix("[0]").removesuffix("_0")
        if len(run) == 6 and used["force"] | used["torque"] == set(run):
            out.append(f"the six numbers of '{name}' were taken as force, then torque")
        if len(run) == 16 and used.get("rotation", set()) < set(run):
            out.append(f"the 4 x 4 matrices of '{name}' were taken as poses of S in W")
    return tuple(out)


def _simplified(table: Table) -> Names:
    header = table.header
    if header.names is None:
        raise cannot_tell(table, "the file has no header", numbered_lines(table))
    plain: dict[str, int] = {}
    units: dict[int, str] = {}
    inner = {n for group in header.groups.values() if len(group) > 1 for n in group}
    alone = {group[0]: name for name, group in header.groups.items() if len(group) == 1}  # (N, 1), as MATLAB has them
    for number, name in enumerate(header.names):
        name = alone.get(number, name)
        plain_name, unit = (name, "") if number in inner else apart(name)
        unit = unit or header.unit(number)
        if unit not in _NO_UNIT:
            units[number] = unit
        simple = compared(plain_name)
        if simple and simple in plain:
            known = Names(plain, units, header.dates, header.words)
            raise cannot_tell(table, f'two columns are called "{simple}"', own_lines(table, known))
        plain[simple] = number
    runs = counted(plain)
    return Names({**plain, **part_names(table, runs)}, units, header.dates, header.words, runs)


def _vector_spec(
    table: Table, names: Names, quantity: str, numbers: tuple[int, ...], cells: Columns
) -> QuantitySpec | None:
    """Return the vector with its unit, None where its size does not tell what it is."""
    said = names.said_units(quantity, numbers)
    if len(said) > 1:
        reason = f"the columns of {quantity} have different units, {' and '.join(said)}; write them in one"
        raise cannot_tell(table, reason, own_lines(table, names))
    unit = said[0] if said else None
    if unit is not None and unit not in UNITS[quantity]:
        how = converted(quantity, unit)
        reason = f'unknown unit "{unit}" of {quantity}; possible are {listed(list(UNITS[quantity]))}{how and "; "}{how}'
        raise cannot_tell(table, reason, own_lines(table, names))
    if unit is None:
        unit = unit_by_size(quantity, np.stack([cells[n] for n in numbers], -1))
    return None if unit is None else QuantitySpec(quantity, numbers, unit, quantity)


def _time_unit(table: Table, names: Names, number: int, cells: Columns) -> str:
    """Return the unit from the name (t_ms, t [ms]), from the size of stamps since 1970, or seconds."""
    said = names.said_unit(number)
    if said is not None:
        return said
    if cells[number].dtype.kind == "M":
        return "s"
    unit, step = stamp_unit(cells[number])
    if unit is None and step > SLOWEST:
        reason = f"time rises by {step:g} per row, which can hardly be seconds"
        raise cannot_tell(table, reason, own_lines(table, names))
    return unit or "s"


def _gravity(specs: Sequence[QuantitySpec], cells: Columns) -> tuple[Array, tuple[str, ...]]:
    """Return gravity in W, z up, as long as the file's own gravity; standard where it has none, which a note says."""
    for spec in specs:
        if spec.name == "gravity":
            values = np.stack([cells[int(n)] for n in spec.columns], -1)
            return np.array([0.0, 0.0, -median_size(values)]), ()
    way = " along -z of the world" if any(spec.name == "rotation" for spec in specs) else ""
    return default_gravity(), (
        f"the file does not say gravity: {ASSUMED}{way} was assumed, the spread from equator to pole, which "
        "the bar of the mass holds (that of your place narrows it, in [log] gravity of a description, which "
        "`steelyard identify FILE --describe` writes)",
    )


def _each_row_is_a_pose(specs: Sequence[QuantitySpec], cells: Columns, gravity: Array) -> bool:
    """Whether gravity turns by more than 5 degrees from row to row: then each row is a still pose."""
    spec = next(s for s in reversed(specs) if s.name in ("rotation", "gravity", "specific_force"))
    values = channel_with_gaps(spec, [cells[int(n)].astype(np.float64) for n in spec.columns], gravity)
    return turns_each_row(values[:, 2] if spec.form else values)
