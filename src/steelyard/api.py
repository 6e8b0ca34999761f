"""The verbs of `import steelyard as sy`: the pipelines, with files read where paths are given."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from steelyard.errors import BadDescription, BadInput, BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate, known_body
from steelyard.inertia import InertialParameters
from steelyard.io import read_recording, read_result
from steelyard.io.contents import in_file
from steelyard.io.ply_files import read_mesh_noting
from steelyard.io.recordings.description import ObjectPose, read_object_pose
from steelyard.io.team_files import read_team
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.logs.team_log import TeamLog
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.parts.parts import Parts
from steelyard.pipelines import held_object
from steelyard.pipelines.load import require_place
from steelyard.pipelines.options import DEFAULTS, Options
from steelyard.spatial import Pose
from steelyard.team.estimate import TeamEstimate

if TYPE_CHECKING:
    from steelyard.identify.same import Comparison
    from steelyard.io.shapes.parts_files import SavedParts
    from steelyard.pipelines.shape_in_parts import Shape
    from steelyard.pipelines.shared_payload import Method
    from steelyard.shape.cloud import Cloud
    from steelyard.shape.views import Views

Log = str | Path | Recording | MotionLog
Tool = str | Path | Recording | Estimate | InertialParameters


def identify(
    log: Log,
    options: Options = DEFAULTS,
    *,
    tool: Tool | None = None,
    parts: str | Path | Parts | None = None,
    scan: str | Path | Cloud | Views | Shape | None = None,
    pose_in_sensor: str | Path | Pose | None = None,
    data: str | Path | None = None,
) -> Estimate:
    """Return mass, centre of mass and inertia of what the robot holds, with covariance, evidence and findings.

    log      a log description (.toml), a bare data file, a Recording (of arrays: `sy.recording`), or a MotionLog made
             by the caller (which is fitted as it is, without alignment and sanity checks; its object's frame is S
             unless pose_in_sensor says)
    options  method, bias and prior size
    tool     the gripper alone: its result (.json), its log or its Estimate; taken away, one sensor bias shared. Or its
             InertialParameters in S, taken as exact
    parts    the object's homogeneous parts in its own frame; or a mesh (.ply) whose faces carry part numbers, or parts
             saved by `segment` (.npz)
    scan     what was seen of the object instead: a cloud (.ply, .pcd, .npz), a folder of views, or their values; it is
             closed, cut into parts, and the log chooses among the cuts
    pose_in_sensor  where the object's frame sits in the sensor: a Pose, a TOML file with [object], or its inline table;
             it takes the place of what the description says
    data     folder that relative paths in the description start from

    Raises BadInput where the files make no sense, CannotAnswer where they do not determine mass and centre of mass.
    """
    _require_one_shape(parts, scan, pose_in_sensor, options)
    place = None if pose_in_sensor is None else _place(pose_in_sensor)
    if isinstance(log, MotionLog):
        known = _tool(tool, data)
        known = held_object.identify(known, options) if isinstance(known, Recording) else known
        seen, notes = _parts(parts) if scan is None else (shape_of(scan), ())
        where = () if place is None else (place.pose, place.std)
        return held_object.identify_rows(log, options, known, seen, *where).noted(*notes)
    recording = _recording(log, data)
    if place is not None:
        recording = replace(recording, object_pose=place.pose, object_pose_std=place.std)
    if parts is not None or scan is not None:
        require_place(recording.object_pose)  # before the work, which takes seconds
    known = _tool(recording.tool if tool is None else tool, data)
    seen, notes = _parts(parts) if scan is None else (shape_of(scan), ())
    return held_object.identify(recording, options, known, seen).noted(*notes)


def identify_team(
    log: str | Path | TeamLog, method: Method = "joint", *, data: str | Path | None = None
) -> TeamEstimate:
    """Return where every robot of a team holds the payload, and its mass, centre of mass and inertia.

    log     a team description (.toml) or a TeamLog
    method  "joint" or "paper"
    data    folder that relative paths in the description start from

    The answer is in the grasp frame of the reference robot. Raises BadInput where the files make no sense, CannotAnswer
    where they do not determine it.
    """
    from steelyard.pipelines import shared_payload

    _require("log", log, "a path or a TeamLog", str, Path, TeamLog)
    return shared_payload.identify_team(log if isinstance(log, TeamLog) else read_team(log, data), method)


def compare(one: str | Path | Estimate, other: str | Path | Estimate, any_grasp: bool = False) -> Comparison:
    """Say whether two results (files, or estimates) can be the same object, held the same way: `same`, `p_value`.

    any_grasp  compare only mass and principal moments: the grasps may differ

    Raises BadInput for places in different frames, CannotAnswer where both identify nothing alike.
    """
    from steelyard.identify import same

    a, b = (read_result(given) if isinstance(given, str | Path) else given for given in (one, other))
    for given in (a, b):
        _require("a result", given, "a path or an Estimate", Estimate)
    if a.frame != b.frame and not any_grasp:
        first, second = (
            each if isinstance(each, str | Path) else f"the {n} result"
            for n, each in (("first", one), ("second", other))
        )
        raise BadValue(
            f'{first} is in frame "{a.frame}" and {second} in "{b.frame}": places in them cannot be compared. '
            "Give --any-grasp (in Python any_grasp=True) to compare mass and principal moments."
        )
    return same.compare(a.parameters, a.covariance, b.parameters, b.covariance, a.identified & b.identified, any_grasp)


def _require_one_shape(parts: object, scan: object, pose_in_sensor: object, options: Options) -> None:
    """Raise BadValue where a shape is given twice, or what needs one has none."""
    if parts is not None and scan is not None:
        raise BadValue("parts and a scan both say what the object looks like; give one of them.")
    if options.materials and parts is None and scan is None:
        raise BadValue("materials are of the parts of a shape: give parts or a scan with them, or leave them out.")
    if pose_in_sensor is not None and parts is None and scan is None:
        raise BadValue("pose_in_sensor says where a shape sits: give parts or a scan with it, or leave it out.")


def _require(name: str, given: object, expected: str, *kinds: type, hint: str = "") -> None:
    """Raise BadValue where `given` is of none of these kinds."""
    if not isinstance(given, kinds):
        raise BadValue(f"{name} must be {expected}; got {type(given).__name__}.{hint}")


def _recording(log: str | Path | Recording, data: str | Path | None) -> Recording:
    """Return the recording, read where it is given as a path."""
    arrays = " Arrays become one with sy.recording(time=.., force=.., torque=.., rotation=.., ..)."
    _require("log", log, "a path, a Recording or a MotionLog", str, Path, Recording, hint=arrays)
    return log if isinstance(log, Recording) else read_recording(log, data)


def _parts(parts: str | Path | Parts | None) -> tuple[Parts | None, tuple[str, ...]]:
    """Return the parts, read where they are given as a path, and what must be said of how they were read."""
    if parts is None or isinstance(parts, Parts):
        return parts, ()
    _require("parts", parts, "a path (mesh.ply, parts.npz) or Parts", str, Path)
    path = Path(parts)
    if path.suffix.lower() == ".npz":
        from steelyard.io.shapes.parts_files import read_parts

        return read_parts(path).parts, ()
    mesh, notes = read_mesh_noting(path)
    return in_file(path, lambda: parts_of_mesh(mesh)), notes


def shape_of(scan: str | Path | Cloud | Views | Shape, parts: int | None = None, cells: str = "delaunay") -> Shape:
    """Return the closed solid in homogeneous parts of what was seen of an object.

    scan   a cloud (.ply, .pcd, .npz), a folder of views, or their values
    parts  how many, where that is known; chosen by shape and colour where not
    cells  "delaunay", or a mesher that is installed, "ftetwild" or "tetgen", to fill the same volume anew

    Raises BadInput or CannotAnswer, with the file's name, where nothing closed can be made of it.
    """
    from steelyard.io.shapes.foreign_cells import in_cells_of
    from steelyard.pipelines.shape_in_parts import Shape, shape_of
    from steelyard.shape.cloud import Cloud
    from steelyard.shape.scan import Scan
    from steelyard.shape.views import Views

    if isinstance(scan, Shape):
        return scan
    if not isinstance(scan, str | Path):
        points = " Points become one with Cloud(xyz, rgb) of steelyard.shape.cloud."
        _require("scan", scan, "a path, a Cloud, Views or a Shape", Cloud, Scan, Views, hint=points)
    refill = None if cells == "delaunay" else partial(in_cells_of, cells)
    if not isinstance(scan, str | Path):
        return shape_of(scan, parts, refill)
    seen = _seen(Path(scan))
    try:
        return shape_of(seen, parts, refill)
    except (BadInput, CannotAnswer) as error:
        raise type(error)(f"{scan}: {error}") from None


def save_parts(shape: Shape, path: str | Path) -> None:
    """Write a shape in parts to `path` (parts.npz), with how wrong it may be; raises BadFile."""
    from steelyard.io.shapes.parts_files import write_parts

    write_parts(saved_parts(shape), path)


def saved_parts(shape: Shape) -> SavedParts:
    """Return a shape in parts as parts.npz holds it."""
    from steelyard.io.shapes.parts_files import SavedParts

    made, error = shape.segmentation, shape.error
    unsure = (error.com_m, error.stretch, error.turn_rad)
    return SavedParts(made.mesh, made.labels, made.rgb, made.hierarchy, made.names, *unsure)


def _seen(path: Path) -> Cloud | Views:
    """Return the views of a folder, or the cloud of a file."""
    if path.is_dir():
        from steelyard.io.view_folders import read_views

        return read_views(path)
    from steelyard.io.cloud_files import read_cloud

    return read_cloud(path)


def _place(given: str | Path | Pose) -> ObjectPose:
    """Return where the object sits, read where it is given as TOML."""
    if isinstance(given, Pose):
        return ObjectPose(given)
    matrix = " A 4 x 4 matrix becomes one with sy.Pose.from_matrix(T)."
    _require("pose_in_sensor", given, "a Pose, a TOML file or its inline table", str, Path, hint=matrix)
    return read_object_pose(str(given))


def _tool(tool: Tool | None, data: str | Path | None) -> Recording | Estimate | None:
    """Return the tool, read where it is given as a path."""
    if tool is None or isinstance(tool, Recording | Estimate):
        return tool
    if isinstance(tool, InertialParameters):
        return known_body(tool)
    _require("tool", tool, "a path, a Recording, an Estimate or InertialParameters", str, Path)
    if Path(tool).suffix.lower() == ".json":
        return read_result(tool)
    recording = read_recording(tool, data)
    if recording.tool is not None:
        raise BadDescription(
            f'{Path(tool).name}, [log]: a tool\'s run cannot have a "tool" taken away itself: the load weighs both. '
            "Leave the key out of this description."
        )
    return recording
