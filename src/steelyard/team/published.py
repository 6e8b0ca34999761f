"""The paper's estimator, step by step: grasp kinematics, loop closure, mass and centre of mass, inertia matrix.

Source: "Cooperative Payload Estimation by a Team of Mocobots", III and IV-B. It gives no cut-off, no weights and no
covariance; ours are the default of `cutoff_hz`, weights by the residuals of the star of pairs, formal covariances.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.evidence import Evidence
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import parameter_jacobian
from steelyard.logs.clock import median_step
from steelyard.logs.stillness import MOVING, TURNING
from steelyard.logs.team_conditioning import all_conditioned
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_rows import TeamRows
from steelyard.spatial import Pose
from steelyard.team import grasp_kinematics
from steelyard.team.estimate import GraspEstimate, TeamEstimate
from steelyard.team.grasp_kinematics import Pair, total_wrench
from steelyard.team.inertia_matrix import InertiaFit, Negative, inertia, made_positive, moment_about
from steelyard.team.loop_closure import refine
from steelyard.team.mass_and_com import MassAndCom, mass_and_com

FORMAL = (
    "standard deviations are formal, from white residuals of each step by itself: the paper gives none, and with "
    "correlated noise or force bias these are too small."
)


@dataclass(frozen=True)
class PublishedTeam:
    """The published sequence.

    cutoff_hz   of the zero-phase fourth-order Butterworth filter; None = data that need none
    close_loops whether the star of pairs is refined over all pairs and loops (with three robots or more)
    trim_s      cut from both ends of motion recordings, as the paper does for its inertia (4 s there)
    negative    what happens to negative eigenvalues of the inertia: "clamp" to zero, or "discard" the answer
    """

    cutoff_hz: float | None = 3.0
    close_loops: bool = True
    trim_s: float = 0.0
    negative: Negative = "clamp"

    def identify(self, log: TeamLog) -> TeamEstimate:
        """Return the team's answer in the reference grasp.

        Raises BadValue for clocks that cannot be joined, CannotAnswer where a step lacks motion, poses or wrenches.
        """
        require_wrenches(log)
        grasps, pairs = self.grasps(log)
        rest = self.mass_and_com(log, grasps)
        try:
            turning = self.inertia(log, grasps, rest.com)
        except CannotAnswer as error:
            open_ = Finding.of("inertia-not-identified", f"The inertia is not told: {error}")
            return _assembled(log, grasps, pairs, rest, findings=(open_,))
        matrix, below = made_positive(turning.matrix, self.negative)
        notes = (f"{below} negative principal moment(s) were set to zero.",) if below else ()
        return _assembled(log, grasps, pairs, rest, replace(turning, matrix=matrix), notes)

    def grasps(self, log: TeamLog) -> tuple[Pose, dict[str, Pair]]:
        """Return the grasps in the reference grasp, and the star of pairs that they started from (eq. 1-8)."""
        moving = _conditioned(log, log.of_kind("grasp"), self.cutoff_hz)
        if not moving:
            raise CannotAnswer("grasps need a recording in motion, of kind grasp or motion; there is none.")
        twists = np.concatenate([rows.twist for rows in moving], axis=1)
        measured = np.concatenate([rows.has_twist for rows in moving], axis=1)
        pairs = grasp_kinematics.star(log.names, twists, measured, log.reference)
        found = grasp_kinematics.from_star(log.names, pairs)
        if self.close_loops and len(log.names) > 2:
            found = refine(log.names, found, pairs, twists, measured)
        return found, pairs

    def mass_and_com(self, log: TeamLog, grasps: Pose) -> MassAndCom:
        """Return mass and centre of mass in the reference grasp from still rows (eq. 9-16)."""
        if len(log.names) == 2 and all(log.force_only(name) for name in log.names):
            raise CannotAnswer(
                "two robots with passive gimbals cannot hold a payload still: nothing resists the moment about the "
                "line that joins their grasps, so still poses tell nothing sound. Add a third robot or a six-axis "
                "wrist, or use the joint method, which works from motion."
            )
        still = tuple(r for r in log.recordings if r.kind == "still")
        # Still rows are averaged, which no filter improves on: near its ends it would weigh single samples heavily.
        resting = _conditioned(log, still or log.of_kind("motion"), None if still else self.cutoff_hz)
        level = [_level(log, rows) for rows in resting]
        chosen = [
            _at_rest(rows, bool(still)) & rows.complete_wrench() & rows.has_gravity[teller]
            for rows, teller in zip(resting, level, strict=True)
        ]
        told = zip(resting, level, chosen, strict=True)
        gravity = [grasps[i].rotation.apply(rows.gravity[i])[keep] for rows, i, keep in told]
        wrench = [total_wrench(grasps, rows.carried_wrench)[keep] for rows, keep in zip(resting, chosen, strict=True)]
        if not any(map(len, gravity)):
            raise CannotAnswer(
                "mass and centre of mass need rows at rest in which every carrying robot has a wrench; there are none. "
                "Record still poses, at least two, tilted against each other."
            )
        return mass_and_com(np.concatenate(gravity), np.concatenate(wrench))

    def inertia(self, log: TeamLog, grasps: Pose, com: Array) -> InertiaFit:
        """Return the inertia about `com` (3,) [m] in R's axes (eq. 17-32); negative eigenvalues stay.

        Rates and angular accelerations are the reference robot's alone. The covariance counts as many rows as the
        low-pass leaves free.
        """
        omega, alpha, moment = [], [], []
        alike = 1.0
        for rows in _conditioned(log, log.of_kind("motion"), self.cutoff_hz):
            if self.trim_s:
                rows = rows.trimmed(self.trim_s)
            hub = rows.index(log.reference)
            keep = rows.has_rate[hub] & rows.complete_wrench()
            omega.append(rows.twist[hub, keep, :3])
            alpha.append(rows.twist_rate[hub, keep, :3])
            moment.append(moment_about(total_wrench(grasps, rows.carried_wrench)[keep], com))
            alike = max(alike, self._alike(rows))
        if not omega:
            raise CannotAnswer("the inertia needs a recording in motion; there is none.")
        fit = inertia(*(np.concatenate(part) for part in (omega, alpha, moment)))
        return replace(fit, covariance=alike * fit.covariance)

    def _alike(self, rows: TeamRows) -> float:
        """Return how many rows the low-pass leaves for one that tells something new: two in a period of its cut-off."""
        if self.cutoff_hz is None or len(rows.time) < 2:
            return 1.0
        return max(1.0, 1 / (2 * self.cutoff_hz * median_step(rows.time)))


def _conditioned(log: TeamLog, recordings: Sequence[TeamRecording], cutoff_hz: float | None) -> tuple[TeamRows, ...]:
    """Return the rows of recordings, filtered; who holds nothing says nothing of the payload's motion."""
    held = dict(zip(log.recordings, log.while_holding().recordings, strict=True))
    return all_conditioned(log, tuple(held[recording] for recording in recordings), cutoff_hz)


def require_wrenches(log: TeamLog) -> None:
    """Raise CannotAnswer where nobody, or not every robot, has measured a wrench."""
    dumb = [name for name in log.names if not log.has_wrench(name)]
    if len(dumb) == len(log.names):
        raise CannotAnswer("no robot of the team measured a force, so mass, centre of mass and inertia stay open.")
    silent = [name for name in dumb if not all(name in r.away for r in log.recordings if r.kind != "grasp")]
    if silent:
        raise CannotAnswer(
            f"every robot that carries must measure its force, or the sum falls short; '{silent[0]}' has none. Add it, "
            "or say that the robot was away."
        )


def _at_rest(rows: TeamRows, declared: bool) -> Mask:
    """Return rows (T,) at rest: all of a still recording; else those in which no robot that is seen moves."""
    if declared:
        return np.ones(len(rows.time), np.bool_)
    quick = (np.linalg.norm(rows.twist[..., :3], axis=-1) > TURNING) | (
        np.linalg.norm(rows.twist[..., 3:], axis=-1) > MOVING
    )
    return np.asarray(~(quick & rows.has_twist).any(0) & rows.has_twist.any(0))


def _level(log: TeamLog, rows: TeamRows) -> int:
    """Return the robot that tells gravity: the reference, or the first other one that can."""
    order: Sequence[str] = (log.reference, *log.others)
    for name in order:
        if rows.has_gravity[rows.index(name)].any():
            return rows.index(name)
    raise CannotAnswer(
        "somebody must know where gravity points: give [team] gravity for level bases and rotations, or a gravity "
        "channel of a level sensor to at least one robot."
    )


def _assembled(
    log: TeamLog,
    grasps: Pose,
    pairs: dict[str, Pair],
    rest: MassAndCom,
    turning: InertiaFit | None = None,
    notes: tuple[str, ...] = (),
    findings: tuple[Finding, ...] = (),
) -> TeamEstimate:
    """Return the answer of the steps; without `turning` the inertia stays open."""
    known = turning is not None
    # Nothing of the payload is much farther from its centre of mass than the grasps are from each other.
    reach = float(np.linalg.norm(grasps.position, axis=1).max())
    people = np.zeros((10, 10))
    people[0, 0] = rest.mass_std**2
    people[1:4, 1:4] = rest.com_covariance
    people[4:, 4:] = turning.covariance if turning else (rest.mass * reach**2) ** 2 * np.eye(6)
    body = InertialParameters.from_com(rest.mass, rest.com, turning.matrix if turning else np.zeros((3, 3)))
    back = parameter_jacobian(body.vector.copy())
    evidence = Evidence(
        rank=10 if known else 4,
        condition=turning.condition if turning else float(1 / max(np.sin(rest.tilt), 1e-9)),
        samples=rest.samples + (turning.samples if turning else 0),
        still_samples=rest.samples,
        residual_force_N=rest.residual_force,
        residual_torque_Nm=turning.residual if turning else rest.residual_moment,
    )
    return TeamEstimate(
        parameters=body,
        covariance=back @ people @ back.T,
        method="paper",
        evidence=evidence,
        identified=np.array([True] * 4 + [known] * 6),
        frame=log.reference,
        findings=findings,
        notes=(FORMAL, *notes),
        reference=log.reference,
        grasps={
            name: GraspEstimate(grasps[i], pairs[name].covariance if name in pairs else np.zeros((6, 6)))
            for i, name in enumerate(log.names)
        },
    )
