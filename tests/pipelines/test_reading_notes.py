"""What reading a log had to assume stands among the notes of the answer; remedies suit how it was recorded."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

import steelyard as sy
from steelyard.findings import AT_REST
from steelyard.io import read_pendant
from steelyard.simulate import hammer


def test_notes_of_the_recording_are_notes_of_the_answer() -> None:
    made = replace(hammer.recording().recording, notes=("something was assumed",))
    assert "something was assumed" in sy.identify(made).notes


def test_a_table_of_still_poses_is_not_told_to_turn_faster() -> None:
    turns = ["0 0 0", "90 0 0", "180 0 0", "-90 0 0", "0 90 0", "0 -90 0"]
    lines = []
    for turn in turns:
        roll, pitch, yaw = np.radians(np.array(turn.split(), float))
        down = sy.Rotation.from_rpy([roll, pitch, yaw]).inverse().apply([0.0, 0.0, -9.81])
        values = [*(-down), *np.cross([0.01, 0.02, 0.05], -down)]
        lines.append(f"{turn} {' '.join(f'{value:.6f}' for value in values)}")
    remedies = {finding.code: finding.remedy for finding in sy.identify(read_pendant(lines)).findings}
    assert remedies["inertia-not-identified"] == AT_REST["inertia-not-identified"]
