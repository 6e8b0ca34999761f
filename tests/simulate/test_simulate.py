"""The simulated logs obey mechanics, and the embedded bench is what it says."""

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.inertia import solids
from steelyard.simulate import bounds, scenarios, simulate_log
from steelyard.simulate.motions import minimum_jerk
from steelyard.simulate.noise import unit_noise
from steelyard.spatial import Pose, Rotation

TIME = np.arange(1000) / 100
STEP = 1e-4


def shifted(motion, shift):
    return motion.at(TIME[7:-7] + 0.003 + shift)


@pytest.mark.parametrize("name", scenarios.motion_names())
def test_derivatives_agree_with_differences_of_the_pose(name):
    motion = scenarios.motion(name)
    before, now, after = (shifted(motion, s) for s in (-STEP, 0.0, STEP))
    turn = (before.rotation.inverse() @ after.rotation).log() / (2 * STEP)
    np.testing.assert_allclose(turn, now.angular_velocity, atol=2e-5)
    speed = (after.position - before.position) / (2 * STEP)
    np.testing.assert_allclose(now.rotation.inverse().apply(speed), now.velocity, atol=1e-6)
    gain = (after.angular_velocity - before.angular_velocity) / (2 * STEP)
    np.testing.assert_allclose(gain, now.angular_acceleration, atol=2e-4)
    world = (after.rotation.apply(after.velocity) - before.rotation.apply(before.velocity)) / (2 * STEP)
    np.testing.assert_allclose(now.rotation.inverse().apply(world), now.acceleration, atol=1e-5)


def test_rotation_is_extrinsic_xyz():
    keys = np.radians([[90, 0, 25], [180, 10, -20]])
    x, y, z = np.eye(3)
    for key, time in zip(keys, (1.4, 2.8), strict=True):
        about = [Rotation.exp(angle * axis) for angle, axis in zip(key, (x, y, z), strict=True)]
        held = scenarios.motion("stop_go").at(np.array([10 / 7 * round(time / 1.4) + 0.6])).rotation
        np.testing.assert_allclose(held.matrix[0], (about[2] @ about[1] @ about[0]).matrix, atol=1e-12)


def test_position_steps_of_stop_and_go():
    seen = scenarios.motion("stop_go").at(np.array([0.0, 0.5, 2.0, 5.5, 9.9]))
    expected = [[0, 0, 0], [0, 0, 0.075], [0, 0, 0.15], [0.05, 0, 0.15], [0.1, 0, 0.15]]
    np.testing.assert_allclose(seen.position, expected, atol=1e-15)


def test_minimum_jerk_starts_and_ends_at_rest():
    value, slope, curvature = minimum_jerk(np.array([-1.0, 0.0, 0.5, 1.0, 2.0]))
    np.testing.assert_allclose(value, [0, 0, 0.5, 1, 1], atol=1e-15)
    np.testing.assert_allclose(slope, [0, 0, 1.875, 0, 0])
    np.testing.assert_allclose(curvature, 0, atol=1e-15)


def test_still_rows_are_those_of_the_bench():
    log, _ = simulate_log("hammer", "stop_go", "moderate", 0)
    assert log.still.sum() == 516
    for name in ("dyn_slow", "dyn_fast"):
        assert simulate_log("hammer", name, "moderate", 0)[0].still.sum() == 0


def test_seven_still_poses_keep_their_gravity():
    log, _ = simulate_log("pan", "stop_go", "none", 0, shuffled=False)
    assert set(log.pose[log.still]) == set(range(7))
    assert (log.pose[~log.still] == -1).all()
    for pose in range(7):
        assert np.ptp(log.gravity[log.pose == pose], axis=0).max() < 0.01


@pytest.mark.parametrize("name", scenarios.object_names())
def test_wrench_moves_the_centre_of_mass(name):
    """Force = m (a_C - g), moment about C = I_C alpha + omega x I_C omega: the laws, not at S."""
    log, body = simulate_log(name, "dyn_fast", "none", 0, shuffled=False)
    c, omega, alpha = body.com, log.angular_velocity, log.angular_acceleration
    acceleration = log.acceleration + np.cross(alpha, c) + np.cross(omega, np.cross(omega, c))
    np.testing.assert_allclose(log.wrench[:, 3:], body.mass * (acceleration - log.gravity), atol=1e-12)
    moment = log.wrench[:, :3] - np.cross(c, log.wrench[:, 3:])
    central = body.inertia_com
    np.testing.assert_allclose(moment, alpha @ central + np.cross(omega, omega @ central), atol=1e-12)


def test_box_union_adds_shifted_boxes():
    body = scenarios.body("hammer")
    handle = solids.box(0.028, 0.022, 0.24, 700).in_frame(Pose(Rotation.identity(), [0, 0, 0.17]))
    head = solids.box(0.12, 0.03, 0.03, 7800).in_frame(Pose(Rotation.identity(), [0.01, 0, 0.305]))
    np.testing.assert_allclose(body.parameters().vector, (handle + head).vector, rtol=1e-14)
    assert body.parameters().mass == pytest.approx(0.028 * 0.022 * 0.24 * 700 + 0.12 * 0.03**2 * 7800)
    np.testing.assert_allclose(bounds("hammer"), [[-0.05, -0.015, 0.05], [0.07, 0.015, 0.32]], atol=1e-15)


def test_box_union_agrees_with_a_point_cloud():
    boxes = scenarios.body("c_clamp")
    middle = (np.arange(40) + 0.5) / 40 - 0.5
    unit = np.stack(np.meshgrid(middle, middle, middle, indexing="ij"), -1).reshape(-1, 3)
    mass = boxes.density * boxes.size.prod(1)
    body = boxes.parameters()
    points = np.concatenate([c + unit * s for c, s in zip(boxes.centre, boxes.size, strict=True)])
    weight = np.repeat(mass / len(unit), len(unit))
    homogeneous = np.column_stack([points, np.ones(len(points))])
    np.testing.assert_allclose((homogeneous.T * weight) @ homogeneous, body.pseudo_inertia, atol=2e-6)


def test_same_seed_same_log_and_other_seed_another():
    one, two = (simulate_log("pan", "stop_go", "high", 3)[0] for _ in range(2))
    other = simulate_log("pan", "stop_go", "high", 4)[0]
    np.testing.assert_array_equal(one.wrench, two.wrench)
    assert not np.array_equal(one.wrench, other.wrench)


def test_shuffled_rows_are_the_ordered_rows():
    mixed, _ = simulate_log("pan", "stop_go", "high", 3)
    ordered, _ = simulate_log("pan", "stop_go", "high", 3, shuffled=False)
    assert mixed.time is None
    assert (mixed.pose == -1).all()
    assert ordered.time is not None
    order = np.lexsort(mixed.wrench.T), np.lexsort(ordered.wrench.T)
    for name in ("wrench", "gravity", "acceleration", "angular_acceleration", "still"):
        np.testing.assert_array_equal(getattr(mixed, name)[order[0]], getattr(ordered, name)[order[1]])
    assert not np.array_equal(mixed.wrench, ordered.wrench)


def test_noise_has_the_declared_size_and_bias_is_added():
    bias = np.array([0.1, -0.2, 0.3, 1, 2, -3])
    noisy, body = simulate_log("drill", "dyn_slow", "high", 1, shuffled=False, bias=bias, repeats=20)
    clean, _ = simulate_log("drill", "dyn_slow", "none", 1, shuffled=False, repeats=20)
    assert len(noisy) == 20_000
    assert clean.noise is None
    (noise,) = noisy.noise
    np.testing.assert_allclose((noisy.wrench - clean.wrench).mean(0), bias, atol=0.02)
    np.testing.assert_allclose((noisy.wrench - clean.wrench).var(0), noise.wrench, rtol=0.05)
    np.testing.assert_allclose((noisy.acceleration - clean.acceleration).var(0), noise.acceleration[3:], rtol=0.05)
    alpha = noisy.angular_acceleration - clean.angular_acceleration
    np.testing.assert_allclose(alpha.var(0), noise.acceleration[:3], rtol=0.05)
    np.testing.assert_array_equal(noisy.gravity, clean.gravity)
    np.testing.assert_array_equal(noisy.angular_velocity, clean.angular_velocity)
    np.testing.assert_allclose(replace(clean, wrench=np.zeros((20_000, 6))).predicted(body.vector), clean.wrench)


def test_low_passed_noise_is_stationary_unit_and_below_two_hertz():
    noise = unit_noise(np.random.default_rng(5), 200, 20_000, "2hz", 100.0)
    np.testing.assert_allclose(noise.var(1)[[0, 1, 10, 199]], 1, rtol=0.05)
    long = unit_noise(np.random.default_rng(6), 400_000, 1, "2hz", 100.0)[:, 0]
    power = np.abs(np.fft.rfft(long.reshape(200, 2000), axis=1)) ** 2
    mean, frequency = power.mean(0), np.fft.rfftfreq(2000, 0.01)
    low = mean[(frequency > 0) & (frequency < 0.5)].mean()
    assert mean[np.argmin(abs(frequency - 2))] / low == pytest.approx(0.5, rel=0.2)
    assert mean[np.argmin(abs(frequency - 8))] / low < 0.01


@pytest.mark.parametrize(
    ("names", "text"),
    [
        (
            ("spoon", "stop_go", "high"),
            "There is no 'spoon' in the bench's objects; there are: hammer, mallet",
        ),
        (
            ("pan", "stop", "high"),
            "There is no 'stop' in the bench's motions; there are: stop_go, dyn_slow, dyn_fast.",
        ),
        (
            ("pan", "stop_go", "unit"),
            "There is no 'unit' in the bench's noise_std; there are: none, low, moderate, high.",
        ),
    ],
)
def test_unknown_names_are_refused_with_those_there_are(names, text):
    with pytest.raises(BadValue, match="There is no") as caught:
        simulate_log(*names, 0)
    assert text in str(caught.value)
