"""The payload of a team by its wrenches, once the motion has shown where everybody holds it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.logs.team_log import TeamLog
from steelyard.team.assembled import assembled, consistent, team_size
from steelyard.team.changes.contact import unpropped, unpushed, untouched, without_odd
from steelyard.team.changes.load_steps import with_one_load
from steelyard.team.clocks.errors import ClockErrors, Errors
from steelyard.team.estimate import TeamEstimate
from steelyard.team.mass_and_com import WITHOUT_WRISTS, require_lift
from steelyard.team.misread.files import require_metres
from steelyard.team.misread.forces import reread, with_one_reading
from steelyard.team.misread.moment_places import with_moments_at_grasps
from steelyard.team.misread.own_gain import own_gain
from steelyard.team.misread.signs import TORQUES_TURNED, sign_finding, torque_sign_finding, torques_of_other_sign
from steelyard.team.motion_fit import MotionFit, against
from steelyard.team.payload.body_rows import PayloadRows, balance_frame, require_balance, require_runs, summing
from steelyard.team.payload.doubt import weight_by_gains
from steelyard.team.payload.fit import PayloadFit, Weighing, fit_payload
from steelyard.team.payload.late_forces import with_timely_forces
from steelyard.team.payload.model import Group, unit_bias, units_of_body, weight
from steelyard.team.payload.room_forces import with_room_forces
from steelyard.team.payload.spectra import band_edges, gathered, motion_noise
from steelyard.team.poses.covariance import Spread
from steelyard.team.poses.yielding import Yields
from steelyard.team.team_findings import (
    bad_robots,
    gains,
    late_clocks,
    lost_directions,
    open_parameters,
    pulled_in_room,
    uncalibrated,
    unseen_gains,
    unsettled,
)
from steelyard.team.unexplained import covariance_of_unexplained, unexplained

# Below this chi^2 per degree of freedom the motion is no measurement.
LEAST_CHI2 = -0.1
# Forces are not compared along the axes of grasps whose rotation is known no better than this [rad]: what that leaves
# of their sum is as much as a misreading.
COMPARABLE = 0.1
# The mass is open where so much of it lies along what is not shown: mostly it is all of it or next to nothing.
UNWEIGHED = 0.5
# A mass below zero by fewer standard deviations is open; by more, a sign is wrong.
OPEN_SIGN = 3.0
# Findings that say already why forces do not fit.
TOLD = {"wrench-unexplained", "force-unit", "payload-not-rigid"}


@dataclass(frozen=True, eq=False)
class Seen:
    """What the motion of a team shows, before anything is weighed.

    log       with clocks put right
    motion    the joint fit     spread  to within which its grasps are known
    begun     how late clocks are in single recordings, beside what the fit says
    rows      of every recording, beside residuals (T, N, 6)     path  (6, 6) their covariance
    down      (3,) gravity in R, None where nobody tells it
    yields    how far grasps yield, by what they push; None where that was not asked
    tipped    rows as of `rows`, with gravity off by what bases leave open about either level axis; none if they agree
    """

    log: TeamLog
    motion: MotionFit
    spread: Spread
    begun: ClockErrors
    findings: tuple[Finding, ...]
    rows: PayloadRows
    path: Array
    down: Array | None
    yields: Yields | None = None
    tipped: tuple[PayloadRows, ...] = ()


def weighed(seen: Seen, wrists: Mapping[str, float], with_gain: bool, highest_hz: float) -> TeamEstimate:
    """Return the answer; raises CannotAnswer where the wrenches leave it open.

    wrists, highest_hz, and with_gain for `gains`: as of `JointTeam`
    """
    log, motion, grasps, spread = seen.log, seen.motion, seen.motion.fit.grasps, seen.spread
    require_metres(log.names, grasps)
    placed = balance_frame(grasps).inverse() @ grasps
    D = summing(placed)
    require_balance(log, [body for body, _ in seen.rows], placed)
    size = team_size(grasps, spread)
    known = spread.turn(size) < COMPARABLE
    six_axis = np.array([not log.force_only(name) for name in log.names])

    def fitted(rows: PayloadRows) -> Weighing:
        groups = _groups(rows, seen.path, highest_hz, motion.ORDER)
        groups = tuple(replace(group, sighted=known) for group in groups)
        groups, read, taken = _with_forces_read(groups, D, log.names) if known else (groups, (), {})
        fit = again(groups)
        if known and (taken or not read):  # forces that are misread, and left so, tell no places
            moved_groups, moved_fit, places = with_moments_at_grasps(groups, fit, again, D, C, six_axis)
            if places is not None and not rather_a_gain(groups, fit) and not beside_pulls(moved_fit)[1]:
                groups, fit = moved_groups, moved_fit
                moved = places.taken(log.names)
                taken = {**taken, **{name: M @ taken.get(name, np.eye(6)) for name, M in moved.items()}}
                read = (*read, places.finding(log.names))
        return Weighing(groups, _summing_given(D, log.names, taken), read, taken, fit)

    def as_given(rows: PayloadRows) -> Weighing:
        groups = _groups(rows, seen.path, highest_hz, motion.ORDER)
        return Weighing(groups, D, (), {}, again(groups))

    def again(some: tuple[Group, ...]) -> PayloadFit:
        return fit_payload(some, D, C, size, with_gain)

    def rather_a_gain(groups: tuple[Group, ...], fit: PayloadFit) -> bool:
        """Return whether one robot's gain leaves nothing for moments about other points to explain."""
        one = own_gain(groups, fit, again, D)
        return one is not None and with_moments_at_grasps(one.groups, one.fit, again, D, C, six_axis)[2] is None

    def beside_pulls(fit: PayloadFit) -> tuple[PayloadFit, float]:
        """Return the fit beside what stands still in the room, and how large that is [N]; as it is where grasps may be
        elsewhere, since that explains forces as well.
        """
        return (fit, 0.0) if spread.blind.size else with_room_forces(fit, D, C, placed.position, six_axis, with_gain)

    C = unit_bias(D, six_axis, size)
    standing, propped = unpropped(seen.rows, fitted, D, highest_hz)
    standing, begun, pushed = unpushed(standing, fitted(standing), as_given, fitted, size, highest_hz)
    rows, begun, late = with_timely_forces(standing, begun, fitted, highest_hz)
    rows, alike, loaded = with_one_load(rows, begun, fitted, D, size, highest_hz)
    _, first, touched = untouched(rows, alike, fitted, size, highest_hz)
    groups, read, payload = first.groups, first.read, first.payload
    payload, odd = without_odd(payload, groups, D, C, size, with_gain)
    plain = payload
    # What a filter takes of accelerations passes for it.
    payload, pull = beside_pulls(payload) if late is None else (payload, 0.0)
    _require_one_clock(payload.chi2)
    if not any(one.code == "payload-not-rigid" for one in seen.findings):
        _require_mass(payload)
        require_lift(float(payload.parameters[0]), "the forces")
    told = any(one.code in TOLD for one in (*seen.findings, *read))
    wrong = () if told else tuple(unexplained(payload, D, log.names, placed=not spread.blind.size))
    left_so = bool(read) and not first.taken  # what is named and not put right is in the forces still
    if wrong or left_so:
        more = covariance_of_unexplained(payload, D, log.names, forces=left_so)
        payload = replace(payload, covariance=payload.covariance + more)
    asked = known and with_gain and not (told or wrong or left_so or odd)
    own = own_gain(groups, plain, again, D) if asked else None
    if own is not None:
        payload = replace(payload, covariance=payload.covariance + own.more)
    if late is not None:
        payload = replace(payload, covariance=payload.covariance + late.unsure(payload, D))
    if seen.yields is not None:
        # Of all sensors only the sum of their biases is known: it may be that of any one.
        borne = np.linalg.solve(D.reshape(6, -1, 6).swapaxes(0, 1), payload.biases.T)
        each = np.asarray(borne, np.float64)
        spread = seen.yields.biased(spread, grasps, log.names.index(log.reference), each.transpose(2, 0, 1))
    team = _without_wrists(
        assembled(log, grasps, spread, payload, D, against(motion.late, log.reference)), wrists, size
    )
    team = clocked(team, seen.begun.first(log))
    pulls, little = pulled_in_room(pull, weight(payload.parameters))
    # Who errs, when, and what was read wrongly comes before what is seen of grasps, and that before what does not fit.
    found = (
        *bad_robots(log.names, motion.fit.noise),
        *seen.begun.findings(log),
        *late_clocks(team.clock_offsets_s, team.clock_offset_std_s),
        *read,
        *(() if late is None else late.findings(log.names)),
        *seen.findings,
        *propped,
        *loaded,
        *pushed,
        *touched,
        *odd,
        *pulls,
        *(gains(payload.gain, payload.gainless) if known and own is None else ()),
        *wrong,
        *(() if own is None else (own.finding(log.names),)),
        *lost_directions(team.grasps, seen.down, motion.apart),
        *open_parameters(team.identified, team.evidence.rank),
    )
    said = (*unsettled(motion.fit.left), *little, *unseen_gains(team, weight_by_gains(groups, D)))
    said = said if motion.ORDER == 1 else (*said, *uncalibrated(seen.spread.recurring))
    return replace(team, findings=found, notes=(*team.notes, *said), wrench_maps=first.taken)


def _with_forces_read(
    groups: tuple[Group, ...], D: Array, names: Sequence[str]
) -> tuple[tuple[Group, ...], tuple[Finding, ...], Mapping[str, Array]]:
    """Return groups with wrenches read as they fit the others', why, and by robot as what (6, 6).

    D  (6, 6 N) sums the pushes at B
    """
    groups, found, reading = with_one_reading(groups, D, names)
    taken = {} if reading is None else {names[reading[0]]: reading[1]}
    odd = torques_of_other_sign(groups, D)
    if odd is not None:
        name, whole = names[odd], sign_finding(names[odd])
        groups = reread(groups, odd, TORQUES_TURNED)
        taken[name] = TORQUES_TURNED @ taken.get(name, np.eye(6))
        found = (*(one for one in found if one != whole), torque_sign_finding(name, whole in found))
    return groups, found, taken


def _summing_given(D: Array, names: Sequence[str], taken: Mapping[str, Array]) -> Array:
    """Return D (6, 6 N) for pushes as given, some of which were taken for others (6, 6)."""
    maps = [taken.get(name, np.eye(6)) for name in names]
    return np.concatenate([block @ M for block, M in zip(np.split(D, len(names), axis=1), maps, strict=True)], axis=1)


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
    units = units_of_body(float(left.mass), size)
    return replace(team, parameters=InertialParameters(consistent(left.vector, team.covariance, units)))


def _require_one_clock(chi2: float) -> None:
    """Raise CannotAnswer where noise of the motion would explain more of the wrench than there is."""
    if chi2 < LEAST_CHI2:
        raise CannotAnswer(
            f"motion and forces do not belong together: what noise of the motion makes of them is more than all that "
            f"was measured (chi^2 per degree of freedom {chi2:.3g}). Check units of time and rates of the streams."
        )


def _require_mass(payload: PayloadFit) -> None:
    """Raise CannotAnswer where the mass lies along directions that the rows do not show, where it would be zero, and
    where biases leave even its sign open.
    """
    mass, std = float(payload.parameters[0]), float(np.sqrt(payload.covariance[0, 0]))
    if np.linalg.norm(payload.lost[0]) > UNWEIGHED or -OPEN_SIGN * std < mass <= 0:
        raise CannotAnswer(
            "motion and forces do not show the mass: beside a bias of the forces, what they tell of it is no more than "
            "noise. Turn the payload about two axes, farther or faster, or measure the motion better; check the sign "
            "of each robot's forces."
        )


def clocked(team: TeamEstimate, first: Errors) -> TeamEstimate:
    """Return the estimate with how late every clock is with what it was off by in the first recording."""
    late = {n: seconds + first[n].late if n in first else seconds for n, seconds in team.clock_offsets_s.items()}
    std = {
        n: float(np.hypot(doubt, first[n].late_std)) if n in first else doubt
        for n, doubt in team.clock_offset_std_s.items()
    }
    return replace(team, clock_offsets_s=late, clock_offset_std_s=std)


def _groups(made: PayloadRows, noise: Array, highest_hz: float, order: int) -> tuple[Group, ...]:
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
