"""What only the sensor can do to a wrench: a turn that no mount says, gains that differ by axis."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import BODY, recorded
from sound_hammer import hammer_answer, hammer_log
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.inertia import solids
from steelyard.logs.alignment import align
from steelyard.logs.log import MotionLog
from steelyard.logs.prepared import AlignOptions
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine
from steelyard.sanity.fitted.sensor_matrix import SURE, sensor_matrix
from steelyard.simulate import hammer
from steelyard.simulate.logs import simulate_log
from steelyard.spatial import Pose, Rotation

TURN = np.radians([1.0, -1.0, 1.5])


@pytest.fixture(scope="module")
def recording() -> Recording:
    return hammer_log()


@pytest.fixture(scope="module")
def answer() -> Estimate:
    return hammer_answer()


def misread(recording: Recording, turn: np.ndarray, gains: tuple[float, ...] = (1, 1, 1)) -> Recording:
    """Return the recording of a sensor that is turned and whose forces have these gains."""
    R = Rotation.exp(turn).matrix

    def felt(quantity: str, values: np.ndarray) -> np.ndarray:
        if quantity not in ("force", "torque"):
            return values
        return np.asarray((values * gains if quantity == "force" else values) @ R.T)

    streams = (replace(s, channels={q: felt(q, v) for q, v in s.channels.items()}) for s in recording.streams)
    return replace(recording, streams=tuple(streams))


def in_one_stream(recording: Recording) -> Recording:
    """Return the recording as one file would hold it: a wrench in S beside poses in W, of one clock."""
    wrench, poses = recording.streams
    felt = {q: v[:: len(wrench) // len(poses)] for q, v in wrench.channels.items()}
    both = Stream("log.csv", {**felt, **poses.channels}, poses.time, frames={"position": "W"})
    return replace(recording, streams=(both,))


def off(found: Estimate, right: Estimate) -> float:
    """Return how many standard deviations mass and centre of mass are off at most."""
    gap = np.append(found.mass - right.mass, found.com - right.com)
    return float(np.abs(gap / found.std[:4]).max())


def made(motion: str, noise: str, seed: int, turn: np.ndarray, gains: tuple[float, ...] = (1, 1, 1)) -> MotionLog:
    log, _ = simulate_log("drill", motion, noise, seed, shuffled=False)
    R = Rotation.exp(turn).matrix
    return replace(log, wrench=np.hstack([log.wrench[:, :3] @ R.T, log.wrench[:, 3:] * gains @ R.T]))


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow", "dyn_fast"])
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
@pytest.mark.parametrize("seed", range(3))
def test_a_good_sensor_shows_nothing(motion: str, noise: str, seed: int) -> None:
    found = sensor_matrix(made(motion, noise, seed, np.zeros(3)))
    assert (np.abs(found.turn) < SURE * found.turn_std).all()
    assert (np.abs(found.stretch) <= SURE * found.stretch_std).all()


@pytest.mark.parametrize(("motion", "noise"), [("stop_go", "high"), ("dyn_slow", "low"), ("dyn_fast", "moderate")])
def test_turn_and_gains_are_measured(motion: str, noise: str) -> None:
    turned = sensor_matrix(made(motion, noise, 0, TURN))
    np.testing.assert_allclose(turned.turn, TURN, atol=np.radians(0.25))
    stretched = sensor_matrix(made(motion, noise, 0, np.zeros(3), (1.03, 1.0, 1.0)))
    np.testing.assert_allclose(np.diag(stretched.stretch), [0.02, -0.01, -0.01], atol=0.005)


@pytest.mark.parametrize("turn", [TURN, np.radians([0.0, 8.0, 0.0])])
def test_a_turned_sensor_is_told_though_it_disturbs_delays(
    recording: Recording, answer: Estimate, turn: np.ndarray
) -> None:
    found = identify(misread(recording, turn))
    (finding,) = (f for f in found.findings if f.code == "sensor-turned")
    assert off(found, answer) < 3
    said = float(finding.message.split(" turned by ")[1].split(" ±")[0])
    assert said == pytest.approx(np.degrees(np.linalg.norm(turn)), rel=0.1)


@pytest.mark.parametrize("turn", np.radians([[0.0, 0.0, 2.0], [3.0, 0.0, 4.0]]))
def test_a_turned_sensor_is_told_with_the_mount_that_mends_it(
    recording: Recording, answer: Estimate, turn: np.ndarray
) -> None:
    assert not answer.codes() & {"sensor-turned", "gains-differ"}
    wrong = misread(recording, turn)
    found = identify(wrong)
    (finding,) = (f for f in found.findings if f.code == "sensor-turned")
    assert off(found, answer) < 3
    vector = [float(v) for v in re.search(r"rotation vector \((.*?)\) rad", finding.message)[1].split(",")]
    np.testing.assert_allclose(vector, -turn, atol=np.radians(0.2))
    mounted = (replace(s, mount=Mount(Rotation.exp(vector))) if "force" in s.channels else s for s in wrong.streams)
    mended = identify(replace(wrong, streams=tuple(mounted)))
    assert mended.codes() == answer.codes()
    assert off(mended, answer) < 4


@pytest.mark.parametrize("degrees", [(0, 0, 90), (-90, 0, 0), (0, 0, 180), (100, -100, 50), (20, 10, 0)])
def test_the_mount_printed_for_a_large_turn_mends_it(degrees: tuple[float, float, float]) -> None:
    """One paste, and the answer is that of S: no contact, no plane, no other cause on the way."""
    wrong = misread(recorded("paper", 0), np.radians(degrees))
    try:
        found = identify(wrong).findings
        assert not {f.code for f in found} & {"contact", "nearly-planar", "gravity-frame", "force-unit"}
        said = next(f.remedy for f in found if f.code == "sensor-turned")
    except CannotAnswer as refused:
        said = str(refused)
        assert said.startswith("Noticed before the fit: The wrench is turned by")
        assert "Add still poses" not in said
    pasted = re.search(r"Set mount = \{ rotation = \[(.*?)\], form = 'rotation-vector' \} for 'log'", said)
    assert pasted is not None
    mount = Mount(Rotation.exp([float(v) for v in pasted[1].split(",")]))
    mended = identify(replace(wrong, streams=tuple(replace(s, mount=mount) for s in wrong.streams)))
    assert mended.codes() == set()
    assert np.abs((np.append(mended.mass, mended.com) - np.append(BODY.mass, BODY.com)) / mended.std[:4]).max() < 4


def test_a_turned_sensor_is_no_delay(recording: Recording) -> None:
    turn = (0.0, float(np.radians(20.0)), 0.0)
    wrong = misread(recording, np.array(turn))
    assert any(align(wrong).delays_s.values())
    assert not any(align(wrong, AlignOptions(turn=turn)).delays_s.values())


def test_poses_beside_the_wrench_in_one_file_hide_nothing(recording: Recording) -> None:
    one = in_one_stream(recording)
    right = identify(one)
    assert not right.codes() & {"sensor-turned", "gains-differ"}
    for turn, gains, code in ((np.zeros(3), (1.05, 1, 1), "gains-differ"), (TURN, (1, 1, 1), "sensor-turned")):
        found = identify(misread(one, turn, gains))
        assert code in found.codes()
        assert off(found, right) < 3


def test_a_drift_hides_nothing(recording: Recording, answer: Estimate) -> None:
    """A bias that grows by 2 N is most of the residual where nothing says that it may."""

    def drifts(stream: Stream) -> Stream:
        if "force" not in stream.channels:
            return stream
        force = stream.channels["force"] + np.linspace(0, 2, len(stream))[:, None]
        return replace(stream, channels={**stream.channels, "force": force})

    for turn, gains, code in ((np.zeros(3), (1.04, 1, 1), "gains-differ"), (2 * TURN, (1, 1, 1), "sensor-turned")):
        wrong = misread(recording, turn, gains)
        found = identify(replace(wrong, streams=tuple(map(drifts, wrong.streams))))
        assert {"bias-drift", code} <= found.codes()
        assert off(found, answer) < 3


def test_bars_of_an_object_hold_what_a_turn_does_to_it_and_its_tool(monkeypatch: pytest.MonkeyPatch) -> None:
    held = hammer.body()
    tool = solids.box(0.1, 0.08, 0.12, 2000).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.01, 0.06])))
    monkeypatch.setattr(hammer, "body", lambda: tool)
    alone = hammer.recording(1).recording
    monkeypatch.setattr(hammer, "body", lambda: tool + held)
    both = hammer.recording(2).recording
    right = identify(both, tool=alone)
    found = identify(misread(both, TURN), tool=alone)
    assert "sensor-turned" in found.codes() - right.codes()
    assert off(found, right) < 2


def test_two_bursts_tell_no_spread() -> None:
    log = made("stop_go", "low", 0, np.zeros(3))
    first, last = log.time[0], log.time[-1]
    assert sensor_matrix(log.rows((log.time < first + 0.3) | (log.time > last - 0.3))) is None


def test_a_mount_that_is_wrong_is_given_anew(recording: Recording) -> None:
    given = Rotation.exp(np.radians([0.0, 0.0, 3.0]))
    streams = (replace(s, mount=Mount(given)) if "force" in s.channels else s for s in recording.streams)
    found = identify(replace(recording, streams=tuple(streams)))
    (finding,) = (f for f in found.findings if f.code == "sensor-turned")
    vector = [float(v) for v in re.search(r"rotation vector \((.*?)\) rad", finding.message)[1].split(",")]
    np.testing.assert_allclose(vector, 0, atol=np.radians(0.2))


@pytest.mark.parametrize("gains", [(1.03, 1.0, 1.0), (1.0, 1.0, 1.05), (1.0, 0.96, 1.0)])
def test_gains_that_differ_are_told_and_in_the_bars(
    recording: Recording, answer: Estimate, gains: tuple[float, ...]
) -> None:
    found = identify(misread(recording, np.zeros(3), gains))
    assert "gains-differ" in found.codes()
    assert "sensor-turned" not in found.codes()
    assert off(found, answer) < 2.5
    (finding,) = (f for f in found.findings if f.code == "gains-differ")
    said = float(finding.message.split(" read ")[1].split(" %")[0])
    assert said == pytest.approx(100 * (max(gains) - min(gains)), rel=0.15)


def in_base_axes(recording: Recording) -> Recording:
    """Return the recording as UR and Franka write it: one file, forces and torques in W."""
    (both,) = in_one_stream(recording).streams
    R = Rotation(both.channels["rotation"])
    felt = {quantity: R.apply(both.channels[quantity]) for quantity in ("force", "torque")}
    frames = {"position": "W", "force": "W", "torque": "W"}
    return replace(recording, streams=(replace(both, channels={**both.channels, **felt}, frames=frames),))


def test_gains_of_a_wrench_in_base_axes_are_those_of_the_sensor(recording: Recording) -> None:
    right = identify(in_base_axes(recording))
    assert not right.codes() & {"sensor-turned", "gains-differ"}
    unlike = misread(recording, np.zeros(3), (1.0, 1.0, 1.05))
    found, in_sensor = identify(in_base_axes(unlike)), identify(in_one_stream(unlike))
    (finding,) = (f for f in found.findings if f.code == "gains-differ")
    assert float(finding.message.split(" read ")[1].split(" %")[0]) == pytest.approx(5, rel=0.15)
    assert off(found, right) < 2.5
    np.testing.assert_allclose(found.std[:4], in_sensor.std[:4], rtol=0.2)


@pytest.mark.parametrize("seed", range(1, 5))
def test_a_good_sensor_shows_nothing_in_base_axes(seed: int) -> None:
    found = identify(in_base_axes(hammer.recording(seed).recording))
    assert not found.codes() & {"sensor-turned", "gains-differ"}


def about_one_axis(tilt: float, sign: int = 1, seed: int = 0) -> Recording:
    """Return a mass point felt by a sensor that turns about x alone, gravity off by degrees about it, too."""
    time, rng = np.arange(0, 30, 0.01), np.random.default_rng(seed)
    R = Rotation.exp(np.outer(1.2 * np.sin(0.5 * time) + 0.3 * np.sin(1.3 * time), [1.0, 0.0, 0.0]))
    given = np.array([0.0, 0.0, -9.81])
    com = np.array([0.02, 0.01, 0.08])
    moved = np.gradient(np.gradient(R.apply(com), time, axis=0), time, axis=0)
    force = 2.0 * R.inverse().apply(moved - Rotation.exp(np.radians([tilt, 0.0, 0.0])).apply(given))
    torque = np.cross(com, force)
    felt = {"force": sign * (force + 0.05 * rng.normal(size=force.shape)),
            "torque": sign * (torque + 0.0025 * rng.normal(size=force.shape))}  # fmt: skip
    return Recording((Stream("log", {"rotation": R.matrix, **felt}, time),), given)


@pytest.mark.parametrize("tilt", [0.0, 1.0, 3.0, 10.0])
def test_a_flipped_wrench_is_no_turned_sensor_where_turns_are_about_one_axis(tilt: float) -> None:
    """Half a turn about that axis turns forces round as a flip does, and takes a tilt in as well."""
    tilted = {"base-tilted"} if tilt > 2 else set()
    assert {f.code for f in examine(about_one_axis(tilt))[1]} == tilted
    assert {f.code for f in examine(about_one_axis(tilt, -1))[1]} == {"wrench-sign-flipped", *tilted}
    if tilted:
        assert identify(about_one_axis(tilt, -1)).mass == pytest.approx(2.0, abs=0.003)


def test_a_sweep_of_one_joint_tells_no_gain_across_its_plane() -> None:
    """Only noise of the acceleration is there beside mass and bias, and mass would take what that seems to lack."""
    rng, time = np.random.default_rng(0), np.arange(0, 30, 0.01)
    angle, rate = np.sin(0.5 * time), 0.5 * np.cos(0.5 * time)
    down = -9.81 * np.stack([np.full_like(time, 0.02), np.sin(angle), np.cos(angle)], 1)
    turning = np.stack([rate, 0 * rate, 0 * rate], 1)
    rest = MotionLog(np.zeros((len(time), 6)), down, 0 * down, turning, 0 * down, time=time)
    wrench = rest.predicted(BODY.vector) + rng.normal(size=(len(time), 6)) * np.repeat([1e-3, 0.02], 3)
    log = replace(rest, wrench=wrench, acceleration=0.05 * rng.normal(size=down.shape))
    found = sensor_matrix(log)
    assert found is not None
    assert not found.unlike
    assert not found.turned
    assert np.abs(found.stretch).max() < 0.01
