"""Rows that are no measurements, and rows that only look so."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from synthetic import Kind, write

from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.coverage import coverage, directions
from steelyard.sanity.rows.judged import examine_rows, without_clipped, without_frozen
from steelyard.spatial import Rotation


@pytest.fixture
def recording(tmp_path: Path) -> Recording:
    return read_recording(write(tmp_path, Kind()))


def codes(recording: Recording) -> list[str]:
    return sorted({f.code for f in examine_rows(recording)[1]})


def wrench_of(recording: Recording) -> Stream:
    return next(s for s in recording.streams if "force" in s.channels)


def with_wrench(recording: Recording, wrench: Stream) -> Recording:
    return replace(recording, streams=tuple(wrench if "force" in s.channels else s for s in recording.streams))


@pytest.mark.parametrize("stamps", ["same", "new"])
def test_repeated_rows_are_used_once(stamps: str, recording: Recording, tmp_path: Path) -> None:
    once, findings = examine_rows(read_recording(write(tmp_path, Kind(repeated=stamps))))
    assert {f.code for f in findings} == {"rows-duplicated"}
    for clean, twice in zip(recording.streams, once.streams, strict=True):
        assert abs(len(clean) - len(twice)) <= 0.005 * len(clean)
        assert (np.diff(twice.time) > 0).all()


def test_stuck_and_clipped_rows_are_left_out(tmp_path: Path) -> None:
    stuck, findings = examine_rows(read_recording(write(tmp_path, Kind(stuck=True))))
    assert [f.code for f in findings] == ["channel-stuck"]
    assert "1000 of 7000" in findings[0].message
    assert len(wrench_of(stuck)) == 6000
    clipped, findings = examine_rows(read_recording(write(tmp_path, Kind(clipped=True))))
    assert [f.code for f in findings] == ["channel-saturated"]
    assert len(wrench_of(clipped)) < 6520


def test_channels_clipped_at_both_ends_are_not_stuck(recording: Recording) -> None:
    wrench = wrench_of(recording)
    force = wrench.channels["force"]
    low, high = np.quantile(force, [0.1, 0.9], axis=0)
    both = replace(wrench, channels={**wrench.channels, "force": np.clip(force, low, high)})
    assert set(codes(with_wrench(recording, both))) == {"channel-saturated"}


def test_a_dead_channel_is_named(recording: Recording) -> None:
    wrench = wrench_of(recording)
    torque = wrench.channels["torque"].copy()
    torque[:, 1] = 0.25
    dead = with_wrench(recording, replace(wrench, channels={**wrench.channels, "torque": torque}))
    assert codes(dead) == ["channel-stuck"]


def test_a_hung_driver_is_named(recording: Recording) -> None:
    wrench = wrench_of(recording)
    rows = np.arange(len(wrench))
    rows[2600:3100] = 2600
    hung = replace(wrench, channels={q: v[rows] for q, v in wrench.channels.items()})
    assert codes(with_wrench(recording, hung)) == ["channel-stuck"]


@pytest.mark.parametrize("settling", [0, 3])
def test_a_wrench_that_hangs_beside_poses_that_go_on_is_no_hand(settling: int) -> None:
    """It was reported as contact. Behind a filter, one channel comes to rest before the others."""
    stream = turning(1e-5, slice(0, 1))
    force = np.cumsum(stream.channels["force"], axis=0)
    force[300:420] = force[300]
    force[300 - settling : 300, 0] = force[300, 0]
    torque = 0.1 * np.roll(force, 1, axis=1)
    seen, (finding,) = without_frozen(replace(stream, channels={**stream.channels, "force": force, "torque": torque}))
    assert finding.code == "channel-stuck"
    assert "Every noisy channel of 'a.csv' stands still in 120 of 1000 rows and jumps after" in finding.message
    assert len(seen) == 880 - settling


def turning(noise: float, held: slice) -> Stream:
    """Return noisy forces beside poses that turn slowly, stop for a second, and stand still in these rows."""
    rng = np.random.default_rng(4)
    time = np.arange(1000) / 100
    angle = 0.3 * np.where(time < 5, time, np.maximum(time - 1, 5))
    turns = np.stack([angle, 0.5 * angle, 0 * angle], 1) + noise * rng.normal(size=(1000, 3))
    turns[held] = turns[held.start]
    channels = {"rotation": Rotation.exp(turns).matrix, "force": rng.normal(size=(1000, 3))}
    return Stream("a.csv", channels, time=time)


@pytest.mark.parametrize("with_force", [True, False])
def test_hung_poses_are_left_out_though_the_wrench_goes_on(with_force: bool) -> None:
    """They were reported as a hand on the object."""
    stream = turning(1e-5, slice(200, 400))
    if not with_force:
        stream = replace(stream, channels={"rotation": stream.channels["rotation"]})
    seen, (finding,) = without_frozen(stream)
    assert finding.code == "channel-stuck"
    assert "The pose of 'a.csv' stands still in 200 of 1000 rows and jumps after" in finding.message
    assert len(seen) == 800


@pytest.mark.parametrize("held", [slice(0, 0), slice(200, 400)])
def test_poses_without_noise_that_stand_still_at_rest_are_measurements(held: slice) -> None:
    """The second leaps after one rest, as where parts of logs were joined."""
    stream = turning(0.0, slice(0, 1) if held.stop == 0 else held)
    assert without_frozen(stream) == (stream, ())


def test_a_declared_zero_torque_is_not_stuck(recording: Recording) -> None:
    wrench = wrench_of(recording)
    channels = {**wrench.channels, "torque": np.zeros((len(wrench), 3))}
    assert codes(with_wrench(recording, replace(wrench, channels=channels))) == []


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_coarse_and_held_values_are_measurements(noise: float, tmp_path: Path) -> None:
    recording = read_recording(write(tmp_path, Kind(noise=noise, object="mallet")))
    wrench, pose = recording.streams[0], recording.streams[1]
    held = np.clip(np.searchsorted(pose.time, wrench.time, "right") - 1, 0, None)
    channels = {q: v[held] for q, v in pose.channels.items()}
    one_file = replace(wrench, channels={**wrench.channels, **channels})
    assert codes(replace(recording, streams=(one_file, recording.streams[2]))) == []
    force = np.round(wrench.channels["force"], 1)
    coarse = replace(wrench, channels={"force": force, "torque": np.round(wrench.channels["torque"], 2)})
    assert codes(with_wrench(recording, coarse)) == []


def test_resting_pose_repeats() -> None:
    time = np.arange(0, 20, 0.01)
    turn = np.clip(time - 5, 0, 2)[:, None] * [0.3, 0, 0.1]
    stream = Stream("pose.csv", {"position": np.round(turn, 6)}, time)
    assert codes(Recording((stream,), np.array([0, 0, -9.81]))) == []


def test_equal_stamps_of_a_coarse_clock_are_spread(recording: Recording) -> None:
    wrench = wrench_of(recording)
    coarse = with_wrench(recording, replace(wrench, time=np.floor(wrench.time * 100) / 100))
    spread, findings = examine_rows(coarse)
    assert findings == ()
    assert (np.diff(wrench_of(spread).time) > 0).all()
    assert np.abs(wrench_of(spread).time - wrench.time).max() < 0.011


def test_directions() -> None:
    assert [f.code for f in coverage(np.array([[0, 0, -9.8], [0, 9.8, 0], [9.8, 0, 0]]))] == ["too-few-poses"]
    assert coverage(np.concatenate([np.eye(3), -np.eye(3)]) * 9.8) == ()
    angle = np.linspace(0, 3, 50)
    flat = np.stack([np.cos(angle), np.sin(angle), 0 * angle], 1) * 9.8
    (finding,) = coverage(flat)
    assert finding.code == "nearly-planar"
    assert "stays in one plane in S within 0.1 degrees; across it, along (0.00, 0.00, 1.00), nothing" in finding.message
    assert len(directions(flat)) >= 4


def test_what_is_said_of_a_plane_is_true() -> None:
    """Rms and the largest angle from it both."""
    angle = np.linspace(0, 6, 400)
    up = np.sin(np.radians(np.where(np.arange(400) % 40 == 0, 15.0, 0.0)))
    down = np.stack([np.cos(angle) * np.sqrt(1 - up**2), np.sin(angle) * np.sqrt(1 - up**2), up], 1) * 9.8
    (found,) = coverage(down)
    rms, most = np.degrees(np.arcsin(up.std())), np.degrees(np.arcsin(np.abs(up - up.mean()).max()))
    assert f"by {rms:.1f} degrees rms, {most:.1f} at most" in found.message


def noisy(rows: int = 1000) -> Stream:
    rng, time = np.random.default_rng(0), np.arange(rows) / 100
    return Stream("a.csv", {"force": rng.normal(size=(rows, 3)), "torque": rng.normal(size=(rows, 3))}, time)


def with_force_x(stream: Stream, values: np.ndarray) -> Stream:
    force = stream.channels["force"].copy()
    force[:, 0] = values
    return replace(stream, channels={**stream.channels, "force": force})


@pytest.mark.parametrize("rows", [900, 400])
def test_so_many_clipped_rows_that_few_would_be_left_are_used_and_told(rows: int) -> None:
    """With 40 % at the limit almost all rows are beside one."""
    stream = noisy()
    x = stream.channels["force"][:, 0]
    limit = np.sort(x)[len(x) - rows]
    clipped = with_force_x(stream, np.minimum(x, limit))
    seen, (finding,) = without_clipped(clipped)
    assert len(seen) == len(stream)
    assert finding.message == (
        f"Force x of 'a.csv' stops at {limit:.6g} in {rows} of 1000 rows; "
        "so many cannot be left out, and these were used as they are."
    )


def test_so_many_frozen_rows_that_few_would_be_left_are_used_and_told() -> None:
    stream = noisy()
    channels = {name: values.copy() for name, values in stream.channels.items()}
    for values in channels.values():
        values[100:900] = 20.0
    seen, (finding,) = without_frozen(replace(stream, channels=channels))
    assert len(seen) == len(stream)
    assert finding.message == (
        "Every channel of 'a.csv' stands still in 800 of 1000 rows and jumps after; "
        "so many cannot be left out, and these were used as they are."
    )


def test_a_clipped_last_row_takes_its_neighbour_and_not_the_first() -> None:
    stream = noisy()
    x = stream.channels["force"][:, 0].copy()
    x[-20:] = 9.0
    seen, (finding,) = without_clipped(with_force_x(stream, x))
    np.testing.assert_array_equal(seen.time, stream.time[:-21])
    assert finding.message == "Force x of 'a.csv' stops at 9 in 20 of 1000 rows; these rows were left out."


@pytest.mark.parametrize("cut", [False, True])
def test_poses_that_gravity_pulls_alike_are_not_clipped(cut: bool) -> None:
    rng = np.random.default_rng(2)
    down = Rotation.from_rpy([[np.pi, 0, yaw] for yaw in (0.0, 0.5, 1.0)]).matrix
    others = Rotation.exp(rng.normal(size=(9, 3))).matrix
    turns = np.concatenate([down, others])
    force = np.round(np.swapaxes(turns, 1, 2) @ [0.0, 0.0, 12.0], 3)
    if cut:
        force[:, 2] = np.minimum(force[:, 2], np.sort(force[:, 2])[-4])
    torque = np.round(np.cross([0.01, 0.02, 0.05], force), 4)
    table = Stream("poses.csv", {"rotation": turns, "force": force, "torque": torque}, poses=True)
    _, found = examine_rows(Recording((table,), np.array([0.0, 0.0, -9.81])))
    assert [one.code for one in found] == ["channel-saturated"] * cut


def rests(quantum: float = 1.0, noise: float = 0.6) -> Stream:
    """Return forces [N] of a quantum beyond the noise, at eight rests and on the way from one to the next."""
    rng = np.random.default_rng(2)
    time = np.arange(8000) / 500
    places = rng.normal(0, 60, (9, 3))
    where, step = np.divmod(time / 2, 1)
    share = np.clip(2 * step - 1, 0, 1)[:, None]
    here = where.astype(int)
    force = places[here] * (1 - share) + places[here + 1] * share + noise * rng.normal(size=(8000, 3))
    return Stream("a.csv", {"force": quantum * np.round(force / quantum)}, time=time)


def with_force_y(stream: Stream, y: np.ndarray) -> Stream:
    force = stream.channels["force"].copy()
    force[:, 1] = y
    return replace(stream, channels={"force": force})


def test_stuck_and_clipped_channels_of_a_coarse_quantum_are_told() -> None:
    """They were reported as contact: blocks of a channel at rest repeat often, and steps into a stop are small."""
    stream = rests()
    y = stream.channels["force"][:, 1]
    assert without_clipped(stream) == (stream, ())
    assert without_frozen(stream) == (stream, ())
    held = y.copy()
    held[2000:3500] = held[2000]
    assert [f.code for f in without_frozen(with_force_y(stream, held))[1]] == ["channel-stuck"]
    clipped = with_force_y(stream, np.maximum(y, np.quantile(y, 0.25)))
    assert [f.code for f in without_clipped(clipped)[1]] == ["channel-saturated"]


def test_a_coarse_channel_that_rests_at_one_number_is_not_stuck() -> None:
    stream = rests(noise=0.1)
    assert without_clipped(stream) == (stream, ())
    assert without_frozen(stream) == (stream, ())
