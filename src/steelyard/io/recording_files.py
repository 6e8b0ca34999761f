"""A Recording written as CSV files with their description: what a user's own log would look like."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path, PurePosixPath, PureWindowsPath

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, BadValue
from steelyard.io.example import columns_text
from steelyard.io.toml_string import toml_string
from steelyard.logs.recording import Recording, Stream
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

    All of it or nothing is written; other files in the folder stay. Raises BadFile where the folder cannot be written
    or a stream holds a quantity that this writer does not know, BadValue where the name of a stream leads elsewhere or
    is that of another.
    """
    _require_own_places([stream.name for stream in recording.streams])
    sign = "on-object" if recording.wrench_sign > 0 else "on-sensor"
    gravity = ", ".join(f"{g + 0.0:g}" for g in recording.gravity)
    text = [f'[log]\ngravity = [{gravity}]   # in the world frame W, m/s^2\nwrench  = "{sign}"\n']
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


def object_table(pose: Pose, std: tuple[float, float] | None = None, of: str = "the mesh's frame") -> str:
    """Return the [object] table of a description: where the object's frame O sits in S; std in m and rad.

    of  what the frame is, in words
    """
    position, rotation = (
        ", ".join(f"{v + 0.0:.12g}" for v in values) for values in (pose.position, pose.rotation.matrix.ravel())
    )
    spread = "" if std is None else f", std_mm = {1e3 * std[0]:.9g}, std_deg = {np.degrees(std[1]):.9g}"
    place = f'position = [{position}], unit = "m", rotation = [{rotation}], form = "matrix"{spread}'
    return f"[object]\npose_in_sensor = {{ {place} }}   # of {of}\n"


def _described(stream: Stream) -> str:
    """Return the [[stream]] table."""
    lines = ["[[stream]]", f"path = {toml_string(stream.name)}"]
    if stream.time is not None:
        lines.append('time = { columns = ["t"], unit = "s" }')
    for quantity in stream.channels:
        if quantity not in _COLUMNS:
            raise BadFile(f"{stream.name}: cannot write {quantity}; this writer knows {', '.join(_COLUMNS)}.")
        names, unit = _COLUMNS[quantity]
        lines.append(f"{quantity} = {{ columns = {columns_text(names)}, {unit} }}")
    return "\n".join(lines) + "\n"


def _csv(stream: Stream) -> str:
    """Return the table with a header: nine significant figures, twelve of stamps, which may be large and close."""
    names, columns = [], []
    if stream.time is not None:
        names.append("t")
        columns.append(stream.time[:, None])
    for quantity, values in stream.channels.items():
        names += _COLUMNS[quantity][0]
        columns.append(_cells(quantity, values))
    rows = np.concatenate(columns, axis=1)
    digits = [12 if name == "t" else 9 for name in names]
    body = "\n".join(",".join(f"{v:.{k}g}" for v, k in zip(row, digits, strict=True)) for row in rows)
    return ",".join(names) + "\n" + body + "\n"


def _cells(quantity: str, values: Array) -> Array:
    return Rotation(values).quaternion_wxyz() if quantity == "rotation" else values
