"""A gap in the clock is no tap, and a log of a few rows is told what it lacks."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import Swing, recording

from steelyard.errors import CannotAnswer
from steelyard.logs.alignment import align
from steelyard.logs.outliers import bursts
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity import examine


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

    def cut(s: Stream) -> Stream:
        lost = (s.time > 4) & (s.time < 5) | (gaps > 1) & (s.time > 8) & (s.time < 8.5)
        return replace(s, time=s.time[~lost], channels={name: v[~lost] for name, v in s.channels.items()})

    streams = (cut(s) if s.name == stream else s for s in whole.streams)
    (note,) = [note for note in align(replace(whole, streams=tuple(streams))).notes if "no rows" in note]
    assert note.startswith(f"'{stream}' has no rows for 1{' s at' if gaps == 1 else '.5 s in 2 gaps, the first at'} ")
