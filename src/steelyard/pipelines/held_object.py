"""One arm, one held object: a recording becomes an Estimate.

    examine -> align -> leave touched time out -> fit -> look back -> take the tool away

Every step is a named room; what it noticed travels along as findings.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from steelyard.errors import BadValue, CannotAnswer, NoMasses
from steelyard.findings import AT_REST, BARE, UNEXPLAINED, UNMEASURED, WEIGHED, Finding
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import BREAKDOWNS, Bias, within_numbers
from steelyard.identify.placement import contradicted
from steelyard.identify.problem import ADD_POSES
from steelyard.identify.shape_error import MEASURED
from steelyard.identify.tool import bias_prior, different_bias, shares_bias, without_tool
from steelyard.logs.alignment import Aligned
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.parts.parts import Parts
from steelyard.pipelines.choice import Placed, estimator_for
from steelyard.pipelines.options import DEFAULTS, DRIFT_ALLOWED, Options
from steelyard.pipelines.rows import rows_to_fit
from steelyard.sanity import (
    after,
    allow_softness,
    drift_of,
    examine,
    examine_body,
    examine_masses,
    examine_sensor,
    examine_wrench_unit,
    impossible_density,
    maybe_hollow,
)
from steelyard.spatial import Pose

if TYPE_CHECKING:
    from steelyard.pipelines.shape_in_parts import Shape

# [m] No robot holds a part that fills a cube of this edge; one of a centimetre in millimetres does.
LARGEST = 2.0
# Findings after which motion or wrench are no body's.
MISREAD = {"wrench-unexplained", "motion-mismatch", "weight-compensated"}
# Findings of what a load and a bias share: a tared sensor has no bias.
OF_BIAS = {"nearly-planar"}
# Where an acceleration comes from that does not see the arm's structure bend.
ENCODERS = ("position", "linear_velocity")


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
    known = identify(tool, options) if isinstance(tool, Recording) else tool
    known = None if known is None else _in_log_sign(known, recording)
    recording, before = examine(recording)
    before = before if recording.described else tuple(finding.instead(BARE) for finding in before)
    rows = rows_to_fit(recording, before, options)
    log, aligned, touched, unmeasured = rows.log, rows.aligned, rows.touched, rows.unmeasured
    before = before if rows.place is None else (*before, rows.place.finding)
    shape = None if parts is None else _shape(parts, recording.object_pose, recording.object_pose_std)
    load = _Load(log, Bias(options.bias, drift=options.drift), options, shape, known)
    with _beside(before):
        load, estimate = load.followed()
    drift = drift_of(log)
    late = after(log, estimate, aligned, recording, drift)
    if load.bias.free and not load.bias.drift and drift and drift.sure and "base-tilted" not in {f.code for f in late}:
        load, estimate = replace(load, bias=replace(load.bias, drift=True)).followed()
        estimate = estimate.noted(f"{DRIFT_ALLOWED}, as the log shows (most surely {drift.surest_words})")
        late = after(log, estimate, aligned, recording, drift)
    late = late if unmeasured else (*late, *examine_masses(log, (*before, *late)))
    if load.shape is None:
        late = examine_wrench_unit(log, estimate, lambda rows: replace(load, log=rows).estimate(), before, late)
    touched, late = _not_following(touched, before, late)
    estimate = load.without_tool(estimate).noted(
        *rows.level, *unmeasured, *[f"{DRIFT_ALLOWED}, as asked"] * options.drift
    )
    estimate = estimate if rows.place is None else rows.place.widened(estimate)
    estimate, of_sensor = examine_sensor(log, recording, estimate, (*before, *late), load.bias.drift)
    if any(f.code == "sensor-turned" for f in of_sensor):
        before = tuple(f for f in before if f.code != "sensor-turned")  # the fit tells it better
    if load.shape is None:
        of_sensor = (*of_sensor, *examine_body(estimate, (*before, *late, *of_sensor)))
    if aligned.acceleration_from in ENCODERS and load.shape is None:
        estimate = allow_softness(log, estimate)
    aligned = replace(aligned, notes=()) if unmeasured else aligned
    if not (parts is None or isinstance(parts, Parts)):
        before = (*before, *(finding.instead(WEIGHED if load.shape else {}) for finding in parts.findings))
        estimate = estimate.noted(*parts.notes)
    # What is wrong with the log stands before what follows from it.
    own, estimate = estimate.findings, replace(_with_gain(estimate, aligned), findings=())
    told = (*before, *late, *of_sensor, *own, *aligned.findings, *touched)
    estimate = estimate.with_findings(*(f for f in told if load.bias.free or f.code not in OF_BIAS))
    if parts is not None and shape is not None:
        estimate = _looked_at(estimate, parts, shape, load.shape is not None)
        if load.shape and not any(recording.object_pose_std or ()):
            estimate = estimate.noted("pose_in_sensor was taken as exact: give std_mm and std_deg with it if it is not")
    if "weight-compensated" in estimate.codes():
        estimate = estimate.without_inertia("What a controller leaves of a weight has no inertia of its own.")
    if estimate.codes() & (MISREAD if rows.place is None else MISREAD - {"motion-mismatch"}):
        estimate = estimate.with_remedies(UNEXPLAINED)
    elif unmeasured or log.still.all():
        estimate = estimate.with_remedies(UNMEASURED if unmeasured else AT_REST)
    estimate = replace(estimate, delays_s=dict(aligned.delays_s)).noted(*recording.notes, *aligned.notes)
    return _in_recording_sign(estimate, recording)


def _not_following(
    touched: tuple[Finding, ...], before: tuple[Finding, ...], late: tuple[Finding, ...]
) -> tuple[tuple[Finding, ...], tuple[Finding, ...]]:
    """Return the findings `touched` and `late` without what only seems so in a wrong unit, or by a cause left in."""
    left_in = any(f.left_in for f in before)
    # A unit that was found before was put right, and what is touched then is touched.
    wrong_unit = any(f.code in {"force-unit", "length-in-mm"} for f in late)
    seen = tuple(f for f in late if not (left_in and f.code == "nearly-planar"))
    return () if wrong_unit else touched, seen


@contextmanager
def _beside(findings: tuple[Finding, ...]) -> Iterator[None]:
    """Say with a refusal what was noticed before: it is the likely cause."""
    try:
        yield
    except CannotAnswer as error:
        if not findings:
            raise
        said = " ".join(f"{f.message} {f.remedy}" for f in findings)
        if any(f.left_in for f in findings):
            # More poses would be as wrong: what was noticed says what to do.
            lost = str(error).partition(ADD_POSES)[0].rstrip()
            raise CannotAnswer(f"Noticed before the fit: {said} As the log was read: {lost}") from None
        raise CannotAnswer(f"{error} Noticed before the fit: {said}") from None


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

    tool, parts as in `identify`; `pose` is X_SO, where the object's frame sits in S (there, if None), and `pose_std`
    its standard deviations [m], [rad].
    """
    if options.gravity == "unknown":
        raise BadValue('gravity "unknown" needs a recording with rotations: rows know gravity in the sensor only.')
    shape = None if parts is None else _shape(parts, pose or Pose.identity(), pose_std)
    load = _Load(log, Bias(options.bias, drift=options.drift), options, shape, tool)
    load, estimate = load.followed()
    estimate = load.without_tool(estimate)
    if parts is None or shape is None:
        return estimate
    return _looked_at(estimate, parts, shape, load.shape is not None)


@dataclass(frozen=True)
class _Load:
    """Rows to fit, and all that is known beforehand of what they weigh: tool, object, or both."""

    log: MotionLog
    bias: Bias
    options: Options
    shape: Placed | None
    tool: Estimate | None

    def estimate(self) -> Estimate:
        """Return what was held: the tool still in it unless there is a shape."""
        estimator, notes = estimator_for(self.options, self.log, self.bias, self.shape, self.tool)
        estimate = estimator.identify(self.log)
        if self.shape is not None and not estimate.evidence.rank:
            raise CannotAnswer(
                "The data fix nothing of the body, not even its mass: the wrench does not follow the orientations. "
                "Check their unit, form and clock; the shape alone weighs nothing."
            )
        estimate = replace(estimate, notes=(*notes, *estimate.notes))
        if self.shape is None:
            return estimate
        parts, prior, error = self.shape
        light = maybe_hollow(error, estimate.mass, float(parts[0].volume.sum()))
        return replace(self, shape=(parts, prior, light[0])).estimate().noted(light[1]) if light else estimate

    def followed(self) -> tuple[_Load, Estimate]:
        """Return what was held, with the load, which has lost a shape that cannot follow what the log alone can say."""
        try:
            return self, self.estimate()
        except (NoMasses, *BREAKDOWNS):
            if self.shape is None:
                raise
            alone = replace(self, shape=None)
            return alone, alone.estimate()

    def without_tool(self, estimate: Estimate) -> Estimate:
        """Return the object alone."""
        if self.tool is None:
            return estimate
        if self.shape is not None:
            return estimate.noted(f"a tool of {self.tool.mass:.4g} kg was taken away; each run had a bias of its own")
        prior = bias_prior(self.tool) if self.bias.free else None
        if prior is None:
            return without_tool(estimate, self.tool, shared=False).noted("the tool's run tells nothing about the bias")
        same, p = shares_bias(self.tool, estimate)
        if not same:
            return without_tool(estimate, self.tool, shared=False).with_findings(different_bias(p))
        again = replace(self, bias=replace(self.bias, prior=prior)).estimate()
        shared = without_tool(again, self.tool, shared=True)
        return shared.noted(f"one sensor bias is shared with the tool's run (p = {p:.2g})")


def _looked_at(estimate: Estimate, parts: Parts | Shape, shape: Placed, followed: bool) -> Estimate:
    """Return the estimate with what its densities give away, and a shape that was not followed, before all findings."""
    dense = impossible_density(estimate, *_volume(parts, shape), estimate.parts)
    lost = () if followed else (contradicted(estimate, max(shape[0], key=len)),)
    return replace(estimate, findings=(*dense, *lost, *estimate.findings))


def _with_gain(estimate: Estimate, aligned: Aligned) -> Estimate:
    """Return the estimate with the gain error of the accelerometer that alone measured a - g, where there was one.

    f = m (a - g): a reading too small by a share makes mass and first moment too large by the same share.
    """
    if aligned.acceleration_from != "specific_force":
        return estimate
    share = max((m.scale_std for m in aligned.mounts.values()), default=0.0)
    slope = np.concatenate([estimate.parameters.vector[:4], np.zeros(6)])
    return replace(estimate, covariance=estimate.covariance + share**2 * np.outer(slope, slope))


def _shape(parts: Parts | Shape, pose: Pose | None, std: tuple[float, float] | None) -> Placed:
    """Return cuts into parts in the sensor's frame, the weight that each has beforehand, and how wrong they may be."""
    if pose is None:
        raise BadValue(
            "parts need the place of the object in the sensor: give [object] pose_in_sensor in the description."
        )
    grasp = std or (0.0, 0.0)
    if isinstance(parts, Parts):
        _require_metres(parts)
        error = MEASURED.at_least(parts.com_std, parts.stretch, parts.turn_std)
        return (parts.in_frame(pose),), None, error.placed(*grasp, pose.position)
    cuts = parts.cuts()
    placed = tuple(cut.in_frame(pose) for cut in cuts.parts)
    return placed, cuts.prior, parts.error.placed(*grasp, pose.position)


def _volume(parts: Parts | Shape, placed: Placed) -> tuple[float, float]:
    """Return the volume of a shape [m^3] and its standard deviation, as a share of it."""
    std = placed[2].stretch if isinstance(parts, Parts) else parts.solid.volume_std
    return float(placed[0][0].volume.sum()), std


def _require_metres(parts: Parts) -> None:
    """Raise BadValue where the parts are too large for any robot: their mesh is in millimetres."""
    size = float(np.cbrt(parts.volume.max()))
    if size > LARGEST:
        raise BadValue(
            f"the largest part has a volume of {parts.volume.max():.3g} m^3, a cube of {size:.3g} m; a held object's "
            f"must be below {LARGEST:g} m. The mesh is probably in millimetres: scale it by 0.001."
        )


def _in_recording_sign(estimate: Estimate, recording: Recording) -> Estimate:
    """Return the estimate with its bias as the raw channels read it."""
    sign = recording.wrench_sign
    return replace(estimate, wrench_bias=sign * estimate.wrench_bias, cross_covariance=sign * estimate.cross_covariance)


_in_log_sign = _in_recording_sign
