"""Single poses that are wrong are named and left out; quick motion and poses that stay are none."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import BODY, recorded

from steelyard.logs.recording import Recording
from steelyard.pipelines import held_object
from steelyard.sanity.rows.stray_poses import without_strays
from steelyard.spatial import Rotation


def turned_away(recording: Recording, first: list[int], rows: int) -> Recording:
    """Return the log with poses turned by 20 degrees for so many rows, from each of the `first` on."""
    (stream,) = recording.streams
    at = np.array(first)[:, None] + np.arange(rows)
    rotation = stream.channels["rotation"].copy()
    rotation[at] = rotation[at] @ Rotation.exp(np.radians([0.0, 20, 0])).matrix
    return replace(recording, streams=(replace(stream, channels={**stream.channels, "rotation": rotation}),))


@pytest.mark.parametrize("rows", [1, 2, 3])
@pytest.mark.parametrize("count", [1, 8])
def test_poses_that_are_away_are_named_and_left_out(count: int, rows: int) -> None:
    sound = recorded("paper", 0)
    found = held_object.identify(turned_away(sound, [60 + 100 * k for k in range(count)], rows))
    (finding,) = (f for f in found.findings if f.code == "outliers")
    assert f"in {count * rows} of {len(sound.streams[0])} rows, first at 0.60 s" in finding.message
    assert found.std[0] < 1.2 * held_object.identify(sound).std[0]
    assert abs(found.mass - float(BODY.mass)) < 3 * found.std[0]


@pytest.mark.parametrize("variant", ["paper", "slow"])
def test_a_sound_log_has_none(variant: str) -> None:
    (stream,) = recorded(variant, 0).streams
    assert without_strays(stream) == (stream, ())


def test_a_position_that_is_away() -> None:
    (stream,) = recorded("slow", 0).streams
    place = stream.channels["position"].copy()
    place[400:402] += [0.01, 0, 0]
    rest, findings = without_strays(replace(stream, channels={**stream.channels, "position": place}))
    assert len(rest) == len(stream) - 2
    assert [f.code for f in findings] == ["outliers"]


def test_poses_that_stay_or_are_many_are_kept() -> None:
    log = recorded("paper", 0)
    for first, rows in (([200], 6), (list(range(10, 900, 12)), 2)):
        (stream,) = turned_away(log, first, rows).streams
        assert without_strays(stream) == (stream, ())


def test_poses_that_were_reached_one_by_one_are_kept() -> None:
    """A single far attitude among near ones, recorded a second after the one before, is no stray."""
    (stream,) = recorded("slow", 0).streams
    tilts = 0.02 * np.random.default_rng(1).normal(size=(len(stream), 3))
    tilts[300] = [0.0, 0.8, 0.0]
    turned = {**stream.channels, "rotation": Rotation.exp(tilts).matrix}
    quick = replace(stream, channels=turned)
    assert without_strays(quick)[1] != ()
    slow = replace(quick, time=np.arange(len(stream), dtype=float))
    assert without_strays(slow) == (slow, ())
