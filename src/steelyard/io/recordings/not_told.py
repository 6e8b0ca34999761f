"""The error of a file whose columns cannot be told, with the description to write instead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from steelyard.errors import BadDescription
from steelyard.io.entries import listed
from steelyard.io.example import columns_text, example_of
from steelyard.io.recordings.controllers import known_lines
from steelyard.io.streams.usual_names import (
    ANGLES,
    Names,
    rotation_named,
    said_unit,
    said_units,
    time_columns,
    vector_named,
)
from steelyard.io.tables.files import Table
from steelyard.io.units import UNITS


def require_told(table: Table, names: Names, found: Sequence[str]) -> None:
    """Raise BadDescription where the wrench or the direction of gravity is not among the quantities found."""
    missing = [name for name in ("force", "torque") if name not in found]
    if missing:
        raise cannot_tell(table, f"no {' and no '.join(missing)} was recognised", own_lines(table, names))
    if not {"rotation", "gravity", "specific_force"} & set(found):
        _require_no_angles(table, names)
        reason = "nothing says where gravity points in the sensor frame"
        raise cannot_tell(table, reason, own_lines(table, names))


def _require_no_angles(table: Table, names: Names) -> None:
    """Raise BadDescription with the line to write where the orientation is there, but as angles."""
    for three, (form, unit) in ANGLES.items():
        found = names.all_of(three, len(three[0]) < 3)
        if found:
            line = f'{{ columns = {_columns(table, found)}, form = "{form}", unit = "{unit}" }}   # S to W; check both'
            raise cannot_tell(
                table,
                f"{', '.join(three)} turn the sensor, but only a description can say in which form (rpy or "
                "rotation-vector) and unit (deg or rad)",
                {**own_lines(table, names), "rotation": line},
            )


def cannot_tell(table: Table, reason: str, lines: Mapping[str, str]) -> BadDescription:
    """Return the error; `lines` are those of a description that the names of the file do tell."""
    names = table.header.names
    shown = f"Columns here: {listed(table.header.shown())}." if names else f"It has {table.header.count} columns."
    return BadDescription(
        f"{table.path}: cannot tell what the columns are: {reason}. {shown} "
        f"Write a description that says it, for example:\n{example_of(table.path.name, lines, not names)}"
    )


def own_lines(table: Table, names: Names) -> dict[str, str]:
    """Return quantity -> its line of a description, for those whose columns were recognised."""
    lines = {}
    stamps = next(time_columns(names), ())
    if stamps:
        told = None if len(stamps) > 1 else said_unit(names, stamps[0])
        units = '["s", "ns"]' if len(stamps) > 1 else f'"{told or "s"}"'
        mark = "" if told or len(stamps) > 1 else "   # check the unit: s, ms, us or ns"
        lines["time"] = f"{{ columns = {_columns(table, stamps)}, unit = {units} }}{mark}"
    for quantity in ("force", "torque", "specific_force", "gravity", "position"):
        if (found := vector_named(names, quantity)) and len(said := said_units(names, quantity, found)) < 2:
            unit = said[0] if said and said[0] in UNITS[quantity] else next(iter(UNITS[quantity]))
            mark = "   # of S in W; check the unit" if quantity == "position" else ""
            lines[quantity] = f'{{ columns = {_columns(table, found)}, unit = "{unit}" }}{mark}'
    if turn := rotation_named(names):
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
