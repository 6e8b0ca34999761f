"""Before the fit: what a recording itself gives away, put right where there is no doubt."""

from __future__ import annotations

from dataclasses import replace

from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.logs.recording import Recording
from steelyard.sanity.readings.clocks import examine_clock, examine_offset
from steelyard.sanity.readings.conventions import examine_conventions, examine_turns
from steelyard.sanity.readings.silent import without_silent
from steelyard.sanity.readings.units import examine_turning, examine_units
from steelyard.sanity.rows.judged import dead_channels, examine_rows
from steelyard.sanity.rows.still_rows import examine_memory, examine_sparse

# A motion is told from its neighbours in time.
FEWEST_ROWS = 12

_UNTOLD = 'torque = "zero" tells nothing of the centre of mass'


def examine(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording as it should be read, and a finding for everything that was not as its description says.

    Rows that are no measurements are left out; units, signs and frames are put right where the numbers leave no
    doubt, so that the answer is right all the same. Each finding says what was assumed.
    """
    recording, clock = examine_clock(recording)
    recording = examine_sparse(recording)
    _require_rows(recording)
    read, recording = recording.findings, replace(recording, findings=())
    recording, rows = examine_rows(without_zero_torque(recording))
    recording = replace(recording, dead=dead_channels(recording))
    recording, units = examine_units(recording)
    recording, offset = examine_offset(recording)
    recording, turns = examine_turns(recording)
    recording, conventions = examine_conventions(examine_memory(recording))
    recording, turning = examine_turning(recording)
    conventions = (*turns, *conventions, *turning)
    # Misread rotations leave a channel unexplained, too.
    recording, silent = (recording, ()) if conventions else without_silent(recording)
    return recording, (*read, *clock, *rows, *units, *offset, *conventions, *silent)


def _require_rows(recording: Recording) -> None:
    """Raise CannotAnswer where a stream is too short to tell how the sensor moved."""
    short = next((s for s in recording.streams if s.time is not None and len(s) < FEWEST_ROWS), None)
    if short is not None:
        raise CannotAnswer(
            f"'{short.name}' has {len(short)} row{'s' * (len(short) != 1)}; a log with a clock needs at least "
            f"{FEWEST_ROWS} to tell how the sensor moved. Record longer, or mark a table of still poses with "
            'kind = "poses" and no time.'
        )


def without_zero_torque(recording: Recording) -> Recording:
    """Return the recording with torques of exactly zero as dead channels, and a note.

    Raises CannotAnswer for tables at rest, whose forces tell the mass alone.
    """
    torques = [values for _, _, values in recording.channels("torque")]
    if not torques or any(values.any() for values in torques):
        return recording
    if all(stream.poses for stream in recording.streams):
        raise CannotAnswer(
            f"{_UNTOLD}, and forces of still poses tell the mass alone. Give the columns of the torque, or a log of "
            "quick moves, in which the force shows it."
        )
    note = f"{_UNTOLD}: it is told by how the force follows the moves"
    return replace(recording, dead=(True, True, True, *recording.dead[3:])).noted(note)
