"""The team description (TOML) as checked values; no data file is opened here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, get_args

from steelyard.check import Array
from steelyard.io.entries import Entry, each, gathered
from steelyard.io.recordings.description import (
    ARM,
    SIGNS,
    ArmSpec,
    default_gravity,
    measures_gravity,
    parse_arm,
    parse_gravity,
)
from steelyard.io.streams.entries import StreamSpec, parse_stream
from steelyard.logs.recording import ASSUMED_GRAVITY_STD
from steelyard.logs.team_log import KINDS, Base, Kind

EXAMPLE = """\
[team]
gravity   = [0, 0, -9.81]        # in each robot's home frame, m/s^2; or "unknown"
reference = "left"

[[robot]]
name  = "left"
model = "omnid"                  # then joint_position and joint_torque suffice
  [[robot.recording]]
  kind = "motion"                # "grasp", "still" or "motion"; one recording may serve all
    [[robot.recording.stream]]
    path           = "left.csv"
    time           = { columns = ["t"], unit = "s" }
    joint_position = { columns = ["q1", "q2", "q3", "q4", "q5", "q6"], unit = "rad" }
    joint_torque   = { columns = ["tau1", "tau2", "tau3"], unit = "N*m" }
"""


@dataclass(frozen=True)
class RecordingSpec:
    """One [[robot.recording]]; `name` is None where it is matched by its place among those of its kind."""

    kind: Kind
    streams: tuple[StreamSpec, ...]
    where: str
    name: str | None = None
    away: bool = False


@dataclass(frozen=True, eq=False)
class RobotSpec:
    """One [[robot]]; gravity (3,) [m/s^2] in its home frame, None where it is to be estimated.

    omnid, arm  whose joints its streams may tell
    """

    name: str
    gravity: Array | None
    base: Base
    wrench_sign: int
    omnid: bool
    arm: ArmSpec | None
    recordings: tuple[RecordingSpec, ...]


@dataclass(frozen=True, eq=False)
class TeamDescription:
    """What a team description says; gravity_std as in TeamLog."""

    robots: tuple[RobotSpec, ...]
    reference: str
    gravity_std: float = 0.0


def parse_team_description(values: Mapping[str, Any], name: str) -> TeamDescription:
    """Check the parsed TOML `values`; `name` stands in messages. Raises BadDescription with all that is wrong."""
    top = Entry(values, name)
    if "log" in top or "stream" in top:
        raise top.error("[log] and [[stream]] make this the log of one robot. Use it with: steelyard identify")
    top.only("team", "robot")
    team = top.section("team")
    entries = top.sections("robot", "[[robot]]", "[[robot]]")
    if not entries:
        raise top.error(f"no [[robot]] is given, so there is no team. A description begins like this:\n{EXAMPLE}")
    shared = gathered(
        {
            "keys": lambda: team.only("gravity", "reference", "wrench"),
            "reference": lambda: team.text("reference"),
            "gravity": lambda: _gravity(team, default_gravity()),
            "wrench": lambda: team.choice("wrench", list(SIGNS), "on-object"),
        }
    )
    robots = each(entries, partial(_robot, gravity=shared["gravity"], wrench=shared["wrench"]))
    measured = any(measures_gravity(own.streams) for robot in robots for own in robot.recordings)
    told = measured or any(_states_gravity(place) for place in (team, *entries))
    reference = robots[0].name if shared["reference"] is None else shared["reference"]
    return TeamDescription(robots, reference, 0.0 if told else ASSUMED_GRAVITY_STD)


def _robot(entry: Entry, gravity: Array | None, wrench: str) -> RobotSpec:
    """Check one [[robot]]; `gravity` and `wrench` are what it has where it says nothing."""
    entry.require("name", 'name = "left"')
    name = str(entry.text("name"))
    entry = Entry(entry.values, f'{entry.where} ("{name}")')
    entry.only("name", "model", *ARM, "base", "gravity", "wrench", "recording")
    omnid = "model" in entry and bool(entry.choice("model", ("omnid",), ""))
    if omnid and "urdf" in entry:
        raise entry.error('"model" and "urdf" say the same. Give one of them.')
    arm = parse_arm(entry) if set(ARM) & set(entry.values) else None
    entries = entry.sections("recording", "[[robot.recording]]", "recording")
    if not entries:
        raise entry.error(f"no [[robot.recording]] is given. A robot looks like this:\n{EXAMPLE}")
    known = ("joint_position", "joint_torque") if omnid else ("joint_position",) if arm else ()
    found = gathered(
        {
            "base": lambda: entry.choice("base", get_args(Base), "still"),
            "sign": lambda: SIGNS[entry.choice("wrench", list(SIGNS), wrench)],
            "gravity": lambda: _gravity(entry, gravity),
            "recordings": lambda: each(entries, partial(_recording, known=known)),
        }
    )
    return RobotSpec(name=name, omnid=omnid, arm=arm, wrench_sign=found.pop("sign"), **found)


def _gravity(entry: Entry, otherwise: Array | None) -> Array | None:
    """Return gravity as it is stated here, None where it is unknown."""
    if _states_gravity(entry):
        return parse_gravity(entry)
    return None if "gravity" in entry else otherwise


def _states_gravity(entry: Entry) -> bool:
    return "gravity" in entry and entry.values["gravity"] != "unknown"


def _recording(entry: Entry, known: Sequence[str]) -> RecordingSpec:
    """Check one recording of a robot whose joints are `known` by these quantities."""
    entry.only("kind", "name", "away", "stream")
    entry.require("kind", f'kind = "motion"; one of {", ".join(KINDS)}')
    kind: Any = entry.choice("kind", KINDS, "")
    away = entry.flag("away")
    entries = entry.sections("stream", "[[robot.recording.stream]]", "stream")
    if away and entries:
        raise entry.error('"away" says that the robot holds nothing in this recording; leave out its streams.')
    if not away and not entries:
        raise entry.error(
            "no [[robot.recording.stream]] is given. Give one, or away = true where the robot holds nothing."
        )
    streams = each(entries, partial(parse_stream, robot=True, arm="joint_torque" not in known))
    for stream in streams:
        _check(Entry({}, stream.where), stream, known)
    _refuse_twice(entry, streams)
    return RecordingSpec(kind, streams, entry.where, entry.text("name"), away)


def _check(place: Entry, stream: StreamSpec, known: Sequence[str]) -> None:
    """Refuse what cannot be used in a team."""
    if stream.poses or stream.time is None:
        raise place.error(
            "the streams of a team need time: robots are brought together by their clocks. Give "
            'time = { columns = ["t"], unit = "s" }, or time = { rate = 100, unit = "Hz" } where all start together.'
        )
    joints = sorted((stream.names & {"joint_position", "joint_torque"}) - set(known))
    if joints:
        raise place.error(
            f'"{joints[0]}" needs the kinematics of the robot. Write model = "omnid" in its [[robot]], or, for the '
            'pose of an arm, urdf = "arm.urdf" and sensor_link = ".."; or give the pose and the wrench of the grasp '
            "instead."
        )
    if stream.mount is not None and stream.mount.position is not None and "specific_force" in stream.names:
        raise place.error(
            "an accelerometer of a team must sit at the grasp: leave out the position of its mount, or leave it out."
        )


def _refuse_twice(entry: Entry, streams: Sequence[StreamSpec]) -> None:
    given = [name for stream in streams for name in stream.names]
    for name in given:
        if given.count(name) > 1:
            raise entry.error(f'"{name}" is given by {given.count(name)} streams. Give it in one.')
    for name, joint in (("rotation", "joint_position"), ("position", "joint_position"), ("force", "joint_torque")):
        if name in given and joint in given:
            raise entry.error(f'"{name}" and "{joint}" say the same. Give one of them.')
    if "joint_torque" in given and "joint_position" not in given:
        raise entry.error('"joint_torque" becomes a force only at known joint angles. Give "joint_position" as well.')
    if "force" in given and "torque" not in given:
        raise entry.error(
            '"force" is given without "torque". Give its columns, or torque = "zero" for a passive gimbal.'
        )
    if "torque" in given and "force" not in given:
        raise entry.error('"torque" is given without "force"; half a wrench adds up to nothing. Give both.')
