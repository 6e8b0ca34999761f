"""An example of a description, in words of the file, or topics and frames of the bag, where they are known."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from steelyard.io.bags import TRANSFORMS, Bag, Topic

HEAD = """\
[log]
gravity = [0, 0, -9.81]      # in the world frame W, m/s^2
wrench  = "on-sensor"        # or "on-object": what the robot applies to the object

[[stream]]
"""
_USUAL = {
    "time": '{ columns = ["t"], unit = "s" }',
    "force": '{ columns = ["fx", "fy", "fz"], unit = "N" }',
    "torque": '{ columns = ["tx", "ty", "tz"], unit = "N*m" }',
    "rotation": '{ columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }   # S to W',
}
_NUMBERED = {
    "time": '{ columns = [0], unit = "s" }   # columns are counted from 0',
    "force": '{ columns = [1, 2, 3], unit = "N" }',
    "torque": '{ columns = [4, 5, 6], unit = "N*m" }',
    "rotation": '{ columns = [7, 8, 9, 10], form = "quaternion-wxyz" }   # S to W',
}
_ELSE = {"time": ", or leave the line out", "rotation": "; those of another file in a [[stream]] of its own"}
_ATTITUDES = ("rotation", "gravity", "specific_force", "joint_position")
_FIRST_BEYOND = {"time": 1, "force": 4, "torque": 7, "rotation": 11}
_ROBOT = """
[robot]
urdf        = "arm.urdf"     # put the file of your arm here
sensor_link = "tool0"        # S: a link at the sensor's origin, along its axes
"""
_WIDTH = 8

_WRENCH = {
    "geometry_msgs/msg/WrenchStamped": ("wrench.force", "wrench.torque"),
    "geometry_msgs/msg/Wrench": ("force", "torque"),
}
_POSE = {
    **dict.fromkeys(TRANSFORMS, ("rotation", "position")),
    "geometry_msgs/msg/PoseStamped": ("pose.orientation", "pose.position"),
    "geometry_msgs/msg/TransformStamped": ("transform.rotation", "transform.translation"),
    "geometry_msgs/msg/Pose": ("orientation", "position"),
}
_JOINTS = {"joint_position": '{ columns = ["position"], unit = "rad" }'}
_FELT = {"specific_force": '{ columns = ["linear_acceleration"], unit = "m/s^2" }   # an accelerometer on the sensor'}
_BAG_ROBOT = 'urdf        = "arm.urdf"   # put the file of your arm here\n'

_BASE, _SENSOR = "base_link", "tool0"  # where the bag tells none
_IN_FRAMES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")
_LOOKED_AT = 500  # messages of a topic: publishers of transforms take turns


def toml_string(text: str) -> str:
    """Return a text in quotes, as a TOML file in UTF-8 holds it."""
    # TOML knows no surrogate pairs, and takes no delete character as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def lines_of(rows: Mapping[str, str]) -> str:
    """Return the lines of a section, key and value."""
    return "".join(f"{name:{_WIDTH}s} = {text}\n" for name, text in rows.items())


def columns_text(names: Sequence[str]) -> str:
    """Return the list of names as TOML writes it."""
    return f"[{', '.join(toml_string(name) for name in names)}]"


def example_of(path: str, lines: Mapping[str, str], count: int | None = None) -> str:
    """Return a description of the file `path`.

    lines  quantity -> its table; of those that are not known the usual one stands, marked as not the file's own
    count  of the columns where the file has no names: they are called by number
    """
    attitude = next((name for name in _ATTITUDES if name in lines), "rotation")
    rows = {"path": toml_string(path)}
    for name in ("time", "force", "torque", attitude):
        mark = "put your columns here" + _ELSE.get(name, "")
        usual = f"{_USUAL.get(name)}   # {mark}"
        if count is not None:
            usual = _NUMBERED[name] if _FIRST_BEYOND[name] <= count and not lines else f"{_NUMBERED[name]}   # {mark}"
        rows[name] = lines.get(name, usual)
    rows |= {name: text for name, text in lines.items() if name == "position"}
    robot = _ROBOT if attitude == "joint_position" else ""
    return HEAD + lines_of(rows) + robot


EXAMPLE = example_of("data.csv", _USUAL)


def bag_example(path: str, topics: Sequence[Topic], frames: Frames) -> str:
    """Return a description of the bag `path`: its first wrench, and its first pose of the sensor, or what stands in.

    Joints do, and where there are none an accelerometer.
    """
    wrench = first_wrench(topics) or Topic("/wrench", "geometry_msgs/msg/WrenchStamped", 0)
    posed = [t for t in topics if t.kind in _POSE and not t.name.endswith("/tf_static")]
    joints, imu = (next((t for t in topics if t.kind == f"sensor_msgs/msg/{k}"), None) for k in ("JointState", "Imu"))
    pose = next((t for kind in _POSE for t in posed if t.kind == kind), Topic("/tf", TRANSFORMS[0], 0))
    force, torque = _WRENCH[wrench.kind]
    turn, place = _POSE[pose.kind]
    axes = (', frame = "W"', "   # in the base's axes") if frames.felt_in_base else ("", "")
    felt = {
        "force": f'{{ columns = ["{force}"], unit = "N"{axes[0]} }}{axes[1]}',
        "torque": f'{{ columns = ["{torque}"], unit = "N*m"{axes[0]} }}{axes[1]}',
    }
    named = f"[{toml_string(frames.base)}, {toml_string(frames.sensor)}]   # the sensor in the base: check both"
    seen = {
        **({"frames": named} if pose.kind in TRANSFORMS else {}),
        "rotation": f'{{ columns = ["{turn}"], form = "quaternion-xyzw" }}   # S to W',
        "position": f'{{ columns = ["{place}"], unit = "m" }}',
    }
    first = HEAD + _stream(path, wrench, felt) + "\n[[stream]]\n"
    if joints is None or posed:
        return first + (_stream(path, imu, _FELT) if imu is not None and not posed else _stream(path, pose, seen))
    return (
        first + _stream(path, joints, _JOINTS) + f"\n[robot]\n{_BAG_ROBOT}sensor_link = {toml_string(frames.sensor)}\n"
    )


def first_wrench(topics: Sequence[Topic]) -> Topic | None:
    """Return the first topic that holds wrenches, None where there is none."""
    return next((topic for topic in topics if topic.kind in _WRENCH), None)


def _stream(path: str, topic: Topic, lines: dict[str, str]) -> str:
    return lines_of({"path": toml_string(path), "topic": toml_string(topic.name), **lines})


@dataclass(frozen=True)
class Frames:
    """The frames of the base and of the sensor, and whether the wrench is in the base's axes."""

    base: str
    sensor: str
    felt_in_base: bool


def frames_of(bag: Bag, wrench: str | None) -> Frames:
    """Return the frames beside those of the topic `wrench`.

    The base is the frame that carries the sensor's, "base_link" where that is on the way up. A wrench whose frame is
    the one that poses are told in, and hangs on nothing, is in the base's axes, as some controllers give it.
    """
    felt = next((_frame(message) for _, message in bag.messages(wrench)), "") if wrench else ""
    parent = _parents(bag)
    firsts = (islice(bag.messages(topic.name), 1) for topic in bag.topics if topic.kind in _IN_FRAMES)
    told = {_frame(message) for first in firsts for _, message in first}
    if felt and felt not in parent and felt in {*parent.values(), *told}:
        return Frames(felt, _SENSOR, True)
    line = [felt or _SENSOR]
    while line[-1] in parent and parent[line[-1]] not in line:
        line.append(parent[line[-1]])
    return Frames(_BASE if _BASE in line or len(line) == 1 else line[-1], line[0], False)


def _parents(bag: Bag) -> dict[str, str]:
    """Return the first parent that transforms name of each frame."""
    out: dict[str, str] = {}
    for topic in bag.topics:
        if topic.kind in TRANSFORMS:
            for _, message in islice(bag.messages(topic.name), _LOOKED_AT):
                for each in message.transforms:
                    out.setdefault(each.child_frame_id.lstrip("/"), _frame(each))
    return out


def _frame(message: Any) -> str:
    """Return the frame that a message's header names, "" where it has none."""
    return str(getattr(getattr(message, "header", None), "frame_id", "")).lstrip("/")
