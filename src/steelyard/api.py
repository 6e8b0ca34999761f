"""The verbs of `import steelyard as sy`: the pipelines, with files read where paths are given."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias
from steelyard.identify.noise_aware import NoiseAware
from steelyard.io import read_recording, read_result
from steelyard.io.object_pose import ObjectPose, read_object_pose
from steelyard.io.ply_files import read_mesh
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.parts.parts import Parts
from steelyard.pipelines import held_object
from steelyard.spatial import Pose

DEFAULTS = held_object.Options()
Log = str | Path | Recording | MotionLog


def identify(
    log: Log,
    options: held_object.Options = DEFAULTS,
    *,
    tool: str | Path | Recording | Estimate | None = None,
    parts: str | Path | Parts | None = None,
    pose_in_sensor: str | Pose | None = None,
    data: str | Path | None = None,
) -> Estimate:
    """Return mass, centre of mass and inertia of what the robot holds, with covariance, evidence and findings.

    log      a log description (.toml), a bare data file, a Recording, or a MotionLog made by the caller (which is
             fitted as it is, without alignment and sanity checks)
    options  method, bias and prior size
    tool     the gripper alone: its result (.json), its log or its Estimate; taken away, one sensor bias shared
    parts    the object's homogeneous parts in its own frame, or a mesh (.ply) whose faces carry part numbers
    pose_in_sensor  where the object's frame sits in the sensor: a Pose, a TOML file with [object], or its inline table;
             it takes the place of what the description says
    data     folder that relative paths in the description start from

    Raises BadInput where the files make no sense, CannotAnswer where they do not determine mass and centre of mass.
    """
    if isinstance(log, MotionLog):
        return NoiseAware(bias=Bias(options.bias, drift=options.drift)).identify(log)
    recording = log if isinstance(log, Recording) else read_recording(log, data)
    if pose_in_sensor is not None:
        recording = _placed(recording, pose_in_sensor)
    known = _tool(recording.tool if tool is None else tool, data)
    shape = parts_of_mesh(read_mesh(Path(parts))) if isinstance(parts, str | Path) else parts
    return held_object.identify(recording, options, known, shape)


def _placed(recording: Recording, place: str | Pose) -> Recording:
    """Return the recording with the object at `place`."""
    found = ObjectPose(place) if isinstance(place, Pose) else read_object_pose(place)
    return replace(recording, object_pose=found.pose, object_pose_std=found.std)


def _tool(tool: str | Path | Recording | Estimate | None, data: str | Path | None) -> Recording | Estimate | None:
    """Return the tool, read where it is given as a path."""
    if not isinstance(tool, str | Path):
        return tool
    return read_result(tool) if Path(tool).suffix == ".json" else read_recording(tool, data)
