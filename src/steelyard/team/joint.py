"""JointTeam: everything that a team measured in one estimate.

poses or twists -> grasps, homes, clocks (joint maximum likelihood) -> fused motion -> ten parameters with bias and gain
per recording
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.logs.team_log import TeamLog
from steelyard.team.assembled import assembled, team_size
from steelyard.team.changes.odd_recording import without_odd
from steelyard.team.changes.yielding import Yields, stiffened
from steelyard.team.clocks.errors import NOTHING, ClockErrors, Errors
from steelyard.team.clocks.search import F, searched
from steelyard.team.clocks.unsteady import steadied
from steelyard.team.consistent import consistent
from steelyard.team.estimate import TeamEstimate
from steelyard.team.hinge.axis import UNPLACED, Split, find_split, rigidity_findings
from steelyard.team.hinge.bodies import hinge_findings
from steelyard.team.hinge.rows import COUNT
from steelyard.team.hinge.team import identify_two_bodies
from steelyard.team.mass_and_com import WITHOUT_WRISTS, require_lift
from steelyard.team.misread.exchanged import require_own_files
from steelyard.team.misread.forces import with_one_reading
from steelyard.team.misread.length_units import require_metres
from steelyard.team.misread.poses import require_well_read
from steelyard.team.misread.signs import sign_finding, torque_sign_finding, with_one_sign
from steelyard.team.misread.torques import with_torque_sign
from steelyard.team.misread.twists import require_one_velocity_unit
from steelyard.team.payload.balance import require_balance
from steelyard.team.payload.body_rows import BodyRows, balance_frame, require_runs, summing
from steelyard.team.payload.doubt import weight_by_gains
from steelyard.team.payload.fit import fit_payload
from steelyard.team.payload.model import Group, unit_bias
from steelyard.team.payload.motion_noise import motion_noise
from steelyard.team.payload.spectra import band_edges, gathered
from steelyard.team.poses.covariance import grasp_covariance
from steelyard.team.poses.team import PoseTeam
from steelyard.team.published import require_wrenches
from steelyard.team.team_findings import (
    bad_robots,
    gains,
    late_clocks,
    lost_directions,
    open_parameters,
    tilted_bases,
    unseen_gains,
    unsettled,
    vertical,
)
from steelyard.team.twists.team import TwistTeam
from steelyard.team.twists.turning_gains import TurningGains
from steelyard.team.unexplained import unexplained

# Below this chi^2 per degree of freedom the motion is no measurement.
LEAST_CHI2 = -0.1
# Forces are not compared along the axes of grasps whose rotation is known no better than this [rad]: what that leaves
# of their sum is as much as a misreading.
COMPARABLE = 0.1
# The mass is open where so much of it lies along what is not shown: mostly it is all of it or next to nothing.
UNWEIGHED = 0.5
# Findings that say already why forces do not fit.
TOLD = {"wrench-unexplained", "force-unit", "payload-not-rigid"}


@dataclass(frozen=True)
class JointTeam:
    """Options of the joint estimator.

    clocks      whether each robot's clock offset is estimated
    gains       whether errors of the force axes' gains are allowed for, as large as the recordings show
    wrists      mass [kg] that moves with each named robot's grasp between its force sensor and the payload: it is
                taken out, as a point at the grasp. It moves like the payload and cannot be told from it by any motion
    highest_hz  of what motion and wrench are compared at; above, a payload carried by robots hardly moves
    """

    clocks: bool = True
    gains: bool = True
    wrists: Mapping[str, float] = field(default_factory=dict)
    highest_hz: float = 4.0

    def __post_init__(self) -> None:
        check.positive("highest_hz", self.highest_hz)

    def identify(self, log: TeamLog) -> TeamEstimate:
        """Return the team's answer in the reference grasp. Raises CannotAnswer where the data leave it open."""
        require_wrenches(log)
        self._require_wrists(log)
        if needs_twists(log):
            log, moving, begun = self._fitted(log, TwistTeam.of)
            if moving.rough:
                require_one_velocity_unit(log, moving)
            apart = rigidity_findings(moving.split, log.names, UNPLACED)
            if moving.split is not None and moving.split.sure:
                raise CannotAnswer(" ".join(finding.message for finding in apart))
            grasps, noise, late, left = moving.fit.grasps, moving.fit.noise, moving.late, moving.fit.left
            spread = replace(moving.fit.spread, level=moving.level(log.names.index(log.reference)))
            turning = TurningGains.of(moving.parts, grasps, noise)
            spread = turning.widened(spread, grasps)
            made, path = moving.rows(self.highest_hz)
            found = [*moving.findings, *apart, *turning.findings(log.names)]
            down, order = moving.down(), 1
        else:
            log, standing, begun, yields = self._standing(log)
            grasps, noise = standing.fit.team.grasps, standing.fit.noise
            spread = yields.widened(grasp_covariance(standing.fit), grasps, log.names.index(log.reference))
            spread = replace(spread, level=standing.level(log))
            late, order, left = _against(standing.late, log.reference), 2, standing.fit.left
            split = find_split(standing.parts, log.names.index(log.reference)) if standing.rough else None
            jointed = None if split is None else self._jointed(log, split, standing.findings, begun)
            if jointed is not None:
                return jointed
            if standing.rough:
                require_well_read(log)
                require_own_files(log)
            found = [*standing.findings, *yields.findings(log), *rigidity_findings(split, log.names)]
            if not spread.blind.size:
                found += tilted_bases(log, standing.fit.team.homes)
            made, path = standing.rows(log, self.highest_hz)
            down = vertical(standing.gravity(log), standing.fit.team.motion)
        require_metres(log.names, grasps)
        placed = balance_frame(grasps).inverse() @ grasps
        require_balance(log, [body for body, _ in made], placed)
        groups = _groups(made, path, self.highest_hz, order)
        size = team_size(grasps, spread)
        known = spread.turn(size) < COMPARABLE
        groups, D, read = _with_forces_read(groups, summing(placed), log.names, known)
        six_axis = np.array([not log.force_only(name) for name in log.names])
        C = unit_bias(D, six_axis, size)
        payload = fit_payload(groups, D, C, size, self.gains)
        payload, odd = without_odd(payload, groups, D, C, size, self.gains)
        _require_one_clock(payload.chi2)
        if not any(one.code == "payload-not-rigid" for one in found):
            _require_mass(payload.lost)
        team = _without_wrists(assembled(log, grasps, spread, payload, D, late), self.wrists, size)
        team = _clocked(team, begun.first(log))
        found += [
            *read,
            *odd,
            *(() if any(one.code in TOLD for one in (*found, *read)) else unexplained(payload, D, log.names)),
            *lost_directions(team.grasps, down),
            *late_clocks(team.clock_offsets_s, team.clock_offset_std_s),
            *begun.findings(log),
            *bad_robots(log.names, noise),
            *(gains(payload.gain, payload.gainless) if known else ()),
            *open_parameters(team.identified, team.evidence.rank),
        ]
        said = (*unsettled(left), *unseen_gains(team, weight_by_gains(groups, D)))
        return replace(team, findings=tuple(found), notes=(*team.notes, *said))

    def _standing(self, log: TeamLog) -> tuple[TeamLog, PoseTeam, ClockErrors, Yields]:
        """Return log, fit of poses and clocks like `_fitted`, and how far grasps yield.

        Raises BadValue where one robot's poses are misread.
        """
        try:
            log, team, begun = self._fitted(log, PoseTeam.of)
        except (CannotAnswer, BadValue, np.linalg.LinAlgError):
            require_well_read(log)
            raise
        log, team, yields = stiffened(log, team, lambda stiff: PoseTeam.of(stiff, self.clocks))
        return log, team, begun, yields

    def _fitted(self, log: TeamLog, of: Callable[[TeamLog, bool], F]) -> tuple[TeamLog, F, ClockErrors]:
        """Return log, fit, and how late clocks are beside what the fit says: begun anew where robots disagree."""
        team, begun = of(log, self.clocks), NOTHING
        if self.clocks and team.rough:
            log, team, begun = searched(log, team, lambda moved: of(moved, True))
        if team.rough:
            return log, team, begun
        log, team, errors = steadied(log, team, lambda moved: of(moved, True))
        return log, team, begun + errors

    def _jointed(
        self, log: TeamLog, split: Split, standing: Sequence[Finding], begun: ClockErrors
    ) -> TeamEstimate | None:
        """Return the estimate of two bodies with a hinge, None where there is no hinge or too little is shown of it.

        Numbers that degenerate on the way count as too little. Of the rigid fit's findings (`standing`), only who let
        go or took hold is said again: that shows in the wrenches. The hinge itself may pass for a slip.
        """
        if split.hinge is None:
            return None
        try:
            team, payload = identify_two_bodies(log, split, self.clocks, self.gains, self.wrists, self.highest_hz)
        except (CannotAnswer, BadValue, np.linalg.LinAlgError):
            return None
        team = _clocked(team, begun.first(log))
        found = [
            *hinge_findings(team),
            *team.findings,
            *(finding for finding in standing if finding.code in ("robot-left", "robot-joined")),
            *late_clocks(team.clock_offsets_s, team.clock_offset_std_s),
            *begun.findings(log),
            *gains(payload.gain, payload.gainless),
            *open_parameters(team.identified, team.evidence.rank, COUNT),
        ]
        return replace(team, findings=tuple(found))

    def _require_wrists(self, log: TeamLog) -> None:
        """Raise BadValue where a wrist's mass is none, or that of a robot that is not there."""
        unknown = sorted(set(self.wrists) - set(log.names))
        if unknown:
            raise BadValue(f"a mass is given for the wrist of '{unknown[0]}', who is not in the team.")
        for name, mass in self.wrists.items():
            check.not_negative(f"the mass of the wrist of '{name}'", mass)


def _with_forces_read(
    groups: tuple[Group, ...], D: Array, names: Sequence[str], known: bool
) -> tuple[tuple[Group, ...], Array, list[Finding]]:
    """Return groups and D (6, 6 N) with one robot's forces read as they fit the others', and why.

    known  whether grasps' rotations are: forces along axes that nobody knows are not compared
    """
    if known:
        groups, read, doubtful = with_one_reading(groups, D, names)
    else:
        read, doubtful = (), np.zeros(len(names), np.bool_)
    D, signs = with_one_sign(groups, D, names, doubtful)
    found = [*(one for one in read if not (signs and one.code == "wrench-unexplained")), *signs]
    odd, D = with_torque_sign(groups, D) if known else (None, D)
    if odd is not None:
        whole = sign_finding(names[odd])
        found = [*(one for one in found if one != whole), torque_sign_finding(names[odd], whole in found)]
    return groups, D, found


def _without_wrists(team: TeamEstimate, wrists: Mapping[str, float], size: float) -> TeamEstimate:
    """Return the estimate less a point mass at every grasp named; raises CannotAnswer where nothing is left.

    size  of the team [m]
    """
    if not wrists:
        return team
    places = np.array([team.grasps[name].pose.position for name in wrists])
    points = InertialParameters.from_point_masses(np.array(list(wrists.values())), places)
    left = team.parameters - points
    require_lift(float(left.mass), WITHOUT_WRISTS)
    # What is left of a body less points need be none: masses that are too large take more than there is.
    units = np.concatenate([[1.0], np.full(3, size), np.full(6, size**2)]) * float(left.mass)
    return replace(team, parameters=InertialParameters(consistent(left.vector, team.covariance, units)))


def _require_one_clock(chi2: float) -> None:
    """Raise CannotAnswer where noise of the motion would explain more of the wrench than there is."""
    if chi2 < LEAST_CHI2:
        raise CannotAnswer(
            f"motion and forces do not belong together: what noise of the motion makes of them is more than all that "
            f"was measured (chi^2 per degree of freedom {chi2:.3g}). Check units of time and rates of the streams."
        )


def _require_mass(lost: Array) -> None:
    """Raise CannotAnswer where the mass lies along directions (10, L) that the rows do not show: it would be zero."""
    if np.linalg.norm(lost[0]) > UNWEIGHED:
        raise CannotAnswer(
            "motion and forces do not show the mass: noise of the motion is as large as what it tells beside a bias of "
            "the forces. Turn the payload about two axes, farther or faster, or measure the motion better."
        )


def _against(late: Mapping[str, float], reference: str) -> dict[str, float]:
    """Return how late every clock is against the reference's."""
    return {name: seconds - late[reference] for name, seconds in late.items()}


def _clocked(team: TeamEstimate, first: Errors) -> TeamEstimate:
    """Return the estimate with how late every clock is with what it was off by in the first recording."""
    late = {n: seconds + first[n].late if n in first else seconds for n, seconds in team.clock_offsets_s.items()}
    std = {
        n: float(np.hypot(doubt, first[n].late_std)) if n in first else doubt
        for n, doubt in team.clock_offset_std_s.items()
    }
    return replace(team, clock_offsets_s=late, clock_offset_std_s=std)


def needs_twists(log: TeamLog) -> bool:
    """Return whether a base moves, or a robot measured no pose: then only twists can be compared."""
    return any(robot.base == "moving" for robot in log.robots) or not all(
        any(track.has("rotation", "position") for _, track in log.tracks_of(name)) for name in log.names
    )


def _groups(made: list[tuple[BodyRows, Array]], noise: Array, highest_hz: float, order: int) -> tuple[Group, ...]:
    """Return the recordings with complete wrenches in two groups, at rest and in motion; order 2: poses, 1: twists."""
    out = []
    for still in (True, False):
        some = [(body, left) for body, left in made if body.runs and body.still == still]
        if not some:
            continue
        rows, residuals = zip(*some, strict=True)
        edges = band_edges(rows, highest_hz)
        spectra = tuple(gathered(r, edges, highest_hz) for r in rows)
        shaped = motion_noise(rows, residuals, noise, edges, highest_hz, order)
        out.append(Group(spectra, shaped, np.ones((len(edges), 6))))
    require_runs(out)
    return tuple(out)
