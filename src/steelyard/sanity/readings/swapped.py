"""Forces and torques in each other's columns: what is called torque then follows gravity as only a force does."""

from __future__ import annotations

from dataclasses import replace

from steelyard.findings import Finding, percent
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import Glance, glance
from steelyard.sanity.readings.rivals import MUCH_BETTER, Reading, best_rival, outdone, reading_of
from steelyard.sanity.readings.static_fit import fit

# As given, the force leaves more than the first share of its variance; exchanged, less than the second, and the torque
# less than the third.
UNEXPLAINED, WELL, TORQUES_TOO = 0.5, 0.05, 0.3
_OTHER = {"force": "torque", "torque": "force"}


def examine_swapped(recording: Recording, view: Glance) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with forces and torques exchanged where that explains both, and a finding."""
    if any(recording.dead) or view.mirrored is not None:
        return recording, ()
    given = fit(view.seen(recording.gravity, view.rotation), view.block)
    if given.force_share < UNEXPLAINED:
        return recording, ()
    other = replace(recording, streams=tuple(map(_exchanged, recording.streams)))
    seen = glance(other)
    if seen is None:
        return recording, ()
    found = fit(seen.seen(recording.gravity, seen.rotation), seen.block)
    if found.sign == 0 or found.force_share > WELL or found.torque_share > TORQUES_TOO:
        return recording, ()
    if _explained(recording, view, Reading("", recording.gravity, seen.rotation, found, view=seen)):
        return recording, ()
    text = (
        f"Forces and torques are in each other's columns: exchanged, {percent(found.force_share)} of the force "
        f"variance is left unexplained instead of {percent(given.force_share)}. The answer assumes this."
    )
    remedy = "Exchange the columns of force and torque in the description."
    return other, (Finding("force-unit", text, remedy),)


def _explained(recording: Recording, view: Glance, exchanged: Reading) -> bool:
    """Tell whether the columns as they stand explain much more, with a turned sensor or rotations read otherwise.

    In turns about few axes a force in other axes leaves torques that follow gravity, too.
    """
    rival = best_rival(recording, view, reading_of(view, "", recording.gravity, view.rotation))
    better = rival is not None and rival.fit.force_share < MUCH_BETTER * exchanged.fit.force_share
    return better or outdone(exchanged, view, recording.gravity)


def _exchanged(stream: Stream) -> Stream:
    """Return the stream with what is called force called torque, and the other way round."""
    if not _OTHER.keys() <= stream.channels.keys():
        return stream
    channels = {_OTHER.get(quantity, quantity): values for quantity, values in stream.channels.items()}
    frames = {_OTHER.get(quantity, quantity): frame for quantity, frame in stream.frames.items()}
    return replace(stream, channels=channels, frames=frames)
