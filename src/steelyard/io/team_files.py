"""A team description and its data files become a TeamLog."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadDescription, BadFile, BadInput, BadValue
from steelyard.io.contents import load_toml, readable
from steelyard.io.recordings.arm_joints import arm_of, pose_channels, posed, with_joints_in_order
from steelyard.io.recordings.description import default_gravity
from steelyard.io.recordings.stream_files import open_tables, read_cells, streams_of
from steelyard.io.streams.entries import StreamSpec
from steelyard.io.tables.files import Columns, Table, data_folder, find_file
from steelyard.io.teams.team_description import RecordingSpec, RobotSpec, TeamDescription, parse_team_description
from steelyard.logs.recording import Stream
from steelyard.logs.team_log import KINDS, Kind, TeamLog, TeamRecording, TeamRobot
from steelyard.logs.team_streams import in_grasp_axes, on_one_clock, used_once
from steelyard.logs.team_track import Track
from steelyard.robots.omnid import Omnid
from steelyard.robots.serial import SerialArm

_FEWEST = 50  # rows in which a torque shows

# Readings may pass a stop by play and by the zero of an encoder; where most do by more than this [rad] they are others.
_BEYOND = np.deg2rad(25.0)


def read_team(path: Path | str, data: Path | str | None = None) -> TeamLog:
    """Read the log of a team.

    path  a team description (.toml)
    data  folder in which relative paths are sought first; then $STEELYARD_DATA, then beside the description

    Recordings of several robots that have one name belong together; those without a name do by kind and order: the
    second "still" of one robot with the second "still" of the others. Rows that miss a number are masked.
    Raises BadFile, BadDescription or BadValue: what was expected, what was found, where, and what to do.
    """
    path, folder = Path(path), data_folder(data)
    with readable(path):
        if not path.exists():
            path = find_file(str(path), Path.cwd(), folder)
        if path.suffix.lower() != ".toml":
            raise BadFile(
                f"{path}: a team is described by a TOML text; found {path.suffix or 'a file without a suffix'}."
            )
        return _team(parse_team_description(load_toml(path), path.name), path, folder)


def _team(said: TeamDescription, path: Path, data: Path | None) -> TeamLog:
    meetings = _meetings(said, path.name)
    with_streams = [(robot, own) for meeting in meetings for robot, own in meeting.members if not own.away]
    specs = [stream for _, own in with_streams for stream in own.streams]
    tables = open_tables(specs, path.parent, data)
    arms = {robot.name: arm_of(robot.arm, path, data) for robot in said.robots if robot.arm is not None}
    owners = [robot.name for robot, own in with_streams for _ in own.streams]
    specs = [
        with_joints_in_order(spec, table, arms[owner]) if owner in arms else spec
        for spec, table, owner in zip(specs, tables, owners, strict=True)
    ]
    opened = {s.where: (s, t, c) for s, t, c in zip(specs, tables, read_cells(specs, tables), strict=True)}
    robots = [TeamRobot(robot.name, robot.gravity, robot.base) for robot in said.robots]
    recordings = [_recording(meeting, opened, arms, path.name) for meeting in meetings]
    with _at(path.name):
        return TeamLog(tuple(robots), tuple(recordings), said.reference, said.gravity_std)


@contextmanager
def _at(where: str) -> Iterator[None]:
    """Say in the errors of what is made inside where it was described."""
    try:
        yield
    except BadInput as error:
        raise type(error)(f"{where}: {error}") from None


@dataclass(frozen=True, eq=False)
class _Meeting:
    """What the robots did at the same time."""

    name: str
    members: tuple[tuple[RobotSpec, RecordingSpec], ...]


def _meetings(said: TeamDescription, where: str) -> list[_Meeting]:
    """Return the recordings that belong together, in the order in which they are first told."""
    found: dict[tuple[Kind, int] | str, list[tuple[RobotSpec, RecordingSpec]]] = {}
    for robot in said.robots:
        count = dict.fromkeys(KINDS, 0)
        for own in robot.recordings:
            if own.name is None:
                count[own.kind] += 1
            key = (own.kind, count[own.kind]) if own.name is None else own.name
            members = found.setdefault(key, [])
            if any(other is robot for other, _ in members):
                raise BadDescription(f'{own.where}: the robot has another recording named "{own.name}". Rename one.')
            if members and members[0][1].kind != own.kind:
                raise BadDescription(
                    f'{own.where}: recording "{own.name}" is "{own.kind}" here and "{members[0][1].kind}" for '
                    f'"{members[0][0].name}". Give both one kind.'
                )
            members.append((robot, own))
    _require_equal_counts(said, where)
    return [
        # Without a name it is the kind, with its number where there are several.
        _Meeting(
            key if isinstance(key, str) else f"{key[0]} {key[1]}" if (key[0], 2) in found else key[0], tuple(members)
        )
        for key, members in found.items()
        if not all(own.away for _, own in members)
    ]


def _require_equal_counts(said: TeamDescription, where: str) -> None:
    """Raise BadDescription where order cannot say which recordings belong together."""
    for kind in KINDS:
        counts = {r.name: sum(own.kind == kind and own.name is None for own in r.recordings) for r in said.robots}
        different = {n: c for n, c in counts.items() if c}
        if len(set(different.values())) > 1:
            shown = ", ".join(f'"{name}" {count}' for name, count in different.items())
            raise BadDescription(
                f"{where}: recordings without a name are matched by kind and order, but the robots have different "
                f'numbers of "{kind}" ones: {shown}. Give each a name, the same for all robots that took part.'
            )


def _recording(
    meeting: _Meeting,
    opened: Mapping[str, tuple[StreamSpec, Table, Columns]],
    arms: Mapping[str, SerialArm],
    where: str,
) -> TeamRecording:
    """Return what all robots measured at one time, each on its own clock, all from one origin."""
    owners = [robot.name for robot, own in meeting.members for _ in own.streams]
    found = [opened[spec.where] for _, own in meeting.members for spec in own.streams]
    specs, tables, cells = [each[0] for each in found], [each[1] for each in found], [each[2] for each in found]
    down = [robot.gravity for robot, own in meeting.members for _ in own.streams]
    gravity = [default_gravity() if known is None else known for known in down]
    made = streams_of(specs, tables, cells, gravity, gaps=False)
    streams = {}
    for spec, stream, owner in zip(specs, made, owners, strict=True):
        if spec.zero_torque:  # it was only said to be zero
            stream = replace(stream, channels={n: v for n, v in stream.channels.items() if n != "torque"})
        streams[spec.where] = posed(spec, stream, arms[owner]) if owner in arms else stream
    tracks = {
        robot.name: _track(robot, own, [streams[spec.where] for spec in own.streams])
        for robot, own in meeting.members
        if not own.away
    }
    away = frozenset(robot.name for robot, own in meeting.members if own.away)
    with _at(where):
        return TeamRecording(meeting.members[0][1].kind, tracks, meeting.name, away)


def _track(robot: RobotSpec, own: RecordingSpec, streams: Sequence[Stream]) -> Track:
    """Return one robot's samples in SI on one clock: poses, wrench on the payload, what else it measured."""
    with _at(own.where):
        streams, repeated = used_once(streams)
        time, channels = on_one_clock(streams)
        carrying = _carrying(streams, time)
        channels.pop("carrying", None)
        if robot.omnid:
            channels = _kinematics(channels)
        channels = in_grasp_axes(streams, channels)
        for name in ("force", "torque"):
            if name in channels:
                channels[name] = robot.wrench_sign * channels[name]
        return replace(Track.of(time, carrying, **channels), repeated=repeated)


def _carrying(streams: Sequence[Stream], time: Array) -> np.ndarray[Any, np.dtype[np.bool_]] | None:
    """Return whether the robot held the payload, as its nearest sample says; None where nothing says."""
    for stream in streams:
        if "carrying" in stream.channels and stream.time is not None:
            said = stream.channels["carrying"][:, 0]
            known = np.isfinite(said)
            if not np.isin(said[known], (0.0, 1.0)).all():
                raise BadValue('"carrying" must be 1 where the robot holds the payload and 0 where it does not.')
            stamps = stream.sampled[known]
            nearest = np.searchsorted((stamps[1:] + stamps[:-1]) / 2, time)
            return np.asarray(said[known][nearest] == 1)
    return None


def _kinematics(channels: Mapping[str, Array]) -> dict[str, Array]:
    """Return the channels with joints turned into the pose and the force of an Omnid's grasp."""
    if "joint_position" not in channels:
        return dict(channels)
    out = {name: values for name, values in channels.items() if not name.startswith("joint_")}
    joints = channels["joint_position"]
    good: Mask = np.asarray(np.isfinite(joints).all(1))
    robot = Omnid()
    _require_likely(robot, joints[good])
    out |= pose_channels(robot.pose(joints[good]), good)
    if "joint_torque" in channels:
        _require_live(channels["joint_torque"])
        both = good & np.isfinite(channels["joint_torque"]).all(1)
        out["force"] = np.full((len(joints), 3), np.nan)
        out["force"][both] = robot.wrench(joints[both], channels["joint_torque"][both]).force
    return out


def _require_live(torques: Array) -> None:
    """Raise BadValue where one of the spring torques (T, 3) [N m] is exactly 0 throughout and others are not."""
    dead = ~np.nan_to_num(torques).any(0)
    if len(torques) >= _FEWEST and dead.any() and not dead.all():
        raise BadValue(
            f"torque {int(dead.argmax()) + 1} of 3 is exactly 0 in all {len(torques)} rows and the others are not: its "
            "channel is dead. Repair it, or leave the torques of this recording out."
        )


def _require_likely(robot: Omnid, joints: Array) -> None:
    """Raise BadValue where joint angles (T, 6) [rad] are those of no Omnid, so that columns or units are others.

    Radians read as degrees keep every arm within two degrees of level, where the platform is below what it works at.
    """
    if not len(joints):
        return
    low, high = robot.arm_limits
    x, y, z = (stop + _BEYOND for stop in robot.gimbal_stops)
    wide = replace(robot, arm_limits=(low - _BEYOND, high + _BEYOND), gimbal_stops=(x, y, z))
    middle = np.median(joints, axis=0)
    if not _works(wide, middle, joints):
        for said, looks, factor in (("rad", "degrees", np.pi / 180), ("deg", "radians", 180 / np.pi)):
            if _works(wide, factor * middle, factor * joints):
                raise BadValue(
                    f'joint angles look like {looks} that are read as "{said}": they would be between '
                    f"{np.rad2deg(joints.min()):.3g} and {np.rad2deg(joints.max()):.3g} deg, where no Omnid works. Set "
                    f'unit = "{looks[:3]}" for "joint_position".'
                )
    try:
        wide.require_within(middle)
    except BadValue:
        wide.require_within(joints)


def _works(robot: Omnid, middle: Array, joints: Array) -> bool:
    """Return whether arms and gimbal are mostly within their stops and the platform no lower than it works."""
    try:
        robot.require_within(middle)
        robot.require_within(np.quantile(joints, (0.05, 0.95), axis=0))
        height = robot.pose(middle).position[2] + robot.home_height
    except BadValue:
        return False
    return bool(robot.work_box[2] <= height <= robot.work_box[3] + 0.1)
