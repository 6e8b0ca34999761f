"""What is weighed: the rows of a log, and all that is known beforehand of their load, its tool, its object, or both."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from steelyard.check import BREAKDOWNS
from steelyard.errors import BadValue, CannotAnswer, NoMasses
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias
from steelyard.identify.masses.placement import contradicted, lies_elsewhere
from steelyard.identify.masses.shape_error import MEASURED
from steelyard.identify.masses.uneven import explains
from steelyard.identify.tool import bias_prior, different_bias, shares_bias, without_tool
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.parts.parts import Parts
from steelyard.pipelines.choice import Placed, estimator_for
from steelyard.pipelines.options import Options
from steelyard.sanity.fitted.no_body import impossible_density, maybe_hollow
from steelyard.spatial import Pose

if TYPE_CHECKING:
    from steelyard.pipelines.shape_in_parts import Shape

# What helps a refusal where the sensor is not tared.
WITH_BIAS = "With a bias estimated the data answer: leave out --bias none."
# [m] No robot holds a part that fills a cube of this edge; one of a centimetre in millimetres does.
LARGEST = 2.0
# [m], [rad] What a place in the sensor may err by, per axis, where nobody says: not at all, as in a fixture; as camera
# and gripper do that are calibrated well, or fairly; as a tape measure does.
PLACES = (KNOWN_PLACE, *((1e-3 * size, float(np.radians(size / 3))) for size in (1, 3, 10)))


@dataclass(frozen=True)
class Load:
    """Rows to fit, and all that is known beforehand of what they weigh.

    log      the rows
    bias     what the sensor's bias may be
    options  what the caller chose
    shape    the object's parts in S, in every cut that the log may choose from; None where they are not known
    tool     a result of the gripper that is in the log; None where there is none to take away
    """

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
        cuts = self.shape.cuts
        per_mass = next((cut.per_mass for cut in cuts if len(cut) == len(estimate.parts)), None)
        light = maybe_hollow(self.shape.error, estimate, float(cuts[0].volume.sum()), per_mass)
        if not light:
            return estimate
        error, note = light
        return replace(self, shape=self.shape._replace(error=error)).estimate().noted(note)

    def followed(self) -> tuple[Load, Estimate]:
        """Return what was held, with the load, which has lost a shape that cannot follow what the log alone can say."""
        try:
            return self._unless_elsewhere(self.estimate())
        except (NoMasses, *BREAKDOWNS):
            if self.shape is None:
                raise
            alone = replace(self, shape=None)
            return alone, alone.estimate()
        except CannotAnswer as error:
            if self.freed() is None:
                raise
            raise CannotAnswer(f"{error} {WITH_BIAS}") from None

    def _unless_elsewhere(self, estimate: Estimate) -> tuple[Load, Estimate]:
        """Return load and estimate, both of the log alone where that shows the shape to lie elsewhere beyond doubt."""
        if self.shape is None or "part-not-homogeneous" not in estimate.codes():
            return self, estimate
        alone = replace(self, shape=None)
        try:
            found = alone.estimate()
        except CannotAnswer:
            return self, estimate
        held = found if self.tool is None else without_tool(found, self.tool, shared=False)
        if lies_elsewhere(held, explains(estimate.findings), self.shape.finest, self.shape.loosest):
            return alone, found
        return self, estimate

    def freed(self) -> Estimate | None:
        """Return what was held by the log alone, with the bias of a sensor estimated that is said to be tared.

        None where it is estimated anyway, or the log does not tell it.
        """
        if self.bias.free:
            return None
        try:
            return replace(self, bias=Bias(), shape=None).estimate()
        except CannotAnswer:
            return None

    def of(self, log: MotionLog) -> Estimate:
        """Return what other rows weigh, with the same known beforehand."""
        return replace(self, log=log).estimate()

    def drifting(self, settling: float) -> Load:
        """Return the load with a bias that may drift in time, and settles with a time constant [s]."""
        return replace(self, bias=replace(self.bias, drift=True, settling=settling))

    def without_tool(self, estimate: Estimate) -> Estimate:
        """Return the object alone."""
        if self.tool is None:
            return estimate
        if self.shape is not None:
            return estimate.noted(f"a tool of {self.tool.mass:.4g} kg was taken away; each run had a bias of its own")
        prior = bias_prior(self.tool) if self.bias.free else None
        if prior is None:
            return without_tool(estimate, self.tool, shared=False)
        same, p = shares_bias(self.tool, estimate)
        if not same:
            return without_tool(estimate, self.tool, shared=False).with_findings(different_bias(p))
        again = replace(self, bias=replace(self.bias, prior=prior)).estimate()
        shared = without_tool(again, self.tool, shared=True)
        return shared.noted(f"one sensor bias is shared with the tool's run (p = {p:.2g})")


def require_place(pose: Pose | None) -> Pose:
    """Return the pose of a shape in the sensor, X_SO; raises BadValue where there is none."""
    if pose is None:
        raise BadValue(
            "parts and scans need the place of the object in the sensor: give --pose-in-sensor (in Python "
            "pose_in_sensor=), or [object] pose_in_sensor in the description."
        )
    return pose


def placed(parts: Parts | Shape | None, pose: Pose | None, std: tuple[float, float] | None) -> Placed | None:
    """Return the object's shape in the sensor's frame; None without one.

    pose, std  X_SO and its standard deviations [m], [rad]; the log tells these (PLACES) where None
    """
    if parts is None:
        return None
    pose = require_place(pose)
    places = PLACES if std is None else (std,)
    if isinstance(parts, Parts):
        _require_metres(parts)
        error = MEASURED.at_least(parts.com_std, parts.stretch, parts.turn_std)
        return Placed((parts.in_frame(pose),), None, error.placed(*KNOWN_PLACE, pose.position), places)
    cuts = parts.cuts()
    in_sensor = tuple(cut.in_frame(pose) for cut in cuts.parts)
    return Placed(in_sensor, cuts.prior, parts.error.placed(*KNOWN_PLACE, pose.position), places)


def looked_at(estimate: Estimate, parts: Parts | Shape, shape: Placed, followed: bool) -> Estimate:
    """Return the estimate with what its densities give away, and a shape that was not followed, before all findings."""
    dense = impossible_density(estimate, *_volume(parts, shape), estimate.parts)
    lost = () if followed else (contradicted(estimate, shape.finest),)
    return replace(estimate, findings=(*dense, *lost, *estimate.findings))


def _volume(parts: Parts | Shape, placed: Placed) -> tuple[float, float]:
    """Return the volume of a shape [m^3] and its standard deviation, as a share of it."""
    std = placed.error.stretch if isinstance(parts, Parts) else parts.solid.volume_std
    return float(placed.cuts[0].volume.sum()), std


def _require_metres(parts: Parts) -> None:
    """Raise BadValue where the parts are too large for any robot: their mesh is in millimetres."""
    size = float(np.cbrt(parts.volume.max()))
    if size > LARGEST:
        raise BadValue(
            f"the largest part has a volume of {parts.volume.max():.3g} m^3, a cube of {size:.3g} m; a held object's "
            f"must be below {LARGEST:g} m. The mesh is probably in millimetres: scale it by 0.001."
        )
