"""Wrench and poses of two files whose clocks count from different moments."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import recorded, swaying
from sanity.traps import edited
from steelyard.identify.estimate import Estimate
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.readings.clocks import examine_offset
from steelyard.spatial import Rotation


def apart(recording: Recording, late: float, poses: Recording | None = None, name: str = "poses.csv") -> Recording:
    """Return the recording with its motion in a file of its own, whose stamps are `late` [s]."""
    (felt,), (moved,) = recording.streams, (poses or recording).streams
    assert felt.time is not None
    assert moved.time is not None
    wrench = {part: felt.channels[part] for part in ("force", "torque")}
    motion = {part: moved.channels[part] for part in ("rotation", "position")}
    streams = (Stream("wrench.csv", wrench, felt.time), Stream(name, motion, moved.time + late))
    return replace(recording, streams=streams)


@pytest.fixture(scope="module")
def right() -> Estimate:
    return identify(apart(recorded("paper", 0), 0.0))


@pytest.mark.parametrize("late", [-987654.321, -3.2, 0.9, 5.0, 1.7e9])
def test_clocks_are_brought_together(late: float, right: Estimate) -> None:
    found = identify(apart(recorded("paper", 0), late))
    assert found.findings[0].code == "stream-delayed"
    assert f"{'late' if late > 0 else 'early'} by {abs(late):.1f} s" in found.findings[0].message
    assert found.codes() == right.codes() | {"stream-delayed"}
    assert found.delays_s["poses.csv"] == pytest.approx(late, abs=0.01)
    np.testing.assert_allclose(found.parameters.vector[:4], right.parameters.vector[:4], rtol=2e-3, atol=1e-4)


def test_a_mount_that_is_given_turns_the_wrench(right: Estimate) -> None:
    recording, turn = recorded("paper", 0), Rotation.exp([0.0, 0.0, 0.6])
    own = turn.inverse().apply
    felt, posed = apart(edited(recording, force=own, torque=own), 1.7e9).streams
    found = identify(replace(recording, streams=(replace(felt, mount=Mount(turn)), posed)))
    assert found.delays_s["poses.csv"] == pytest.approx(1.7e9, abs=0.01)
    np.testing.assert_allclose(found.parameters.vector[:4], right.parameters.vector[:4], rtol=2e-3, atol=1e-4)


@pytest.mark.parametrize("late", [0.0, 0.1])
@pytest.mark.parametrize("name", ["poses.csv", "wrench.csv#2"])
def test_clocks_that_agree_are_left_alone(late: float, name: str) -> None:
    given = apart(recorded("paper", 0), late, name=name)
    assert examine_offset(given) == (given, ())


def test_streams_of_one_file_and_given_delays_are_left_alone() -> None:
    one_file = apart(recorded("paper", 0), 5.0, name="wrench.csv#2")
    assert examine_offset(one_file) == (one_file, ())
    felt, posed = apart(recorded("paper", 0), 5.0).streams
    given = replace(one_file, streams=(felt, replace(posed, delay=5.0)))
    assert examine_offset(given) == (given, ())


def test_poses_of_another_run_and_misread_ones_fit_at_no_time() -> None:
    other = apart(recorded("paper", 0), 0.0, swaying(1))
    assert examine_offset(other)[1] == ()
    inverse = edited(apart(recorded("paper", 0), 0.0), rotation=lambda R: np.swapaxes(R, 1, 2))
    assert examine_offset(inverse)[1] == ()
    turned = edited(apart(recorded("paper", 0), 0.0), rotation=lambda R: R @ Rotation.exp([0.0, 0.0, 0.8]).matrix)
    assert examine_offset(turned)[1] == ()
