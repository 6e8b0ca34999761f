"""What reading a log had to assume stands among the notes of the answer."""

from dataclasses import replace

import steelyard as sy
from steelyard.simulate import hammer


def test_notes_of_the_recording_are_notes_of_the_answer() -> None:
    made = replace(hammer.recording().recording, notes=("something was assumed",))
    assert "something was assumed" in sy.identify(made).notes
