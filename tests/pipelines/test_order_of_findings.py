"""Causes stand before what follows from them, wherever findings are read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.findings import UNEXPLAINED, Finding, by_cause
from steelyard.logs.recording import POUND_FORCE, Recording
from steelyard.logs.team_track import Track
from steelyard.pipelines.held_object import identify
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate import hammer
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene


def named(*codes: str) -> list[Finding]:
    return [Finding(code, str(k), "") for k, code in enumerate(codes)]


def test_what_was_read_wrongly_comes_before_what_touched_and_both_before_what_the_data_cannot_show() -> None:
    found = by_cause(
        named(
            "inertia-not-identified", "outliers", "contact", "grasp-direction-lost", "force-unit", "grasp-slipped",
            "nearly-planar", "gains-differ", "robot-excluded",
        )
    )  # fmt: skip
    assert [f.code for f in found] == [
        "force-unit", "gains-differ", "robot-excluded", "contact", "grasp-slipped", "outliers",
        "inertia-not-identified", "grasp-direction-lost", "nearly-planar",
    ]  # fmt: skip


@pytest.fixture(scope="module")
def recording() -> Recording:
    return hammer.recording(0).recording


def edited(recording: Recording, **channels: object) -> Recording:
    streams = []
    for stream in recording.streams:
        more = {q: edit(stream.channels[q], stream) for q, edit in channels.items() if q in stream.channels}
        streams.append(replace(stream, channels={**stream.channels, **more}))
    return replace(recording, streams=tuple(streams))


def test_forces_in_pounds_are_the_cause_and_faster_turns_no_remedy(recording: Recording) -> None:
    found = identify(edited(recording, force=lambda force, _: force / POUND_FORCE)).findings
    codes = [f.code for f in found]
    assert codes[0] == "force-unit"
    for finding in found[1:]:
        if finding.code == "inertia-not-identified":
            assert finding.remedy == UNEXPLAINED["inertia-not-identified"]


def test_a_tare_within_the_log_comes_before_what_is_left_open(recording: Recording) -> None:
    def tared(values: np.ndarray, stream: object) -> np.ndarray:
        after = np.arange(len(values)) >= len(values) // 2
        return np.asarray(values - after[:, None] * values[len(values) // 2])

    found = identify(edited(recording, force=tared, torque=tared)).findings
    codes = [f.code for f in found]
    assert "contact" in codes
    assert codes.index("contact") <= min((codes.index(c) for c in codes if c == "inertia-not-identified"), default=99)
    (contact,) = (f for f in found if f.code == "contact")
    assert "that time was left out" in contact.message
    assert "as where the sensor was tared in between" in contact.message
    assert contact.remedy.startswith("If the sensor was tared within the log, cut the log there")


def pushed_wrongly(track: Track, wrong: bool, loses: bool) -> Track:
    """Return the track with its forces turned, or without those of one row in a hundred."""
    lost = loses & (np.arange(len(track)) % 100 == 7)
    force = -track.channels["force"] if wrong else track.channels["force"]
    valid = {**track.valid, "force": track.valid["force"] & ~lost}
    return replace(track, channels={**track.channels, "force": force}, valid=valid)


def test_what_a_team_read_wrongly_comes_before_rows_that_it_lost_and_those_before_what_is_left_open() -> None:
    log = simulate_team(TeamScene(CASES["B"], kinds=("still", "motion"), motion_samples=300), 3).log
    made = [
        {n: pushed_wrongly(t, n == "robot1", n != "robot1" and r.kind == "motion") for n, t in r.tracks.items()}
        for r in log.recordings
    ]
    recordings = [replace(r, tracks=tracks) for r, tracks in zip(log.recordings, made, strict=True)]
    codes = [f.code for f in identify_team(log.with_recordings(*recordings)).findings]
    assert codes[:3] == ["wrench-sign-flipped", "rows-missing", "rows-missing"]
    assert set(codes[3:]) <= {"inertia-not-identified", "grasp-direction-lost"}
