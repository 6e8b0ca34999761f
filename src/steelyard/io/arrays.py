"""Arrays become a Recording: the names, forms and checks of a description, without a file."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike

from steelyard.check import Array, is_complex
from steelyard.errors import BadValue
from steelyard.io.entries import Entry, listed
from steelyard.io.log_files import recording_of
from steelyard.io.recordings.description import (
    ASSUMED,
    SIGNS,
    Description,
    default_gravity,
    measures_gravity,
    parse_gravity,
    parse_noise,
)
from steelyard.io.rotations import ANGULAR, FORMS, TURNS
from steelyard.io.streams.entries import FRAMED, LONGEST_DELAY, MOUNTED, QuantitySpec, StreamSpec, TimeSpec
from steelyard.io.tables.files import Columns, Header
from steelyard.io.units import UNITS
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, QUANTITIES, Mount, Recording
from steelyard.spatial import Pose, Rotation

_MATRICES = "4 x 4 matrices become one with sy.Pose.from_matrix(T)."

Given = np.ndarray[Any, np.dtype[Any]]

# The measured gravity has another name than that of the world, which is an argument of the whole recording.
_MEASURED_GRAVITY = "gravity_sensor"
_KEYS = {_MEASURED_GRAVITY if name == "gravity" else name: name for name in QUANTITIES}
_CALL = 'sy.recording(time=t, force=f, torque=m, rotation=R, wrench="on-sensor", gravity=[0, 0, -9.81])'


class Arrays(TypedDict, total=False):
    """What one clock measured: arrays or lists with one row per sample, SI units; each may be left out.

    time       (N,) [s] or datetime64; or `rate` [Hz] without stamps; or poses=True for a table of still poses
    force, torque    (N, 3) [N], [N m]; torque="zero" declares a wrist that passes no moment
    rotation   of S in W: a Rotation, SciPy's, matrices (N, 3, 3) or (N, 9); or (N, 4) and (N, 3) with their `form`:
               "quaternion-wxyz", "quaternion-xyzw", "rpy", "rotation-vector", "zyz" [rad]
    position   (N, 3) [m] of the S origin in W
    linear_velocity, angular_velocity, linear_acceleration, angular_acceleration    (N, 3) [m, rad, s], classical,
               of the S origin, gravity not included
    specific_force   (N, 3) [m/s^2] of an accelerometer, a - g, in its own frame
    gravity_sensor   (N, 3) [m/s^2] gravity in S
    frame      "S" (default) or "W", the axes of force, torque, velocities and accelerations; or a dict of some of them
    delay      [s] by which the stamps are late; estimated where left out
    mount      pose of the stream's own frame in S: a Pose, or a Rotation where the place is not known
    """

    time: ArrayLike
    rate: float
    poses: bool
    force: ArrayLike
    torque: ArrayLike
    rotation: ArrayLike | Rotation
    form: str
    position: ArrayLike
    linear_velocity: ArrayLike
    angular_velocity: ArrayLike
    linear_acceleration: ArrayLike
    angular_acceleration: ArrayLike
    specific_force: ArrayLike
    gravity_sensor: ArrayLike
    frame: str | Mapping[str, str]
    delay: float
    mount: Pose | Rotation


class StreamArrays(Arrays, total=False):
    """What one of several clocks measured, and the `name` of the stream in messages and `delays_s`."""

    name: str


@dataclass(frozen=True, eq=False)
class _Rows:
    """Arrays as the table that readers expect: columns by number."""

    path: Path
    cells: Columns

    @property
    def header(self) -> Header:
        return Header(None, len(self.cells))

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        return {n: self.cells[n] for n in columns}


def recording(
    *streams: StreamArrays,
    gravity: ArrayLike | None = None,
    wrench: str = "on-object",
    noise: Mapping[str, float] | None = None,
    name: str = "recording",
    **arrays: Unpack[Arrays],
) -> Recording:
    """Return a log given as arrays, checked as files are: `sy.identify(sy.recording(time=.., force=.., ..))`.

    streams  one dict per clock, where there are several; names as below
    gravity  (3,) [m/s^2] in W; the standard one along -z to 0.15 % where it is left out
    wrench   "on-object" = what the robot applies to the object; "on-sensor" = the reaction that most sensors report
    noise    standard deviations, force [N], torque [N m], acceleration [m/s^2], angular_acceleration [rad/s^2];
             estimated where left out
    arrays   with one clock: time, rate or poses; force, torque, rotation (with form), position, linear_velocity,
             angular_velocity, linear_acceleration, angular_acceleration, specific_force, gravity_sensor; frame, delay,
             mount: see `Arrays`

    A row that misses a number (NaN) is left out with the finding `rows-missing`. Raises BadInput: what was expected,
    what was found, and what to do.
    """
    if bool(streams) == bool(arrays):
        raise BadValue(f"{name}: give the arrays of one clock by name, or one dict per clock. Example: {_CALL}")
    made = [_stream(_entry(each, f"{name}, stream {n}"), f"stream {n}") for n, each in enumerate(streams, 1)]
    made = made or [_stream(_entry(arrays, name), name)]
    specs = tuple(spec for spec, _ in made)
    tables = [_Rows(Path(spec.path), cells) for spec, cells in made]
    return recording_of(_description(specs, gravity, wrench, noise, name), tables, [t.cells for t in tables], name)


def _description(
    specs: tuple[StreamSpec, ...], gravity: ArrayLike | None, wrench: str, noise: Mapping[str, float] | None, name: str
) -> Description:
    """Return what a file would say beside its columns; raises BadInput."""
    if not isinstance(wrench, str) or wrench not in SIGNS:
        got = repr(wrench) if isinstance(wrench, str) else f"{type(wrench).__name__} (numbers are force= and torque=)"
        raise BadValue(f'{name}: wrench must be "on-object" or "on-sensor"; got {got}.')
    if noise is not None and not isinstance(noise, Mapping):
        raise BadValue(f'{name}: noise must be a dict, such as {{"force": 0.05}}; got {noise!r}.')
    told = gravity is not None or measures_gravity(specs)
    return Description(
        specs,
        default_gravity() if gravity is None else _gravity(gravity, name),
        SIGNS[wrench],
        parse_noise(Entry({key: _plain(value) for key, value in (noise or {}).items()}, f"{name}, noise")),
        notes=() if told else (f"no gravity was given: {ASSUMED} along -z of W, a level base, was assumed",),
        gravity_std=0.0 if told else ASSUMED_GRAVITY_STD,
    )


def _gravity(given: ArrayLike, name: str) -> Array:
    """Return gravity in W (3,); raises BadInput."""
    shape = np.shape(_array(given, f"{name}, gravity"))
    if shape != (3,):
        raise BadValue(
            f"{name}, gravity: expected one vector (3,) [m/s^2] in the world frame W, such as [0, 0, -9.81]; found "
            f"shape {shape}. What was measured in the sensor frame, row by row, is gravity_sensor."
        )
    return parse_gravity(Entry({"gravity": np.asarray(given, np.float64).tolist()}, name))


def _plain(value: Any) -> Any:
    """Return a number of NumPy as one of Python."""
    return value.item() if isinstance(value, np.generic) else value


def _entry(given: Any, where: str) -> Entry:
    """Return the arrays of one clock, without those that are None; raises BadInput."""
    if not isinstance(given, Mapping):
        raise BadValue(
            f"{where}: expected a dict of arrays such as dict(time=t, force=f, torque=m); got {type(given).__name__}."
        )
    entry = Entry({key: _plain(value) for key, value in given.items() if value is not None}, where)
    entry.only(*Arrays.__annotations__, "name")
    return entry


def _stream(entry: Entry, name: str) -> tuple[StreamSpec, Columns]:
    """Return one stream as a description would tell it, and its columns; raises BadInput."""
    where, cells = entry.where, list[Given]()
    torque = entry.values.get("torque")
    zero = isinstance(torque, str) and torque == "zero"
    given = [key for key in _KEYS if key in entry and not (zero and key == "torque")]
    if not given:
        raise entry.error(f"no quantity is given, so there are no data. Example: {_CALL}")
    frames = _frames(entry, given)
    quantities = []
    for key in given:
        columns, form = _columns(entry, key)
        numbers = tuple(range(len(cells), len(cells) + len(columns)))
        unit, frame = next(iter(UNITS.get(_KEYS[key], {"rad": 1})), "rad"), frames.get(key, "S")
        quantities.append(QuantitySpec(_KEYS[key], numbers, unit, f"{where}, {key}", form, frame))
        cells += columns
    poses = entry.flag("poses")
    time = _time(entry, poses, cells)
    called = entry.text("name") or name
    delay = entry.bounded("delay", entry.number("delay"), LONGEST_DELAY) if "delay" in entry else None
    mount = _mount(entry, given) if "mount" in entry else None
    return StreamSpec(called, tuple(quantities), where, time, poses, zero, delay, mount), dict(enumerate(cells))


def _time(entry: Entry, poses: bool, cells: list[Given]) -> TimeSpec | None:
    """Return the clock, its stamps added to the columns; None where there is none."""
    given = [key for key in ("time", "rate") if key in entry] + ["poses"] * poses
    if len(given) > 1:
        raise entry.error(f"{' and '.join(given)} are given; a stream has one of time, rate and poses=True.")
    if "rate" in entry:
        return TimeSpec((), ("s",), entry.positive("rate"), f"{entry.where}, rate")
    if "time" not in entry:
        return None
    where = f"{entry.where}, time"
    stamps = entry.values["time"]
    stamps = _array(stamps, where) if isinstance(stamps, np.ma.MaskedArray) else np.asarray(stamps)
    if stamps.dtype.kind in "mM":  # durations are as good as dates
        stamps = stamps.astype(f"{stamps.dtype.kind}8[ns]").astype("M8[ns]")
    elif stamps.dtype.kind not in "iu":
        stamps = _array(stamps, where)
    if stamps.ndim != 1:
        raise BadValue(f"{where}: expected one stamp per row, shape (N,) [s]; found shape {stamps.shape}.")
    cells.append(stamps)
    return TimeSpec((len(cells) - 1,), ("s",), 0.0, where)


def _columns(entry: Entry, key: str) -> tuple[list[Given], str | None]:
    """Return the columns of a quantity, each (N,), and the form of a rotation; raises BadInput."""
    where = f"{entry.where}, {key}"
    if key == "rotation":
        values, form = _rotation(entry.values[key], entry.text("form"), where)
        return list(values.T), form
    values = _array(entry.values[key], where)
    if values.ndim != 2 or values.shape[1] != 3:
        turned = " Transpose it (.T)." if values.ndim == 2 and values.shape[0] == 3 else ""
        raise BadValue(f"{where}: expected one row per sample, shape (N, 3); found shape {values.shape}.{turned}")
    return list(values.T), None


def _rotation(given: Any, form: str | None, where: str) -> tuple[Array, str]:
    """Return rotations of S in W as rows of numbers, with their form; raises BadInput."""
    one_each = isinstance(given, Rotation) or hasattr(given, "as_matrix")  # SciPy's
    if one_each:
        given = given.matrix if isinstance(given, Rotation) else given.as_matrix()
    values = _array(given, where)
    if one_each and values.ndim != 3:
        raise BadValue(f"{where}: expected one rotation per row, batch (N,); found batch {values.shape[:-2]}.")
    if values.ndim == 3 and values.shape[1:] == (3, 3):
        values = values.reshape(-1, 9)
    count = values.shape[1] if values.ndim == 2 else 0
    form = "matrix" if form is None and count == FORMS["matrix"] else form
    possible = [name for name, numbers in FORMS.items() if numbers == count]
    if not possible:
        raise BadValue(
            f"{where}: expected a Rotation, matrices (N, 3, 3) or (N, 9), quaternions (N, 4) or angles (N, 3), one per "
            f"row; found shape {np.shape(given)}.{_turned_pose(given)}"
        )
    if form not in possible:
        said = f'form="{form}" does not fit' if form else "does not say what the numbers are"
        forms = " or ".join(f'"{name}"' for name in possible)
        raise BadValue(f"{where}: shape {np.shape(given)} {said}. Say form={forms}; it turns S into W.")
    if form in ANGULAR and float(np.nanmax(np.abs(values), initial=0.0)) > TURNS:
        raise BadValue(
            f"{where}: angles are in rad, and these reach {np.nanmax(np.abs(values)):.4g}, which looks like degrees. "
            "Give np.radians(..) of them."
        )
    return values, form


def _turned_pose(given: Any) -> str:
    """Return what to do with 4 x 4 matrices, which are poses."""
    shape = np.shape(given)
    return " Of poses T give rotation=T[:, :3, :3], position=T[:, :3, 3]." if shape[-2:] == (4, 4) else ""


def _frames(entry: Entry, given: Sequence[str]) -> dict[str, str]:
    """Return in which axes quantities are given; raises BadInput."""
    framed = [key for key in given if key in FRAMED]
    said = entry.values.get("frame", "S")
    frames = dict(said) if isinstance(said, Mapping) else dict.fromkeys(framed, said)
    for key, frame in frames.items() if isinstance(said, Mapping) else [(None, said)]:
        if key is not None and key not in framed:
            raise entry.error(f"frame is of {listed(framed) or 'nothing'} here; got {key!r}.")
        if frame not in ("S", "W"):
            wanted = '"S" (axes of the sensor) or "W" (of the world, the base)'
            raise BadValue(f"{entry.where}, frame: expected {wanted}; got {frame!r}.")
    return frames | ({"position": "W"} if "position" in given else {})


def _mount(entry: Entry, given: Sequence[str]) -> Mount:
    """Return the pose of the stream's own frame; raises BadInput."""
    mount = entry.values["mount"]
    if not MOUNTED & set(given):
        raise entry.error("mount is of use beside force, torque or specific_force only; here is none of them.")
    rotation = mount.rotation if isinstance(mount, Pose) else mount
    if not isinstance(rotation, Rotation) or rotation.batch:
        raise entry.error(f"mount must be one sy.Pose, or one sy.Rotation; got {type(mount).__name__}. {_MATRICES}")
    return Mount(rotation, mount.position if isinstance(mount, Pose) else None)


def _array(given: Any, where: str) -> Array:
    """Return numbers as float64, NaN where they are masked; raises BadValue."""
    if is_complex(given):
        raise BadValue(f"{where}: expected real numbers, one row per sample; these are complex.")
    try:
        if isinstance(given, np.ma.MaskedArray):
            given = np.ma.filled(given.astype(np.float64), np.nan)
        return np.asarray(given, dtype=np.float64)
    except (TypeError, ValueError) as error:
        kind = type(given).__name__
        raise BadValue(f"{where}: expected numbers, one row per sample; got {kind} ({error}).") from None
