"""A bare data file becomes a description when its column names are the usual ones.

Names are compared without case, brackets and separators: `fx`, `Fx [N]`, `force_x`, `wrench.force.x` are one.
A unit in brackets is taken; a vector whose meaning its numbers leave open (gx may be a gyro) is left out.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadDescription
from steelyard.io.channels import channel_with_gaps
from steelyard.io.controllers import known_lines
from steelyard.io.description import ASSUMED, Description, default_gravity
from steelyard.io.entries import listed
from steelyard.io.example import columns_text, example_of
from steelyard.io.missing_rows import stand_apart
from steelyard.io.stream_entries import QuantitySpec, StreamSpec, TimeSpec
from steelyard.io.table_header import Header
from steelyard.io.tables import Table
from steelyard.io.units import TIME, UNITS, spelled
from steelyard.logs.recording import ASSUMED_GRAVITY_STD

Cells = dict[int, np.ndarray[Any, np.dtype[Any]]]

# Quantity -> stems of its three names, each followed by x, y, z. Position and velocities are in W or S as in
# descriptions; a linear velocity does not say its frame, and is not needed, so it is not read.
_STEMS: dict[str, tuple[str, ...]] = {
    "force": ("f", "force"),
    "torque": ("t", "torque", "tau", "moment", "m"),
    "specific_force": ("a", "acc", "accel", "acceleration", "specific_force", "linear_acceleration"),
    "gravity": ("g", "gravity"),
    "position": ("", "p", "pos", "position", "translation"),
    "angular_velocity": ("w", "omega", "angular_velocity"),
    "angular_acceleration": ("alpha", "angular_acceleration"),
}
_QUATERNION = ("q", "quat", "quaternion", "orientation", "rotation")
# Angles leave open in which order they turn and whether they are degrees. Names -> the form and unit that are usual.
_ANGLES = {("roll", "pitch", "yaw"): ("rpy", "deg"), ("rx", "ry", "rz"): ("rotation-vector", "rad")}
_MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
_TIMES = ("t", "time", "timestamp", "stamp")
_SECONDS = ("secs", "seconds")  # the whole stamp, unless its nanoseconds stand beside it
_SPLIT = (("sec", "nanosec"), ("secs", "nsecs"))  # ROS; "header.stamp." may stand in front
_UNIT = re.compile(r"[\[(]\s*(?!\d+\s*[\])])([^\])]*?)\s*[\])]\s*$")
_SEPARATOR = re.compile(r"[^a-z0-9]+")

_EPOCH = (1e9, 1e10)  # [s] stamps since 1970 lie here from 2001 to 2286
_SLOWEST = 10.0  # [s] longer steps than this are not seconds
_ONE_G = (0.8, 1.25)  # size of an accelerometer reading in g
_GRAVITY = (9.7, 9.9)
_SPECIFIC_FORCE = (8.0, 12.0)
_NEW_POSE = float(np.cos(np.radians(5)))


@dataclass(frozen=True)
class _Names:
    """Column numbers by simplified name, units by column number, and the numbers of columns that hold dates."""

    plain: dict[str, int]
    units: dict[int, str]
    dates: tuple[int, ...] = ()

    def find(self, name: str, alone: bool) -> int | None:
        """Return the column called `name`, or, unless `alone`, the only one ending in it after a prefix."""
        if alone or name in self.plain:
            return self.plain.get(name)
        ends = [number for key, number in self.plain.items() if key.endswith(f"_{name}")]
        return ends[0] if len(ends) == 1 else None

    def all_of(self, names: Sequence[str], alone: bool) -> tuple[int, ...]:
        """Return the columns of all `names`; nothing where one is missing."""
        found = [self.find(name, alone) for name in names]
        return tuple(number for number in found if number is not None) if None not in found else ()


def describe(table: Table) -> tuple[Description, Cells]:
    """Return what the names in the file say, and its cells; raises BadDescription with an example."""
    names = _simplified(table)
    vectors = {quantity: found for quantity in _STEMS if (found := _vector(names, quantity))}
    rotation = _rotation(names)
    stamps = next(_time_columns(names), ())
    _require(table, names, [*vectors, *(["rotation"] if rotation else [])])
    wanted = {n for numbers in vectors.values() for n in numbers} | set(rotation.columns if rotation else ())
    cells = table.read(sorted({*map(int, wanted), *stamps}), stamps)
    specs = [spec for q, numbers in vectors.items() if (spec := _vector_spec(table, names, q, numbers, cells))]
    specs += [rotation] if rotation else []
    _require(table, names, [spec.name for spec in specs])
    time = TimeSpec(stamps, _time_units(table, names, stamps, cells), 0.0, "time") if stamps else None
    gravity, notes = _gravity(specs, cells)
    poses = time is None and _turns_each_row(specs, cells, gravity)
    where = table.path.name
    located = [QuantitySpec(s.name, s.columns, s.unit, f"{where}, {s.name}", s.form, s.frame) for s in specs]
    time = time and replace(time, where=f"{where}, time")
    streams = [StreamSpec(where, topic, where, time, poses) for topic in _topics(located, cells, time)]
    return Description(tuple(streams), gravity, notes=notes, gravity_std=ASSUMED_GRAVITY_STD if notes else 0.0), cells


def _topics(specs: Sequence[QuantitySpec], cells: Cells, time: TimeSpec | None) -> list[tuple[QuantitySpec, ...]]:
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


def _simplified(table: Table) -> _Names:
    header = table.header
    if header.names is None:
        raise _cannot_tell(table, "the file has no header", {})
    plain: dict[str, int] = {}
    units: dict[int, str] = {}
    inner = {n for group in header.groups.values() for n in group}
    for number, name in enumerate(header.names):
        unit = None if number in inner else _UNIT.search(name)
        if unit:
            units[number] = unit.group(1)
        simple = _simple(name[: unit.start()] if unit else name)
        if simple in plain:
            known = _Names(plain, units, header.dates)
            raise _cannot_tell(table, f'two columns are called "{simple}"', _own_lines(table, known))
        plain[simple] = number
    return _Names({**plain, **_array_names(header)}, units, header.dates)


def _simple(name: str) -> str:
    return _SEPARATOR.sub("_", name.lower()).strip("_")


def _array_names(header: Header) -> dict[str, int]:
    """Return names for the columns inside arrays: force -> force_x .., rotation (N, 3, 3) -> r11 .."""
    out: dict[str, int] = {}
    for name, group in header.groups.items():
        simple = _simple(name).removesuffix("_sensor").removesuffix("_world")
        if len(group) == 3:
            out |= {f"{simple}_{axis}": n for axis, n in zip("xyz", group, strict=True)}
        if len(group) == 9 and simple.startswith("rotation"):
            out |= dict(zip(_MATRIX, group, strict=True))
    return out


def _vector(names: _Names, quantity: str) -> tuple[int, ...]:
    for stem in _STEMS[quantity]:
        for joint in ("", "_"):
            found = names.all_of([f"{stem}{joint}{axis}" for axis in "xyz"] if stem else list("xyz"), len(stem) < 3)
            if found:
                return found
    return ()


def _rotation(names: _Names) -> QuantitySpec | None:
    for stem in _QUATERNION:
        for joint in ("", "_"):
            found = names.all_of([f"{stem}{joint}{part}" for part in "wxyz"], len(stem) < 3)
            if found:
                return QuantitySpec("rotation", found, "rad", "rotation", form="quaternion-wxyz")
    found = names.all_of(_MATRIX, True)
    return QuantitySpec("rotation", found, "rad", "rotation", form="matrix") if found else None


def _time_columns(names: _Names) -> Iterator[tuple[int, ...]]:
    """Yield the columns that may be the clock, the likeliest first: one, or seconds and nanoseconds.

    The only column of dates is the clock whatever its name, as the index of pandas, which has none.
    """
    yield from _whole_stamps(names, _TIMES)
    yield from (found for pair in _SPLIT if (found := names.all_of(pair, False)))
    yield from _whole_stamps(names, _SECONDS)
    if len(names.dates) == 1:
        yield names.dates


def _whole_stamps(names: _Names, stems: Sequence[str]) -> Iterator[tuple[int, ...]]:
    for name in stems:
        for suffix in ("", *(f"_{unit}" for unit in TIME)):
            if name + suffix in names.plain:
                yield (names.plain[name + suffix],)


def _require(table: Table, names: _Names, found: Sequence[str]) -> None:
    missing = [name for name in ("force", "torque") if name not in found]
    if missing:
        raise _cannot_tell(table, f"no {' and no '.join(missing)} was recognised", _own_lines(table, names))
    if not {"rotation", "gravity", "specific_force"} & set(found):
        _require_no_angles(table, names)
        reason = "nothing says where gravity points in the sensor frame"
        raise _cannot_tell(table, reason, _own_lines(table, names))


def _require_no_angles(table: Table, names: _Names) -> None:
    """Raise BadDescription with the line to write where the orientation is there, but as angles."""
    for three, (form, unit) in _ANGLES.items():
        found = names.all_of(three, len(three[0]) < 3)
        if found:
            line = f'{{ columns = {_columns(table, found)}, form = "{form}", unit = "{unit}" }}   # S to W; check both'
            raise _cannot_tell(
                table,
                f"{', '.join(three)} turn the sensor, but only a description can say in which form (rpy or "
                "rotation-vector) and unit (deg or rad)",
                {**_own_lines(table, names), "rotation": line},
            )


def _cannot_tell(table: Table, reason: str, lines: Mapping[str, str]) -> BadDescription:
    """Return the error; `lines` are those of a description that the names of the file do tell."""
    names = table.header.names
    shown = f"Columns here: {listed(table.header.shown())}." if names else f"It has {table.header.count} columns."
    return BadDescription(
        f"{table.path}: cannot tell what the columns are: {reason}. {shown} "
        f"Write a description that says it, for example:\n{example_of(table.path.name, lines, not names)}"
    )


def _own_lines(table: Table, names: _Names) -> dict[str, str]:
    """Return quantity -> its line of a description, for those whose columns were recognised."""
    lines = {}
    stamps = next(_time_columns(names), ())
    if stamps:
        told = None if len(stamps) > 1 else _said_unit(names, stamps[0])
        units = '["s", "ns"]' if len(stamps) > 1 else f'"{told or "s"}"'
        mark = "" if told or len(stamps) > 1 else "   # check the unit: s, ms, us or ns"
        lines["time"] = f"{{ columns = {_columns(table, stamps)}, unit = {units} }}{mark}"
    for quantity in ("force", "torque", "specific_force", "gravity", "position"):
        if (found := _vector(names, quantity)) and len(said := _said_units(names, quantity, found)) < 2:
            unit = said[0] if said and said[0] in UNITS[quantity] else next(iter(UNITS[quantity]))
            mark = "   # of S in W; check the unit" if quantity == "position" else ""
            lines[quantity] = f'{{ columns = {_columns(table, found)}, unit = "{unit}" }}{mark}'
    if turn := _rotation(names):
        numbers = [int(n) for n in turn.columns]
        lines["rotation"] = f'{{ columns = {_columns(table, numbers)}, form = "{turn.form}" }}   # S to W'
    for quantity, columns, rest, remark in known_lines(names.plain):
        lines[quantity] = f"{{ columns = {_columns(table, columns)}, {rest} }}   # {remark}"
    return lines


def _columns(table: Table, numbers: Sequence[int]) -> str:
    """Return the names of columns as a description lists them; an array that holds them all by its own name."""
    for name, group in table.header.groups.items():
        if group == tuple(numbers):
            return columns_text([name])
    shown = table.header.names or ()
    return columns_text([shown[n] for n in numbers])


def _vector_spec(
    table: Table, names: _Names, quantity: str, numbers: tuple[int, ...], cells: Cells
) -> QuantitySpec | None:
    """Return the vector with its unit, None where its size does not tell what it is."""
    said = _said_units(names, quantity, numbers)
    if len(said) > 1:
        reason = f"the columns of {quantity} have different units, {' and '.join(said)}; write them in one"
        raise _cannot_tell(table, reason, _own_lines(table, names))
    unit = said[0] if said else None
    if unit is not None and unit not in UNITS[quantity]:
        reason = f'unknown unit "{unit}" of {quantity}; possible are {listed(list(UNITS[quantity]))}'
        raise _cannot_tell(table, reason, _own_lines(table, names))
    if unit is None:
        unit = _unit_by_size(quantity, np.stack([cells[n] for n in numbers], -1))
    return None if unit is None else QuantitySpec(quantity, numbers, unit, quantity)


def _said_units(names: _Names, quantity: str, numbers: Sequence[int]) -> list[str]:
    """Return the units that stand over the columns of a vector, each once: a column without one has the others'."""
    return list(dict.fromkeys(spelled(quantity, names.units[n]) for n in numbers if n in names.units))


def _unit_by_size(quantity: str, values: Array) -> str | None:
    """Return SI; an accelerometer shows whether it counts in g, and gravity that it is gravity."""
    size = _size(values) if len(values) else 0.0
    if quantity == "specific_force" and _ONE_G[0] < size < _ONE_G[1]:
        return "g"
    low, high = {"specific_force": _SPECIFIC_FORCE, "gravity": _GRAVITY}.get(quantity, (-1.0, np.inf))
    return next(iter(UNITS[quantity])) if low < size < high or not np.isfinite(size) else None


def _time_units(table: Table, names: _Names, stamps: Sequence[int], cells: Cells) -> tuple[str, ...]:
    return ("s", "ns") if len(stamps) > 1 else (_time_unit(table, names, stamps[0], cells),)


def _time_unit(table: Table, names: _Names, number: int, cells: Cells) -> str:
    """Return the unit from the name (t_ms, t [ms]), from the size of stamps since 1970, or seconds."""
    said = _said_unit(names, number)
    if said is not None:
        return said
    if cells[number].dtype.kind == "M":
        return "s"
    stamps = cells[number].astype(np.float64)
    stamps = stamps[np.isfinite(stamps)]
    for unit, per_second in TIME.items():
        if len(stamps) and _EPOCH[0] < stamps[0] / per_second < _EPOCH[1]:
            return unit
    step = float(np.median(np.diff(stamps))) if len(stamps) > 1 else 0.0
    if step > _SLOWEST:
        reason = f"time rises by {step:g} per row, which can hardly be seconds"
        raise _cannot_tell(table, reason, _own_lines(table, names))
    return "s"


def _said_unit(names: _Names, number: int) -> str | None:
    """Return the unit of time that a name carries: t_ms, t [ms]."""
    name = next(key for key, n in names.plain.items() if n == number)
    return next((said for said in (names.units.get(number, ""), name.rpartition("_")[2]) if said in TIME), None)


def _size(values: Array) -> float:
    """Return the median length of the rows of (N, 3) that hold numbers; NaN where none does."""
    sizes = np.linalg.norm(values[np.isfinite(values).all(-1)], axis=-1)
    return float(np.median(sizes)) if len(sizes) else float("nan")


def _gravity(specs: Sequence[QuantitySpec], cells: Cells) -> tuple[Array, tuple[str, ...]]:
    """Return gravity in W, z up, as long as the file's own gravity; standard where it has none, which a note says."""
    for spec in specs:
        if spec.name == "gravity":
            values = np.stack([cells[int(n)] for n in spec.columns], -1)
            return np.array([0.0, 0.0, -_size(values)]), ()
    way = " along -z of the world" if any(spec.name == "rotation" for spec in specs) else ""
    return default_gravity(), (
        f"the file does not say gravity: {ASSUMED}{way} was assumed ([log] gravity of a description)",
    )


def _turns_each_row(specs: Sequence[QuantitySpec], cells: Cells, gravity: Array) -> bool:
    """Whether gravity turns by more than 5 degrees from row to row: then each row is a still pose."""
    spec = next(s for s in reversed(specs) if s.name in ("rotation", "gravity", "specific_force"))
    values = channel_with_gaps(spec, [cells[int(n)].astype(np.float64) for n in spec.columns], gravity)
    down = values[:, 2] if spec.form else values / np.linalg.norm(values, axis=-1, keepdims=True)
    cosine = np.einsum("ni,ni->n", down[1:], down[:-1])
    cosine = cosine[np.isfinite(cosine)]
    return bool(len(cosine)) and float(np.median(cosine)) < _NEW_POSE
