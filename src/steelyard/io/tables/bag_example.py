"""An example of a description of a bag, in its own topics and frames where its messages are the usual ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Any

from steelyard.io.bags import TRANSFORMS, Bag, Topic
from steelyard.io.example import HEAD, lines_of, toml_string

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
_ROBOT = 'urdf        = "arm.urdf"   # put the file of your arm here\n'

_BASE, _SENSOR = "base_link", "tool0"  # where the bag tells none
_IN_FRAMES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")
_LOOKED_AT = 500  # messages of a topic: publishers of transforms take turns


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
    return first + _stream(path, joints, _JOINTS) + f"\n[robot]\n{_ROBOT}sensor_link = {toml_string(frames.sensor)}\n"


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
