"""An example of a description of a bag, in its own topics where their messages are the usual ones."""

from __future__ import annotations

from collections.abc import Sequence

from steelyard.io.bags import TRANSFORMS, Topic
from steelyard.io.example import HEAD, lines_of
from steelyard.io.tables.bag_frames import Frames
from steelyard.io.toml_string import toml_string

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
