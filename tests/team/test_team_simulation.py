"""Simulated teams obey mechanics, and their noise is what the cases say."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import regressors
from steelyard.robots import Omnid
from steelyard.simulate import team_cases
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, EXACT, GRAVITY, Hinge, Presence, Slip, TeamNoise, TeamScene, case
from steelyard.simulate.team_motions import Freedom, draw_motion
from steelyard.simulate.team_sensing import autoregressive, read_joints
from steelyard.spatial import Pose, Rotation, cross
from steelyard.team.adjoint import BRACKETS

FACTS = Path(__file__).resolve().parents[3] / "shared" / "facts" / "team-cases.json"
SHORT = TeamScene(sensing="poses", kinds=("motion",), motion_samples=400)
HINGE = Hinge(frozenset({0, 1, 2}), np.array([1.0, 0.2, 0]), np.array([0.0, 0.1, 0.05]), 4.0,
              np.array([0.5, 0.6, 0.9]), np.array([0.1, 0.4, -0.1]))  # fmt: skip


def world_poses(trial: TeamTrial, robot: int) -> Pose:
    return trial.truth.homes[robot] @ trial.log.recordings[-1].tracks[f"robot{robot}"].pose


def applied(trial: TeamTrial) -> np.ndarray:
    """Sum of all wrenches (T, 6) about W's origin in W."""
    total = 0.0
    for i in range(len(trial.log.names)):
        pose, track = world_poses(trial, i), trial.log.recordings[-1].tracks[f"robot{i}"]
        force = pose.rotation.apply(track.channels["force"])
        moment = pose.rotation.apply(track.wrench()[:, :3]) + cross(pose.position, force)
        total = total + np.concatenate([moment, force], 1)
    return np.asarray(total)


def momentum_rate(body: InertialParameters, pose: Pose) -> np.ndarray:
    """Momentum's rate less gravity (T - 4, 6) about W's origin, all by central differences of the body's poses."""
    step = 0.01
    com = pose.apply(body.com)
    velocity = (com[2:] - com[:-2]) / (2 * step)
    turned = pose.rotation[:-2].inverse() @ pose.rotation[2:]
    spin = pose.rotation[1:-1].apply(np.einsum("ij,tj->ti", body.inertia_com, turned.log() / (2 * step)))
    angular = spin + body.mass * cross(com[1:-1], velocity)
    momentum = np.concatenate([angular, body.mass * velocity], 1)
    weight = np.broadcast_to([0, 0, -GRAVITY * float(body.mass)], com.shape)
    load = np.concatenate([cross(com, weight), weight], 1)
    return np.asarray((momentum[2:] - momentum[:-2]) / (2 * step) - load[2:-2])


@pytest.mark.parametrize(
    "scene",
    [
        SHORT,
        replace(SHORT, robots=5, six_axis=frozenset({1, 4})),
        replace(SHORT, robots=2, six_axis=frozenset({1})),
        replace(SHORT, sensing="joints"),
        replace(SHORT, robots=4, presence=(Presence(3, leaves=2.0),)),
    ],
)
def test_forces_of_the_team_move_the_payload(scene: TeamScene) -> None:
    trial = simulate_team(scene, 3)
    payload = world_poses(trial, 0)
    gap = np.abs(applied(trial)[2:-2] - momentum_rate(trial.truth.body, payload)).max()
    assert gap < 0.02  # N and N m of 118; what differences leave


def test_forces_move_both_bodies_of_a_jointed_payload() -> None:
    trial = simulate_team(replace(SHORT, robots=6, hinge=HINGE), 3, reference=3)
    payload = world_poses(trial, 3) @ trial.truth.payload
    second = world_poses(trial, 0) @ (trial.truth.payload.inverse() @ trial.truth.grasps[0]).inverse()
    added = InertialParameters.from_com(HINGE.mass, HINGE.centre, np.diag(HINGE.moments))
    first = trial.truth.body.in_frame(trial.truth.payload.inverse()) - added
    assert (payload.rotation.inverse() @ second.rotation).angle().max() > 0.1
    both = momentum_rate(first, payload) + momentum_rate(added, second)
    assert np.abs(applied(trial)[2:-2] - both).max() < 0.05


def test_what_happens_to_grasps_before_noise_is_the_same_in_every_case() -> None:
    shapes = [simulate_team(replace(case(name), kinds=("grasp",)), 7).truth for name in "ABCD"]
    for other in shapes[1:]:
        assert np.array_equal(shapes[0].grasps.matrix(), other.grasps.matrix())
        assert np.array_equal(shapes[0].body.vector, other.body.vector)


def test_one_seed_gives_one_log() -> None:
    first, second, third = (simulate_team(replace(SHORT, noise=CASES["D"]), seed) for seed in (5, 5, 6))
    for name in first.log.names:
        one, two, other = (t.log.recordings[0].tracks[name].channels["force"] for t in (first, second, third))
        assert np.array_equal(one, two)
        assert not np.allclose(one, other)


def test_cases_are_those_of_the_facts() -> None:
    if not FACTS.exists():
        pytest.skip("the facts are not here")
    facts = json.loads(FACTS.read_text())
    for name, fixed in facts["cases"].items():
        ours = CASES[name]
        assert {key: getattr(ours, key) for key in fixed} == fixed
    assert list(team_cases.MOMENTS) == facts["payload"]["principal_moments_kgm2"]
    assert facts["payload"]["mass_kg"] == team_cases.MASS
    still = facts["motion"]["recordings"]["still"]
    assert np.array_equal(team_cases.STILL_TURNS, still["rotation_vectors_rad"])
    assert facts["robot"]["kinematics"].startswith("Delta (base radius 0.180, platform radius 0.062, driven link 0.200")


def test_structure_noise_has_its_corner_at_2_hz() -> None:
    noise = autoregressive(np.random.default_rng(0), 200_000, 2)
    assert noise.std() == pytest.approx(1, abs=0.03)
    lag = np.mean(noise[:-8] * noise[8:])  # 0.08 s = 1 / (2 pi 2 Hz): one time constant
    assert lag == pytest.approx(np.exp(-2 * np.pi * 2 * 0.08), abs=0.03)


def test_encoders_read_steps() -> None:
    joints = np.random.default_rng(0).uniform(-1, 1, (1000, 6))
    read = read_joints(np.random.default_rng(1), joints, TeamNoise(encoder_bits=13))
    step = 2 * np.pi / 2**13
    assert np.abs(read - joints).max() <= step / 2 + 1e-12
    assert np.abs(read / step - np.round(read / step)).max() < 1e-9


def test_bias_and_gain_are_drawn_for_every_recording() -> None:
    noise = TeamNoise(force_bias_N=0.5, force_gain=0.01)
    exact, biased = (simulate_team(replace(TeamScene(n), kinds=("still",)), 4).log for n in (EXACT, noise))
    gaps = []
    for before, after in zip(exact.recordings, biased.recordings, strict=True):
        gap = after.tracks["robot1"].channels["force"] - before.tracks["robot1"].channels["force"]
        assert gap.std(0).max() < 0.2  # a gain of 1 % on forces that hardly change
        gaps.append(gap.mean(0))
    assert 0.2 < np.std(gaps) < 1.2


def test_late_stamps_show_what_was_a_moment_before() -> None:
    late = simulate_team(replace(SHORT, late_s={1: 0.03}), 2).log.recordings[0]
    prompt = simulate_team(SHORT, 2).log.recordings[0]
    before, after = (r.tracks["robot1"].channels["position"] for r in (prompt, late))
    assert np.abs(after[3:] - before[:-3]).max() < 1e-12
    assert np.array_equal(late.tracks["robot0"].channels["position"], prompt.tracks["robot0"].channels["position"])


def test_a_slip_moves_one_grasp_once() -> None:
    slip = Slip(1, np.array([0.003, 0.0, 0.004]), 2.0)
    trial = simulate_team(replace(SHORT, slip=slip), 2)
    between = world_poses(trial, 0).inverse() @ world_poses(trial, 1)
    moved = np.linalg.norm(between.position - trial.truth.grasps.position[1], axis=1)
    assert moved[:200].max() < 1e-12
    assert moved[211:] == pytest.approx(np.full(189, 0.005), abs=1e-12)
    assert np.abs(between.rotation.matrix - trial.truth.grasps.rotation.matrix[1]).max() < 1e-12


def test_a_robot_that_leaves_bears_nothing_and_stands_still() -> None:
    event = Presence(2, joins=1.0, leaves=3.0, new=True)
    trial = simulate_team(replace(SHORT, robots=4, presence=(event,), kinds=("still", "motion")), 2)
    assert trial.log.recordings[0].away == {"robot2"}
    track = trial.log.recordings[-1].tracks["robot2"]
    force, place = np.linalg.norm(track.channels["force"], axis=1), track.channels["position"]
    held = trial.truth.holds[:, 2]
    assert np.flatnonzero(held).tolist() == list(range(100, 300))
    assert force[~held].max() == 0
    assert force[held].min() > 5
    assert np.ptp(place[:50], axis=0).max() < 1e-12
    assert np.ptp(place[360:], axis=0).max() < 1e-12


def test_two_passive_gimbals_cannot_carry() -> None:
    with pytest.raises(BadValue, match="Two passive gimbals bear no moment about the line that joins them"):
        simulate_team(TeamScene(robots=2), 0)


def test_joint_records_are_a_valid_input() -> None:
    trial = simulate_team(replace(case("C"), kinds=("grasp",)), 9)
    omnid = Omnid()
    for name, record in trial.joints[0].items():
        track = trial.log.recordings[0].tracks[name]
        assert np.abs(omnid.pose(record.angles).matrix() - track.pose.matrix()).max() < 1e-12
        assert np.abs(omnid.wrench(record.angles, record.torques).force - track.channels["force"]).max() < 1e-9
        assert np.array_equal(record.time, track.time)


PLANE = np.eye(3)[:, :2]
UPRIGHT = np.eye(3)[:, 2:]
NONE = np.zeros((3, 0))
MOTIONS = {
    "general": (Freedom.general(), 6),
    "two axes": (Freedom(PLANE, np.eye(3)), 6),
    "ball joint": (Freedom(np.eye(3), NONE, np.array([0.3, 0.1, 0.2])), 6),
    "one axis and any translation": (Freedom(UPRIGHT, np.eye(3)), 5),
    "planar": (Freedom(UPRIGHT, PLANE), 5),
    "one axis about a pivot": (Freedom(UPRIGHT, NONE, np.array([0.3, 0.1, 0.2])), 4),
    "translation": (Freedom(NONE, np.eye(3)), 3),
    "translation along one axis": (Freedom(NONE, UPRIGHT), 2),
}


@pytest.mark.parametrize("name", MOTIONS)
def test_motions_show_as_much_of_a_grasp_as_they_should(name: str) -> None:
    freedom, rank = MOTIONS[name]
    time = np.arange(300) / 100
    seen = draw_motion(np.random.default_rng(1), time, (0.2, 0.9), 0.14, 0.03, freedom).at(time)
    twist = np.concatenate([seen.angular_velocity, seen.velocity], 1)
    values = np.linalg.svd(np.einsum("ta,abc->tbc", twist, BRACKETS).reshape(-1, 6), compute_uv=False)
    assert int((values > 1e-9 * values[0]).sum()) == rank


def turned_in_a_plane(time: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Gravity, rates and accelerations (T, 3) of a turning whose rates stay in the body's x-y plane."""
    rate = np.column_stack([np.sin(2 * time), np.cos(3 * time), 0 * time])
    growth = np.column_stack([2 * np.cos(2 * time), -3 * np.sin(3 * time), 0 * time])
    middle = np.column_stack([np.sin(2 * time + 0.01), np.cos(3 * time + 0.015), 0 * time])
    turn, down = Rotation.identity(), []
    for step in middle:
        down.append(turn.inverse().apply([0.0, 0.0, -GRAVITY]))
        turn = turn @ Rotation.exp(0.01 * step)
    return np.array(down), rate, growth


def motion_log(freedom: Freedom) -> MotionLog:
    time = np.arange(300) / 100
    seen = draw_motion(np.random.default_rng(1), time, (0.2, 0.9), 0.14, 0.03, freedom).at(time)
    down = seen.rotation.inverse().apply([0.0, 0.0, -GRAVITY])
    return MotionLog(np.zeros((300, 6)), down, seen.acceleration, seen.angular_velocity, seen.angular_acceleration)


def plane_log() -> MotionLog:
    down, rate, growth = turned_in_a_plane(np.arange(300) / 100)
    return MotionLog(np.zeros((300, 6)), down, 0 * down, rate, growth)


def still_log(poses: int) -> MotionLog:
    turns = Rotation.exp(np.array(team_cases.STILL_TURNS[:poses]))
    return MotionLog.of_poses(np.zeros((poses, 6)), turns.inverse().apply([0.0, 0.0, -GRAVITY]))


WRENCH_SIDE = {
    "one still pose": (lambda: still_log(1), 3),
    "two still poses": (lambda: still_log(2), 4),
    "four still poses": (lambda: still_log(4), 4),
    "three axes": (lambda: motion_log(Freedom(np.eye(3), NONE)), 10),
    "rates in a plane": (plane_log, 9),
    "one horizontal axis": (lambda: motion_log(Freedom(PLANE[:, :1], NONE)), 7),
    "about gravity": (lambda: motion_log(Freedom(UPRIGHT, np.eye(3))), 7),
    "about gravity, no translation": (lambda: motion_log(Freedom(UPRIGHT, NONE)), 6),
}


@pytest.mark.parametrize("name", WRENCH_SIDE)
def test_motions_show_as_much_of_a_body_as_they_should(name: str) -> None:
    make, rank = WRENCH_SIDE[name]
    stacked = regressors(make()).reshape(-1, 10)
    size = np.linalg.norm(stacked, axis=0)
    values = np.linalg.svd(stacked / np.where(size > 0, size, 1.0), compute_uv=False)
    assert int((values > 1e-9 * values[0]).sum()) == rank


def test_an_imu_feels_the_grasp_it_sits_on() -> None:
    scene = replace(SHORT, imus=frozenset({1}))
    trial, pose = simulate_team(scene, 3), world_poses(simulate_team(scene, 3), 1)
    track, step = trial.log.recordings[0].tracks["robot1"], 0.01
    felt = pose.rotation.apply(track.channels["specific_force"])[1:-1] - [0, 0, GRAVITY]
    place = pose.position
    assert np.abs(felt - (place[2:] - 2 * place[1:-1] + place[:-2]) / step**2).max() < 5e-3
    turned = (pose.rotation[:-2].inverse() @ pose.rotation[2:]).log() / (2 * step)
    assert np.abs(turned - track.channels["angular_velocity"][1:-1]).max() < 2e-3
    assert "specific_force" not in trial.log.recordings[0].tracks["robot0"].channels
