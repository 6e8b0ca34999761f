"""Forces in the axes of W point down however the rotations are read: only the torques show how they are meant."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import recorded, swaying
from sanity.traps import edited, reread
from steelyard.identify.estimate import Estimate
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine
from steelyard.spatial import Rotation

MISREADINGS: dict[str, Callable[[Rotation], Rotation]] = {
    "turns W into S": lambda R: R.inverse(),
    "order w, x, y, z, not x, y, z, w": lambda R: Rotation.from_quaternion_wxyz(np.roll(R.quaternion_wxyz(), 1, -1)),
    "moving axes": lambda R: Rotation.from_rpy(-R.inverse().rpy()),
    "a rotation vector, not roll": lambda R: Rotation.from_rpy(R.log()),
}


def in_base(recording: Recording, *parts: str) -> Recording:
    """Return the recording with `parts` of its wrench in the axes of W, where all of it is said to be."""
    (stream,) = recording.streams
    R = stream.channels["rotation"]
    turned = {part: np.einsum("nij,nj->ni", R, stream.channels[part]) for part in parts}
    said = replace(stream, channels={**stream.channels, **turned}, frames={"force": "W", "torque": "W"})
    return replace(recording, streams=(said,))


@pytest.fixture(scope="module", params=[0, 1])
def made(request: pytest.FixtureRequest) -> Recording:
    return in_base(recorded("paper", request.param), "force", "torque")


@pytest.fixture(scope="module")
def right(made: Recording) -> Estimate:
    return identify(made)


@pytest.mark.parametrize("words", MISREADINGS)
def test_misread_rotations_are_put_right(made: Recording, right: Estimate, words: str) -> None:
    found = identify(reread(made, MISREADINGS[words]))
    assert found.codes() == right.codes() | {found.findings[0].code}
    assert words in found.findings[0].message
    assert "of the torque variance" in found.findings[0].message
    np.testing.assert_allclose(found.parameters.vector[:4], right.parameters.vector[:4], rtol=1e-5, atol=1e-6)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("whole", [False, True])
def test_turned_round_in_slow_motion_beside_much_noise(seed: int, whole: bool) -> None:
    """Rotations alone or whole poses: the torques fit as well, since no acceleration shows beside the noise."""
    made = in_base(swaying(seed, noise=15.0), "force", "torque")
    right = made.streams[0].channels["rotation"]
    back = np.swapaxes(right, 1, 2)
    wrong = edited(made, rotation=lambda _: back)
    if whole:
        wrong = edited(wrong, position=lambda p: -np.einsum("nij,nj->ni", back, p))
    read, (found,) = examine(wrong)
    assert found.code == "gravity-frame"
    assert found.message.endswith("The answer assumes this.")
    np.testing.assert_allclose(read.streams[0].channels["rotation"], right, atol=1e-9)


@pytest.mark.parametrize("amplitude", [0.3, 0.8])
@pytest.mark.parametrize("seed", range(3))
def test_a_load_that_stands_upright_tells_transposed_rotations_from_torques_in_s(seed: int, amplitude: float) -> None:
    """Said to be in S, and read row by row: to first order torques in S fit, too, of a load on the other side."""
    made = in_base(swaying(seed, amplitude, 10.0, down=1), "force", "torque")
    (right,) = made.streams
    channels = {**right.channels, "rotation": np.swapaxes(right.channels["rotation"], 1, 2)}
    del channels["position"]
    read, findings = examine(replace(made, streams=(replace(right, channels=channels, frames={}),)))
    assert [f.code for f in findings] == ["gravity-frame"] * 2
    assert read.streams[0].frames == {"force": "W", "torque": "W"}
    np.testing.assert_allclose(read.streams[0].channels["rotation"], right.channels["rotation"], atol=1e-9)


def test_rotations_as_given_are_silent(made: Recording) -> None:
    assert examine(made)[1] == ()
    assert examine(edited(made, force=lambda f: f + np.array([2.0, -1.0, 3.0])))[1] == ()


def test_torques_that_are_in_s_are_no_misread_rotations() -> None:
    (found,) = examine(in_base(recorded("paper", 0), "force"))[1]
    assert "The torques are in the axes of S" in found.message


def test_torques_that_would_fit_badly_in_s_are_only_named() -> None:
    recording = recorded("paper", 0)
    size = float(recording.streams[0].channels["torque"].std())
    wave = 0.17 * size * np.sin(np.linspace(0, 20, len(recording.streams[0])))[:, None]
    given = in_base(edited(recording, torque=lambda t: t + wave), "force")
    read, (found, *_) = examine(given)
    assert found.code == "wrench-unexplained"
    assert "where the torques are in the axes of S: so read" in found.message
    assert found.message.endswith("The answer does not assume this.")
    assert read.streams[0].frames == given.streams[0].frames


def kuka(R: Rotation) -> Rotation:
    """Return rotations whose yaw, pitch, roll are read as roll, pitch, yaw."""
    return Rotation.from_rpy(R.rpy()[:, ::-1])


def test_angles_in_the_order_of_kuka_are_put_right(made: Recording) -> None:
    """Seen from other axes of the sensor, since a pitch of a quarter turn leaves roll and yaw open."""
    askew = reread(made, lambda R: R @ Rotation.from_rpy([0.2, 0.3, 0.4]))
    read, (found,) = examine(reread(askew, kuka))
    assert found.code == "gravity-frame"
    assert "as KUKA's A, B, C" in found.message
    put, right = (log.streams[0].channels["rotation"] for log in (read, askew))
    np.testing.assert_allclose(put, right, atol=1e-9)


def test_readings_that_fit_alike_are_all_named_and_none_is_assumed(made: Recording) -> None:
    """Noise of a quarter of the torque hides which of two readings is the right one."""
    rng = np.random.default_rng(0)
    noisy = edited(made, torque=lambda t: t + 0.25 * t.std() * rng.normal(size=t.shape))
    wrong = reread(noisy, kuka)
    read, (found,) = examine(wrong)
    assert found.code == "wrench-unexplained"
    assert "as KUKA's A, B, C" in found.message
    assert "; or where " in found.message
    np.testing.assert_array_equal(read.streams[0].channels["rotation"], wrong.streams[0].channels["rotation"])
