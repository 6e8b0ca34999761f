"""A team whose payload is two bodies with a hinge: grasps, hinge, the whole and what can be told of each body."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import CannotAnswer
from steelyard.evidence import Evidence
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.inertia.parameters import frame_change
from steelyard.inertia.regressor import basis
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose, Rotation, axial_vector, cross_matrix
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.assembled import consistent, known
from steelyard.team.estimate import BodyEstimate, GraspEstimate, HingeEstimate, TeamEstimate
from steelyard.team.hinge.payload import (
    FROM_TEN,
    HingedPayload,
    Kind,
    both_bodies,
    fit_hinged_payload,
    second_body,
    seen_from,
    seven_rows,
)
from steelyard.team.hinge.poses import GUESS, Hinged, HingedFit, finished, fit_hinged, followed, rates
from steelyard.team.hinge.rows import COUNT, WHOLE, Bands, Sums, bodies_of, gathered, hinge_frame, robot_of_other_sign
from steelyard.team.mass_and_com import WITHOUT_WRISTS, require_lift
from steelyard.team.motion_fit import CLOCK_ROUNDS, PUNCTUAL, against, later
from steelyard.team.payload.body_rows import BodyRows, reach, require_runs
from steelyard.team.payload.doubt import turned_by_step
from steelyard.team.payload.gain_sight import of_force
from steelyard.team.payload.spectra import band_edges, shares_of, tilt_noise
from steelyard.team.poses.covariance import Spread, variances_against
from steelyard.team.poses.measured import TeamMotion
from steelyard.team.poses.solver import OWN
from steelyard.team.poses.team import FEW_ROWS, mean_gravity
from steelyard.team.split import Split
from steelyard.team.stacked import Stretch, stretches, with_rows

# Rows that are enough to come near the optimum.
ROUGH_ROWS = 200
# Sweeps over a row with which the motion follows grasps, homes and hinge from wherever it was.
FOLLOWED = 3


def fit_two_bodies(log: TeamLog, split: Split, clocks: bool) -> tuple[tuple[Stretch, ...], HingedFit, dict[str, float]]:
    """Return recordings with their clocks right, the fit of all their rows, and how late every clock is [s].

    Raises CannotAnswer where the motion leaves more open than it must.
    """
    if split.hinge is None:
        raise CannotAnswer("what is between the two bodies is no hinge.")
    reference, late = log.names.index(log.reference), dict.fromkeys(log.names, 0.0)
    parts = stretches(log, late)
    data = TeamMotion.of(parts)
    team = first_hinged(data, split.twist, reference, split.groups[1], split.hinge[:2])
    few, some = (slice(None, None, max(1, len(data.valid) // rows)) for rows in (ROUGH_ROWS, FEW_ROWS))
    team = followed(data, team, GUESS, FOLLOWED)
    fit = fit_hinged(data.rows(few), team.rows(few), reference, GUESS, None)
    for _ in range(CLOCK_ROUNDS if clocks else 1):
        team = followed(data, replace(fit.team, motion=team.motion, angle=team.angle), fit.noise, FOLLOWED)
        speed = _speeds(parts, team)[some] if clocks else None
        fit = fit_hinged(data.rows(some), team.rows(some), reference, fit.noise, speed)
        step = fit.team.delays
        late = later(late, step)
        if not clocks or np.abs(step).max() < PUNCTUAL:
            break
        before, parts = parts, stretches(log, late)
        data, team = TeamMotion.of(parts), team.rows(_places(before, parts))
        fit = replace(fit, team=replace(fit.team, delays=np.zeros(len(step))))
    if fit.lost:
        raise CannotAnswer("the motion does not show where the hinge is and where the robots hold.")
    team = followed(data, replace(fit.team, motion=team.motion, angle=team.angle), fit.noise, FOLLOWED)
    last = finished(data, replace(fit, team=team), reference, _speeds(parts, team) if clocks else None)
    return parts, last, later(late, last.team.delays - fit.team.delays)


def _speeds(parts: tuple[Stretch, ...], team: Hinged) -> Array:
    """Return how motion and angle change (T, 7), recording by recording."""
    return np.concatenate([rates(team.rows(rows), part.rate) for part, rows in with_rows(parts)])


def _places(before: tuple[Stretch, ...], after: tuple[Stretch, ...]) -> Integers:
    """Return which row of `before` is nearest to each of `after`, recording by recording."""
    middles = [(part.time[1:] + part.time[:-1]) / 2 for part in before]
    each = zip(middles, after, with_rows(before), strict=True)
    return np.concatenate([rows.start + np.searchsorted(middle, now.time) for middle, now, (_, rows) in each])


def identify_two_bodies(
    log: TeamLog, split: Split, clocks: bool, gains: bool, wrists: Mapping[str, float], highest_hz: float
) -> tuple[TeamEstimate, HingedPayload]:
    """Return the estimate of the whole with the hinge and its bodies; options as in `JointTeam`.

    Raises CannotAnswer where the motion does not show the hinge and the grasps.
    """
    parts, fit, late = fit_two_bodies(log, split, clocks)
    team, sums = fit.team, Sums.of(fit.team)
    kinds, turned, maps = _kinds(log, parts, fit, sums, highest_hz)
    size = reach(team.grasps)
    six_axis = np.repeat([not log.force_only(name) for name in log.names], 6)
    force = of_force(len(six_axis))
    payload = fit_hinged_payload(kinds, sums, np.where(force, 1.0, size * six_axis), size, gains)
    require_lift(float(payload.parameters[0]), "the forces")
    doubt, frame = _Doubt.of(payload, fit, force), hinge_frame(team)
    seventeen = payload.parameters - _wrists(log, team, wrists)
    require_lift(float(seventeen[0]), WITHOUT_WRISTS)
    units, whole = payload.scale[:WHOLE], slice(0, WHOLE)
    vector = consistent(seventeen[whole], payload.covariance[whole, whole], units)
    body = InertialParameters(vector).in_frame(frame)
    change = frame_change(frame)
    outer = change @ doubt.covariance(np.eye(COUNT)[whole], payload.covariance) @ change.T
    spread = _spread(fit, log.names.index(log.reference))
    grasps = {name: GraspEstimate(team.grasps[i], spread.of(i)) for i, name in enumerate(log.names)}
    moment, push = payload.residual
    rows, still = (sum(p.samples for k in kinds for p in k.parts if p.still or every) for every in (True, False))
    late = against(late, log.reference)
    held = tuple(tuple(log.names[i] for i in np.flatnonzero(who)) for who in (~team.second, team.second))
    hinge = _hinge(
        fit, both_bodies(seventeen, _spreads(payload, doubt, frame), float(outer[0, 0]), payload.scale, frame, held)
    )
    found = TeamEstimate(
        parameters=body, covariance=outer, method="joint",
        evidence=Evidence(COUNT - payload.lost.shape[1], payload.condition, rows, still, push, moment, payload.chi2),
        identified=known(body, outer, units) if payload.lost.size else np.ones(10, np.bool_),
        frame=log.reference, reference=log.reference, grasps=grasps,
        clock_offsets_s=late if clocks else {},
        clock_offset_std_s=spread.delays(log.names) if clocks else {}, hinge=hinge, findings=turned,
        wrench_maps=maps,
    )  # fmt: skip
    return found, payload


def _hinge(fit: HingedFit, bodies: tuple[BodyEstimate, BodyEstimate]) -> HingeEstimate:
    """Return the hinge where it is nearest to the middle of the grasps, and how well it is known across its line."""
    team, line = fit.team, fit.covariance[-6:, -6:]
    point = hinge_frame(team).position
    across = np.eye(3) - np.outer(team.axis, team.axis)
    at_point = np.concatenate([-cross_matrix(point), np.eye(3)], axis=1)
    return HingeEstimate(
        team.axis, point, float(np.rad2deg(_largest(line[:3, :3], across))),
        _largest(at_point @ line @ at_point.T, across), float(np.abs(team.angle).max()), bodies,
    )  # fmt: skip


def _spreads(payload: HingedPayload, doubt: _Doubt, frame: Pose) -> tuple[tuple[Array, Array], ...]:
    """Return, for each body, the covariance of what is told of it (7, 7) and of its first moment in R's axes (3, 3).

    The hinge's line is where a body is seen from, and what its first moment is across.
    """
    second = second_body(payload.parameters)
    first, into, across = payload.parameters[:WHOLE] - second, adjoint_inverse(frame), frame.rotation.matrix[:, :2]
    out = []
    for rows, ten in zip(seven_rows(), (first, second), strict=True):
        elsewhere = FROM_TEN @ seen_from(ten) @ into
        tilted = across @ elsewhere[:2]
        tilted[:, :3] -= cross_matrix(across @ ten[1:3])
        vector = doubt.covariance(across @ rows[:2], payload.covariance, tilted)
        out.append((doubt.covariance(rows, payload.covariance, elsewhere), vector))
    return tuple(out)


def _wrists(log: TeamLog, team: Hinged, wrists: Mapping[str, float]) -> Array:
    """Return what point masses at the grasps add to the seventeen parameters."""
    points = (hinge_frame(team).inverse() @ team.grasps).position
    out = np.zeros(COUNT)
    for name, mass in wrists.items():
        i = log.names.index(name)
        ten = InertialParameters.from_point_masses(np.array([mass]), points[i : i + 1]).vector
        out[:WHOLE] += ten
        out[WHOLE:] += team.second[i] * (FROM_TEN @ ten)
    return out


def _largest(covariance: Array, across: Array) -> float:
    """Return the largest standard deviation of a vector (3,) across the hinge."""
    return float(np.sqrt(max(float(np.linalg.eigvalsh(across @ covariance @ across)[-1]), 0.0)))


def _spread(fit: HingedFit, reference: int) -> Spread:
    """Return the covariance of grasps and clocks."""
    robots = OWN * np.arange(len(fit.team.second))
    grasp, delay = (robots[:, None] + np.arange(6)).ravel(), robots + 12
    late = np.sqrt(np.maximum(variances_against(fit.covariance[np.ix_(delay, delay)], reference), 0.0))
    shown = fit.covariance[np.ix_(grasp, grasp)]
    return Spread(shown, np.zeros((len(grasp), 0)), late, fit.team.grasps)


def _kinds(
    log: TeamLog, parts: tuple[Stretch, ...], fit: HingedFit, sums: Sums, highest_hz: float
) -> tuple[tuple[Kind, ...], tuple[Finding, ...], Mapping[str, Array]]:
    """Return the recordings with complete wrenches, at rest and in motion, whose sign was turned, and by what (6, 6).

    Raises CannotAnswer where there are none.
    """
    gravity, made = mean_gravity(log, fit.team.homes), []
    for part, rows in with_rows(parts):
        team = fit.team.rows(rows)
        made.append((team, fit.residual[rows], *bodies_of(part, team, gravity, highest_hz)))
    wrong, turned = robot_of_other_sign([(team, one, two) for team, _, one, two in made], sums, log.names, highest_hz)
    if wrong is not None:
        made = [(team, left, _turned(one, wrong), _turned(two, wrong)) for team, left, one, two in made]
    out = []
    for still in (True, False):
        some = [row for row in made if row[2].runs and row[2].still == still]
        if some:
            ones = [one for _, _, one, _ in some]
            edges = band_edges(ones, highest_hz)
            bands = tuple(gathered(one, two, team, sums, edges, highest_hz) for team, _, one, two in some)
            noise = _motion_noise(ones, [left for _, left, _, _ in some], fit, edges, highest_hz)
            out.append(Kind(bands, noise, np.ones(len(edges))))
    require_runs(out)
    return tuple(out), turned, {} if wrong is None else {log.names[wrong]: -np.eye(6)}


def _turned(body: BodyRows, robot: int) -> BodyRows:
    """Return the rows with what one robot pushes of the other sign."""
    own = np.arange(body.runs[0].pushed.shape[1] if body.runs else 0) // 6 == robot
    return replace(body, runs=tuple(replace(run, pushed=np.where(own, -run.pushed, run.pushed)) for run in body.runs))


def _motion_noise(ones: list[BodyRows], left: list[Array], fit: HingedFit, edges: Array, highest_hz: float) -> Array:
    """Return the noise (K, 7, 7) of angular acceleration and acceleration less gravity of H, and of the hinge's."""
    into = np.eye(7)
    into[:6, :6] = adjoint_inverse(hinge_frame(fit.team))
    path, shares = into @ fit.path @ into.T, shares_of(ones, left, edges, highest_hz)
    out = np.zeros((len(edges), 7, 7))
    if not ones[0].still:
        out += shares[2, :, None, None] * path
    out[:, 3:6, 3:6] += shares[0, :, None, None] * tilt_noise(ones, path)
    return out


@dataclass(frozen=True, eq=False)
class _Doubt:
    """What errors of grasps, hinge and gains do to the seventeen parameters.

    slope  (17, 6 N + 6) per step of the grasps in their own axes, then of the hinge in R's
    steps  covariance (6 N + 6,) of those     gains  (17, 17) what gains add
    """

    slope: Array
    steps: Array
    gains: Array

    @classmethod
    def of(cls, payload: HingedPayload, fit: HingedFit, force: Mask) -> _Doubt:
        """Return the doubt: from elsewhere a force has another moment, another line bears what a hinge should not."""
        team, count = fit.team, len(fit.team.second)
        frame = hinge_frame(team)
        turned, body = turned_by_step(frame.inverse() @ team.grasps), second_body(payload.parameters)
        z, reaction = cross_matrix(np.array([0.0, 0.0, 1.0])), np.einsum("k,kix->ix", body, basis())
        unit = payload.sums.seven[:, force]

        def by_grasps(part: Bands, band: int) -> Array:
            own = part.pushed[band].reshape(-1, count, 6)
            change = np.einsum("ikab,nib->naik", turned, own, optimize=True)
            about = change[:, 2:3] * team.second[:, None]
            return np.concatenate([change, about], axis=1).reshape(len(own), 7, -1)

        def by_line(part: Bands, band: int) -> Array:
            bears = part.pushed[band] @ payload.sums.second.T - part.second[band] @ reaction.T
            out = np.zeros((len(bears), 7, 6))
            out[:, 6, :3], out[:, 6, 3:] = bears[:, :3] @ z.T, bears[:, 3:] @ z.T
            return out

        def by_gains(part: Bands, band: int) -> Array:
            # The mean force acts as a bias, which is there already.
            varying = part.pushed[band] - part.z[band][:, 0, COUNT, None] * part.mean
            return np.asarray(varying[:, None, force] * unit)

        lines = payload.moved(by_line) @ adjoint_inverse(frame)
        gains = payload.gain * payload.moved(by_gains)
        chosen = np.concatenate([*(OWN * i + np.arange(6) for i in range(count)), OWN * count + np.arange(6)])
        slope = np.concatenate([payload.moved(by_grasps), lines], axis=1)
        return cls(slope, fit.covariance[np.ix_(chosen, chosen)], gains @ gains.T)

    def covariance(self, rows: Array, known: Array, elsewhere: Array | float = 0.0) -> Array:
        """Return the covariance of rows (k, 17) of the parameters, whose own is `known` (17, 17).

        elsewhere  (k, 6) how they move with the hinge besides
        """
        slope = rows @ self.slope
        slope[:, -6:] += elsewhere
        return np.asarray(rows @ (known + self.gains) @ rows.T + slope @ self.steps @ slope.T)


def from_twists(first: Array, second: Array) -> Pose:
    """Return the pose of a grasp in another from their twists (T, 6): M in second = M first is Ad^-1 but for noise.

    A hinge's own motion, which M cannot hold, is averaged out of it.
    """
    M = np.linalg.lstsq(first, second, rcond=1e-6)[0].T
    turn = Rotation.nearest(M[:3, :3].T)
    lever = -turn.matrix @ M[3:, :3]
    return Pose(turn, 0.5 * axial_vector(lever))


def first_hinged(
    data: TeamMotion, twist: Array, reference: int, second: Sequence[int], line: tuple[Array, Array]
) -> Hinged:
    """Return a first team; twist (T', N, 6) of all grasps, line (axis, point) of the hinge in grasp second[0]."""
    count = data.count
    made = [Pose.identity() if i == reference else from_twists(twist[:, reference], twist[:, i]) for i in range(count)]
    one = second[0]
    for i in second[1:]:
        # Grasps of the second body hang together better than each with the first.
        made[i] = made[one] @ from_twists(twist[:, one], twist[:, i])
    grasps = Pose.stacked(made)
    held = np.zeros(count, np.bool_)
    held[list(second)] = True
    rows = data.valid[:, reference]
    measured = data.poses[:, reference]
    homes = [Pose.identity()] * count
    for i in range(count):
        both = rows & data.valid[:, i]
        if i != reference and both.any():
            every = (measured[both] @ grasps[i]) @ data.poses[both, i].inverse()
            turn = Rotation.nearest(every.rotation.matrix.mean(0))
            homes[i] = Pose(turn, every.position.mean(0))
    place = Pose.stacked(homes)
    first = [i for i in range(count) if not held[i]]
    seer = np.array(first)[np.argmax(data.valid[:, first], axis=1)]
    motion = place[seer] @ data.poses[np.arange(len(seer)), seer] @ grasps[seer].inverse()
    axis, point = grasps[one].rotation.apply(line[0]), grasps[one].apply(line[1])
    return Hinged(grasps, place, held, axis, point, motion, np.zeros(len(seer)), np.zeros(count))
