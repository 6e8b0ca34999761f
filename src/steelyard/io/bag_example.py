"""An example of a description of a bag, in words of its topics and frames, where they are known."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.io.bags import TRANSFORMS, Bag, Topic
from steelyard.io.example import HEAD, columns_text, lines_of, toml_string
from steelyard.io.rotations import NORM, matrix_order

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
_ARRAYS = ("std_msgs/msg/Float64MultiArray", "std_msgs/msg/Float32MultiArray")
_OF_WRENCH = re.compile(r"wrench|force|torque|(?<![a-z])(ft|f_ext)", re.IGNORECASE)
_JOINTS = {"joint_position": '{ columns = ["position"], unit = "rad" }'}
_FELT = {"specific_force": '{ columns = ["linear_acceleration"], unit = "m/s^2" }   # an accelerometer on the sensor'}
_ROBOT = """
[robot]
urdf        = "arm.urdf"   # put the file of your arm here
sensor_link = {sensor}
"""
_ANY_WRENCH, _ANY_POSE = Topic("/wrench", "geometry_msgs/msg/WrenchStamped", 0), Topic("/tf", TRANSFORMS[0], 0)
_UNKNOWN = "   # put your topic here"
_BASE, _SENSOR = "base_link", "tool0"  # where the bag tells none
_IN_FRAMES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")
_LOOKED_AT = 500  # messages of a topic: publishers of transforms take turns


def bag_example(bag: Bag) -> str:
    """Return a description of a bag: its first wrench, and its first pose of the sensor, or what stands in.

    Joints do, and where there are none an accelerometer, and where messages are bare lists those of fitting length.
    """
    path, frames, lists = bag.path.name, _frames(bag), _lists(bag)
    posed = [t for t in bag.topics if t.kind in _POSE and not t.name.endswith("/tf_static")]
    pose = next((t for kind in _POSE for t in posed if t.kind == kind), None)
    joints, imu = (_first(bag, f"sensor_msgs/msg/{kind}") for kind in ("JointState", "Imu"))
    robot = ""
    if pose is not None:
        seen = _stream(path, pose.name, _pose_lines(pose, frames))
    elif joints is not None:
        seen, robot = _stream(path, joints.name, _JOINTS), _ROBOT.format(sensor=toml_string(frames.sensor))
    elif imu is not None:
        seen = _stream(path, imu.name, _FELT)
    else:
        seen = _listed_pose(path, lists) or _stream(path, "/tf", _pose_lines(_ANY_POSE, frames), _UNKNOWN)
    return f"{HEAD}{_felt(path, bag, frames, lists)}\n[[stream]]\n{seen}{robot}"


def _felt(path: str, bag: Bag, frames: Frames, lists: Mapping[str, Array]) -> str:
    """Return the stream of the wrench: a topic of wrenches, or lists of six numbers."""
    wrench = _first(bag, *_WRENCH)
    six = sorted((name for name, rows in lists.items() if rows.shape[1] == 6), key=lambda n: not _OF_WRENCH.search(n))
    axes, remark = (', frame = "W"', "   # in the base's axes") if frames.felt_in_base else ("", "")
    force, torque = _WRENCH[(wrench or _ANY_WRENCH).kind]
    columns = columns_text([force]), columns_text([torque])
    if wrench is None and six:
        columns, remark = (_data(range(3)), _data(range(3, 6))), '   # check; if in the base\'s axes, frame = "W"'
    lines = {
        name: f'{{ columns = {cells}, unit = "{unit}"{axes} }}{remark}'
        for name, cells, unit in zip(("force", "torque"), columns, ("N", "N*m"), strict=True)
    }
    if wrench is None and not six:
        return _stream(path, _ANY_WRENCH.name, lines, _UNKNOWN)
    return _stream(path, wrench.name if wrench else six[0], lines)


def _pose_lines(pose: Topic, frames: Frames) -> dict[str, str]:
    turn, place = _POSE[pose.kind]
    named = f"[{toml_string(frames.base)}, {toml_string(frames.sensor)}]   # the sensor in the base: check both"
    return {
        **({"frames": named} if pose.kind in TRANSFORMS else {}),
        "rotation": f'{{ columns = ["{turn}"], form = "quaternion-xyzw" }}   # S to W',
        "position": f'{{ columns = ["{place}"], unit = "m" }}',
    }


def _listed_pose(path: str, lists: Mapping[str, Array]) -> str:
    """Return the stream of poses in lists: 4 x 4 matrices, or positions with unit quaternions; "" without any."""
    for name, rows in lists.items():
        order = matrix_order(rows) if rows.shape[1] == 16 else None
        if order is not None:
            turn, place, form = _data(order[:3, :3].ravel()), _data(order[:3, 3]), "matrix"
        elif rows.shape[1] == 7 and (np.abs(np.linalg.norm(rows[:, 3:], axis=1) - 1) < NORM).all():
            turn, place, form = _data(range(3, 7)), _data(range(3)), "quaternion-xyzw"
        else:
            continue
        lines = {
            "rotation": f'{{ columns = {turn}, form = "{form}" }}   # S to W: check',
            "position": f'{{ columns = {place}, unit = "m" }}',
        }
        return _stream(path, name, lines)
    return ""


def _lists(bag: Bag) -> dict[str, Array]:
    """Return topic -> its first messages (N, k), of those that hold bare lists of one length."""
    out = {}
    for topic in bag.topics:
        if topic.kind in _ARRAYS:
            rows = [np.asarray(message.data, float) for _, message in islice(bag.messages(topic.name), _LOOKED_AT)]
            if len({len(row) for row in rows}) == 1 and np.isfinite(rows).all():
                out[topic.name] = np.array(rows)
    return out


def _data(numbers: Iterable[int]) -> str:
    return columns_text([f"data[{n}]" for n in numbers])


def _first(bag: Bag, *kinds: str) -> Topic | None:
    """Return the first topic of some kinds, None where there is none."""
    return next((topic for topic in bag.topics if topic.kind in kinds), None)


def _stream(path: str, topic: str, lines: Mapping[str, str], mark: str = "") -> str:
    return lines_of({"path": toml_string(path), "topic": toml_string(topic) + mark, **lines})


@dataclass(frozen=True)
class Frames:
    """The frames of the base and of the sensor, and whether the wrench is in the base's axes."""

    base: str
    sensor: str
    felt_in_base: bool


def _frames(bag: Bag) -> Frames:
    """Return the frames beside those of the first wrench.

    The base is the frame that carries the sensor's, "base_link" where that is on the way up. A wrench whose frame is
    the one that poses are told in, and hangs on nothing, is in the base's axes, as some controllers give it.
    """
    wrench = _first(bag, *_WRENCH)
    felt = next((_frame(message) for _, message in bag.messages(wrench.name)), "") if wrench else ""
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
