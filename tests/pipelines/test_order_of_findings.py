"""Causes stand before what follows from them, wherever findings are read."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.findings import UNEXPLAINED, Finding, by_cause
from steelyard.logs.recording import POUND_FORCE, Recording
from steelyard.pipelines.held_object import identify
from steelyard.simulate import hammer


def named(*codes: str) -> list[Finding]:
    return [Finding(code, str(k), "") for k, code in enumerate(codes)]


def test_what_was_read_wrongly_comes_before_what_touched_and_both_before_what_the_data_cannot_show() -> None:
    found = by_cause(
        named("inertia-not-identified", "outliers", "contact", "force-unit", "nearly-planar", "gains-differ")
    )
    assert [f.code for f in found] == [
        "force-unit", "gains-differ", "contact", "outliers", "inertia-not-identified", "nearly-planar",
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
