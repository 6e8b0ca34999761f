"""Alignment of made recordings: three clocks, a turned and late accelerometer, taps, tables."""

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BODY, GRAVITY, Swing, fitted, recording

from steelyard.errors import BadDescription, CannotAnswer
from steelyard.logs.alignment import align
from steelyard.logs.prepared import AlignOptions
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.spatial import Rotation

TURN = Rotation.exp([0.9, -1.2, 0.4])
ARM = (0.05, -0.03, 0.08)


def codes(aligned):
    return {f.code for f in aligned.findings}


@pytest.mark.parametrize("seed", [0, 1])
def test_three_clocks_and_an_accelerometer_that_is_turned_off_centre_and_late(seed):
    made = recording(Swing(seed), seed=seed, imu_delay=0.013, pose_delay=-0.006, mount=TURN, lever=ARM)
    aligned = align(made)
    assert aligned.delays_s["imu.csv"] == pytest.approx(0.013, abs=2e-4)
    assert aligned.delays_s["pose.csv"] == pytest.approx(-0.006, abs=1e-3)
    mount = aligned.mounts["imu.csv"]
    assert np.degrees((mount.rotation.inverse() @ TURN).angle()) < 0.1
    assert np.allclose(mount.position, ARM, atol=2e-3)
    assert codes(aligned) == {"stream-delayed", "imu-rotated"}
    remedies = " ".join(f.remedy for f in aligned.findings if f.code == "stream-delayed")
    assert f"delay = {{ value = {1e3 * aligned.delays_s['imu.csv']:.2f}, unit = 'ms' }}" in remedies
    x = fitted(aligned.log)
    assert x[0] == pytest.approx(float(BODY.mass), rel=6e-3)
    assert np.allclose(x[1:4] / x[0], BODY.com, atol=3e-4)


def test_recovers_bias_and_exact_mass_when_positions_are_measured():
    made = recording(Swing(2), imu_delay=0.013, mount=TURN, lever=ARM, position=True)
    aligned = align(made)
    mount = aligned.mounts["imu.csv"]
    assert np.allclose(mount.bias, [0.1, -0.2, 0.15], atol=0.01)
    assert mount.scale == pytest.approx(1, abs=1e-3)
    assert fitted(aligned.log)[0] == pytest.approx(float(BODY.mass), rel=1e-3)


@pytest.mark.parametrize("seed", range(4))
def test_nothing_is_claimed_where_nothing_is_wrong(seed):
    aligned = align(recording(Swing(seed, duration=8.0, travel=0.05), seed=seed))
    assert set(aligned.delays_s.values()) == {0.0}
    assert not codes(aligned)
    assert not len(aligned.left_out)


def test_a_given_delay_and_mount_are_used_as_given():
    made = recording(Swing(0), imu_delay=0.013, mount=TURN, lever=ARM)
    given = [
        replace(s, delay=0.013, mount=Mount(TURN, np.array(ARM))) if s.name == "imu.csv" else replace(s, delay=0.0)
        for s in made.streams
    ]
    aligned = align(replace(made, streams=tuple(given)))
    assert aligned.delays_s == {"pose.csv": 0.0, "imu.csv": 0.013}
    assert np.allclose(aligned.mounts["imu.csv"].rotation.matrix, TURN.matrix)
    assert not codes(aligned)


def test_turning_about_one_axis_is_said():
    made = recording(Swing(1, axes=(0, 1.5, 0), travel=0.0), imu_delay=0.013, mount=TURN, lever=ARM)
    aligned = align(made)
    assert codes(aligned) == {"stream-delayed", "imu-rotated", "nearly-planar"}
    assert np.degrees((aligned.mounts["imu.csv"].rotation.inverse() @ TURN).angle()) < 0.2
    assert aligned.delays_s["imu.csv"] == pytest.approx(0.013, abs=2e-4)


def test_taps_are_found_and_left_out():
    times = (2.0, 5.0, 7.7)
    aligned = align(recording(Swing(1), taps=times))
    assert codes(aligned) == {"outliers"}
    assert len(aligned.left_out) == 3
    start = aligned.log.time[0]
    assert all(a <= t <= b for t, (a, b) in zip(times, aligned.left_out, strict=True)), start
    assert not any(((aligned.log.time > a) & (aligned.log.time < b)).any() for a, b in aligned.left_out)


def test_a_hand_on_the_object_does_not_turn_the_mount():
    made = recording(Swing(1, axes=(0, 1.5, 0), travel=0.01, duration=8.0), imu_delay=0.008, mount=TURN, lever=ARM)
    wrench = made.streams[0]
    t = wrench.time
    push = np.where((t > 2) & (t < 6), np.sin(np.pi * (t - 2) / 4) ** 2, 0.0)[:, None] * np.array([6.0, -4.0, 5.0])
    touched = replace(wrench, channels={**wrench.channels, "force": wrench.channels["force"] + push})
    aligned = align(replace(made, streams=(touched, *made.streams[1:])))
    assert np.degrees((aligned.mounts["imu.csv"].rotation.inverse() @ TURN).angle()) < 3


def test_the_sign_of_the_wrench_is_that_of_the_object():
    one = align(recording(Swing(0, duration=6.0), sign=1))
    other = align(recording(Swing(0, duration=6.0), sign=-1))
    assert np.allclose(one.log.wrench, other.log.wrench)


def test_accelerations_and_their_variance_from_poses_alone():
    swing = Swing(3)
    aligned = align(recording(swing, imu=False, position=True))
    log = aligned.log
    truth = swing.log(log.time)
    inner = slice(50, -50)
    for name, part in (("angular_acceleration", 0), ("acceleration", 3)):
        variance = np.stack([n.acceleration for n in log.noise])[log.noise_class][inner, part : part + 3]
        chi2 = np.mean((getattr(log, name) - getattr(truth, name))[inner] ** 2 / variance)
        assert 0.2 < chi2 < 1.6, name
    assert fitted(log)[0] == pytest.approx(float(BODY.mass), rel=2e-3)


def test_one_stream_that_gives_everything_passes_unchanged():
    swing = Swing(4, duration=5.0)
    t = np.arange(0, 5, 0.01)
    log = swing.log(t)
    channels = {
        "force": log.wrench[:, 3:],
        "torque": log.wrench[:, :3],
        "gravity": log.gravity,
        "linear_acceleration": log.acceleration,
        "angular_velocity": log.angular_velocity,
        "angular_acceleration": log.angular_acceleration,
    }
    aligned = align(Recording((Stream("all.csv", channels, time=t),), GRAVITY))
    for name in ("wrench", "gravity", "acceleration", "angular_velocity", "angular_acceleration"):
        assert np.allclose(getattr(aligned.log, name), getattr(log, name), atol=1e-9), name
    assert not codes(aligned)
    bare = Recording((Stream("all.csv", channels),), GRAVITY)
    without_clock = align(bare)
    assert codes(without_clock) == {"clock-missing"}
    assert np.array_equal(without_clock.log.wrench, log.wrench)


def test_world_frame_wrench_and_moved_sensor_are_brought_to_s():
    swing = Swing(5, duration=6.0)
    t = np.arange(0, 6, 0.01)
    R, *_ = swing.at(t)
    log = swing.log(t)
    at = np.array([0.0, 0.02, -0.05])
    torque = log.wrench[:, :3] - np.cross(at, log.wrench[:, 3:])
    moved = Stream(
        "w",
        {"force": TURN.inverse().apply(log.wrench[:, 3:]), "torque": TURN.inverse().apply(torque), "rotation": R},
        time=t,
        mount=Mount(TURN, at),
    )
    assert np.allclose(align(Recording((moved,), GRAVITY)).log.wrench, log.wrench, atol=1e-3)
    turned = Stream(
        "w",
        {
            "force": np.einsum("nij,nj->ni", R, log.wrench[:, 3:]),
            "torque": np.einsum("nij,nj->ni", R, log.wrench[:, :3]),
            "rotation": R,
        },
        time=t,
        frames={"force": "W", "torque": "W"},
    )
    assert np.allclose(align(Recording((turned,), GRAVITY)).log.wrench, log.wrench, atol=1e-3)


@pytest.mark.parametrize(
    ("parts", "late", "sensors"),
    [
        (("force", "torque"), 0.1, {"imu": False, "position": True}),
        (("force", "torque"), -0.06, {"imu_delay": 0.013, "mount": TURN}),
        (("force",), 0.1, {"imu": False, "position": True}),
        (("torque",), -0.06, {"imu": False, "position": True}),
    ],
)
def test_a_late_pose_is_found_alike_whether_the_wrench_is_given_in_s_or_in_w(parts, late, sensors):
    swing = Swing(1)
    made = recording(swing, pose_delay=late, sign=-1, **sensors)
    wrench = made.streams[0]
    R, *_ = swing.at(wrench.time)
    given = {q: np.einsum("nij,nj->ni", R, v) if q in parts else v for q, v in wrench.channels.items()}
    turned = replace(wrench, channels=given, frames=dict.fromkeys(parts, "W"))
    own, other = align(made), align(replace(made, streams=(turned, *made.streams[1:])))
    assert other.delays_s["pose.csv"] == pytest.approx(late, abs=2e-4)
    for name, seconds in own.delays_s.items():
        assert other.delays_s[name] == pytest.approx(seconds, abs=3e-4), name
    assert codes(other) == codes(own)
    mine, found = fitted(own.log), fitted(other.log)
    assert found[0] == pytest.approx(mine[0], rel=2e-4)
    assert np.allclose(found[1:4] / found[0], mine[1:4] / mine[0], atol=2e-5)


def test_tables_of_still_poses_match_by_row():
    rng = np.random.default_rng(0)
    R = Rotation.exp(rng.normal(size=(12, 3)))
    wrench = rng.normal(size=(12, 6))
    streams = (
        Stream("w", {"force": wrench[:, 3:], "torque": wrench[:, :3]}, poses=True),
        Stream("r", {"rotation": R.matrix}, poses=True),
    )
    aligned = align(Recording(streams, GRAVITY, -1))
    assert np.array_equal(aligned.log.wrench, -wrench)
    assert np.allclose(aligned.log.gravity, R.inverse().matrix @ GRAVITY)
    assert aligned.log.still.all()
    assert list(aligned.log.pose) == list(range(12))
    with pytest.raises(BadDescription, match="need one length; 'w' has 12, 'r' has 11 rows"):
        align(Recording((streams[0], Stream("r", {"rotation": R.matrix[:11]}, poses=True)), GRAVITY))


def test_still_stretches_become_poses():
    swing = Swing(0, duration=12.0)
    stretch = np.interp(np.arange(0, 30, 0.01), [0, 3, 8, 12, 17, 21, 30], [0, 0, 3, 3, 7, 7, 7])
    soft = np.convolve(np.pad(stretch, 40, "edge"), np.hanning(81) / np.hanning(81).sum(), "valid")
    t = 0.01 * np.arange(len(soft))
    R, *_ = swing.at(soft)
    rng = np.random.default_rng(0)
    gravity = np.swapaxes(R, 1, 2) @ GRAVITY
    force = -float(BODY.mass) * gravity + 0.02 * rng.normal(size=gravity.shape)
    torque = np.cross(BODY.com, -float(BODY.mass) * gravity) + 0.002 * rng.normal(size=gravity.shape)
    noisy = R @ Rotation.exp(1e-4 * rng.normal(size=(len(t), 3))).matrix
    log = align(Recording((Stream("a", {"force": force, "torque": torque, "rotation": noisy}, time=t),), GRAVITY)).log
    assert {2.0, 10.0, 28.0} <= {float(v) for v in np.round(log.time[log.still], 2)}
    assert not log.still[(log.time > 4) & (log.time < 7)].any()
    numbers = [set(log.pose[(log.time > a) & (log.time < b)]) for a, b in ((0.5, 2.5), (9, 11), (22, 29))]
    assert all(len(n) == 1 for n in numbers)
    assert len(set.union(*numbers)) == 3
    assert (np.diff(log.pose) >= 0).all()


def test_bad_recordings_say_what_is_missing():
    made = recording(Swing(0, duration=4.0))
    wrench, pose, imu = made.streams
    with pytest.raises(BadDescription, match="no stream has force"):
        align(replace(made, streams=(pose, imu)))
    with pytest.raises(BadDescription, match="where gravity points"):
        align(replace(made, streams=(wrench,)))
    with pytest.raises(CannotAnswer, match="share no time"):
        align(replace(made, streams=(wrench, replace(pose, time=pose.time + 1e6), imu)))
    with pytest.raises(CannotAnswer, match=r"from 1700000000\.00"):
        align(replace(made, streams=(wrench, *(replace(s, time=s.time + 1.7e9 + 0.001) for s in (pose, imu)))))
    with pytest.raises(CannotAnswer, match=r"share 0.00\d+ s .* Check the time units"):
        align(replace(made, streams=tuple(replace(s, time=1e-3 * s.time) for s in made.streams)))
    with pytest.raises(BadDescription, match="need a clock"):
        align(replace(made, streams=(wrench, replace(pose, time=None))))


def test_delays_can_be_left_alone():
    aligned = align(recording(Swing(0, duration=6.0), imu_delay=0.013), AlignOptions(estimate_delays=False))
    assert set(aligned.delays_s.values()) == {0.0}


def test_a_mount_is_found_where_turns_about_the_vertical_hardly_move_gravity() -> None:
    mount = Rotation.exp([0.15, -0.16, 0.77])
    aligned = align(recording(Swing(5, angle=0.3, axes=(0, 0, 1)), seed=0, imu_delay=0.005, mount=mount))
    found = aligned.mounts["imu.csv"].rotation
    assert np.degrees((found.inverse() @ mount).angle()) < 0.3
    assert aligned.delays_s["imu.csv"] == pytest.approx(0.005, abs=5e-4)
