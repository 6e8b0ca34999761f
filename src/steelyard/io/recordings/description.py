"""The log description (TOML) as checked values; no data file is opened here.

Where the object sits in the sensor, the one entry that shapes need, may also be given on its own.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription, BadInput
from steelyard.io.contents import load_toml, parse_toml
from steelyard.io.entries import Entry, each, gathered
from steelyard.io.example import EXAMPLE
from steelyard.io.streams.entries import STREAM, StreamSpec, parse_pose, parse_stream
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, STANDARD_GRAVITY
from steelyard.spatial import Pose, Rotation

# [m/s^2] gravity on anything with robots; and noise of no sensor, in SI.
_WEAKEST, _STRONGEST = 0.1, 100.0
_LOUDEST = 1e6
NOISE = ("force", "torque", "acceleration", "angular_acceleration")  # whose standard deviation can be told
SIGNS = {"on-object": 1, "on-sensor": -1}  # of the wrench
ARM = ("urdf", "sensor_link", "base_link")  # keys that describe an arm
_LOG = ("gravity", "wrench", "tool")
_SECTIONS = ("log", "noise", "object", "stream", "robot")
# Where keys stand that may be looked for in [log], or above all sections.
_PLACES = {
    **dict.fromkeys(STREAM, "[[stream]]"),
    **dict.fromkeys(_LOG, "[log]"),
    **dict.fromkeys(ARM, "[robot]"),
    "pose_in_sensor": "[object]",
}

# Gravity that nobody states, and how well it is known.
ASSUMED = f"{STANDARD_GRAVITY} ± {STANDARD_GRAVITY * ASSUMED_GRAVITY_STD:.3f} m/s²"
LEVEL_BASE = f"[log] gives no gravity: {ASSUMED} along -z of W, a level base, was assumed"

_EXAMPLE = '{ position = [0, 0, 0.12], unit = "m", rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix" }'

_STD = ("std_mm", "std_deg")


def default_gravity() -> Array:
    """Return standard gravity in W, z up (3,) [m/s^2]: what holds where a description does not say."""
    return np.array([0.0, 0.0, -STANDARD_GRAVITY])


def measures_gravity(streams: Sequence[StreamSpec]) -> bool:
    """Return whether a stream measures gravity."""
    return any(quantity.name == "gravity" for spec in streams for quantity in spec.quantities)


@dataclass(frozen=True)
class ArmSpec:
    """Where the arm is described: path of its URDF as written, the sensor's link, and the base's, None for the root."""

    urdf: str
    sensor_link: str
    base_link: str | None
    where: str


@dataclass(frozen=True, eq=False)
class Description:
    """What a description says.

    gravity      (3,) [m/s^2] in W, and the relative standard deviation of its length
    wrench_sign  +1 on-object, -1 on-sensor
    noise        standard deviations, SI
    tool         path of a result, as written
    placed       pose of O in S, None where nothing says
    arm          where the arm's joints are described, None where nothing says
    notes        what was left to be assumed
    """

    streams: tuple[StreamSpec, ...]
    gravity: Array = field(default_factory=default_gravity)
    wrench_sign: int = 1
    noise: Mapping[str, float] = field(default_factory=dict)
    tool: str | None = None
    placed: ObjectPose | None = None
    arm: ArmSpec | None = None
    notes: tuple[str, ...] = ()
    gravity_std: float = 0.0


def parse_description(values: Mapping[str, Any], name: str) -> Description:
    """Check the parsed TOML `values`; `name` stands in messages. Raises BadDescription with all that is wrong."""
    top = Entry(values, name)
    if "team" in top:
        raise top.error("[team] makes this a team description. Use it with: steelyard team")
    top.only(*_SECTIONS, places=_PLACES)
    log = top.section("log")
    found = gathered(
        {
            "gravity": lambda: _gravity(log),
            "wrench_sign": lambda: SIGNS[log.choice("wrench", ("on-sensor", "on-object"), "on-object")],
            "tool": lambda: log.text("tool"),
            "noise": lambda: parse_noise(top.section("noise")),
            "placed": lambda: parse_object_pose(top.section("object")),
            "streams": lambda: each(top.sections("stream", "[[stream]]", "[[stream]]"), parse_stream),
            "arm": lambda: _arm(top) if "robot" in top else None,
        }
    )
    if not found["streams"]:
        raise top.error(f"no [[stream]] is given, so there are no data. A complete description:\n{EXAMPLE}")
    _require_arm_for_joints(found["streams"], found["arm"])
    told = "gravity" in log or measures_gravity(found["streams"])
    return Description(**found, notes=() if told else (LEVEL_BASE,), gravity_std=0.0 if told else ASSUMED_GRAVITY_STD)


def _gravity(log: Entry) -> Array:
    log.only(*_LOG, places=_PLACES)
    return parse_gravity(log) if "gravity" in log else default_gravity()


def parse_gravity(entry: Entry) -> Array:
    """Return `gravity` (3,) [m/s^2]; raises BadDescription where nothing on Earth is as heavy or as light."""
    gravity = entry.numbers("gravity", 3)
    if not gravity.any():
        raise entry.error('"gravity" must not be zero; on a level base it is [0, 0, -9.81].')
    if not _WEAKEST <= np.abs(gravity).max() <= _STRONGEST:
        shown = ", ".join(f"{v:g}" for v in gravity)
        raise entry.error(f'"gravity" must be in m/s^2, [0, 0, -9.81] on a level base; got [{shown}].')
    return gravity


def parse_noise(entry: Entry) -> dict[str, float]:
    """Return the standard deviations that `entry` gives, SI; raises BadDescription."""
    entry.only(*NOISE)
    return {key: entry.positive(key, _LOUDEST) for key in NOISE if key in entry}


def _arm(top: Entry) -> ArmSpec:
    entry = top.section("robot")
    if "model" in entry:
        raise entry.error('"model" is for teams. Give an arm\'s urdf = "arm.urdf" and sensor_link = "..".')
    entry.only(*ARM)
    return parse_arm(entry)


def parse_arm(entry: Entry) -> ArmSpec:
    """Return what `entry` says of an arm under the keys ARM; raises BadDescription."""
    for key, example in (("urdf", 'urdf = "arm.urdf"'), ("sensor_link", 'sensor_link = "tool0"')):
        entry.require(key, example)
    return ArmSpec(str(entry.text("urdf")), str(entry.text("sensor_link")), entry.text("base_link"), entry.where)


def _require_arm_for_joints(streams: Sequence[StreamSpec], arm: ArmSpec | None) -> None:
    """Raise BadDescription where joints have no arm, or the pose that they tell is told again."""
    for spec in streams:
        if "joint_position" not in spec.names:
            continue
        if arm is None:
            raise BadDescription(
                f'{spec.where}: "joint_position" needs the arm. Add [robot] with urdf = "arm.urdf" and sensor_link = '
                '".."; or give the orientation of the sensor, as rotation = { columns = [..], form = .. }.'
            )
        if twice := [name for other in streams for name in ("rotation", "position") if name in other.names]:
            raise BadDescription(f'{spec.where}: "joint_position" tells the {twice[0]}, too. Give one of them.')


@dataclass(frozen=True, eq=False)
class ObjectPose:
    """Pose of the scan's frame O in the sensor frame S, and its spread.

    pose  X_SO
    std   (position [m], rotation [rad]), None where nothing says
    """

    pose: Pose
    std: tuple[float, float] | None = None


def parse_object_pose(entry: Entry) -> ObjectPose | None:
    """Return what `pose_in_sensor` of an [object] section says, None where it is not there; raises BadDescription."""
    entry.only("pose_in_sensor")
    if "pose_in_sensor" not in entry:
        return None
    table = entry.table("pose_in_sensor")
    rotation, position = parse_pose(table, *_STD)
    if rotation is None or position is None:
        raise table.error('give both "rotation" and "position".')
    return ObjectPose(Pose(rotation, position), _std(table))


def _std(table: Entry) -> tuple[float, float] | None:
    """Return the standard deviations [m], [rad], both zero where the pose is exact; None where nothing says."""
    given = [key for key in _STD if key in table]
    if not given:
        return None
    for key in _STD:
        if key not in table:
            raise table.error(
                f'"{key}" is missing beside "{given[0]}". Give both, 0 where the pose is exact, or neither.'
            )
    mm, deg = (table.spread(key) for key in _STD)
    return mm * 1e-3, float(np.radians(deg))


def read_object_pose(text: str) -> ObjectPose:
    """Return the pose that `text` gives: a TOML file with an [object] section, or the inline table itself.

    Raises BadDescription.
    """
    written = text.strip()
    try:
        if not written.startswith("{"):
            top = load_toml(Path(written))
        else:
            top = {"object": parse_toml(f"pose_in_sensor = {written}", "the table given")}
    except BadInput as error:
        raise BadDescription(f"pose in sensor: {error} Give a TOML file with [object], or {_EXAMPLE}") from None
    section = top.get("object", {})
    found = parse_object_pose(Entry(section if isinstance(section, dict) else {}, "pose in sensor, [object]"))
    if found is None:
        raise BadDescription(
            f"pose in sensor: {text} has no [object] pose_in_sensor. Write pose_in_sensor = {_EXAMPLE}"
        )
    return found


def read_pose(text: str, where: str) -> Pose:
    """Return the pose that an inline table gives; what it leaves out is none. Raises BadDescription."""
    try:
        table = Entry(parse_toml(f"pose = {text.strip()}", where), where).table("pose")
        rotation, position = parse_pose(table)
    except BadInput as error:
        raise BadDescription(f"{error} Give a table in quotes, such as {_EXAMPLE}") from None
    return Pose(rotation or Rotation.identity(), np.zeros(3) if position is None else position)
