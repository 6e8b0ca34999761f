"""Residuals of an answer are those of the log as it was put right, with its tool and its drift."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import steelyard as sy
from sound_hammer import hammer_answer, hammer_log
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.left_over import left_over, of_another_fit
from steelyard.pipelines.options import DRIFT_ALLOWED


@pytest.fixture(scope="module")
def made() -> Recording:
    return hammer_log()


def changed(recording: Recording, quantity: str, change: np.ndarray) -> Recording:
    """Return the recording with what is added to one quantity, a row of which is as long as time goes from 0 to 1."""

    def of(stream: Stream) -> Stream:
        if quantity not in stream.channels:
            return stream
        added = np.linspace(0, 1, len(stream))[:, None] * change
        return replace(stream, channels={**stream.channels, quantity: stream.channels[quantity] + added})

    return replace(recording, streams=tuple(map(of, recording.streams)))


def rms(left: np.ndarray) -> tuple[float, float]:
    return float(np.sqrt((left[:, 3:] ** 2).mean())), float(np.sqrt((left[:, :3] ** 2).mean()))


@cache
def drifting_a_little() -> tuple[Recording, sy.Estimate]:
    """Return a log whose force drifts by too little to be named, and its answer."""
    recording = changed(hammer_log(), "force", np.array([0.1, -0.08, 0.05]))
    return recording, sy.identify(recording)


@pytest.mark.parametrize("mistake", ["none", "sign", "gravity", "drift", "small drift", "drift that was asked for"])
def test_residuals_are_those_of_the_answer(made: Recording, mistake: str) -> None:
    recording, options = made, sy.Options()
    if mistake == "sign":
        recording = replace(made, wrench_sign=-made.wrench_sign)
    if mistake == "gravity":
        turn = sy.Rotation.from_rpy([0.05, -0.08, 0])
        recording, options = replace(made, gravity=turn.apply(made.gravity)), sy.Options(gravity="unknown")
    if mistake == "drift":
        recording = changed(made, "force", np.array([2.0, -1.5, 1.0]))
    if mistake == "small drift":
        recording = drifting_a_little()[0]
    if mistake == "drift that was asked for":
        recording, options = drifting_a_little()[0], sy.Options(drift=True)
    answers = {"none": hammer_answer, "small drift": lambda: drifting_a_little()[1]}
    estimate = answers[mistake]() if mistake in answers else sy.identify(recording, options)
    assert any(note.startswith(DRIFT_ALLOWED) for note in estimate.notes) == ("drift" in mistake)
    assert ("bias-drift" in estimate.codes()) == (mistake == "drift")
    _, left = left_over(recording, estimate)
    force, torque = rms(left)
    assert force == pytest.approx(estimate.evidence.residual_force_N, rel=0.05)
    assert torque == pytest.approx(estimate.evidence.residual_torque_Nm, rel=0.05)
    assert not of_another_fit(estimate, left)


def test_times_are_since_the_first_row_of_the_wrench(made: Recording) -> None:
    estimate = hammer_answer()
    late = replace(made, streams=tuple(replace(s, time=s.time + 1050.0) for s in made.streams if s.time is not None))
    first, second = (left_over(recording, estimate)[0].time for recording in (made, late))
    assert first is not None
    assert second is not None
    assert second[0] < 5.0
    assert np.allclose(second, first, atol=1e-6)


def test_a_drift_too_small_to_be_named_does_not_move_the_answer() -> None:
    right, found = hammer_answer(), drifting_a_little()[1]
    assert "bias-drift" not in found.codes()
    assert np.all(np.abs(found.com - right.com) < 1.5 * right.std[1:4])
    assert abs(found.mass - right.mass) < 1.5 * right.std[0]


def test_a_tool_that_was_taken_away_is_asked_for(made: Recording) -> None:
    tool = hammer_answer()
    both = replace(tool, parameters=sy.InertialParameters(0.3 * tool.parameters.vector))
    rest = replace(tool, parameters=sy.InertialParameters(0.7 * tool.parameters.vector))
    assert of_another_fit(rest, left_over(made, rest)[1])
    assert not of_another_fit(rest, left_over(made, rest, both)[1])
