"""A structure that swings: the wrench is followed only up to where it follows the poses."""

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BODY, GRAVITY, Swing, fitted, recording

from steelyard.logs.alignment import align
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.simulate import hammer
from steelyard.spatial import Pose, Rotation


def swinging(hz, size=4.0, seed=0):
    """Return a recording whose load rings at `hz` every two seconds, by up to `size` [rad/s^2], unseen by the poses."""
    made = recording(Swing(seed), seed=seed, imu=False, position=True)
    wrench = made.streams[0]
    since = wrench.time % 2.0
    ring = size * np.exp(-since / 0.3) * np.cos(2 * np.pi * hz * since)
    zero = np.zeros((len(since), 3))
    shaken = MotionLog(np.zeros((len(since), 6)), zero, zero, zero, ring[:, None] * [0.8, -1.0, 0.6])
    more = shaken.predicted(BODY.vector)
    channels = {"force": wrench.channels["force"] + more[:, 3:], "torque": wrench.channels["torque"] + more[:, :3]}
    return replace(made, streams=(replace(wrench, channels=channels), *made.streams[1:]))


def lowered(aligned):
    return [n for n in aligned.notes if "low-passed there" in n]


@pytest.mark.parametrize(("hz", "at"), [(9.0, 5), (12.0, 7), (17.0, 14)])
def test_swinging_is_left_out(hz, at):
    aligned = align(swinging(hz))
    assert lowered(aligned) == [
        f"above {at} Hz the wrench does not follow the poses, as where an arm swings or noise is most of it: "
        "it was low-passed there"
    ]
    assert np.median(np.diff(aligned.log.time)) == pytest.approx(1 / (2.5 * at), rel=0.2)
    assert fitted(aligned.log)[0] == pytest.approx(float(BODY.mass), rel=2e-3)


@pytest.mark.parametrize("seed", range(3))
def test_a_slip_comes_once_and_is_no_swinging(seed):
    """A step of the wrench at one time is loud at all frequencies; a swing comes back after every stop."""
    made = recording(Swing(seed, 40.0), seed=seed, imu=False, position=True)
    wrench = made.streams[0]
    moved = BODY.in_frame(Pose(Rotation.identity(), np.array([0.0, 0.01, 0.0]))).vector - BODY.vector
    share = np.clip((wrench.time - 17.0) / 0.15, 0.0, 1.0)[:, None]
    more = share * Swing(seed, 40.0).log(wrench.time).predicted(moved)
    channels = {"force": wrench.channels["force"] + more[:, 3:], "torque": wrench.channels["torque"] + more[:, :3]}
    slipped = replace(made, streams=(replace(wrench, channels=channels), *made.streams[1:]))
    found = identify(slipped)
    assert not lowered(found)
    (said,) = (f.message for f in found.findings if f.code == "load-changed")
    assert said.startswith("At 17.")
    assert "moved by 10 mm" in said
    assert np.abs(found.com - BODY.com - [0.0, 0.01, 0.0]).max() < 1e-4


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_lowers_nothing(seed):
    for noise in (1.0, 5.0):
        made = recording(
            Swing(seed), seed=seed, imu=False, position=True, force_std=0.05 * noise, torque_std=0.005 * noise,
            angle_std=2e-4 * noise,
        )  # fmt: skip
        assert not lowered(align(made))


@pytest.mark.parametrize("seed", range(2))
def test_a_low_pass_that_ends_where_a_band_begins(seed):
    assert not lowered(align(hammer.recording(seed).recording))  # poses at 25 Hz: a low-pass at 10


@pytest.mark.parametrize("seed", range(2))
def test_an_accelerometer_swings_with_the_load(seed):
    assert not lowered(align(recording(Swing(seed), seed=seed)))


def in_one_file(late, seed=0, hz=500.0):
    """Return a recording of one stream whose wrench is `late` [s] beside the poses of the same rows."""
    swing, rng = Swing(seed), np.random.default_rng(seed)
    t = np.arange(0.1, swing.duration, 1 / hz)
    wrench = swing.log(t - late).wrench + rng.normal(size=(len(t), 6)) * np.repeat([0.005, 0.05], 3)
    R, _, _, p, _, _ = swing.at(t)
    channels = {"force": wrench[:, 3:], "torque": wrench[:, :3], "rotation": R, "position": p}
    return Recording((Stream("all.csv", channels, time=t),), GRAVITY)


@pytest.mark.parametrize("late", [0.02, -0.008])
def test_a_wrench_that_is_late_beside_the_poses_of_its_own_rows(late):
    aligned = align(in_one_file(late))
    assert aligned.delays_s["all.csv"] == pytest.approx(-late, abs=5e-4)
    (found,) = aligned.findings
    who = ("wrench", "motion") if late > 0 else ("motion", "wrench")
    assert found.code == "stream-delayed"
    assert found.message.startswith(f"In the rows of 'all.csv' the {who[0]} is ")
    assert found.message.endswith(f" ms later than the {who[1]} (corrected here).")
    truth = BODY.inertia_com
    assert np.abs(identify(in_one_file(late)).inertia_com - truth).max() < 0.02 * np.trace(truth)


@pytest.mark.parametrize("seed", range(4))
def test_rows_in_step_stay_so(seed):
    aligned = align(in_one_file(0.0, seed))
    assert aligned.delays_s == {"all.csv": 0.0}
    assert not aligned.findings


def test_a_delay_that_is_given_is_believed():
    made = in_one_file(0.02)
    given = replace(made, streams=(replace(made.streams[0], delay=0.0),))
    assert not align(given).findings


def through(follows, seed=0, step=0.002):
    """Return a recording whose wrench w reads w + follows * w'' [s^2]: below zero a soft arm, above a filter."""
    swing = Swing(seed, angle=1.4)
    made = recording(swing, seed=seed, imu=False, position=True, force_std=0.02, torque_std=0.001, angle_std=2e-5)
    wrench = made.streams[0]
    before, now, later = (swing.log(wrench.time + d).wrench for d in (-step, 0.0, step))
    more = follows * (later - 2 * now + before) / step**2
    channels = {"force": wrench.channels["force"] + more[:, 3:], "torque": wrench.channels["torque"] + more[:, :3]}
    return replace(made, streams=(replace(wrench, channels=channels), *made.streams[1:]))


@pytest.mark.parametrize(
    ("follows", "words"), [(-5e-4, "its first mode near 7 Hz"), (1e-3, "a slow filter of the force")]
)
def test_bars_hold_what_a_soft_arm_or_a_slow_filter_does(follows, words):
    estimate = identify(through(follows))
    assert any(words in note for note in estimate.notes)
    off = np.append(estimate.mass - float(BODY.mass), (estimate.inertia_com - BODY.inertia_com)[np.triu_indices(3)])
    assert (np.abs(off) < 3 * estimate.std[[0, 4, 5, 6, 7, 8, 9]]).all()


def test_a_stiff_arm_widens_nothing():
    assert not any("bends" in note for note in identify(through(0.0)).notes)
