"""A hose or cable that pulls harder the farther it is drawn out: taken out of what one body feels, and said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.logs.recording import Recording
from steelyard.pipelines.left_over import left_over, of_another_fit
from steelyard.sanity.fitted.tether import Tether
from steelyard.simulate import hammer
from steelyard.simulate.motions import Step, StopAndGo

# Where it is fixed in W and hangs on the load in S [m], how stiff it is [N/m], and how long when it is slack [m].
ANCHORS = {"above": (0.3, 0.2, 1.4), "beside": (0.4, -0.9, 0.2), "below": (-0.2, 0.3, -0.8)}
POINT, SLACK = np.array([0.02, -0.03, 0.05]), 0.3
TURNS = hammer.motion()
MOVES = ((0.25, 0.1, 0.0), (-0.2, 0.15, 0.2), (0.0, -0.4, -0.1), (-0.25, 0.2, -0.2), (0.2, 0.1, 0.25), (0.1, -0.2, 0.0))


@pytest.fixture(autouse=True)
def moving(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the hammer be carried about between its stops."""
    steps = tuple(Step(7.0 * k + 1.0, 4.0, np.array(by)) for k, by in enumerate(MOVES))
    carried: StopAndGo = replace(TURNS, moves=steps)
    monkeypatch.setattr(hammer, "motion", lambda: carried)


def pulled(recording: Recording, anchor: str, stiffness: float, slack: float = SLACK) -> Recording:
    """Return the hammer's recording with a hose that pulls on the load; the raw wrench is that on the sensor."""
    wrench, poses = recording.streams
    at = hammer.motion().at(wrench.time)
    drawn = np.array(ANCHORS[anchor]) - at.position - at.rotation.apply(POINT)
    length = np.linalg.norm(drawn, axis=1, keepdims=True)
    force = at.rotation.inverse().apply(stiffness * np.maximum(length - slack, 0) * drawn / length)
    channels = {
        "force": wrench.channels["force"] + force,
        "torque": wrench.channels["torque"] + np.cross(POINT, force),
    }
    return replace(recording, streams=(replace(wrench, channels=channels), poses))


@cache
def sound_answer(seed: int = 0) -> Estimate:
    return sy.identify(hammer.recording(seed).recording)


@cache
def answer(anchor: str, stiffness: float, seed: int = 0) -> Estimate:
    """Return the answer of a recording with a hose, kept for all tests: of the motion of `moving`."""
    return sy.identify(pulled(hammer.recording(seed).recording, anchor, stiffness))


def misses(estimate: Estimate) -> np.ndarray:
    """Return how many bars mass and centre of mass (4,) are off."""
    truth = hammer.body()
    return np.asarray((estimate.parameters.people - truth.people)[:4] / estimate.std[:4])


@pytest.mark.parametrize("stiffness", [1.5, 6.0])
@pytest.mark.parametrize("anchor", ANCHORS)
def test_a_log_is_answered_without_it(anchor: str, stiffness: float) -> None:
    found = answer(anchor, stiffness)
    assert np.abs(misses(found)).max() < 3
    assert found.std[0] < 0.15 * found.mass
    (said,) = (f for f in found.findings if f.code == "contact")
    assert "as a hose, a cable or a spring does" in said.message
    assert not {"weight-compensated", "bias-drift", "base-tilted", "motion-mismatch"} & found.codes()


@pytest.mark.parametrize("seed", range(3))
def test_a_sound_log_keeps_its_answer(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    found = sound_answer(seed)
    assert "contact" not in found.codes()
    monkeypatch.setattr("steelyard.pipelines.rows.examine_tether", lambda *_: None)
    assert np.array_equal(sy.identify(hammer.recording(seed).recording).covariance, found.covariance)


def test_residuals_of_all_rows_are_without_it() -> None:
    """The report kept its pull in them, and took the answer for that of another log."""
    recording = pulled(hammer.recording(0).recording, "above", 6.0)
    found = answer("above", 6.0)
    _, left = left_over(recording, found)
    assert np.sqrt((left[:, 3:] ** 2).mean()) == pytest.approx(found.evidence.residual_force_N, rel=0.1)
    assert not of_another_fit(found, left)


def test_bars_hold_one_that_noise_hides() -> None:
    """It is left in, and made the mass ten bars too large."""
    recording = pulled(hammer.recording(0).recording, "below", 0.5)
    wrench, poses = recording.streams
    rng, noise = np.random.default_rng(1), {"force": 0.5, "torque": 0.025}
    channels = {name: read + noise[name] * rng.normal(size=read.shape) for name, read in wrench.channels.items()}
    found = sy.identify(replace(recording, streams=(replace(wrench, channels=channels), poses)))
    assert "contact" not in found.codes()
    assert any("pull" in note for note in found.notes)
    assert np.abs(misses(found)).max() < 3
    assert found.std[0] > 0.03 * found.mass


def test_a_slack_one_changes_nothing() -> None:
    slack = sy.identify(pulled(hammer.recording(0).recording, "above", 6.0, slack=3.0))
    assert np.array_equal(slack.covariance, sound_answer().covariance)


@pytest.mark.parametrize(("anchor", "stiffness"), [("above", 1.5), ("beside", 1.5), ("beside", 6.0)])
def test_one_on_a_tool_that_turns_in_place(anchor: str, stiffness: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """Alike in all directions its stiffness looks like a bias; the pull shows by the point where it hangs."""
    monkeypatch.setattr(hammer, "motion", lambda: replace(TURNS, moves=()))
    found = sy.identify(pulled(hammer.recording(0).recording, anchor, stiffness))
    assert np.abs(misses(found)).max() < 3
    (said,) = (f for f in found.findings if f.code == "contact")
    assert "Something hangs on what is held and pulls" in said.message
    assert not {"bias-drift", "base-tilted", "motion-mismatch"} & found.codes()


@pytest.mark.parametrize(
    ("across", "words"), [((3.0, 3.001), "and 3 N/m across"), ((2.0, 3.0), "and 2 to 3 N/m across")]
)
def test_stiffness_that_reads_alike_is_said_once(across: tuple[float, float], words: str) -> None:
    nothing = np.zeros(3)
    hose = Tether(nothing, 0.1, np.diag([*across, 12.0]), nothing, nothing, np.array([0.0, 0.0, 1.0]), np.eye(10))
    assert words in hose.finding.message


def test_one_that_bears_more_than_the_load_weighs_is_refused() -> None:
    unsaid = replace(hammer.recording(0).recording, sign_said=False)
    with pytest.raises(CannotAnswer, match="the sign of the wrench"):
        sy.identify(pulled(unsaid, "above", 40.0))
