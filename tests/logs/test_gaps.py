"""A gap in the clock is no tap, and a log of a few rows is told what it lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BODY, Swing, recording

from steelyard.errors import CannotAnswer
from steelyard.logs.alignment import align
from steelyard.logs.holes import unknown_motion
from steelyard.logs.outliers import bursts
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine


def test_a_gap_is_no_tap() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0, 20, 0.002)
    force = 10 * np.stack([np.sin(0.7 * time + k) for k in range(3)], 1) + 0.05 * rng.normal(size=(len(time), 3))
    kept = (time < 6) | (time > 9)
    assert len(bursts(time[kept], force[kept])) == 0
    force[2000:2010] += 40
    assert len(bursts(time[kept], force[kept])) == 1


@pytest.mark.parametrize("rows", [1, 5, 11])
def test_a_few_rows_cannot_answer(rows: int) -> None:
    channels = {"force": np.ones((rows, 3)), "torque": np.ones((rows, 3)), "rotation": np.tile(np.eye(3), (rows, 1, 1))}
    recording = Recording((Stream("log.csv", channels, np.arange(rows, dtype=np.float64)),), np.array([0, 0, -9.81]))
    with pytest.raises(CannotAnswer, match=rf"'log.csv' has {rows} rows?; a log with a clock needs at least 12"):
        examine(recording)
    table = replace(recording.streams[0], time=None, poses=True)
    examine(replace(recording, streams=(table,)))


@pytest.mark.parametrize(("stream", "gaps"), [("wrench.csv", 1), ("pose.csv", 2)])
def test_rows_that_are_missing_for_a_while_are_noted(stream: str, gaps: int) -> None:
    whole = recording(Swing(0), imu=False, position=True, quiet=True)
    assert not [note for note in align(whole).notes if "no rows" in note]
    lost = ((4.0, 5.0), (8.0, 8.5))[:gaps]
    (note,) = [note for note in align(cut(whole, stream, *lost)).notes if "no rows" in note]
    assert note.startswith(f"'{stream}' has no rows for 1{' s at' if gaps == 1 else '.5 s in 2 gaps, the first at'} ")


def cut(whole: Recording, name: str, *lost: tuple[float, float]) -> Recording:
    """Return the recording without the rows of one stream within these times [s]."""

    def less(s: Stream) -> Stream:
        kept = ~np.any([(s.time > a) & (s.time < b) for a, b in lost], axis=0)
        return replace(s, time=s.time[kept], channels={quantity: v[kept] for quantity, v in s.channels.items()})

    return replace(whole, streams=tuple(less(s) if s.name == name else s for s in whole.streams))


@pytest.mark.parametrize("delay", [0.0, 0.03])
def test_nothing_is_fitted_where_no_pose_tells_the_motion(delay: float) -> None:
    whole = recording(Swing(0, 30.0), imu=False, position=True, pose_delay=delay)
    holed = cut(whole, "pose.csv", (10.0, 13.0), (20.0, 20.2))
    time = align(holed).log.time
    assert not ((time > 10.02 - delay) & (time < 12.98 - delay)).any()
    assert ((time > 20.05) & (time < 20.15)).any()
    found = identify(holed)
    assert not found.codes() & {"contact", "load-changed"}
    assert abs(found.mass - BODY.mass) < 4 * found.std[0]


def test_a_driver_that_writes_what_changes_leaves_no_hole() -> None:
    swing = Swing(0, 20.0)
    time = np.arange(0, 20, 0.01)
    at = np.where(time > 12, np.maximum(time - 4, 8), np.minimum(time, 8))
    kept = (time < 8) | (time > 12)
    channels = {"rotation": swing.at(at)[0][kept], "position": swing.at(at)[3][kept]}
    assert unknown_motion(Stream("pose.csv", channels, time[kept])).shape == (0, 2)
    moved = {"rotation": swing.at(time)[0][kept], "position": swing.at(time)[3][kept]}
    assert np.allclose(unknown_motion(Stream("pose.csv", moved, time[kept])), [[7.99, 12.01]])
    assert len(unknown_motion(Stream("imu.csv", {"specific_force": moved["position"]}, time[kept]))) == 1
