"""Columns by their usual names.

Names are compared without case, brackets and separators: `fx`, `Fx [N]`, `force_x`, `wrench.force.x` are one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from steelyard.io.streams.entries import QuantitySpec
from steelyard.io.table_header import Header
from steelyard.io.units import TIME, spelled

# Quantity -> stems of its three names, each followed by x, y, z. Position and velocities are in W or S as in
# descriptions; a linear velocity does not say its frame, and is not needed, so it is not read.
STEMS: dict[str, tuple[str, ...]] = {
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
ANGLES = {("roll", "pitch", "yaw"): ("rpy", "deg"), ("rx", "ry", "rz"): ("rotation-vector", "rad")}
_MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
_TIMES = ("t", "time", "timestamp", "stamp")
_SECONDS = ("secs", "seconds")  # the whole stamp, unless its nanoseconds stand beside it
_SPLIT = (("sec", "nanosec"), ("secs", "nsecs"))  # ROS; "header.stamp." may stand in front
_SEPARATOR = re.compile(r"[^a-z0-9]+")


@dataclass(frozen=True)
class Names:
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


def compared(name: str) -> str:
    """Return the name in the form in which names are compared."""
    return _SEPARATOR.sub("_", name.lower()).strip("_")


def array_names(header: Header) -> dict[str, int]:
    """Return names for the columns inside arrays: force -> force_x .., rotation (N, 3, 3) -> r11 .."""
    out: dict[str, int] = {}
    for name, group in header.groups.items():
        simple = compared(name).removesuffix("_sensor").removesuffix("_world")
        if len(group) == 3:
            out |= {f"{simple}_{axis}": n for axis, n in zip("xyz", group, strict=True)}
        if len(group) == 9 and simple.startswith("rotation"):
            out |= dict(zip(_MATRIX, group, strict=True))
    return out


def vector_named(names: Names, quantity: str) -> tuple[int, ...]:
    """Return the three columns of a vector, x first; nothing where there are none."""
    for stem in STEMS[quantity]:
        for joint in ("", "_"):
            found = names.all_of([f"{stem}{joint}{axis}" for axis in "xyz"] if stem else list("xyz"), len(stem) < 3)
            if found:
                return found
    return ()


def rotation_named(names: Names) -> QuantitySpec | None:
    """Return the columns that turn S into W, None where there are none."""
    for stem in _QUATERNION:
        for joint in ("", "_"):
            found = names.all_of([f"{stem}{joint}{part}" for part in "wxyz"], len(stem) < 3)
            if found:
                return QuantitySpec("rotation", found, "rad", "rotation", form="quaternion-wxyz")
    found = names.all_of(_MATRIX, True)
    return QuantitySpec("rotation", found, "rad", "rotation", form="matrix") if found else None


def time_columns(names: Names) -> Iterator[tuple[int, ...]]:
    """Yield the columns that may be the clock, the likeliest first: one, or seconds and nanoseconds.

    The only column of dates is the clock whatever its name, as the index of pandas, which has none.
    """
    yield from _whole_stamps(names, _TIMES)
    yield from (found for pair in _SPLIT if (found := names.all_of(pair, False)))
    yield from _whole_stamps(names, _SECONDS)
    if len(names.dates) == 1:
        yield names.dates


def _whole_stamps(names: Names, stems: Sequence[str]) -> Iterator[tuple[int, ...]]:
    for name in stems:
        for suffix in ("", *(f"_{unit}" for unit in TIME)):
            if name + suffix in names.plain:
                yield (names.plain[name + suffix],)


def said_units(names: Names, quantity: str, numbers: Sequence[int]) -> list[str]:
    """Return the units that stand over the columns of a vector, each once: a column without one has the others'."""
    return list(dict.fromkeys(spelled(quantity, names.units[n]) for n in numbers if n in names.units))


def said_unit(names: Names, number: int) -> str | None:
    """Return the unit of time that a name carries: t_ms, t [ms]."""
    name = next(key for key, n in names.plain.items() if n == number)
    return next((said for said in (names.units.get(number, ""), name.rpartition("_")[2]) if said in TIME), None)
