"""JointTeam: everything that a team measured in one estimate.

poses or twists -> grasps, homes, clocks (joint maximum likelihood) -> fused motion -> ten parameters with bias and gain
per recording
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

from steelyard import check
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.team.changes.found import whose_slip
from steelyard.team.clocks.errors import NOTHING, ClockErrors
from steelyard.team.clocks.jumps import cut_at_jumps
from steelyard.team.clocks.lags import searched
from steelyard.team.clocks.unsteady import steadied
from steelyard.team.estimate import TeamEstimate
from steelyard.team.hinge.payload import hinge_findings
from steelyard.team.hinge.rows import COUNT
from steelyard.team.hinge.team import identify_two_bodies
from steelyard.team.misread.poses import require_own_files, require_well_read
from steelyard.team.misread.twists import require_twists_well_read
from steelyard.team.motion_fit import F, MotionFit, Tilted
from steelyard.team.poses.covariance import grasp_covariance
from steelyard.team.poses.team import PoseTeam
from steelyard.team.poses.yielding import stiffened
from steelyard.team.published import require_wrenches
from steelyard.team.split import UNPLACED, Split, find_split, rigidity_findings
from steelyard.team.team_findings import gains, late_clocks, open_parameters
from steelyard.team.twists.team import TwistTeam
from steelyard.team.twists.turning_gains import TurningGains
from steelyard.team.weighed import Seen, clocked, weighed

# What is found of robots that then no longer disagree: poses that are misread may pass for it.
CHANGES = {"grasp-slipped", "robot-left", "robot-joined"}
UNLEVEL = "bases disagree on where gravity points: the bars hold how far their mean may be off"


@dataclass(frozen=True)
class JointTeam:
    """Options of the joint estimator.

    clocks      whether each robot's clock offset is estimated
    gains       whether errors of the force axes' gains are allowed for, as large as the recordings show
    wrists      mass [kg] that moves with each named robot's grasp between its force sensor and the payload: it is
                taken out, as a point at the grasp. It moves like the payload and cannot be told from it by any motion
    highest_hz  of what motion and wrench are compared at; above, a payload carried by robots hardly moves
    slipped     with two robots: which slips, the clearest first, are those of the robot that shows them less; None =
                what the wrenches say
    """

    clocks: bool = True
    gains: bool = True
    wrists: Mapping[str, float] = field(default_factory=dict)
    highest_hz: float = 4.0
    slipped: tuple[bool, ...] | None = None

    def __post_init__(self) -> None:
        check.positive("highest_hz", self.highest_hz)

    def identify(self, log: TeamLog) -> TeamEstimate:
        """Return the team's answer in the reference grasp. Raises CannotAnswer where the data leave it open."""
        require_wrenches(log)
        self._require_wrists(log)
        log = log.while_holding()
        log, jumped = cut_at_jumps(log, drifts=True) if self.clocks else (log, NOTHING)
        if self.slipped is None:
            return whose_slip(log, lambda slipped: self._answer(log, jumped, slipped))
        return self._answer(log, jumped, self.slipped)

    def _answer(self, log: TeamLog, jumped: ClockErrors, slipped: Sequence[bool]) -> TeamEstimate:
        """Return the answer with stamps put right by `jumped`, and slips taken for the robots' that `slipped` says."""
        seen = (self._from_twists if needs_twists(log) else self._from_poses)(log, jumped, slipped)
        if isinstance(seen, TeamEstimate):
            return seen
        answer = self._weighed(seen)
        if not seen.tipped:
            return answer
        others = [self._weighed(replace(seen, rows=rows)).parameters.vector for rows in seen.tipped]
        return answer.allowing(*(other - answer.parameters.vector for other in others)).noted(UNLEVEL)

    def _weighed(self, seen: Seen) -> TeamEstimate:
        return weighed(seen, self.wrists, self.gains, self.highest_hz)

    def _from_twists(self, log: TeamLog, jumped: ClockErrors, slipped: Sequence[bool]) -> Seen:
        """Return what twists show; raises CannotAnswer where two bodies with a hinge move on bases that move."""
        log, moving, begun = self._fitted(log, partial(TwistTeam.of, other=slipped), jumped)
        turning = TurningGains.of(moving.parts, moving.fit.grasps, moving.fit.noise)
        tilt, differ = moving.tilt(log.names), tuple(turning.findings(log.names))
        if differ or _doubtful(moving, tilt):
            require_twists_well_read(log, moving)
        apart = rigidity_findings(moving.split, log.names, UNPLACED)
        if moving.split is not None and moving.split.sure:
            raise CannotAnswer(" ".join(finding.message for finding in apart))
        spread = replace(moving.fit.spread, level=moving.level(log.names.index(log.reference)))
        spread = turning.widened(spread, moving.fit.grasps)
        found = [*moving.findings, *apart, *differ]
        if tilt is not None:
            found.append(tilt.finding)
            moving = moving if tilt.odd is None else moving.without_level(tilt.odd)
        made, path = moving.rows(self.highest_hz)
        return Seen(log, moving, spread, begun, tuple(found), made, path, moving.down())

    def _from_poses(self, log: TeamLog, jumped: ClockErrors, slipped: Sequence[bool]) -> Seen | TeamEstimate:
        """Return what poses show, or the answer itself where the payload is two bodies with a hinge.

        Raises BadValue where one robot's poses are misread.
        """
        of = partial(PoseTeam.of, other=slipped)
        try:
            log, standing, begun = self._fitted(log, of, jumped)
        except check.FAILURES:
            require_well_read(log)
            raise
        log, standing, yields = stiffened(log, standing, lambda stiff: of(stiff, self.clocks))
        reference = log.names.index(log.reference)
        spread = yields.widened(grasp_covariance(standing.fit), standing.fit.grasps, reference)
        spread = replace(spread, level=standing.level(log))
        split = find_split(standing.parts, reference) if standing.rough else None
        jointed = None if split is None else self._jointed(log, split, standing.findings, begun)
        if jointed is not None:
            return jointed
        tilt = standing.tilt(log, spread)
        if _doubtful(standing, tilt):
            require_well_read(log)
        if standing.rough:
            require_own_files(log)
        found = [*standing.findings, *yields.findings(log), *rigidity_findings(split, log.names)]
        if tilt is not None:
            found.append(tilt.finding)
            log = log if tilt.odd is None else log.without_gravity(log.names[tilt.odd])
        made, path = standing.rows(log, self.highest_hz)
        tipped = tuple(standing.rows(log, self.highest_hz, tip)[0] for tip in standing.tipped(log, spread))
        return Seen(log, standing, spread, begun, tuple(found), made, path, standing.down(log), yields, tipped)

    def _fitted(
        self, log: TeamLog, of: Callable[[TeamLog, bool], F], jumped: ClockErrors
    ) -> tuple[TeamLog, F, ClockErrors]:
        """Return log, fit, and how late clocks are beside what the fit says: begun anew where robots disagree."""
        team, begun = of(log, self.clocks), NOTHING
        if self.clocks and team.rough:
            log, team, begun = searched(log, team, lambda moved: of(moved, True))
        begun = jumped + begun
        if team.rough:
            return log, team, begun
        return steadied(log, team, lambda moved: of(moved, True), begun)

    def _jointed(
        self, log: TeamLog, split: Split, standing: Sequence[Finding], begun: ClockErrors
    ) -> TeamEstimate | None:
        """Return the estimate of two bodies with a hinge, None where there is no hinge or too little is shown of it.

        Numbers that degenerate on the way count as too little. Of the rigid fit's findings (`standing`), only who let
        go or took hold is said again: that shows in the wrenches. The hinge itself may pass for a slip.
        """
        try:
            team, payload = identify_two_bodies(log, split, self.clocks, self.gains, self.wrists, self.highest_hz)
        except check.FAILURES:
            return None
        team = clocked(team, begun.first(log))
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


def _doubtful(team: MotionFit, tilt: Tilted | None) -> bool:
    """Return whether motion may be misread: robots disagree, on where gravity points, too, or did until rows were left
    out in which one of them slipped or let go.
    """
    return team.rough or tilt is not None or any(one.code in CHANGES for one in team.findings)


def needs_twists(log: TeamLog) -> bool:
    """Return whether a base moves, or a robot measured no pose: then only twists can be compared."""
    return any(robot.base == "moving" for robot in log.robots) or not all(
        any(track.has("rotation", "position") for _, track in log.tracks_of(name)) for name in log.names
    )
