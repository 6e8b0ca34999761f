"""Finding: there is an answer, and you must know this about it.

One table gives every code its remedy; `docs/findings.md` has an entry for each. The message carries the numbers.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

REMEDIES: dict[str, str] = {
    "wrench-sign-flipped": 'Set wrench = "on-sensor" in [log] ("on-object" if that is what it says).',
    "gravity-frame": "Check [log] gravity (in the world frame) and that rotation turns S into W, not W into S.",
    "gravity-in-g": 'Set unit = "g" for this channel, or correct [log] gravity to m/s^2.',
    "weight-compensated": "Set the payload in the controller, or in the sensor's driver, to zero, and record again; or "
    "reckon: mass = set + answered, centre of mass = both centres, weighted by mass.",
    "motion-mismatch": "Check that the position is that of S, its unit, the unit of time, and filters of the force.",
    "wrench-unexplained": "Check order and signs of columns, angles, clocks, and a payload set in the controller.",
    "force-unit": "Check the force and torque units of the wrench stream.",
    "length-in-mm": 'Set the unit that the numbers have: "mm" (or "m") for positions, "N*mm" (or "N*m") for torques.',
    "time-unit": 'Set the unit that the stamps have: "s", "ms", "us" or "ns".',
    "quaternion-order": "Swap form between quaternion-wxyz and quaternion-xyzw.",
    "sensor-turned": "Set mount = { rotation = [..], form = 'rotation-vector' } of the wrench, or correct the poses.",
    "gains-differ": "Calibrate the sensor, or weigh a known mass in several poses.",
    "base-tilted": "Level the base, or correct [log] gravity to the direction found. If it is level, look for what "
    "pulls one way in the room, as a hose or a spring does: it counts as weight.",
    "stream-delayed": "Give this stream the delay that the message says, so that it is not estimated anew.",
    "imu-rotated": "Give mount = { rotation = .. } for this stream so that it is not estimated anew.",
    "clock-missing": "Record a time column, or give time = { rate = .. }, so that delay and noise can be judged.",
    "rows-duplicated": "Log each sensor sample once; repeated rows were left out.",
    "channel-stuck": "Check the cable and the driver of this channel.",
    "channel-saturated": "Lower the load, move more gently, or take a sensor with a wider range.",
    "bias-drift": "Warm the sensor up, tare just before the run, or record shorter runs.",
    "outliers": "Nothing to do if knocks were expected; the rows were left out.",
    "contact": "Keep people and fixtures off the object, then record again; the touched time was left out. An arm that "
    "estimates its wrench from the torques of its joints may err as much by itself.",
    "cable-force": "Lead cables so that they do not pull, and switch the payload compensation of controllers off; or "
    "weigh a known mass with the team once.",
    "load-changed": "Record one run per load: cut the log where the load changed.",
    "too-few-poses": "Add still poses whose gravity directions in S differ by more than 30 degrees.",
    "nearly-planar": "Add poses that tilt gravity out of that plane, so that it visits all axes of S.",
    "inertia-not-identified": "Turn the object faster about the weak axes, with stops between the turns.",
    "prior-dominated": "Add faster rotation; the number shown is mostly the assumed prior.",
    "noise-level-off": "Correct [noise], or leave it out so that it is estimated.",
    "part-zero-mass": "Check the part's label and shape; merge it with a neighbour of the same material.",
    "centroids-coplanar": "Move between the poses as well, or merge parts of the same material.",
    "more-parts-than-rank": "Merge parts of the same material, or turn the object faster between the poses.",
    "surface-open": "Close the surface: weld equal vertices, fill holes, or scan the missing side.",
    "views-disagree": "Check the hand-eye calibration, camera.json, and that each pose belongs to its image.",
    "object-cut": "Move the camera back, or aim it at the middle, so that most images hold the whole object.",
    "several-objects": "Scan one object at a time, or check that the one kept is the one meant.",
    "cloud-in-mm": "Give the points in metres.",
    "thin-thickened": "Scan thin walls more densely, with normals from the views, or give the object as a mesh.",
    "cloud-thinned": "Nothing to do; give fewer points if you want to choose them yourself.",
    "cloud-noisy": "Nothing to do; points with less noise show thinner walls.",
    "table-in-cloud": "Cut the table's points away, or give the views to `steelyard scan`, which finds the table.",
    "table-uneven": "Scan on a flat, hard surface, without a cloth: gaps over its folds count as solid.",
    "normals-flipped": "Turn the normals outward, or leave them out so that they are found.",
    "parts-overlap": "Cut one part out of the other, so that they only touch and no volume counts twice.",
    "part-unseen": "Nothing to do if the part is hidden inside; give its shape, since no scan can see it.",
    "parts-unsure": "Give --parts if you know how many, join parts of one material, or let a log of forces decide.",
    "part-not-homogeneous": "Check the shape, and that pose_in_sensor is of its own frame (that of a scan is not "
    "a mesh's), not its inverse, and in the right unit (m, mm); if all are right, split the part by material.",
    "materials-tied": "Move faster, add poses, or shorten the list of materials.",
    "materials-impossible": "Add the missing material to the list, or check the shape and its units.",
    "grasp-direction-lost": "Turn the payload about a second axis as well, or move it along the missing direction.",
    "clock-offset": "Nothing to do: the offsets were taken out. Synchronise the robots' clocks to be rid of them.",
    "clock-unsteady": "Nothing to do: clocks were put right in every recording. Keep one clock through the session.",
    "grasp-yields": "Nothing to do: poses were put right. Stiffer grippers or lighter loads tell more.",
    "grasp-slipped": "Clamp this grasp tighter; record again if you need its pose after the slip.",
    "robot-left": "Nothing to do if the robot was meant to let go; its rows after that were left out.",
    "robot-joined": "Nothing to do if the robot was meant to join; its rows before that were left out.",
    "robot-excluded": "Check whether its file is of this run, its clock, encoders and columns, or leave it out.",
    "turning-gains": "Calibrate the gyros against each other, or take twists from poses where a base stands.",
    "common-gain-unseen": "Weigh a known mass with the team once; a gain error that all robots share looks like mass.",
    "payload-jointed": "Weigh one body by itself to know each mass; lock the hinge to weigh both as one.",
    "payload-not-rigid": "Stiffen the payload or its grasps, or move slower.",
    "tool-included": "Give --tool (a result or a tool-only log) if you want the object alone.",
    "rows-missing": "Check the robot's network and logger if they were not meant to be missing; they were left out.",
}

# What helps instead where all rows are at rest, as in a table of still poses: there is no motion to make faster.
AT_REST: dict[str, str] = {
    "inertia-not-identified": "Record a log with times in which the object turns, or give its shape (parts or a scan).",
    "centroids-coplanar": "Record a log with times in which the object turns, or merge parts of the same material.",
    "more-parts-than-rank": "Merge parts of the same material, or record a log with times in which the object turns.",
}
# And where nothing measured the acceleration of S.
UNMEASURED: dict[str, str] = {
    "inertia-not-identified": "Record the position of the sensor or an accelerometer as well: "
    "without its acceleration only rest counts.",
}
# And where the motion, or the wrench, is no body's as it was read.
UNEXPLAINED: dict[str, str] = {
    "inertia-not-identified": "See to the findings above first, then identify again.",
    "stream-delayed": "See to the findings above first: until then, this delay is a guess.",
}
# And where a shape lies elsewhere than its pose says, so that it was left out.
OTHER_FRAME: dict[str, str] = {
    "part-not-homogeneous": "Give the pose of the shape's own frame with --pose-in-sensor FILE: a cloud of `steelyard "
    "scan` lies in the frame W of its views, not in that of a mesh, which the log's [object] may be for. Check that it "
    "is of the object in the sensor, not its inverse, and in the right unit (m, mm). If it is right but rough, state "
    "std_mm and std_deg with it.",
}
# And where a bare data file was read, or rows were typed: no description is there to be corrected.
BARE: dict[str, str] = {
    "wrench-sign-flipped": "Nothing to do if z of the world points up: the answer has the sign found. To say the sign, "
    'set wrench = "on-sensor" or "on-object" and gravity in [log] of what `steelyard identify FILE --describe` writes.',
}


@dataclass(frozen=True)
class Finding:
    """A code of `formats`, one sentence with the numbers, and what to do.

    left_in  whether the log was read with it, cause as it is: what it makes a log look like is then not told as well
    """

    code: str
    message: str
    remedy: str
    left_in: bool = False

    @classmethod
    def of(cls, code: str, message: str) -> Finding:
        """Return the finding with the remedy of its code."""
        return cls(code, message, REMEDIES[code])

    def plain(self) -> dict[str, str]:
        """Return the finding as JSON has it."""
        return {"code": self.code, "message": self.message, "remedy": self.remedy}

    def instead(self, remedies: Mapping[str, str]) -> Finding:
        """Return the finding with the remedy that `remedies` have for its code, if they have one."""
        return replace(self, remedy=remedies.get(self.code, self.remedy))


# What touched or changed the load while it was recorded, single rows beside that, and what the data then cannot show.
# All else comes before these: what was read wrongly, and what of the sensor or the shape is wrong.
_OF_THE_RUN = {"contact", "cable-force", "load-changed", "bias-drift", "grasp-slipped", "robot-left", "robot-joined"}
_LEFT_OUT = {"outliers"}
_CANNOT_SHOW = {
    "too-few-poses",
    "nearly-planar",
    "inertia-not-identified",
    "prior-dominated",
    "noise-level-off",
    "part-zero-mass",
    "centroids-coplanar",
    "more-parts-than-rank",
    "materials-tied",
    "grasp-direction-lost",
    "tool-included",
    "common-gain-unseen",
}


def codes(findings: Iterable[Finding]) -> set[str]:
    """Return the codes of all findings."""
    return {finding.code for finding in findings}


def other_than(findings: Iterable[Finding], *gone: str) -> tuple[Finding, ...]:
    """Return findings without those of some codes."""
    return tuple(finding for finding in findings if finding.code not in gone)


def by_cause(findings: Iterable[Finding]) -> tuple[Finding, ...]:
    """Return findings with causes before what follows from them, else as they came.

    First what was read wrongly, then what touched or changed during the run, then what the data cannot show.
    """
    later = (_OF_THE_RUN, _LEFT_OUT, _CANNOT_SHOW)
    return tuple(sorted(findings, key=lambda f: next((k for k, codes in enumerate(later, 1) if f.code in codes), 0)))


def percent(share: float) -> str:
    """Return a share as a message says it: whole per cent, below ten two figures."""
    return f"{100 * share:.0f} %" if share > 0.1 else f"{100 * share:.2g} %"


def counted(count: int, noun: str) -> str:
    """Return a number of things as a message says it: "1 part", "2 parts"."""
    return f"{count} {noun}{'s' * (count != 1)}"


def quoted(names: Iterable[str], between: str = " and ") -> str:
    """Return names as a message says them: each in quotes, one after the other."""
    return between.join(f"'{name}'" for name in names)


def about(value: float) -> str:
    """Return a factor as a message says it: two figures, without a power of ten."""
    return f"{float(f'{value:.2g}'):g}"


def with_bar(value: float, std: float) -> str:
    """Return "value ± std" as a message says it: two figures of the standard deviation, and the value to the same."""
    places = min(max(1 - math.floor(math.log10(std)), 0), 9) if std > 0 else 1
    return f"{value:.{places}f} ± {std:.{places}f}"
