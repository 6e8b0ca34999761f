"""Rotation vectors near half a turn, as of a hand that points down, leap where they are read as roll, pitch, yaw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import recorded
from sanity.traps import edited, reread
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify
from steelyard.spatial import Rotation


def hanging(turn: float) -> Recording:
    """Return a recording whose world is turned so that the hand points down in it on average."""
    recording = recorded("paper", 0)
    mean = Rotation.nearest(recording.streams[0].channels["rotation"].mean(0))
    down = Rotation.exp(np.pi * np.array([np.cos(turn), np.sin(turn), 0.0]))
    world = down @ mean.inverse()
    turned = edited(recording, rotation=lambda R: world.matrix @ R, position=lambda p: p @ world.matrix.T)
    return replace(turned, gravity=world.apply(recording.gravity))


@pytest.mark.parametrize("turn", [0.0, 0.5, 1.2])
def test_the_answer_is_that_of_the_vectors(turn: float) -> None:
    recording = hanging(turn)
    wrong = reread(recording, lambda R: Rotation.from_rpy(R.log()))
    found, right = identify(wrong), identify(recording)
    assert found.codes() == right.codes() | {"gravity-frame"}
    assert "rotation vector" in found.findings[0].message
    np.testing.assert_allclose(found.parameters.vector[:4], right.parameters.vector[:4], rtol=1e-5, atol=1e-6)
    assert not any("leap" in note for note in found.notes)
