"""Before the fit: what a recording itself gives away, put right where there is no doubt."""

from __future__ import annotations

from steelyard.findings import Finding
from steelyard.logs.recording import Recording
from steelyard.sanity.conventions import examine_conventions
from steelyard.sanity.rows import examine_rows
from steelyard.sanity.units import examine_units


def examine(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording as it should be read, and a finding for everything that was not as its description says.

    Rows that are no measurements are left out; units, signs and frames are put right where the numbers leave no
    doubt, so that the answer is right all the same. Each finding says what was assumed.
    """
    recording, rows = examine_rows(recording)
    recording, units = examine_units(recording)
    recording, conventions = examine_conventions(recording)
    return recording, (*rows, *units, *conventions)
