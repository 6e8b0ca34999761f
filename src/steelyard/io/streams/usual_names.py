"""Columns by their usual names, or by those that the controllers of common arms write.

Names are compared without case, brackets and separators: `fx`, `Fx [N]`, `force_x`, `wrench.force.x` are one.

The names of controllers alone do not say what a log needs (axes, point, form of a turn), so that a file with them is
not read without a description; the example of one can say it, for its user to check.
Source: the makers' interfaces: UR's RTDE, libfranka's RobotState and log, Kinova's Kortex, KUKA's RSI and the recorder
of its Sunrise, UFACTORY's report, FANUC's W, P, R.
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
# Words of a name that say that a wrench may have the axes of W.
_OF_BASE = {"base", "world"}
_SEPARATOR = re.compile(r"[^a-z0-9]+")

_XYZ = ("x", "y", "z")
_CBA = ("c", "b", "a")


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

    def vector(self, quantity: str) -> tuple[int, ...]:
        """Return the three columns of a vector, x first; nothing where there are none.

        A wrench by the name of a base is left out: only a description can say whether its axes are those of W.
        """
        found = next((found for three in _three(quantity) if (found := self.all_of(three, _alone(three)))), ())
        return () if self.of_base(quantity, found) else found

    def of_base(self, quantity: str, numbers: Sequence[int]) -> bool:
        """Whether the columns of a force or a torque are called after a base or the world."""
        called = (name for name, number in self.plain.items() if number in numbers)
        return quantity in ("force", "torque") and any(_OF_BASE & set(name.split("_")) for name in called)

    def vectors(self, quantity: str) -> list[tuple[int, ...]]:
        """Return the columns of each vector that may be meant, where several prefixes have one."""
        return next((found for three in _three(quantity) if not _alone(three) and (found := self.behind(three))), [])

    def rotation(self) -> QuantitySpec | None:
        """Return the columns that turn S into W, None where there are none."""
        for parts, form, alone in _rotations():
            if found := self.all_of(parts, alone):
                return QuantitySpec("rotation", found, "rad", "rotation", form=form)
        return None

    def rotations(self) -> tuple[str, list[tuple[int, ...]]]:
        """Return the form and the columns of each rotation that may be meant, where several prefixes have one."""
        every = ((form, self.behind(parts)) for parts, form, alone in _rotations() if not alone)
        return next(((form, found) for form, found in every if found), ("", []))

    def time_columns(self) -> Iterator[tuple[int, ...]]:
        """Yield the columns that may be the clock, the likeliest first: one, or seconds and nanoseconds.

        The only column of dates, or with a unit of time, is the clock whatever its name: the index of pandas has none.
        """
        yield from self._whole_stamps(_TIMES, True)
        yield from (found for pair in _SPLIT if (found := self.all_of(pair, False)))
        yield from self._whole_stamps(_SECONDS, True)
        if len(self.dates) == 1:
            yield self.dates
        if timed := self.clock_by_unit():
            yield timed
        yield from self._whole_stamps(_TIMES[1:], False)

    def clock_by_unit(self) -> tuple[int, ...]:
        """Return the only column with a unit of time; nothing without. It may be a duration, too, unless it rises."""
        timed = tuple(number for number, unit in self.units.items() if unit in TIME)
        return timed if len(timed) == 1 else ()

    def _whole_stamps(self, stems: Sequence[str], alone: bool) -> Iterator[tuple[int, ...]]:
        for name in stems:
            for suffix in ("", *(f"_{unit}" for unit in TIME)):
                found = self.all_of([name + suffix], alone)
                if found and found[0] not in self.words:
                    yield found

    def said_units(self, quantity: str, numbers: Sequence[int]) -> list[str]:
        """Return the units that stand over the columns of a vector, each once: a column without one has the others'."""
        return list(dict.fromkeys(spelled(quantity, self.units[n]) for n in numbers if n in self.units))

    def said_unit(self, number: int) -> str | None:
        """Return the unit of time that a name carries: t_ms, t [ms]."""
        name = next((key for key, n in self.plain.items() if n == number), "")
        return next((said for said in (self.units.get(number, ""), name.rpartition("_")[2]) if said in TIME), None)

    def of_controllers(self) -> Iterator[tuple[str, tuple[int, ...], str, str]]:
        """Yield quantity, column numbers, rest of the line and remark of each that is there, also behind one prefix.

        A remark may have a second line, which is a comment of its own.
        """
        told = set()
        for quantity, wanted, rest, remark in _KNOWN:
            columns = () if quantity in told else self.all_of(wanted, short(wanted))
            if columns:
                told.add(quantity)
                yield quantity, columns, rest, remark


def matrix_parts(name: str) -> list[str]:
    """Return what the nine parts of a matrix are called, row by row."""
    return [f"{name}_{part}" for part in _MATRIX]


def compared(name: str) -> str:
    """Return the name in the form in which names are compared."""
    return _SEPARATOR.sub("_", name.lower()).strip("_")


def short(names: Sequence[str]) -> bool:
    """Whether names are too short to mean the same behind any prefix."""
    return len(names[0]) < 3


def _three(quantity: str) -> Iterator[list[str]]:
    for stem in STEMS[quantity]:
        for joint in ("", "_"):
            yield [f"{stem}{joint}{axis}" for axis in "xyz"] if stem else list("xyz")


def _alone(three: Sequence[str]) -> bool:
    """Whether the stem of three names is too short to stand behind a prefix."""
    return len(three[0].removesuffix("x").strip("_")) < 3


def _rotations() -> Iterator[tuple[Sequence[str], str, bool]]:
    """Yield the names of parts of rotations, their form, and whether they are too short to stand behind a prefix."""
    for stem in _QUATERNION:
        for joint in ("", "_"):
            yield [f"{stem}{joint}{part}" for part in "wxyz"], "quaternion-wxyz", len(stem) < 3
    yield _MATRIX, "matrix", False


def _numbered(name: str, *numbers: int) -> tuple[str, ...]:
    return tuple(f"{name}_{number}" for number in numbers)


def _lettered(name: str, letters: tuple[str, ...] = _XYZ) -> tuple[str, ...]:
    return tuple(f"{name}_{letter}" for letter in letters)


def _wrench(name: str, force: str, torque: str, axes: str = "") -> tuple[tuple[str, tuple[str, ...], str, str], ...]:
    """Return what is known of six columns that are a force, then a torque, and what their user must know of each."""
    return (
        ("force", _numbered(name, 0, 1, 2), f'unit = "N"{axes}', force),
        ("torque", _numbered(name, 3, 4, 5), f'unit = "N*m"{axes}', torque),
    )


# Lines of their own: what must be set in the controller before a run, which no name of a column shows.
_PAYLOAD = "\n# the payload that is set in the controller is taken away from this wrench: set none before the run"
_TCP = "\n# the TCP that is set in the controller must be S"

_BASE = "in the base's axes, as {} gives it"
_HAND = "of {} in W; S must be there"

_TURNS = "KUKA turns by A about z first; Doosan and Kawasaki about z, y, z: a, b, c in form zyz; S to W"

# Quantity, names as they are simplified, the rest of its line, what its user must know. Franka's O_T_EE needs no line:
# a 4 x 4 matrix shows itself how it is written.
_KNOWN = (
    *_wrench("actual_tcp_force", _BASE.format("UR") + _PAYLOAD, _BASE.format("UR"), ', frame = "W"'),
    (
        "position",
        _numbered("actual_tcp_pose", 0, 1, 2),
        'unit = "m"',
        f"of the TCP in W{_TCP}: the flange (TCP all zero) on an e-Series",
    ),
    ("rotation", _numbered("actual_tcp_pose", 3, 4, 5), 'form = "rotation-vector", unit = "rad"', "S to W"),
    *_wrench(
        "o_f_ext_hat_k",
        _BASE.format("Franka") + _PAYLOAD,
        _BASE.format("Franka") + ", about K, which is EE unless it was set",
        ', frame = "W"',
    ),
    *_wrench("k_f_ext_hat_k", "of K; S must be there" + _PAYLOAD, "of K; S must be there"),
    ("time", ("duration",), 'unit = "ms"', "as libfranka logs it; check the unit"),
    (
        "force",
        _lettered("tool_external_wrench_force"),
        'unit = "N", frame = "W"',
        "estimated by Kinova; try both frames" + _PAYLOAD,
    ),
    ("torque", _lettered("tool_external_wrench_torque"), 'unit = "N*m", frame = "W"', "as the force"),
    ("position", _lettered("tool_pose"), 'unit = "m"', _HAND.format("the tool")),
    ("rotation", _lettered("tool_pose_theta"), 'form = "rpy", unit = "deg"', "S to W"),
    *_wrench("ft_raw_force", "of UFACTORY's sensor, without its compensation", "as the force"),
    *_wrench("ft_ext_force", "UFACTORY takes the payload away; log ft_raw_force", "as the force"),
    ("time", ("ipoc",), 'unit = "ms"', "as KUKA's RSI counts it"),
    ("position", _lettered("rist"), 'unit = "mm"', f"of the TCP in W{_TCP}"),
    ("rotation", _lettered("rist", _CBA), 'form = "rpy", unit = "deg"', "S to W"),
    (
        "force",
        _lettered("cartforce1"),
        'unit = "N"',
        "estimated by KUKA, in the frame that the recorder was given" + _PAYLOAD,
    ),
    ("torque", ("carttorque1_taux", "carttorque1_tauy", "carttorque1_tauz"), 'unit = "N*m"', "as the force"),
    ("position", _lettered("cartposmsr1"), 'unit = "mm"', _HAND.format("the recorder's frame")),
    ("rotation", _lettered("cartposmsr1", _CBA), 'form = "rpy", unit = "rad"', "S to W"),
    ("rotation", _CBA, 'form = "rpy", unit = "deg"', _TURNS),
    ("rotation", ("w", "p", "r"), 'form = "rpy", unit = "deg"', "as FANUC turns; S to W"),
)
