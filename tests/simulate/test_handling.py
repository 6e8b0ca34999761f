"""The handling motions obey mechanics, their limits and their noise scenarios."""

from dataclasses import replace

import numpy as np
import pytest

from steelyard.bench.objects.conditions import condition, condition_as_published
from steelyard.errors import BadValue
from steelyard.identify.least_squares import LeastSquares
from steelyard.inertia import solids
from steelyard.simulate.handling import (
    NOISE,
    REACH,
    TIP_SPEED,
    VARIANTS,
    Disturbance,
    handling_log,
    handling_motion,
    motion_arrays,
)
from steelyard.spatial import Pose, Rotation

BODY = solids.box(0.05, 0.1, 0.2, 2000.0).in_frame(
    Pose(Rotation.from_rpy([0.3, -0.2, 0.5]), np.array([0.01, 0.0, 0.1]))
)
STEP = 1e-4


@pytest.mark.parametrize("variant", ["paper", "slow"])
def test_motion_is_the_derivative_of_itself(variant):
    motion, duration = handling_motion(variant)
    time = np.linspace(0.1, duration - 0.1, 400) + 1e-3
    before, now, after = (motion.at(time + shift) for shift in (-STEP, 0.0, STEP))
    turn = (before.rotation.inverse() @ after.rotation).log() / (2 * STEP)
    np.testing.assert_allclose(turn, now.angular_velocity, atol=1e-5)
    gain = (after.angular_velocity - before.angular_velocity) / (2 * STEP)
    np.testing.assert_allclose(gain, now.angular_acceleration, atol=1e-4)
    world = (after.rotation.apply(after.velocity) - before.rotation.apply(before.velocity)) / (2 * STEP)
    np.testing.assert_allclose(now.rotation.inverse().apply(world), now.acceleration, atol=1e-5)


@pytest.mark.parametrize("variant", VARIANTS)
def test_gravity_visits_every_axis_of_the_sensor_at_rest(variant):
    log = handling_log(BODY, variant, "none")
    held = np.abs(log.gravity[log.still]).max(0)
    np.testing.assert_allclose(held, 9.81, atol=1e-6)
    assert len(np.unique(log.pose[log.still])) >= 3


def test_the_slow_variant_is_safe_at_every_point_in_reach():
    for reach in (0.2, REACH, 0.5):
        motion, duration = handling_motion("slow", reach)
        seen = motion.at(np.linspace(0, duration, 5000))
        tip = np.linalg.norm(seen.velocity, axis=1) + reach * np.linalg.norm(seen.angular_velocity, axis=1)
        assert 0.9 * TIP_SPEED < tip.max() <= TIP_SPEED


def test_the_static_variant_never_moves():
    log = handling_log(BODY, "static", "none")
    assert log.still.all()
    assert not log.acceleration.any()
    assert not log.angular_velocity.any()
    assert condition(log) == np.inf


@pytest.mark.parametrize("variant", ["paper", "slow"])
def test_the_moving_variants_tell_all_ten_parameters(variant):
    log = handling_log(BODY, variant, "none")
    found = LeastSquares("ordinary", bias="none").identify(log)
    np.testing.assert_allclose(found.parameters.vector, BODY.vector, atol=1e-10)
    assert condition(log) < 4.6  # the worst of the published motions
    assert condition_as_published(log) > 10


def test_the_published_condition_number_is_another_number():
    noisy = handling_log(BODY, "paper", "low")
    assert condition_as_published(noisy) > 10 * condition(noisy)
    assert condition_as_published(noisy) == condition_as_published(noisy.rows(np.arange(len(noisy))[::-1]))


def test_resting_weight_points_against_gravity():
    log = handling_log(BODY, "static", "none")
    np.testing.assert_allclose(log.wrench[:, 3:], -BODY.mass * log.gravity, atol=1e-12)
    np.testing.assert_allclose(log.wrench[:, :3], np.cross(BODY.com, log.wrench[:, 3:]), atol=1e-12)


@pytest.mark.parametrize("noise", NOISE)
def test_noise_has_the_strength_of_its_scenario(noise):
    clean, noisy = handling_log(BODY, "paper", "none"), handling_log(BODY, "paper", noise, seed=3)
    angular, linear, force, torque = NOISE[noise]
    for name, wanted in (("angular_acceleration", angular), ("acceleration", linear)):
        assert (getattr(noisy, name) - getattr(clean, name)).std() == pytest.approx(wanted, rel=0.05)
    error = noisy.wrench - clean.wrench
    assert error[:, :3].std() == pytest.approx(torque, rel=0.05)
    assert error[:, 3:].std() == pytest.approx(force, rel=0.05)
    np.testing.assert_array_equal(noisy.gravity, clean.gravity)
    np.testing.assert_array_equal(noisy.angular_velocity, clean.angular_velocity)
    assert (noisy.noise is None) == (noise == "none")


def test_same_seed_same_log():
    one, two, other = (handling_log(BODY, noise="low", seed=seed) for seed in (5, 5, 6))
    np.testing.assert_array_equal(one.wrench, two.wrench)
    assert (one.wrench != other.wrench).any()


def test_disturbances_are_what_they_say():
    bias, drift = np.arange(6) / 10, np.full(6, 0.01)
    clean = handling_log(BODY, noise="none")
    moved = handling_log(BODY, noise="none", disturbance=Disturbance(bias=bias, drift=drift))
    np.testing.assert_allclose(moved.wrench - clean.wrench, bias + np.outer(clean.time, drift), atol=1e-12)
    rounded = handling_log(BODY, noise="none", disturbance=Disturbance(quantum=[0, 0, 0, 0.5, 0.5, 0.5])).wrench
    np.testing.assert_array_equal(rounded[:, :3], clean.wrench[:, :3])
    np.testing.assert_allclose(rounded[:, 3:] % 0.5, 0, atol=1e-12)
    late = handling_log(BODY, noise="none", disturbance=Disturbance(latency=0.05))
    np.testing.assert_allclose(late.wrench[5:], clean.wrench[:-5], atol=1e-9)
    np.testing.assert_array_equal(late.acceleration, clean.acceleration)


def test_correlated_noise_keeps_its_strength_and_gains_memory():
    clean = handling_log(BODY, "static", "none")
    noisy = handling_log(BODY, "static", "high", disturbance=Disturbance(spectrum="2hz"))
    error = (noisy.wrench - clean.wrench)[:, 3:]
    assert error.std() == pytest.approx(0.33, rel=0.15)
    assert (error[1:] * error[:-1]).mean() > 0.9 * error.var()


def test_motion_columns_hold_the_log():
    columns = motion_arrays("paper", BODY)
    assert {len(c) for c in columns.values()} == {1000}
    log = handling_log(BODY, "paper", "none")
    np.testing.assert_array_equal(columns["force_sensor"], log.wrench[:, 3:])
    np.testing.assert_array_equal(columns["torque_sensor"], log.wrench[:, :3])
    speed = np.gradient(columns["position_world"], columns["time"], axis=0)
    world = np.einsum("nij,nj->ni", columns["rotation_world_from_sensor"], columns["linear_velocity_sensor"])
    np.testing.assert_allclose(speed[1:-1], world[1:-1], atol=1e-3)
    assert "force_sensor" not in motion_arrays("slow")


def test_refusals_name_what_there_is():
    with pytest.raises(BadValue, match="variant must be one of paper, slow, static; got 'fast'"):
        handling_log(BODY, "fast")
    with pytest.raises(BadValue, match="no noise scenario 'loud'; there are: none, low, moderate, high, high-code"):
        handling_log(BODY, noise="loud")


def test_own_noise_can_be_given():
    log = handling_log(BODY, noise=(0.1, 0.2, 0.3, 0.4))
    np.testing.assert_allclose(log.noise[0].wrench, [0.16] * 3 + [0.09] * 3)
    assert replace(log, noise=None).noise is None
