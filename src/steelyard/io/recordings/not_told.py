"""The error of a file whose columns cannot be told, with the description to write instead."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.errors import NoDescription
from steelyard.io.entries import listed
from steelyard.io.example import columns_text, example_of
from steelyard.io.recordings.counted import joint_torques, joints, open_pose, open_quaternion, values
from steelyard.io.streams.usual_names import ANGLES, Names
from steelyard.io.tables.files import Table
from steelyard.io.units import ANGLE, SLOWEST, UNITS, angle_unit, length_unit, stamp_unit

ATTITUDES = {"rotation", "gravity", "specific_force"}
_OF_S = "of S in W; check the unit"
_ORDERS = ("quaternion-xyzw", "quaternion-wxyz")

# Half and twice as much do as well: logs turn by a degree or two from row to row, tables of poses by twenty and more.
_NEW_POSE = float(np.cos(np.radians(5)))


def require_told(table: Table, names: Names, found: Sequence[str]) -> None:
    """Raise NoDescription where the wrench or the direction of gravity is not among the quantities found."""
    missing = [name for name in ("force", "torque") if name not in found]
    if missing:
        lines = own_lines(table, names)
        reason = f"no {' and no '.join(missing)} was recognised{_of_joints(table, names)}"
        if all(len(names.vectors(name)) > 1 for name in missing):
            reason = f"several columns may be the {' and the '.join(missing)}"
        elif set(missing) <= set(lines):
            are = "are" if missing[1:] else "is"
            reason = (
                f"{' and '.join(missing)} {are} a controller's, whose axes, units and settings only you can confirm"
            )
        raise _to_check(table, reason, lines)
    if not ATTITUDES & set(found):
        lines = own_lines(table, names)
        reason = "nothing says where gravity points in the sensor frame"
        if "rotation" in lines:
            reason = "only a description can say how the columns of the orientation turn the sensor"
        if "joint_position" in lines:
            reason = "its joints turn the sensor, but only a description can name the URDF of their arm"
        if three := next((three for three in ANGLES if names.all_of(three, False)), None):
            reason = (
                f"{', '.join(three)} turn the sensor, but only a description can say in which form (rpy or "
                "rotation-vector) and unit (deg or rad)"
            )
        raise _to_check(table, reason, lines)


def _of_joints(table: Table, names: Names) -> str:
    """Return that torques of joints are no wrench, where there are any."""
    found = joint_torques(names.plain)
    if not found:
        return ""
    shown = table.header.names or ()
    return (
        f', and torques of joints ("{shown[found[0]]}" .. "{shown[found[-1]]}") are not read: log the wrench of a '
        "sensor, or the one that the controller estimates from them"
    )


def left_out(table: Table, names: Names) -> tuple[str, ...]:
    """Return a note on columns that seem to be the orientation, and were not read because they do not say how."""
    text = _open_lines(table, names).get("rotation")
    if text is None:
        return ()
    shown = " ".join(text.split())
    return (f"an orientation was left out, which only a description can say how to read: rotation = {shown}",)


def cannot_tell(table: Table, reason: str, lines: Mapping[str, str]) -> NoDescription:
    """Return the error; `lines` are those of a description that the names of the file do tell."""
    count = None if table.header.names else table.header.count
    example = example_of(table.path.name, lines, count)
    shown = f"Columns here: {listed(table.header.shown())}." if count is None else f"It has {count} columns."
    return NoDescription(
        f"{table.path}: cannot tell what the columns are: {reason}. {shown}{_lying(table)} "
        "Write a description that says it, for example:",
        example,
    )


def _to_check(table: Table, reason: str, lines: Mapping[str, str]) -> NoDescription:
    """Return the error where a description can be made of the names; one that must be filled in is `cannot_tell`."""
    if not ({"force", "torque"} <= set(lines) and {"rotation", "joint_position"} & set(lines)):
        return cannot_tell(table, reason, lines)
    words = f"{table.path}: needs a description: {reason}.{_lying(table)} Check this one, made of its names:"
    return NoDescription(words, example_of(table.path.name, lines))


def _lying(table: Table) -> str:
    """Return what to do with arrays that have one column per row of the others."""
    shapes = table.header.shapes
    rows = max((shape[0] for shape in shapes.values() if len(shape) == 1), default=0)
    lying = [name for name, shape in shapes.items() if len(shape) == 2 and shape[1] == rows > shape[0]]
    if not lying:
        return ""
    return f' Arrays need one row per sample; "{lying[0]}" has {rows} columns: save {lying[0]}.T.'


def own_lines(table: Table, names: Names) -> dict[str, str]:
    """Return quantity -> its line of a description, for those whose columns were recognised."""
    lines = {}
    stamps = next(names.time_columns(), ())
    if stamps:
        lines["time"] = _time_line(table, names, stamps)
    for quantity in ("force", "torque", "specific_force", "gravity", "position"):
        if text := _vector_line(table, names, quantity):
            lines[quantity] = text
    lines |= _open_lines(table, names)
    if turn := names.rotation():
        lines["rotation"] = line(table, [int(n) for n in turn.columns], f'form = "{turn.form}"', "S to W")
    elif (rotations := names.rotations())[1]:
        form, turns = rotations
        lines["rotation"] = line(table, turns[0], f'form = "{form}"', f"S to W{_or(table, turns)}")
    for quantity, columns, rest, remark in names.of_controllers():
        lines[quantity] = line(table, columns, rest, remark)
    if not ATTITUDES & set(lines) and (found := joints(names)):
        unit = angle_unit(values(table, found)) or "rad"
        lines["joint_position"] = line(table, found, f'unit = "{unit}"', "from base to sensor")
        lines.pop("position", None)  # which joints tell, too
    if "time" not in lines and (force := names.vector("force")) and turns_each_row(values(table, force)):
        lines["kind"] = '"poses"   # each row is a still pose: check'
    return lines


def turns_each_row(vectors: Array | None) -> bool:
    """Whether vectors (N, 3) turn by more than 5 degrees from row to row: then each row is a still pose."""
    if vectors is None or len(vectors) < 2:
        return False
    with np.errstate(invalid="ignore"):
        along = vectors / np.linalg.norm(vectors, axis=-1, keepdims=True)
    cosine = np.einsum("ni,ni->n", along[1:], along[:-1])
    cosine = cosine[np.isfinite(cosine)]
    return bool(len(cosine)) and float(np.median(cosine)) < _NEW_POSE


def numbered_lines(table: Table) -> dict[str, str]:
    """Return the lines of a file without header that begins as `ros2 topic echo --csv` writes it, else none."""
    first = values(table, (0, 1)) if table.header.count > 2 else None
    if first is None or 2 not in table.header.words or stamp_unit(first[:, 0])[0] != "s":
        return {}
    lines = {"time": '{ columns = [0, 1], unit = ["s", "ns"] }   # columns are counted from 0'}
    if table.header.count == 9:
        lines["force"] = '{ columns = [3, 4, 5], unit = "N" }   # as a WrenchStamped of ROS 2'
        lines["torque"] = '{ columns = [6, 7, 8], unit = "N*m" }'
    return lines


def _time_line(table: Table, names: Names, stamps: Sequence[int]) -> str:
    if len(stamps) > 1:
        return line(table, stamps, 'unit = ["s", "ns"]')
    if told := names.said_unit(stamps[0]):
        return line(table, stamps, f'unit = "{told}"')
    found = values(table, stamps) if stamps[0] not in names.dates else None
    unit, step = stamp_unit(found[:, 0]) if found is not None else (None, 0.0)
    if unit is None and step > SLOWEST:
        unit = next(unit for unit, longest in (("ms", 1e3), ("us", 1e6), ("ns", float("inf"))) if step < longest)
    return line(table, stamps, f'unit = "{unit or "s"}"', "check the unit: s, ms, us or ns")


def _vector_line(table: Table, names: Names, quantity: str) -> str | None:
    """Return the line of a vector, with the other columns that may be meant; None where there is none."""
    several = names.vectors(quantity)
    found = names.vector(quantity) or next(iter(several), ())
    said = names.said_units(quantity, found)
    if not found or len(said) > 1:
        return None
    unit, remark = next(iter(UNITS[quantity])), ""
    if said and said[0] in UNITS[quantity]:
        unit = said[0]
    elif quantity == "position":
        unit = length_unit(values(table, found))
    if quantity == "position":
        remark = _OF_S
    elif found in several and len(several) > 1:
        remark = _or(table, several).lstrip()
    frame = ""
    if names.of_base(quantity, found):
        frame, remark = ', frame = "W"', f"if in the base's axes; else without frame{_or(table, several)}"
    return line(table, found, f'unit = "{unit}"{frame}', remark)


def _or(table: Table, several: Sequence[tuple[int, ...]]) -> str:
    return "".join(f" or {_columns(table, other)}" for other in several[1:])


def _open_lines(table: Table, names: Names) -> dict[str, str]:
    """Return lines of columns that turn the sensor in a form that they leave open, and of the position beside them."""
    for three, (form, unit) in ANGLES.items():
        if found := names.all_of(three, False):
            said = next((names.units[n] for n in found if names.units.get(n) in ANGLE), None)
            return {"rotation": _angle_line(table, found, form, said or angle_unit(values(table, found)) or unit)}
    four, scalar_first = open_quaternion(names)
    if four:
        return {"rotation": _quaternion_line(table, four, scalar_first)}
    if pose := open_pose(names):
        place, turn = pose[:3], pose[3:]
        unit = length_unit(values(table, place))
        angles = angle_unit(values(table, turn)) or "rad"
        return {
            "position": line(table, place, f'unit = "{unit}"', _OF_S),
            "rotation": _quaternion_line(table, turn, False)
            if len(turn) == 4
            else _angle_line(table, turn, "rotation-vector", angles),
        }
    return {}


def _quaternion_line(table: Table, columns: Sequence[int], scalar_first: bool) -> str:
    form, other = _ORDERS[::-1] if scalar_first else _ORDERS
    remark = f'S to W; or "{other}": the file does not tell which of the four is w'
    return line(table, columns, f'form = "{form}"', remark)


def _angle_line(table: Table, columns: Sequence[int], form: str, unit: str) -> str:
    """Return the line of three angles; in degrees no maker gives a rotation vector."""
    form, other = ("rpy", "rotation-vector") if unit == "deg" or form == "rpy" else ("rotation-vector", "rpy")
    remark = f'S to W; check both: the form may be "{other}", too'
    return line(table, columns, f'form = "{form}", unit = "{unit}"', remark)


def line(table: Table, columns: Sequence[int], rest: str, remark: str = "") -> str:
    """Return the line of a quantity: its columns by name, the rest, and what its user must know."""
    return f"{{ columns = {_columns(table, columns)}, {rest} }}{'   # ' if remark else ''}{remark}"


def _columns(table: Table, numbers: Sequence[int]) -> str:
    """Return the names of columns as a description lists them; an array that holds them all by its own name."""
    for name, group in table.header.groups.items():
        if group == tuple(numbers):
            return columns_text([name])
    shown = table.header.names or ()
    return columns_text([shown[n] for n in numbers])
