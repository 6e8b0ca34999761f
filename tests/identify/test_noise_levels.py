"""Noise that a log does not declare, and rows that are not at rest after all."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from bench_logs import BIAS, MOTIONS, OBJECTS, bench_log, truth

from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.noise_levels import with_declared, with_noise
from steelyard.identify.rest import RIPPLE, at_rest
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.noise import rounding


def found_over_true(log: MotionLog) -> list[tuple[bool, np.ndarray, np.ndarray]]:
    """Per class: whether it is the still one, and standard deviations found over true of acceleration and wrench."""
    assert log.noise is not None
    true = log.noise[0]
    found = with_noise(replace(log, noise=None), with_bias=True)
    assert found.noise is not None
    out = []
    for c in np.unique(found.noise_class):
        noise = found.noise[c]
        still = bool(found.still[found.noise_class == c].all())
        out.append((still, np.sqrt(noise.acceleration / true.acceleration), np.sqrt(noise.wrench / true.wrench)))
    return out


@pytest.mark.parametrize("thing", OBJECTS)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("level", ["low", "moderate", "high"])
def test_levels_of_bench_logs(thing: str, motion: str, level: str) -> None:
    for still, acceleration, wrench in found_over_true(bench_log(thing, motion, level)):
        assert (np.abs(acceleration - 1) < 0.2).all()
        assert (np.abs(wrench[3:] - 1) < 0.1).all()
        if still:
            assert (np.abs(wrench[:3] - 1) < 0.2).all()
        else:
            # Where noise in the angular acceleration explains nearly all of the torque's residual, a tenth of it is
            # kept for the sensor, so that its level is too high there; never too low.
            assert (wrench[:3] > 0.85).all()
            assert (wrench[:3] < 4).all()


def test_declared_levels_are_kept() -> None:
    log = bench_log("hammer", "stop_go", "moderate")
    kept = with_noise(log, True).noise or ()
    assert all(np.array_equal(k.wrench, n.wrench) for k, n in zip(kept, log.noise or (), strict=True))
    loud = with_declared(replace(log, noise=None), {"force": 0.7})
    assert loud.noise is not None
    assert all((n.wrench[3:] == 0.7**2).all() and not n.wrench[:3].any() for n in loud.noise)
    filled = with_noise(loud, True)
    assert filled.noise is not None
    assert all((n.wrench[3:] == 0.7**2).all() and (n.wrench[:3] > 0).all() for n in filled.noise)


def test_a_log_without_time_and_rest_has_no_acceleration_noise() -> None:
    log = replace(bench_log("hammer", "dyn_slow", "moderate"), noise=None, time=None)
    filled = with_noise(log, True)
    assert filled.noise is not None
    assert not any(n.acceleration.any() for n in filled.noise)


def test_time_order_of_rows_does_not_matter_to_the_levels() -> None:
    """Fourth differences are taken along time, not along the rows as they come."""
    log = replace(bench_log("hammer", "dyn_slow", "moderate"), noise=None)
    mixed = log.rows(np.random.default_rng(0).permutation(len(log)))
    one, other = with_noise(log, True).noise, with_noise(mixed, True).noise
    assert one is not None
    assert other is not None
    np.testing.assert_allclose(other[0].acceleration, one[0].acceleration, rtol=1e-9)


def test_rows_at_rest_are_fused_with_zero() -> None:
    log = bench_log("mallet", "stop_go", "moderate", 1)
    noise = (log.noise or ())[0]
    quiet = at_rest(log, truth("mallet").vector, BIAS)
    assert quiet.noise is not None
    kept = quiet.still
    # Rows that hold still keep the flag, all but one in a thousand or so.
    assert kept.sum() > 0.97 * log.still.sum()
    assert not kept[~log.still].any()
    share = RIPPLE / (RIPPLE + noise.acceleration)
    np.testing.assert_allclose(quiet.acceleration[kept], share[3:] * log.acceleration[kept], rtol=1e-12)
    np.testing.assert_array_equal(quiet.acceleration[~kept], log.acceleration[~kept])
    assert set(quiet.noise_class[kept]) == {1}
    assert set(quiet.noise_class[~kept]) == {0}
    np.testing.assert_allclose(quiet.noise[1].acceleration, 1 / (1 / RIPPLE + 1 / noise.acceleration))
    np.testing.assert_array_equal(quiet.noise[1].wrench, noise.wrench)


def test_flagged_rows_that_move_are_demoted() -> None:
    """A row that is flagged still while the wrench shows its acceleration keeps what was measured."""
    log = bench_log("mallet", "stop_go", "moderate", 1)
    body = truth("mallet")
    felt = log.wrench - BIAS
    quiet = replace(log, acceleration=np.zeros_like(log.acceleration), angular_acceleration=0 * log.acceleration)
    noise = (log.noise or ())[0]
    surprise = ((felt - quiet.predicted(body.vector)) ** 2 / noise.wrench).sum(1)
    lying = replace(log, still=np.ones(len(log), np.bool_))
    judged = at_rest(lying, body.vector, BIAS)
    moving = surprise > 40
    assert moving.sum() > 50
    assert not judged.still[moving].any()
    np.testing.assert_array_equal(judged.angular_acceleration[moving], log.angular_acceleration[moving])
    assert judged.still[log.still].mean() > 0.97


def test_logs_that_cannot_be_judged_stay_as_they_are() -> None:
    log = bench_log("mallet", "dyn_fast", "moderate")
    assert at_rest(log, truth("mallet").vector, BIAS) is log
    unknown = replace(bench_log("mallet", "stop_go", "moderate"), noise=None)
    assert at_rest(unknown, truth("mallet").vector, BIAS) is unknown


def test_noise_refuses_negative_variances() -> None:
    with pytest.raises(Exception, match=r"^wrench variances must not be negative; got \["):
        Noise(np.ones(6), -np.ones(6))


@pytest.mark.parametrize(("newton", "newton_metre"), [(2, 3), (1, 2)])
def test_bars_hold_the_digits_of_a_typed_table(newton: int, newton_metre: int) -> None:
    down = -9.80665 * np.concatenate([np.eye(3), -np.eye(3)])
    z = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        body = InertialParameters.from_com(rng.uniform(0.5, 2), [*rng.uniform(-0.03, 0.03, 2), 0.08], 1e-3 * np.eye(3))
        wrench = MotionLog.of_poses(np.zeros((6, 6)), down).predicted(body.vector) + rng.uniform(-1, 1, 6)
        typed = np.column_stack([wrench[:, :3].round(newton_metre), wrench[:, 3:].round(newton)])
        found = NoiseAware().identify(MotionLog.of_poses(typed, down))
        z.append((np.append(found.mass, found.com) - np.append(body.mass, body.com)) / found.std[:4])
    # All rows are rounded alike, so that residuals show next to nothing: bars of what they show are left behind.
    assert np.sqrt(np.mean(np.square(z))) < 1.3
    assert np.abs(z).max() < 3


def test_full_doubles_have_no_rounding() -> None:
    rng = np.random.default_rng(0)
    assert not rounding(rng.normal(size=(50, 6))).any()
    coarse = np.column_stack([rng.normal(size=(50, 3)).round(3), np.zeros((50, 3))])
    assert rounding(coarse) == pytest.approx(np.repeat([1e-6 / 12, 0.0], 3))
