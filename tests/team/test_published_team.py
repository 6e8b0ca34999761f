"""The published team estimator: every step against its law, the whole on exact data, what it cannot do."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Oracle

from steelyard.errors import CannotAnswer
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import Presence, TeamNoise, TeamScene, case
from steelyard.simulate.team_motions import Freedom
from steelyard.spatial import Pose, Rotation, Twist
from steelyard.team import grasp_kinematics, inertia_matrix, loop_closure, mass_and_com
from steelyard.team.estimate import TeamEstimate
from steelyard.team.published import PublishedTeam

RNG = np.random.default_rng(11)
EXACT = TeamScene(sensing="poses", motion_samples=1500)
NOISY = TeamScene(TeamNoise(rate_rad_s=0.01, velocity_m_s=0.003), 4, "twists", kinds=("grasp",), grasp_samples=300)
PLAIN = PublishedTeam(cutoff_hz=None)


def worst(trial: TeamTrial, found: TeamEstimate) -> dict[str, float]:
    angle, distance = 0.0, 0.0
    for i, name in enumerate(trial.log.names):
        pose = found.grasps[name].pose
        gap = trial.truth.grasps[i].rotation.inverse() @ pose.rotation
        angle = max(angle, float(gap.angle()))
        distance = max(distance, float(np.linalg.norm(pose.position - trial.truth.grasps[i].position)))
    body = trial.truth.body
    moments = found.principal_moments
    assert moments is not None
    return {
        "angle": angle,
        "distance": distance,
        "mass": abs(found.mass / float(body.mass) - 1),
        "com": float(np.linalg.norm(found.com - body.com)),
        "moments": float(np.abs(moments / trial.truth.moments - 1).max()),
    }


@pytest.mark.parametrize(
    "scene",
    [
        EXACT,
        replace(EXACT, robots=2, six_axis=frozenset({0})),
        replace(EXACT, robots=2, six_axis=frozenset({0, 1})),
        replace(EXACT, robots=5, six_axis=frozenset({2})),
        replace(EXACT, sensing="twists", bases_move=True),
        replace(EXACT, robots=4, presence=(Presence(3, joins=4.0, leaves=9.0),)),
        replace(EXACT, dropout=0.01),
    ],
)
def test_exact_data_give_the_truth(scene: TeamScene) -> None:
    trial = simulate_team(scene, 21)
    gap = worst(trial, PLAIN.identify(trial.log))
    # What is left are central differences: (2 pi f dt)^2 / 6 = 7e-4 at 1 Hz, of the acceleration and so of the inertia.
    assert gap["angle"] < 1e-7
    assert gap["distance"] < 2e-5
    assert gap["mass"] < 1e-7
    assert gap["com"] < 2e-5
    assert gap["moments"] < 3e-3


@pytest.mark.parametrize("reference", ["robot0", "robot1", "robot2"])
def test_any_robot_may_be_the_reference(reference: str) -> None:
    trial = simulate_team(replace(EXACT, sensing="twists"), 22)
    one, other = (PLAIN.identify(trial.log.with_reference(r)) for r in ("robot0", reference))
    assert other.frame == reference
    moved = one.parameters.in_frame(one.grasps[reference].pose.inverse())
    assert np.abs(moved.inertia_com - other.parameters.inertia_com).max() < 5e-3
    assert np.abs(moved.com - other.com).max() < 1e-6
    for name in trial.log.names:
        seen = one.grasps[reference].pose.inverse() @ one.grasps[name].pose
        assert np.abs(seen.matrix() - other.grasps[name].pose.matrix()).max() < 1e-6
        frames = one.principal_frames[name].position - other.principal_frames[name].position
        assert np.abs(frames).max() < 1e-5


def test_names_and_homes_do_not_matter() -> None:
    trial = simulate_team(replace(case("C"), motion_samples=1500), 23)
    log = trial.log
    names = {"robot0": "a", "robot1": "z", "robot2": "m"}
    shuffled = replace(log.renamed(names), robots=tuple(reversed(log.renamed(names).robots)))
    homes = {n: Pose(Rotation.exp(RNG.standard_normal(3)), RNG.standard_normal(3)) for n in log.names}
    first, second, third = (PublishedTeam().identify(x) for x in (log, shuffled, log.with_homes(homes)))
    for name in log.names:
        plain = first.grasps[name].pose.matrix()
        assert np.abs(second.grasps[names[name]].pose.matrix() - plain).max() < 1e-8
        assert np.abs(third.grasps[name].pose.matrix() - plain).max() < 1e-8
    for other in (second, third):
        assert np.abs(other.parameters.vector - first.parameters.vector).max() < 1e-8


def test_rotation_is_that_of_the_oracle() -> None:
    omega_j = RNG.standard_normal((50, 3)) * [1.0, 0.5, 0.2]
    truth = Rotation.exp([0.4, -1.0, 2.0])
    omega_i = truth.apply(omega_j) + 0.02 * RNG.standard_normal((50, 3))
    found, _ = grasp_kinematics.rotation(omega_i, omega_j)
    assert np.abs(found.matrix - Oracle.align_vectors(omega_i, omega_j)[0].as_matrix()).max() < 1e-12


def test_two_directions_of_turning_suffice() -> None:
    pose = Pose(Rotation.exp([0.4, -1.0, 2.0]), np.array([0.3, -0.5, 1.0]))
    twist = RNG.standard_normal((60, 6))
    twist[:, 2] = 0.0
    found = grasp_kinematics.pair((pose @ Twist.from_array(twist)).array(), twist)
    assert np.abs(found.pose.matrix() - pose.matrix()).max() < 1e-12
    assert found.spread[1] > 0.1
    assert found.spread[2] < 1e-6


def test_formal_covariance_of_a_pair_is_what_errors_are() -> None:
    pose = Pose(Rotation.exp([0.4, -1.0, 2.0]), np.array([0.3, -0.5, 1.0]))
    twist = RNG.standard_normal((400, 6)) * np.repeat([0.3, 0.2], 3)
    exact = (pose @ Twist.from_array(twist)).array()
    squares, errors = 0.0, []
    for _ in range(300):
        noisy = exact + RNG.standard_normal(exact.shape) * np.repeat([0.004, 0.002], 3)
        found = grasp_kinematics.pair(noisy, twist)
        turn = (found.pose.rotation @ pose.rotation.inverse()).log()
        error = np.concatenate([turn, found.pose.position - pose.position])
        errors.append(error)
        squares += float(error @ np.linalg.solve(found.covariance, error)) / 300
    assert 5.4 < squares < 6.6  # six degrees of freedom
    assert np.abs(np.std(errors, axis=0) / np.sqrt(np.diag(found.covariance)) - 1).max() < 0.15


def test_bars_of_the_inertia_count_what_the_low_pass_leaves_free() -> None:
    """With white noise alone; rows that were low-passed hang together, and as many as there are tell less."""
    noise = TeamNoise(pose_rad=1e-4, pose_m=1e-4, force_white_N=0.2)
    scene = replace(EXACT, noise=noise, squeeze_N=0.0, motion_samples=2000)
    times = []
    for seed in range(12):
        trial = simulate_team(scene, seed)
        steps = PublishedTeam()
        grasps, _ = steps.grasps(trial.log)
        fit = steps.inertia(trial.log, grasps, trial.truth.body.com)
        gap = fit.matrix - trial.truth.body.inertia_com
        times += list(gap[np.triu_indices(3)] / np.sqrt(np.diag(fit.covariance)))
    assert 0.5 < np.sqrt(np.mean(np.square(times))) < 1.6


def test_loop_closure_turns_grasps_more_truly_than_the_star() -> None:
    angles = []
    for seed in range(8):
        trial = simulate_team(NOISY, seed)
        back = trial.truth.grasps.rotation.inverse()
        found = [PublishedTeam(cutoff_hz=None, close_loops=close).grasps(trial.log)[0] for close in (False, True)]
        angles.append([(back @ grasps.rotation).angle().mean() for grasps in found])
    star, refined = np.mean(angles, axis=0)
    assert refined < 0.9 * star


def test_loop_closure_ends_where_the_slope_is_zero() -> None:
    trial = simulate_team(NOISY, 3)
    log = trial.log
    tracks = [log.recordings[0].tracks[name] for name in log.names]
    twists = np.array(
        [np.concatenate([t.channels["angular_velocity"], t.channels["linear_velocity"]], 1) for t in tracks]
    )
    measured = np.ones(twists.shape[:2], bool)
    measured[2, 50:90] = False
    pairs = grasp_kinematics.star(log.names, twists, measured, log.reference)
    start = grasp_kinematics.from_star(log.names, pairs)
    end = loop_closure.refine(log.names, start, pairs, twists, measured)
    left = np.mean([p.residual**2 for p in pairs.values()], axis=0)
    weight = 1 / np.repeat([left[:3].mean(), left[3:].mean()], 3)

    def cost(grasps: Pose) -> float:
        total = 0.0
        for i in range(len(log.names)):
            for j in range(len(log.names)):
                rows = measured[i] & measured[j]
                seen = (grasps[j].inverse() @ grasps[i] @ Twist.from_array(twists[i, rows])).array()
                total += float((weight * (twists[j, rows] - seen) ** 2).sum())
        return total

    best = cost(end)
    assert best < cost(start)
    for k in range(18):
        for size in (-1e-4, 1e-4):
            step = np.zeros((3, 6))
            step.flat[k] = size
            moved = loop_closure._moved(end, [1, 2, 3], step)
            assert cost(moved) > best - 1e-6 * best


def test_mass_and_com_of_a_known_body() -> None:
    gravity = 9.81 * Rotation.exp(0.1 * RNG.standard_normal((6, 3))).apply([0.0, 0.0, -1.0])
    com = np.array([0.2, -0.1, 0.4])
    wrench = np.concatenate([np.cross(com, -12 * gravity), -12 * gravity], 1)
    found = mass_and_com.mass_and_com(gravity, wrench)
    assert found.mass == pytest.approx(12)
    assert found.com == pytest.approx(com)
    with pytest.raises(CannotAnswer, match=r"add up to a mass of -12 kg. Check the sign"):
        mass_and_com.mass_and_com(gravity, -wrench)
    with pytest.raises(CannotAnswer, match=r"gravity keeps the direction \(.*\) of the reference grasp"):
        mass_and_com.mass_and_com(np.tile(gravity[0], (6, 1)), np.tile(wrench[0], (6, 1)))


def test_inertia_of_a_known_body_and_its_negative_eigenvalues() -> None:
    omega, alpha = RNG.standard_normal((2, 80, 3))
    matrix = np.array([[2.0, 0.1, -0.2], [0.1, 3.0, 0.3], [-0.2, 0.3, 4.0]])
    moment = alpha @ matrix + np.cross(omega, omega @ matrix)
    found = inertia_matrix.inertia(omega, alpha, moment).matrix
    assert found == pytest.approx(matrix)
    assert inertia_matrix.made_positive(found)[1] == 0
    below = np.diag([-0.1, 1.0, 2.0])
    assert inertia_matrix.made_positive(below)[0] == pytest.approx(np.diag([0.0, 1.0, 2.0]))
    with pytest.raises(CannotAnswer, match="1 negative eigenvalue"):
        inertia_matrix.made_positive(below, "discard")
    with pytest.raises(CannotAnswer, match="leaves entries open"):
        inertia_matrix.inertia(omega * [0, 0, 1], alpha * [0, 0, 1], moment)


@pytest.mark.parametrize("rotation", [np.eye(3)[:, 2:], np.zeros((3, 0))])
def test_planar_motion_and_translation_fail_and_say_so(rotation: np.ndarray) -> None:
    trial = simulate_team(replace(EXACT, freedom=Freedom(rotation, np.eye(3))), 24)
    with pytest.raises(CannotAnswer, match=r"^Grasp of 'robot1' seen from 'robot0': .*Tilt the payload about"):
        PLAIN.identify(trial.log)


def test_slow_motion_gives_mass_and_com_and_says_that_inertia_is_open() -> None:
    still = simulate_team(replace(EXACT, kinds=("grasp", "still", "motion")), 25)
    log = still.log
    quiet = [replace(r, kind="motion", name="again") for r in log.recordings if r.kind == "still"][:1]
    found = PLAIN.identify(log.with_recordings(*[r for r in log.recordings if r.kind != "motion"], *quiet))
    assert found.inertia_com is None
    assert found.principal_moments is None
    assert found.codes() == {"inertia-not-identified"}
    assert found.mass == pytest.approx(12, rel=1e-6)


def test_wrenches_must_be_complete() -> None:
    log = simulate_team(EXACT, 26).log

    def without(*names: str) -> object:
        recordings = [
            replace(r, tracks={n: t.without("force") if n in names else t for n, t in r.tracks.items()})
            for r in log.recordings
        ]
        return PLAIN.identify(log.with_recordings(*recordings))

    with pytest.raises(CannotAnswer, match="no robot of the team measured a force"):
        without(*log.names)
    with pytest.raises(CannotAnswer, match=r"'robot2' has none. Add it, or say that the robot was away"):
        without("robot2")


def test_two_passive_gimbals_cannot_hold_still() -> None:
    log = simulate_team(replace(EXACT, robots=2, six_axis=frozenset({0, 1})), 27).log
    recordings = [replace(r, tracks={n: t.without("torque") for n, t in r.tracks.items()}) for r in log.recordings]
    with pytest.raises(CannotAnswer, match="two robots with passive gimbals cannot hold a payload still"):
        PLAIN.identify(log.with_recordings(*recordings))


def test_one_recording_may_serve_all() -> None:
    trial = simulate_team(EXACT, 28)
    moving = trial.log.with_recordings(*[r for r in trial.log.recordings if r.kind != "grasp"])
    found = PLAIN.identify(moving)
    assert worst(trial, found)["distance"] < 1e-4
    assert found.method == "paper"
    assert "formal" in found.notes[0]
