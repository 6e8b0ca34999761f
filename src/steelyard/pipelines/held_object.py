"""One arm, one held object: a recording becomes an Estimate.

    examine -> rows to fit -> weigh -> look back -> take the tool away -> look at the sensor -> say what was noticed

Every step is a named room; what it noticed travels along as findings.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TYPE_CHECKING

from steelyard.errors import BadInput, BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias, within_numbers
from steelyard.identify.tool import of_tools_run
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import KNOWN_PLACE, Recording
from steelyard.parts.parts import Parts
from steelyard.pipelines.load import Load, looked_at, placed
from steelyard.pipelines.looking_back import corrections_allowed, looked_back, of_sensor_and_body, pull_allowed
from steelyard.pipelines.options import DEFAULTS, DRIFT_ALLOWED, Options
from steelyard.pipelines.telling import (
    Noticed,
    beside,
    noticed_before,
    of_a_controller,
    remedied,
    sign_found,
    told,
    uncalibrated,
)
from steelyard.pipelines.told_by_rows import rows_as_given
from steelyard.sanity.before import examine
from steelyard.spatial import Pose

if TYPE_CHECKING:
    from steelyard.pipelines.shape_in_parts import Shape


@within_numbers()
def identify(
    recording: Recording,
    options: Options = DEFAULTS,
    tool: Recording | Estimate | None = None,
    parts: Parts | Shape | None = None,
) -> Estimate:
    """Return mass, centre of mass and inertia of what the robot holds, in the frame of the sensor.

    tool   a recording or a result of the gripper alone: it is taken away, and its sensor bias is shared
    parts  the object's homogeneous parts in its own frame O, or its shape as scanned: then the log also chooses among
           cuts of the shape into parts; the recording says where O sits in the sensor

    Raises CannotAnswer where the data do not fix mass and centre of mass, BadInput where they make no sense.
    """
    known = _of_tool(tool, options) if isinstance(tool, Recording) else tool
    of_tool = () if known is None else of_tools_run(known)
    known = None if known is None else _with_bias_as(known, recording)
    examined, before = examine(recording)
    recording, before, rows = rows_as_given(recording, examined, before, options)
    before, of_sign = sign_found(before, recording)
    before = noticed_before(before, recording, rows)
    shape = placed(parts, recording.object_pose, recording.object_pose_std)
    load = Load(rows.log, Bias(options.bias, drift=options.drift), options, shape, known)
    with beside(before, rows.log.gravity):
        load, estimate = load.followed()
    load, estimate, late = looked_back(load, estimate, rows, recording, before)
    estimate = corrections_allowed(load, estimate, rows)
    estimate = load.without_tool(estimate).noted(*rows.notes, *[f"{DRIFT_ALLOWED} in a line, as asked"] * options.drift)
    estimate = estimate if rows.place is None else rows.place.widened(estimate)
    estimate = estimate if rows.maybe is None else rows.maybe.allowed(estimate)
    estimate, of_sensor = of_sensor_and_body(load, estimate, rows, recording, (*before, *late))
    estimate = pull_allowed(load, estimate, rows, recording, (*before, *late, *of_sensor))
    estimate = told(estimate, Noticed(before, late, of_sensor), rows, load, parts)
    if parts is not None and shape is not None:
        estimate = looked_at(estimate, parts, shape, load.shape is not None)
        if load.shape and recording.object_pose_std is None:
            estimate = estimate.noted("give std_mm and std_deg with pose_in_sensor, both 0 where it is exact")
    moved = {stream.name: stream.moved for stream in recording.streams}
    delays_s = {name: late + moved.get(name, 0.0) for name, late in rows.aligned.delays_s.items()}
    estimate = replace(remedied(estimate, rows), delays_s=delays_s).with_findings(*of_tool).by_cause()
    aligning = () if rows.unmeasured else rows.aligned.notes
    late_notes = (*of_a_controller(estimate, rows, recording), *uncalibrated(estimate))
    return _with_bias_as(estimate.noted(*recording.notes, *of_sign, *aligning, *late_notes), recording)


def _of_tool(tool: Recording, options: Options) -> Estimate:
    """Return what the tool alone is; what is wrong with its run is said to be of its run."""
    try:
        return identify(tool, options)
    except (BadInput, CannotAnswer) as error:
        raise type(error)(f"In the tool's run: {error}") from None


@within_numbers()
def identify_rows(
    log: MotionLog,
    options: Options = DEFAULTS,
    tool: Estimate | None = None,
    parts: Parts | Shape | None = None,
    pose: Pose | None = None,
    pose_std: tuple[float, float] | None = None,
) -> Estimate:
    """Return what the robot holds, from rows made by the caller: fitted as they are, neither aligned nor checked.

    tool, parts as in `identify`; `pose` is X_SO, where the object's frame sits in S (there exactly, if None), and
    `pose_std` its standard deviations [m], [rad]; where None, the log tells how sure a given pose is.
    """
    if options.gravity == "unknown":
        raise BadValue('gravity "unknown" needs a recording with rotations: rows know gravity in the sensor only.')
    shape = placed(parts, pose or Pose.identity(), KNOWN_PLACE if pose is None else pose_std)
    load = Load(log, Bias(options.bias, drift=options.drift), options, shape, tool)
    load, estimate = load.followed()
    estimate = load.without_tool(estimate).with_findings(*(() if tool is None else of_tools_run(tool)))
    if parts is not None and shape is not None:
        estimate = looked_at(estimate, parts, shape, load.shape is not None)
    return estimate.by_cause()


def _with_bias_as(estimate: Estimate, recording: Recording) -> Estimate:
    """Return the estimate with its bias in the sign of a recording's raw channels, or from there in that of its log."""
    sign = recording.wrench_sign
    return replace(estimate, wrench_bias=sign * estimate.wrench_bias, cross_covariance=sign * estimate.cross_covariance)
