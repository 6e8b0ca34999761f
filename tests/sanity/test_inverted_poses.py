"""Poses of the world in the sensor given as poses of the sensor in the world: rotations and positions are put right."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import steelyard as sy
from sound_hammer import hammer_answer, hammer_log
from steelyard.logs.recording import Recording


def inverted(recording: Recording, positions: bool) -> Recording:
    """The recording with rotations as their inverse, and positions as those of the inverse poses if asked."""
    streams = []
    for stream in recording.streams:
        if "rotation" in stream.channels:
            R, p = stream.channels["rotation"], stream.channels["position"]
            back = np.swapaxes(R, 1, 2)
            place = -np.einsum("nij,nj->ni", back, p) if positions else p
            stream = replace(stream, channels={**stream.channels, "rotation": back, "position": place})
        streams.append(stream)
    return replace(recording, streams=tuple(streams))


@pytest.fixture(scope="module")
def made() -> Recording:
    return hammer_log()


@pytest.fixture(scope="module")
def right() -> sy.Estimate:
    return hammer_answer()


@pytest.mark.parametrize("positions", [True, False])
def test_inverse_poses_answer_as_right_ones(positions: bool, made: Recording, right: sy.Estimate) -> None:
    found = sy.identify(inverted(made, positions))
    np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-6, atol=1e-9)
    (said,) = [f for f in found.findings if f.code == "gravity-frame"]
    assert ("rotations and positions" in said.message) == positions
    assert ("inverse of each pose" in said.remedy) == positions
    assert "contact" not in found.codes()
