"""Columns by their usual names.

Names are compared without case, brackets and separators: `fx`, `Fx [N]`, `force_x`, `wrench.force.x` are one.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

from steelyard.io.streams.entries import QuantitySpec
from steelyard.io.units import TIME, spelled

# Quantity -> stems of its three names, each followed by x, y, z. Position and velocities are in W or S as in
# descriptions; a linear velocity does not say its frame, and is not needed, so it is not read.
STEMS: dict[str, tuple[str, ...]] = {
    "force": ("f", "force", "forces", "ft_f", "wrench_f", "kraft"),
    "torque": ("t", "torque", "tau", "moment", "m", "torques", "ft_t", "ft_m", "wrench_t", "wrench_m", "drehmoment"),
    "specific_force": ("a", "acc", "accel", "acceleration", "specific_force", "linear_acceleration"),
    "gravity": ("g", "gravity"),
    "position": ("", "p", "pos", "position", "translation", "positions", "tcp"),
    "angular_velocity": ("w", "omega", "angular_velocity"),
    "angular_acceleration": ("alpha", "angular_acceleration"),
}
_QUATERNION = ("q", "quat", "quaternion", "orientation", "rotation", "ori")
# Angles leave open in which order they turn and whether they are degrees. Names -> the form and unit that are usual.
ANGLES = {("roll", "pitch", "yaw"): ("rpy", "deg"), ("rx", "ry", "rz"): ("rotation-vector", "rad")}
_MATRIX = tuple(f"r{i}{j}" for i in "123" for j in "123")
_TIMES = ("t", "time", "timestamp", "stamp", "times", "timestamps", "sample_times", "zeit")
_SECONDS = ("secs", "seconds")  # the whole stamp, unless its nanoseconds stand beside it
# ROS ("header.stamp." may stand in front), KUKA's Sunrise
_SPLIT = (("sec", "nanosec"), ("secs", "nsecs"), ("zeitinsec", "zeitinnanosec"))
# Words of a name that say what was wanted, not what was measured.
WANTED = {"desired", "target", "goal", "cmd", "command", "commanded", "ref", "reference", "setpoint"}
_SEPARATOR = re.compile(r"[^a-z0-9]+")


@dataclass(frozen=True)
class Names:
    """Columns by what they are called.

    plain   simplified name -> number
    units   number -> the unit that stands in its name
    dates   numbers of the columns that hold dates, `words` of those that hold neither dates nor numbers
    counted name -> numbers of the columns that are counted behind it from 0, as those of an array are
    """

    plain: dict[str, int]
    units: dict[int, str]
    dates: tuple[int, ...] = ()
    words: tuple[int, ...] = ()
    counted: dict[str, tuple[int, ...]] = field(default_factory=dict)

    def all_of(self, names: Sequence[str], alone: bool) -> tuple[int, ...]:
        """Return the columns called `names`, or, unless `alone`, all of them behind the only prefix that has them."""
        if all(name in self.plain for name in names):
            return tuple(self.plain[name] for name in names)
        found = [] if alone else self.behind(names)
        return found[0] if len(found) == 1 else ()

    def behind(self, names: Sequence[str]) -> list[tuple[int, ...]]:
        """Return the columns of all `names` behind each prefix that has them all, of a measurement if there is one."""
        prefixes = [key.removesuffix(names[0]) for key in self.plain if key.endswith(f"_{names[0]}")]
        found = [each for each in prefixes if all(each + name in self.plain for name in names)]
        measured = [each for each in found if not WANTED & set(each.split("_"))]
        return [tuple(self.plain[each + name] for name in names) for each in measured or found]


def matrix_parts(name: str) -> list[str]:
    """Return what the nine parts of a matrix are called, row by row."""
    return [f"{name}_{part}" for part in _MATRIX]


def compared(name: str) -> str:
    """Return the name in the form in which names are compared."""
    return _SEPARATOR.sub("_", name.lower()).strip("_")


def short(names: Sequence[str]) -> bool:
    """Whether names are too short to mean the same behind any prefix."""
    return len(names[0]) < 3


def vector_named(names: Names, quantity: str) -> tuple[int, ...]:
    """Return the three columns of a vector, x first; nothing where there are none."""
    return next((found for three in _three(quantity) if (found := names.all_of(three, _alone(three)))), ())


def vectors_named(names: Names, quantity: str) -> list[tuple[int, ...]]:
    """Return the columns of each vector that may be meant, where several prefixes have one."""
    return next((found for three in _three(quantity) if not _alone(three) and (found := names.behind(three))), [])


def _three(quantity: str) -> Iterator[list[str]]:
    for stem in STEMS[quantity]:
        for joint in ("", "_"):
            yield [f"{stem}{joint}{axis}" for axis in "xyz"] if stem else list("xyz")


def _alone(three: Sequence[str]) -> bool:
    """Whether the stem of three names is too short to stand behind a prefix."""
    return len(three[0].removesuffix("x").strip("_")) < 3


def rotation_named(names: Names) -> QuantitySpec | None:
    """Return the columns that turn S into W, None where there are none."""
    for parts, form, alone in _rotations():
        if found := names.all_of(parts, alone):
            return QuantitySpec("rotation", found, "rad", "rotation", form=form)
    return None


def rotations_named(names: Names) -> tuple[str, list[tuple[int, ...]]]:
    """Return the form and the columns of each rotation that may be meant, where several prefixes have one."""
    every = ((form, names.behind(parts)) for parts, form, alone in _rotations() if not alone)
    return next(((form, found) for form, found in every if found), ("", []))


def _rotations() -> Iterator[tuple[Sequence[str], str, bool]]:
    """Yield the names of parts of rotations, their form, and whether they are too short to stand behind a prefix."""
    for stem in _QUATERNION:
        for joint in ("", "_"):
            yield [f"{stem}{joint}{part}" for part in "wxyz"], "quaternion-wxyz", len(stem) < 3
    yield _MATRIX, "matrix", False


def time_columns(names: Names) -> Iterator[tuple[int, ...]]:
    """Yield the columns that may be the clock, the likeliest first: one, or seconds and nanoseconds.

    The only column of dates, or with a unit of time, is the clock whatever its name: the index of pandas has none.
    """
    yield from _whole_stamps(names, _TIMES, True)
    yield from (found for pair in _SPLIT if (found := names.all_of(pair, False)))
    yield from _whole_stamps(names, _SECONDS, True)
    if len(names.dates) == 1:
        yield names.dates
    if timed := clock_by_unit(names):
        yield timed
    yield from _whole_stamps(names, _TIMES[1:], False)


def clock_by_unit(names: Names) -> tuple[int, ...]:
    """Return the only column with a unit of time; nothing without. It may be a duration, too, unless it rises."""
    timed = tuple(number for number, unit in names.units.items() if unit in TIME)
    return timed if len(timed) == 1 else ()


def _whole_stamps(names: Names, stems: Sequence[str], alone: bool) -> Iterator[tuple[int, ...]]:
    for name in stems:
        for suffix in ("", *(f"_{unit}" for unit in TIME)):
            found = names.all_of([name + suffix], alone)
            if found and found[0] not in names.words:
                yield found


def said_units(names: Names, quantity: str, numbers: Sequence[int]) -> list[str]:
    """Return the units that stand over the columns of a vector, each once: a column without one has the others'."""
    return list(dict.fromkeys(spelled(quantity, names.units[n]) for n in numbers if n in names.units))


def said_unit(names: Names, number: int) -> str | None:
    """Return the unit of time that a name carries: t_ms, t [ms]."""
    name = next(key for key, n in names.plain.items() if n == number)
    return next((said for said in (names.units.get(number, ""), name.rpartition("_")[2]) if said in TIME), None)
