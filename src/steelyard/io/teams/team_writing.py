"""A TeamLog written as CSV files with their description: what the robots' own logs would look like."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.io.example import columns_text, toml_string
from steelyard.logs.team_log import TeamLog, TeamRecording, TeamRobot
from steelyard.logs.team_track import Track
from steelyard.spatial import Rotation
from steelyard.whole_files import whole_folder, write_text

# Quantity -> columns, what its description says beside them, digits after the point.
_COLUMNS: dict[str, tuple[tuple[str, ...], str, int]] = {
    "rotation": (("qw", "qx", "qy", "qz"), 'form = "quaternion-wxyz"', 9),
    "position": (("x", "y", "z"), 'unit = "m"', 8),
    "angular_velocity": (("wx", "wy", "wz"), 'unit = "rad/s"', 8),
    "linear_velocity": (("vx", "vy", "vz"), 'unit = "m/s"', 8),
    "angular_acceleration": (("alx", "aly", "alz"), 'unit = "rad/s^2"', 7),
    "linear_acceleration": (("ax", "ay", "az"), 'unit = "m/s^2"', 7),
    "specific_force": (("sx", "sy", "sz"), 'unit = "m/s^2"', 7),
    "gravity": (("gx", "gy", "gz"), 'unit = "m/s^2"', 7),
    "force": (("fx", "fy", "fz"), 'unit = "N"', 6),
    "torque": (("tx", "ty", "tz"), 'unit = "N*m"', 6),
    "joint_position": (("q1", "q2", "q3", "q4", "q5", "q6"), 'unit = "rad"', 6),
    "joint_torque": (("tau1", "tau2", "tau3"), 'unit = "N*m"', 5),
    "carrying": (("holds",), 'unit = "1"', 0),
}
_BY_JOINTS = ("rotation", "position", "force")


class JointReadings(Protocol):
    """Joint angles (T, 6) [rad] and spring torques (T, 3) [N m] of one Omnid at the rows of its track."""

    @property
    def angles(self) -> Array:
        """Joint angles (T, 6) [rad]."""

    @property
    def torques(self) -> Array:
        """Spring torques (T, 3) [N m]."""


def write_team(
    log: TeamLog, path: Path, joints: Sequence[Mapping[str, JointReadings]] = (), *, heading: str = ""
) -> Path:
    """Write the description to `path` and one CSV per robot and recording into the folder of that name beside it.

    joints   by recording and robot: written in place of the poses and forces that they give
    heading  stands first in the description, as a comment

    All of it or nothing is written; other files in the folders stay. Returns `path`. Raises BadFile where a folder
    cannot be written, BadValue for a six-axis robot with joints.
    """
    with whole_folder(path.parent) as new:
        _write(log, new / path.name, joints, heading)
    return path


def _write(log: TeamLog, path: Path, joints: Sequence[Mapping[str, JointReadings]], heading: str) -> None:
    """Write the tables, then the description."""
    folder = path.with_suffix("")
    folder.mkdir(exist_ok=True)
    level = {_gravity(robot) for robot in log.robots}
    said = "".join(f"# {line}\n" for line in heading.splitlines())
    text = [f"{said}[team]\nreference = {toml_string(log.reference)}   # the answer is given in its grasp frame\n"]
    text[0] += _gravity(log.robots[0]) if len(level) == 1 else ""
    taken: set[str] = set()
    for robot in log.robots:
        by_joints = any(robot.name in each for each in joints)
        text.append(_robot(robot, by_joints) + (_gravity(robot) if len(level) > 1 else ""))
        for k, recording in enumerate(log.recordings):
            if robot.name in recording.away:
                text.append(_recording(recording) + "  away = true   # it holds nothing then\n")
            if robot.name not in recording.tracks:
                continue
            name = _own_name(f"{robot.name}-{recording.name}", taken) + ".csv"
            columns = _columns(recording.tracks[robot.name], joints[k].get(robot.name) if by_joints else None)
            text.append(_recording(recording) + _stream(f"{folder.name}/{name}", columns))
            _write_table(folder / name, recording.tracks[robot.name].time, columns)
    write_text(path, "\n".join(text))


def _own_name(said: str, taken: set[str]) -> str:
    """Return the name of a file for what is `said`, and add it to those taken; a number makes it another than they."""
    plain = re.sub(r"[^\w.-]+", "-", said)
    name = next(n for n in (plain, *(f"{plain}-{k}" for k in range(2, len(taken) + 3))) if n.casefold() not in taken)
    taken.add(name.casefold())
    return name


def _robot(robot: TeamRobot, by_joints: bool) -> str:
    lines = ["[[robot]]", f"name = {toml_string(robot.name)}"]
    if by_joints:
        lines.append('model = "omnid"')
    if robot.base != "still":
        lines.append(f'base = "{robot.base}"')
    return "\n".join(lines) + "\n"


def _gravity(robot: TeamRobot) -> str:
    said = '"unknown"' if robot.gravity is None else "[" + ", ".join(f"{g:.9g}" for g in robot.gravity) + "]"
    return f"gravity = {said}   # in the home frame, m/s^2\n"


def _recording(recording: TeamRecording) -> str:
    return f'  [[robot.recording]]\n  kind = "{recording.kind}"\n  name = {toml_string(recording.name)}\n'


def _columns(track: Track, joints: JointReadings | None) -> dict[str, Array]:
    """Return what is written, NaN where it was not measured."""
    out: dict[str, Array] = {}
    if joints is not None:
        if "torque" in track.channels:
            raise BadValue("spring torques tell no moment: a six-axis robot is written with poses, not with joints.")
        out["joint_position"] = _with_gaps(joints.angles, track, "rotation")
        out["joint_torque"] = _with_gaps(joints.torques, track, "force")
    for name, values in track.channels.items():
        if joints is None or name not in _BY_JOINTS:
            given = Rotation(values).quaternion_wxyz() if name == "rotation" else values
            out[name] = _with_gaps(given, track, name)
    if track.carrying is not None:
        out["carrying"] = track.carrying[:, None].astype(np.float64)
    return out


def _with_gaps(values: Array, track: Track, channel: str) -> Array:
    return np.where(track.valid[channel][:, None], values, np.nan)


def _stream(path: str, columns: Mapping[str, Array]) -> str:
    lines = [
        "    [[robot.recording.stream]]",
        f"    path = {toml_string(path)}",
        '    time = { columns = ["t"], unit = "s" }',
    ]
    for name in columns:
        names, said, _ = _COLUMNS[name]
        lines.append(f"    {name} = {{ columns = {columns_text(names)}, {said} }}")
    if "force" in columns and "torque" not in columns:
        lines.append('    torque = "zero"   # a passive gimbal')
    return "\n".join(lines) + "\n"


def _write_table(path: Path, time: Array, columns: Mapping[str, Array]) -> None:
    names, parts = ["t"], [_cells(time[:, None], 6)]
    for name, values in columns.items():
        names += _COLUMNS[name][0]
        parts.append(_cells(values, _COLUMNS[name][2]))
    rows = [",".join(names), *(",".join(cells) for cells in np.concatenate(parts, axis=1).tolist())]
    write_text(path, "\n".join(rows) + "\n")


def _cells(values: Array, digits: int) -> np.ndarray[tuple[int, ...], np.dtype[np.str_]]:
    """Return numbers as text, without zeros at their end."""
    return np.array([[_short(v, digits) for v in row] for row in values.tolist()])


def _short(value: float, digits: int) -> str:
    text = f"{value:.{digits}f}"
    return text.rstrip("0").rstrip(".") if "." in text else text
