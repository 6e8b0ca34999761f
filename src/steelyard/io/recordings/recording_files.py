"""A Recording written as CSV files with their description: what a user's own log would look like."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, BadValue
from steelyard.io.example import columns_text, toml_string
from steelyard.io.recordings.description import NOISE, SIGNS, Description, default_gravity
from steelyard.io.streams.entries import FRAMED
from steelyard.io.tables.files import TEXT
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, Recording, Stream
from steelyard.spatial import Pose, Rotation
from steelyard.whole_files import whole_folder, write_text

_DESCRIPTION = "log.toml"
_COLUMNS = {
    "force": (("fx", "fy", "fz"), 'unit = "N"'),
    "torque": (("tx", "ty", "tz"), 'unit = "N*m"'),
    "rotation": (("qw", "qx", "qy", "qz"), 'form = "quaternion-wxyz"'),
    "position": (("x", "y", "z"), 'unit = "m"'),
    "specific_force": (("ax", "ay", "az"), 'unit = "m/s^2"'),
}


def write_recording(recording: Recording, folder: Path) -> Path:
    """Write every stream as CSV and the description as log.toml into `folder`; return the description's path.

    All of it or nothing is written; other files in the folder stay. Findings, notes and the name of the recording are
    not part of a description. Raises BadFile where the folder cannot be written or a stream holds a quantity that this
    writer does not know; BadValue where the name of a stream leads elsewhere, is that of another or of no text table,
    and where a description has no words for what is recorded.
    """
    _require_own_places([stream.name for stream in recording.streams])
    text = [_log(recording), *_noise(recording.noise)]
    if recording.object_pose is not None:
        text.append(object_table(recording.object_pose, recording.object_pose_std))
    text += [_described(stream) for stream in recording.streams]
    with whole_folder(folder) as new:
        for stream in recording.streams:
            path = new / stream.name
            path.parent.mkdir(parents=True, exist_ok=True)
            write_text(path, _csv(stream))
        write_text(new / _DESCRIPTION, "\n".join(text))
    return folder / _DESCRIPTION


def _require_own_places(names: Sequence[str]) -> None:
    """Raise BadValue where a name leads out of the folder, or two streams would be one file."""
    places: dict[PurePosixPath, str] = {}
    for name in names:
        _require_inside(name)
        place = PurePosixPath(name)
        if place in places:
            raise BadValue(
                f"streams {places[place]!r} and {name!r} would be one file: give every stream a name of its own."
            )
        places[place] = name


def _require_inside(name: str) -> None:
    """Raise BadValue where a stream's name, as a path of any system, is none of a table inside the folder."""
    for path in (PurePosixPath(name), PureWindowsPath(name)):
        if path.anchor or not path.parts or ".." in path.parts or str(path) == _DESCRIPTION or "\0" in name:
            raise BadValue(
                f"stream {name!r} cannot be written: its name must be a path inside the folder, such as wrench.csv, "
                f"and not {_DESCRIPTION}."
            )
    if PurePosixPath(name).suffix.lower() not in TEXT:
        raise BadValue(
            f"stream {name!r} cannot be written: its table is a text, so its name must end in {', '.join(TEXT)}."
        )


def _log(recording: Recording) -> str:
    """Return the [log] table; the file of the tool stays where it is. Raises BadValue for dead channels."""
    if any(recording.dead):
        raise BadValue(
            "a description has no words for channels of the wrench that do not measure: "
            "write the recording as it was read, before its dead channels were found."
        )
    lines = ["[log]", *_gravity(recording)]
    # Where nothing said the sign that a description without it has, too, it is left out.
    if recording.sign_said or recording.wrench_sign != Description.wrench_sign:
        lines.append(f'wrench  = "{next(word for word, sign in SIGNS.items() if sign == recording.wrench_sign)}"')
    if recording.tool is not None:
        lines.append(f"tool    = {toml_string(str(Path(recording.tool).absolute()))}")
    return "\n".join(lines) + "\n"


def _gravity(recording: Recording) -> list[str]:
    """Return the line of gravity, none where it was assumed; raises BadValue where it is known to some other degree."""
    if not recording.gravity_std:
        return [f"gravity = {_list(recording.gravity)}   # in the world frame W, m/s^2"]
    if recording.gravity_std == ASSUMED_GRAVITY_STD and np.array_equal(recording.gravity, default_gravity()):
        return []
    raise BadValue("a description has no words for how well gravity is known: set gravity_std of the recording to 0.")


def _noise(noise: Mapping[str, float]) -> list[str]:
    """Return the [noise] table, if there is any; raises BadValue for what it cannot hold."""
    for key, value in noise.items():
        if key not in NOISE or not 0 < value < np.inf:
            raise BadValue(f"noise {key!r} of {value} cannot be written: it must be above zero, of {', '.join(NOISE)}.")
    return ["[noise]\n" + "".join(f"{key} = {value:.12g}\n" for key, value in noise.items())] if noise else []


def object_table(pose: Pose, std: tuple[float, float] | None = None, of: str = "the mesh's frame") -> str:
    """Return the [object] table of a description: where the object's frame O sits in S; std [m], [rad].

    of  what the frame is, in words
    """
    spread = "" if std is None else f", std_mm = {1e3 * std[0]:.9g}, std_deg = {np.degrees(std[1]):.9g}"
    place = f"{_position(pose.position)}, {_rotation(pose.rotation)}{spread}"
    return f"[object]\npose_in_sensor = {{ {place} }}   # of {of}\n"


def _position(position: Array) -> str:
    return f'position = {_list(position)}, unit = "m"'


def _rotation(rotation: Rotation) -> str:
    return f'rotation = {_list(rotation.matrix.ravel())}, form = "matrix"'


def _list(values: Array) -> str:
    return f"[{', '.join(f'{v + 0.0:.12g}' for v in values)}]"


def _described(stream: Stream) -> str:
    """Return the [[stream]] table; raises BadValue for what it cannot hold."""
    lines = ["[[stream]]", f"path = {toml_string(stream.name)}"]
    if stream.poses:
        if stream.time is not None:
            raise BadValue(f"{stream.name}: a table of still poses cannot be written with time. Leave one of them out.")
        lines.append('kind = "poses"')
    if stream.time is not None:
        lines.append('time = { columns = ["t"], unit = "s" }')
    if stream.delay is not None:
        lines.append(f'delay = {{ value = {stream.delay:.12g}, unit = "s" }}')
    if stream.turn is not None or stream.arm is not None:
        place = [_rotation(stream.turn)] if stream.turn is not None else []
        place += [_position(stream.arm)] if stream.arm is not None else []
        lines.append(f"mount = {{ {', '.join(place)} }}")
    for quantity in _tabled(stream):
        names, unit = _COLUMNS[quantity]
        lines.append(f"{quantity} = {{ columns = {columns_text(names)}, {unit}{_frame(stream, quantity)} }}")
    if _passive(stream):
        lines.append('torque = "zero"')
    return "\n".join(lines) + "\n"


def _frame(stream: Stream, quantity: str) -> str:
    """Return what says that a quantity is in W; raises BadValue where a description cannot say its frame."""
    frames = ("S", "W") if quantity in FRAMED else ("W",) if quantity == "position" else ("S",)
    frame = stream.frames.get(quantity, frames[0])
    if frame not in frames:
        raise BadValue(
            f"{stream.name}: {quantity} in {frame} cannot be written; a description can say {' or '.join(frames)}."
        )
    return ', frame = "W"' if frame != frames[0] else ""


def _tabled(stream: Stream) -> dict[str, Array]:
    """Return the channels that are columns; raises BadFile for one that this writer does not know."""
    for quantity in stream.channels:
        if quantity not in _COLUMNS:
            raise BadFile(f"{stream.name}: cannot write {quantity}; this writer knows {', '.join(_COLUMNS)}.")
    return {name: values for name, values in stream.channels.items() if name != "torque" or not _passive(stream)}


def _passive(stream: Stream) -> bool:
    """Whether the torque beside a force is exactly zero: columns of zeros would be refused as a dead channel."""
    return {"force", "torque"} <= set(stream.channels) and not stream.channels["torque"].any()


def _csv(stream: Stream) -> str:
    """Return the table with a header: nine significant figures, twelve of stamps, which may be large and close."""
    names, columns = [], []
    if stream.time is not None:
        names.append("t")
        columns.append(stream.time[:, None])
    for quantity, values in _tabled(stream).items():
        names += _COLUMNS[quantity][0]
        columns.append(Rotation(values).quaternion_wxyz() if quantity == "rotation" else values)
    rows = np.concatenate(columns, axis=1)
    digits = [12 if name == "t" else 9 for name in names]
    body = "\n".join(",".join(f"{v:.{k}g}" for v, k in zip(row, digits, strict=True)) for row in rows)
    return ",".join(names) + "\n" + body + "\n"
