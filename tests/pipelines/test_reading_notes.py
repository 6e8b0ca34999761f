"""What reading a log had to assume stands among the notes of the answer; remedies suit how it was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import steelyard as sy
from steelyard.findings import AT_REST, BARE
from steelyard.io import read_pendant
from steelyard.simulate import hammer


def test_notes_of_the_recording_are_notes_of_the_answer() -> None:
    made = replace(hammer.recording().recording, notes=("something was assumed",))
    assert "something was assumed" in sy.identify(made).notes


def typed(sign: float) -> list[str]:
    """Return lines of the pendant, the wrench on the object or (-1) on the sensor."""
    lines = []
    for turn in ("0 0 0", "90 0 0", "180 0 0", "-90 0 0", "0 90 0", "0 -90 0"):
        down = sy.Rotation.from_rpy(np.radians(np.array(turn.split(), float))).inverse().apply([0.0, 0.0, -9.81])
        values = [*(-sign * down), *np.cross([0.01, 0.02, 0.05], -sign * down)]
        lines.append(f"{turn} {' '.join(f'{value:.6f}' for value in values)}")
    return lines


def test_who_types_has_no_description_to_correct() -> None:
    (flipped,) = (f for f in sy.identify(read_pendant(typed(1.0))).findings if f.code == "wrench-sign-flipped")
    assert flipped.remedy == BARE["wrench-sign-flipped"]
    assert "wrench-sign-flipped" not in sy.identify(read_pendant(typed(-1.0))).codes()


def test_a_table_of_still_poses_is_not_told_to_turn_faster() -> None:
    remedies = {finding.code: finding.remedy for finding in sy.identify(read_pendant(typed(1.0))).findings}
    assert remedies["inertia-not-identified"] == AT_REST["inertia-not-identified"]
