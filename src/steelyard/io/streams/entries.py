"""One [[stream]] of a description as checked values: which columns hold what, in which unit and frame."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.io.entries import Entry, gathered, listed
from steelyard.io.rotations import ANGULAR, FORMS, rotation_of
from steelyard.io.tables.files import Column
from steelyard.io.units import ANGLE, LENGTH, TIME, UNITS, instead, spelled
from steelyard.logs.recording import QUANTITIES, Mount
from steelyard.spatial import Rotation

FRAMED = ("force", "torque", "linear_velocity", "angular_velocity", "linear_acceleration", "angular_acceleration")

# [s] between clocks with different origins; [m] from S to anything that is fixed to it.
LONGEST_DELAY, _FURTHEST = 1e10, 10.0
_JOINT = ("joint_position", "joint_torque")
# What a robot of a team may tell beside QUANTITIES: the joints of an Omnid, and whether it holds the payload.
ROBOT: dict[str, int] = {"joint_position": 6, "joint_torque": 3, "carrying": 1}
MOUNTED = {"force", "torque", "specific_force"}  # what is read in the stream's own frame
STREAM = ("path", "topic", "frames", "kind", "time", "delay", "mount", *QUANTITIES)


@dataclass(frozen=True)
class QuantitySpec:
    """Which columns hold a quantity; `form` says how a rotation is written, `open_count` that any number will do."""

    name: str
    columns: tuple[Column, ...]
    unit: str
    where: str
    form: str | None = None
    frame: str = "S"
    open_count: bool = False

    @property
    def count(self) -> int | None:
        """How many columns the quantity has; None where its description does not know."""
        if self.open_count:
            return None
        return FORMS[self.form] if self.form else (QUANTITIES | ROBOT)[self.name]


@dataclass(frozen=True)
class TimeSpec:
    """One column of stamps with its unit, two with the larger unit first, or (none) a steady `rate` [Hz]."""

    columns: tuple[Column, ...]
    units: tuple[str, ...]
    rate: float
    where: str

    @property
    def unit(self) -> str:
        """The unit that the stamps count in: of two, the smaller."""
        return self.units[-1]


@dataclass(frozen=True)
class StreamSpec:
    """One stream as its description tells it; `delay` [s], `mount` in SI."""

    path: str
    quantities: tuple[QuantitySpec, ...]
    where: str
    time: TimeSpec | None = None
    poses: bool = False
    zero_torque: bool = False
    delay: float | None = None
    mount: Mount | None = None
    topic: str | None = None
    frames: tuple[str, str] | None = None
    names: frozenset[str] = field(init=False)

    def __post_init__(self) -> None:
        zero = {"torque"} if self.zero_torque else set()
        object.__setattr__(self, "names", frozenset(q.name for q in self.quantities) | zero)

    @property
    def source(self) -> tuple[object, ...]:
        """What its rows are read from: streams of one source have one table."""
        return self.path, self.topic, self.frames


def parse_stream(entry: Entry, robot: bool = False, arm: bool = True) -> StreamSpec:
    """Check one [[stream]] table, which in a team's `robot` may also hold what ROBOT names.

    arm  joints are those of an arm, of any number, and not an Omnid's

    Raises BadDescription with all that is wrong in it.
    """
    bare = entry
    entry.require("path", 'path = "log.csv"')
    path = str(entry.text("path"))
    entry = Entry(entry.values, f'{entry.where} ("{path}")')
    if not robot and "joint_torque" in entry:
        raise entry.error('"joint_torque" is of use for an Omnid of a team only. Leave it out: the sensor measures.')
    zero = entry.values.get("torque") == "zero"
    names = [name for name in (*QUANTITIES, *ROBOT) if name in entry and not (zero and name == "torque")]
    steps: dict[str, Callable[[Entry], Any]] = {
        "time": _time,
        **{name: partial(_quantity, name=name, arm=arm) for name in names},
        "kind": _kind,
        "delay": _delay,
        "mount": partial(_mount, names=set(names)),
        "frames": _frames,
    }
    given = {key: partial(step, entry) for key, step in steps.items() if key in entry}
    found = gathered({"keys": lambda: bare.only(*STREAM, *(ROBOT if robot else _JOINT)), **given})
    kind, time = found.get("kind"), found.get("time")
    if time is None and "topic" in entry and kind != "poses":
        # A topic whose stream names no clock has the stamps of its messages [ns].
        time = TimeSpec(("stamp",), ("ns",), 0.0, f"{entry.where}, time")
    if not names:
        raise entry.error('no quantity is given. Example: force = { columns = ["fx", "fy", "fz"], unit = "N" }')
    return StreamSpec(
        path,
        tuple(found[name] for name in names),
        entry.where,
        time,
        kind == "poses",
        zero,
        found.get("delay"),
        found.get("mount"),
        entry.text("topic"),
        found.get("frames"),
    )


def _kind(stream: Entry) -> str | None:
    kind = stream.text("kind")
    if kind not in (None, "poses"):
        raise stream.error(f'unknown kind "{kind}". Leave it out, or write kind = "poses" for a table of still poses.')
    if kind == "poses" and "time" in stream:
        raise stream.error('kind = "poses" is a table of still poses without time; leave out "time" or "kind".')
    return kind


def _frames(stream: Entry) -> tuple[str, str]:
    """Return the two frames of a topic of transforms, the second of which is meant as it lies in the first."""
    value = stream.values["frames"]
    if not isinstance(value, list) or len(value) != 2 or not all(isinstance(name, str) and name for name in value):
        raise stream.error(f'"frames" must name two frames, such as ["base_link", "tool0"]; got {value!r}.')
    if "topic" not in stream:
        raise stream.error('"frames" belongs to a topic of transforms: topic = "/tf".')
    return value[0].lstrip("/"), value[1].lstrip("/")


def _quantity(stream: Entry, name: str, arm: bool) -> QuantitySpec:
    entry = stream.table(name)
    if name == "rotation":
        return _rotation(entry)
    framed = name in FRAMED
    entry.only("columns", "unit", *(("frame",) if framed else ()))
    units = list(UNITS[name])
    said = entry.values.get("unit", units[0])
    if isinstance(said, str):
        unit = spelled(name, said)
        if unit not in units:
            raise entry.error(f'unknown unit "{said}".{instead(name, said)} Possible here: {listed(units)}.')
        entry = Entry({**entry.values, "unit": unit}, entry.where)
    unit = entry.choice("unit", units, units[0])
    frame = entry.choice("frame", ("S", "W"), "S") if framed else "W" if name == "position" else "S"
    of_arm = name == "joint_position" and arm
    columns = _columns(entry, None if of_arm else (QUANTITIES | ROBOT)[name])
    return QuantitySpec(name, columns, unit, entry.where, frame=frame, open_count=of_arm)


def _rotation(entry: Entry) -> QuantitySpec:
    entry.only("columns", "form", "unit")
    entry.require("columns", 'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }')
    entry.require("form", f'form = "matrix"; one of {", ".join(FORMS)}')
    form = entry.choice("form", list(FORMS), "")
    if form not in ANGULAR and "unit" in entry:
        raise entry.error(f'"unit" belongs to form = "rpy", "rotation-vector" and "zyz"; a {form} has none.')
    unit = entry.choice("unit", list(ANGLE), "rad")
    return QuantitySpec("rotation", _columns(entry, FORMS[form]), unit, entry.where, form=form)


def _columns(entry: Entry, count: int | None) -> tuple[Column, ...]:
    """Return `count` column names or numbers, any if None; one alone may name an array that holds all of them."""
    value = entry.require("columns", f"columns = [..] with {count or 'their'} names")
    good = isinstance(value, list) and all(isinstance(c, str | int) and not isinstance(c, bool) for c in value)
    if not good or any(isinstance(c, int) and c < 0 for c in value):
        raise entry.error(f'"columns" must be a list of names or of numbers from 0; got {value!r}.')
    if (count is not None and len(value) not in (1, count)) or not value:
        raise entry.error(f'"columns" must have {count} entries; got {len(value)}: {value!r}.')
    if len(set(value)) != len(value):
        raise entry.error(f'"columns" names a column twice: {value!r}.')
    return tuple(value)


def _time(stream: Entry) -> TimeSpec:
    entry = stream.table("time")
    if "rate" in entry:
        entry.only("rate", "unit")
        scale = {"Hz": 1.0, "kHz": 1e3}[entry.choice("unit", ("Hz", "kHz"), "Hz")]
        return TimeSpec((), ("s",), entry.positive("rate") * scale, entry.where)
    entry.only("columns", "unit", "rate")
    value = entry.require("columns", 'time = { columns = ["t"], unit = "s" }, or time = { rate = 1000, unit = "Hz" }')
    units = _time_units(entry)
    if isinstance(value, list) and len(value) not in (1, len(units)):
        raise entry.error(
            '"columns" must be one with one unit, or two with two units, such as unit = ["s", "ns"]; '
            f"got {len(value)} with {len(units)}: {value!r}."
        )
    return TimeSpec(_columns(entry, len(units)), units, 0.0, entry.where)


def _time_units(entry: Entry) -> tuple[str, ...]:
    """Return the unit of time, or two of them, the larger first."""
    value = entry.values.get("unit")
    if not isinstance(value, list):
        return (entry.choice("unit", list(TIME), "s"),)
    known = list(TIME)  # from the largest
    places = [known.index(unit) for unit in value if unit in known]
    if len(value) != 2 or len(places) != 2 or places[0] >= places[1]:
        raise entry.error(
            f'two columns of time take two units, the larger first, such as unit = ["s", "ns"]; got {value!r}. '
            f"Possible here: {listed(known)}."
        )
    return tuple(value)


def _delay(stream: Entry) -> float:
    entry = stream.table("delay")
    entry.only("value", "unit")
    value = entry.number("value") / TIME[entry.choice("unit", list(TIME), "s")]
    return entry.bounded("value", value, LONGEST_DELAY)


def _mount(stream: Entry, names: set[str]) -> Mount:
    entry = stream.table("mount")
    if not names & MOUNTED:
        raise entry.error(
            "of use beside force, torque or specific_force only; this stream has none of them. If its poses are those "
            "of another frame, call that frame S: then the mount of the wrench's stream is the sensor's pose in it."
        )
    rotation, position = parse_pose(entry)
    if rotation is None and position is None:
        raise entry.error('give "rotation", "position" or both.')
    return Mount(rotation, position)


def parse_pose(entry: Entry, *more: str) -> tuple[Rotation | None, Array | None]:
    """Return rotation and position [m] of a pose table, None where left out.

    `unit` is that of the position, `angle_unit` that of a rotation by angles. Raises BadDescription.
    """
    entry.only("rotation", "form", "angle_unit", "position", "unit", *more)
    _each_of_use(entry)
    position = None
    if "position" in entry:
        position = entry.numbers("position", 3) * LENGTH[entry.choice("unit", list(LENGTH), "m")]
        entry.bounded("position", float(np.abs(position).max()), _FURTHEST)
    return (_fixed_rotation(entry) if "rotation" in entry else None), position


def _each_of_use(entry: Entry) -> None:
    """Raise BadDescription where a pose table holds a form or a unit of what it does not give."""
    if "unit" in entry and "position" not in entry:
        raise entry.error('"unit" belongs to "position", which is left out; angles have "angle_unit".')
    if "form" in entry and "rotation" not in entry:
        raise entry.error('"form" belongs to "rotation", which is left out.')
    if "angle_unit" in entry and entry.values.get("form") not in ANGULAR:
        raise entry.error('"angle_unit" belongs to a rotation of form = "rpy", "rotation-vector" or "zyz".')


def _fixed_rotation(entry: Entry) -> Rotation:
    form = entry.choice("form", list(FORMS), "matrix")
    values = entry.numbers("rotation", FORMS[form])
    angle = ANGLE[entry.choice("angle_unit", list(ANGLE), "rad")]
    try:
        return rotation_of(values, form, angle, "angle_unit")
    except BadValue as error:
        raise entry.error(str(error)) from None
