"""A bare data file becomes a description when its column names are the usual ones."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription
from steelyard.io.channels import require_finite
from steelyard.io.description import EXAMPLE, Description
from steelyard.io.entries import listed
from steelyard.io.rotations import FORMS, rotation_of
from steelyard.io.stream_entries import QuantitySpec, StreamSpec, TimeSpec
from steelyard.io.tables import Table
from steelyard.io.units import TIME, UNITS

Cells = dict[int, np.ndarray[Any, np.dtype[Any]]]

# Quantity -> stems of its three names; each is followed by x, y, z (fx, force_x, wrench.force.x).
_STEMS: dict[str, tuple[str, ...]] = {
    "force": ("f", "force"),
    "torque": ("t", "torque", "tau", "moment", "m"),
    "acceleration": ("a", "acc", "accel", "linear_acceleration", "acceleration", "specific_force"),
    "gravity": ("g", "gravity"),
    "position": ("", "p", "pos", "position"),
    "linear_velocity": ("v", "vel", "velocity", "linear_velocity"),
    "angular_velocity": ("w", "omega", "angular_velocity"),
    "angular_acceleration": ("alpha", "angular_acceleration"),
}
_QUATERNIONS = (
    ("qw", "qx", "qy", "qz"),
    ("orientation_w", "orientation_x", "orientation_y", "orientation_z"),
)
_MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
_TIMES = ("t", "time", "timestamp", "stamp", "time_stamp", "secs", "seconds")
_UNIT = re.compile(r"[\[(]\s*([^\])]*?)\s*[\])]\s*$")
_SEPARATOR = re.compile(r"[^a-z0-9]+")
_NOW = 1e9  # [s] stamps since 1970 are above this until the year 2286
_FAR = 10.0  # streams sampled more slowly than every 10 s are poses typed by hand, or the unit is not seconds


def describe(table: Table) -> tuple[Description, Cells]:
    """Return what the file's names say, and its cells; raises BadDescription listing the columns and an example."""
    plain, units = _plain_names(table)
    found = {name: numbers for name in _STEMS if (numbers := _vector(plain, name))}
    rotation = _rotation(plain)
    stamps = next((plain[name] for name in _time_names(plain)), None)
    _require(table, found, rotation is not None)
    columns = [n for numbers in found.values() for n in numbers] + list(rotation[1] if rotation else ())
    exact = [] if stamps is None else [stamps]
    cells = table.read(sorted({*columns, *exact}), exact)
    name = table.path.name
    quantities = _quantities(found, units, cells, name)
    if rotation:
        quantities.append(QuantitySpec("rotation", rotation[1], "rad", f"{name}, rotation", form=rotation[0]))
    time = None if stamps is None else _time(stamps, _time_unit(table, stamps, plain, units, cells), name)
    if not {"rotation", "gravity", "specific_force"} & {q.name for q in quantities}:
        raise _cannot_tell(table, "nothing says where gravity points in the sensor frame")
    poses = time is None and _turns_each_row(quantities, cells)
    stream = StreamSpec(name, tuple(quantities), name, time, poses)
    return Description((stream,)), cells


def _plain_names(table: Table) -> tuple[dict[str, int], dict[int, str]]:
    """Return column numbers by simplified name (lower case, words joined by _), and units written behind names."""
    if table.header.names is None:
        raise _cannot_tell(table, "the file has no header")
    plain: dict[str, int] = {}
    units: dict[int, str] = {}
    for number, name in enumerate(table.header.names):
        inner = any(number in group for group in table.header.groups.values())
        unit = None if inner else _UNIT.search(name)
        if unit:
            units[number] = unit.group(1)
        simple = _SEPARATOR.sub("_", (name[: unit.start()] if unit else name).lower()).strip("_")
        if simple in plain:
            raise _cannot_tell(table, f'two columns are called "{simple}"')
        plain[simple] = number
    for name, group in table.header.groups.items():
        plain |= {
            f"{_SEPARATOR.sub('_', name.lower())}_{axis}": n for axis, n in zip("xyz", group, strict=False)
        }
        if len(group) == 9:
            plain |= dict(zip(_MATRIX, group, strict=True)) if name.lower().startswith("rotation") else {}
    return plain, units


def _vector(plain: Mapping[str, int], quantity: str) -> tuple[int, ...]:
    for stem in _STEMS[quantity]:
        for joint in ("", "_") if stem else ("",):
            keys = [_lookup(plain, f"{stem}{joint}{axis}", len(stem) > 2) for axis in "xyz"]
            if all(key is not None for key in keys):
                return tuple(plain[str(key)] for key in keys)
    return ()


def _lookup(plain: Mapping[str, int], name: str, may_end: bool) -> str | None:
    """Return the name that is `name`, or that alone ends in it after a prefix (ft_wrench_force_x)."""
    if name in plain:
        return name
    ends = [key for key in plain if may_end and key.endswith(f"_{name}")]
    return ends[0] if len(ends) == 1 else None


def _rotation(plain: Mapping[str, int]) -> tuple[str, tuple[int, ...]] | None:
    for names in _QUATERNIONS:
        keys = [_lookup(plain, name, True) for name in names]
        if all(key is not None for key in keys):
            return "quaternion-wxyz", tuple(plain[str(key)] for key in keys)
    if all(name in plain for name in _MATRIX):
        return "matrix", tuple(plain[name] for name in _MATRIX)
    return None


def _time_names(plain: Mapping[str, int]) -> Iterable[str]:
    for name in _TIMES:
        for suffix in ("", *(f"_{unit}" for unit in TIME)):
            if name + suffix in plain:
                yield name + suffix


def _require(table: Table, found: Mapping[str, object], rotation: bool) -> None:
    missing = [name for name in ("force", "torque") if name not in found]
    if missing:
        raise _cannot_tell(table, f"no {' and no '.join(missing)} was recognised")
    if not rotation and not {"gravity", "acceleration"} & set(found):
        raise _cannot_tell(table, "nothing says where gravity points in the sensor frame")


def _cannot_tell(table: Table, reason: str) -> BadDescription:
    names = table.header.names
    there = (
        (*table.header.groups, *(n for n in names if "[" not in n or not table.header.groups))
        if names
        else ()
    )
    columns = f"Columns here: {listed(there)}." if names else f"It has {table.header.count} columns."
    return BadDescription(
        f"{table.path}: cannot tell what the columns are: {reason}. {columns} "
        f"Write a description that says it, for example:\n{EXAMPLE}"
    )


def _quantities(
    found: Mapping[str, tuple[int, ...]], units: Mapping[int, str], cells: Cells, name: str
) -> list[QuantitySpec]:
    """Return the vectors, deciding by their size what ax and gx are; those that stay unclear are left out."""
    out = []
    for key, numbers in found.items():
        values = np.stack([cells[n].astype(np.float64) for n in numbers], -1)
        quantity, unit = _by_size(key, values, name)
        if quantity is None:
            continue
        unit = units.get(numbers[0], unit)
        if unit not in UNITS[quantity]:
            raise BadDescription(
                f'{name}, {quantity}: unknown unit "{unit}" in the header. Possible here: {listed(list(UNITS[quantity]))}.'
            )
        out.append(QuantitySpec(quantity, numbers, unit, f"{name}, {quantity}"))
    return out


def _by_size(key: str, values: Array, name: str) -> tuple[str | None, str]:
    """Return quantity and unit: an accelerometer reads about 1 g or 9.8 m/s^2, gravity has the length 9.8."""
    if key not in ("acceleration", "gravity"):
        return key, next(iter(UNITS[key]))
    require_finite(values, f"{name}, {key}")
    size = float(np.median(np.linalg.norm(values, axis=-1))) if len(values) else 0.0
    if key == "gravity":
        return ("gravity" if 9.7 < size < 9.9 else None), "m/s^2"
    if 0.8 < size < 1.25:
        return "specific_force", "g"
    return ("specific_force" if 8.0 < size < 12.0 else None), "m/s^2"


def _time(number: int, unit: str, name: str) -> TimeSpec:
    return TimeSpec(number, unit, 0.0, f"{name}, time")


def _time_unit(
    table: Table, number: int, plain: Mapping[str, int], units: Mapping[int, str], cells: Cells
) -> str:
    """Return the unit from the name (t_ms, t [ms]), from the size of stamps since 1970, or seconds."""
    suffix = next(key for key, n in plain.items() if n == number).rpartition("_")[2]
    for said in (units.get(number), suffix):
        if said in TIME:
            return said
    stamps = cells[number].astype(np.float64)
    for unit, per_second in TIME.items():
        if len(stamps) and _NOW < abs(float(stamps[0])) / per_second < 10 * _NOW:
            return unit
    if len(stamps) > 1 and float(np.median(np.diff(stamps))) > _FAR:
        raise _cannot_tell(table, f"the time steps are {float(np.median(np.diff(stamps))):g}, hardly seconds")
    return "s"


def _turns_each_row(quantities: Iterable[QuantitySpec], cells: Cells) -> bool:
    """Whether the direction of gravity jumps from row to row by more than 5 degrees: a table of still poses."""
    for spec in quantities:
        values = np.stack([cells[int(n)] for n in spec.columns], -1)
        if spec.name == "rotation":
            down = (
                rotation_of(values, spec.form or "matrix").matrix[:, 2]
                if len(values[0]) == FORMS[str(spec.form)]
                else values
            )
        elif spec.name in ("gravity", "specific_force"):
            down = values / np.linalg.norm(values, axis=-1, keepdims=True)
        else:
            continue
        cosine = np.einsum("ni,ni->n", down[1:], down[:-1])
        return bool(len(cosine)) and float(np.median(cosine)) < np.cos(np.radians(5))
    return False
