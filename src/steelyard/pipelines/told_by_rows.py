"""What rows alone tell of a recording, after all that was examined before: it is put right, and read anew."""

from __future__ import annotations

from dataclasses import replace

from steelyard.findings import Finding, codes, other_than
from steelyard.logs.recording import Recording
from steelyard.pipelines.options import Options
from steelyard.pipelines.rows import UNLIKE_ONE_BODY, FitRows, Reading
from steelyard.sanity.readings.torques import OPPOSED, turned_round

# Findings before the fit for which the pull of a hose or a cable passes.
LIKE_A_PULL = ("base-tilted", *UNLIKE_ONE_BODY)


def rows_as_given(
    given: Recording, recording: Recording, before: tuple[Finding, ...], options: Options
) -> tuple[Recording, tuple[Finding, ...], FitRows]:
    """Return recording, findings before the fit, and rows; with what rows alone tell put right.

    Torques may have the other sign; a bias may have passed for a tilt, and then gravity is as given. Where a hose or a
    cable pulls, what it passed for is not said.

    given  the recording before it was examined
    """
    if options.gravity == "unknown":
        # The fit tells how well it knows the direction, whatever a tilt seen before says of that.
        recording = replace(recording, gravity_std=given.gravity_std)
    recording, rows = Reading(recording, before, options).without_play()
    if OPPOSED in rows.units:
        recording, before = turned_round(recording), (*before, OPPOSED)
        recording, rows = Reading(recording, before, options).without_play()
    tilted = "base-tilted" in codes(before)
    if not tilted and (rows.tether is None or not codes(before) & set(LIKE_A_PULL)):
        return recording, before, rows
    level = replace(recording, gravity=given.gravity, gravity_std=given.gravity_std) if tilted else recording
    others = other_than(before, *(("base-tilted",) if rows.tether is None else LIKE_A_PULL))
    again = Reading(level, others, options).rows_to_fit()
    found = again.tether is not None or (tilted and again.room is not None)
    return (level, others, again) if found else (recording, before, rows)
