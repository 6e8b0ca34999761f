"""Rests put one after the other, and parts of logs that are joined: no derivative is taken across."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import BODY, recorded, rows

from steelyard.identify.estimate import Estimate
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines import held_object
from steelyard.sanity.rows.still_rows import examine_leaps, examine_sparse
from steelyard.simulate.handling import motion_arrays
from steelyard.spatial import Rotation


def missed(found: Estimate) -> np.ndarray:
    """Return by how many bars mass and centre of mass are off (4,)."""
    return np.abs(np.append(found.mass - float(BODY.mass), found.com - BODY.com) / found.std[:4])


def at_rest(variant: str) -> np.ndarray:
    arrays = motion_arrays(variant)
    speeds = [np.linalg.norm(arrays[f"{kind}_velocity_sensor"], axis=1) for kind in ("angular", "linear")]
    return np.maximum(*speeds) < 1e-3


def test_poses_without_the_ways_between_are_a_table() -> None:
    inside = []
    for seed in range(40):
        found = held_object.identify(recorded("static", seed))
        assert found.codes() == {"inertia-not-identified"}
        assert any(note.startswith("the log is 6 rests with leaps") for note in found.notes)
        inside.append(missed(found) < 1.96)
    assert np.mean(inside) > 0.9


@pytest.mark.parametrize("restamped", [False, True])
@pytest.mark.parametrize("variant", ["paper", "slow"])
def test_rests_cut_out_of_a_motion_are_a_table(variant: str, restamped: bool) -> None:
    found = held_object.identify(rows(recorded(variant, 3), at_rest(variant), restamped))
    assert found.evidence.samples == found.evidence.still_samples < 20
    assert missed(found).max() < 4
    assert not found.codes() & {"stream-delayed", "contact", "outliers"}


def test_streams_with_clocks_of_their_own_are_read_together() -> None:
    (log,) = recorded("static", 0).streams
    assert log.time is not None
    poses = Stream("poses", {"rotation": log.channels["rotation"][::5]}, log.time[::5])
    felt = Stream("felt", {q: log.channels[q] for q in ("force", "torque")}, log.time + 0.05)
    read = examine_leaps(Recording((felt, poses), np.array([0, 0, -9.81])))
    assert [s.poses for s in read.streams] == [True, True]
    assert len(read.streams[0]) == len(read.streams[1]) == 12
    assert missed(held_object.identify(read)).max() < 4


def test_a_leap_between_motions_becomes_a_pause() -> None:
    whole = recorded("paper", 3)
    keep = np.ones(len(whole.streams[0]), np.bool_)
    keep[330:480] = False
    found = held_object.identify(rows(whole, keep, restamped=True))
    assert any(note.startswith("the poses leap at 3.3 s") for note in found.notes)
    assert found.identified.all()
    assert missed(found).max() < 3
    assert found.codes() == set()


@pytest.mark.parametrize("variant", ["paper", "slow"])
def test_logs_without_leaps_stay(variant: str) -> None:
    log = recorded(variant, 0)
    assert examine_leaps(log) is log


def test_a_row_that_is_wrong_is_no_leap() -> None:
    log = recorded("paper", 0)
    turned = log.streams[0].channels["rotation"].copy()
    turned[200] = turned[200] @ np.diag([1.0, -1.0, -1.0])
    stream = replace(log.streams[0], channels={**log.streams[0].channels, "rotation": turned})
    spoilt = replace(log, streams=(stream,))
    assert examine_leaps(spoilt) is spoilt


@pytest.mark.parametrize("count", [8, 24])
def test_a_row_a_stop_is_a_table_whatever_its_stamps(count: int) -> None:
    rng = np.random.default_rng(5)
    turns = Rotation.exp(1.2 * rng.normal(size=(count, 3)))
    pull = turns.inverse().apply(np.array([0, 0, -9.81]))
    force = -float(BODY.mass) * pull
    channels = {
        "rotation": turns.matrix,
        "force": force + 0.05 * rng.normal(size=(count, 3)),
        "torque": np.cross(BODY.com, force) + 0.0025 * rng.normal(size=(count, 3)),
    }
    log = Recording((Stream("stops", channels, 4.0 * np.arange(count)),), np.array([0, 0, -9.81]))
    found = held_object.identify(log)
    assert "rows are 4 s apart, too far to tell a motion: each was read as a still pose" in found.notes
    assert missed(found).max() < 4


def test_stamps_in_another_unit_are_not_sparse() -> None:
    log = recorded("slow", 0)
    slow = replace(log, streams=tuple(replace(s, time=1000 * s.time) for s in log.streams if s.time is not None))
    assert examine_sparse(slow) is slow
