"""Conventions: sign and axes of the wrench, sense of the rotation, order of quaternions, gravity, unit of torque.

The log as given is fitted beside the log under each rival convention (see `glance` and `rivals`). Where a rival is so
much better that it is no matter of noise, the recording is returned as the rival reads it. All forces and torques
scaled alike (lbf for N) fit as well as before, and so do the sign of the wrench and of gravity on a log at rest: no fit
can tell them apart, and the messages say so.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import REMEDIES, Finding
from steelyard.logs.recording import Recording
from steelyard.sanity.readings.glance import Glance, glance
from steelyard.sanity.readings.level import examine_level, examine_order
from steelyard.sanity.readings.levers import far_away
from steelyard.sanity.readings.rivals import (
    GOOD,
    MUCH_BETTER,
    Reading,
    as_read,
    best_rival,
    reading_of,
    rival_findings,
    sign_of,
)
from steelyard.sanity.readings.silent import require_weight
from steelyard.sanity.readings.static_fit import apart_clearly, examine_both_masses, masses_at_a_glance
from steelyard.sanity.readings.tilt import blind_axis, blind_tilt
from steelyard.sanity.readings.torques import examine_swapped, examine_torques
from steelyard.sanity.rows.still_rows import examine_leaps
from steelyard.sanity.words import unexplained

# So many mistakes of one description are put right.
MOST_MISTAKES = 4


def examine_conventions(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording in the conventions that explain it, and a finding for each that was not as said.

    One mistake hides another: once one is put right, all is judged anew. What is only named is that of the log as it is
    read in the end.

    Raises CannotAnswer where the force shows no weight in any.
    """
    found: list[Finding] = []
    named: tuple[Finding, ...] = ()
    for _ in range(MOST_MISTAKES):
        view = glance(recording)
        if view is None:
            break
        read, findings = _judged(recording, view)
        if read is recording:
            named = findings
            break
        recording, found = read, [*found, *findings]
    return recording, (*found, *named)


def _judged(recording: Recording, view: Glance) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with its plainest mistake put right, and what is said of it; else all that is only named."""
    read, findings = examine_swapped(recording, view)
    if findings:
        return read, findings
    reading = reading_of(view, "", recording.gravity, view.rotation)
    best = best_rival(recording, view, reading)
    if best is not None:
        return as_read(recording, best), rival_findings(best, reading)
    named = examine_both_masses(view, recording.gravity, reading.rotation)
    read, findings = examine_order(recording, view, reading)
    if findings:
        return read, (*named, *findings)
    # What a controller leaves of a weight may have either sign.
    left_over = any(finding.code == "weight-compensated" for finding in named)
    read, findings = (recording, ()) if left_over else _signs(recording, view, reading)
    if findings:
        return read, findings
    for step in (far_away if named else _units_of, examine_level):
        read, findings = step(recording, view, reading)
        if read is not recording:
            return read, findings
        named = (*named, *findings)
    blind = None if reading.rotation is None else blind_axis(view, reading.rotation)
    if blind is not None and not named:
        named = blind_tilt(view, recording.gravity, blind)
    if not named:
        require_weight(view, recording.gravity, reading.rotation, reading.fit)
    return recording, named


def _units_of(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with torques that belong to the forces, and what is said of those that do not."""
    read, findings = examine_torques(recording, view, reading)
    return (read, findings) if findings else far_away(recording, view, reading)


def examine_turns(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with pauses where its poses leap, unless they only leap as they were misread.

    Then it comes back with its rotations as they were meant, and a finding.
    """
    paused = examine_leaps(recording)
    view = None if paused is recording else glance(paused)
    if view is None:
        return paused, ()
    given = reading_of(view, "", recording.gravity, view.rotation)
    best = best_rival(paused, view, given)
    if best is None or best.misread is None:
        return paused, ()
    return examine_leaps(as_read(recording, best)), rival_findings(best, given)


def _signs(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the wrench or gravity turned round where the mass comes out negative, or with both."""
    sign = sign_of(view, reading)
    if view.mirrored is not None:
        return _mirrored(recording, view, view.mirrored, reading)
    if sign == 0:
        return recording, ()
    if sign > 0:
        return _both_signs(recording, view, reading)
    mass = f"The mass comes out as {reading.fit.mass:.3g} ± {reading.fit.mass_std:.2g} kg"
    moved = _moved_sign(view, reading)
    upside_down = moved > 0
    if moved == 0 and reading.rotation is not None:
        # Nothing but habit can tell: a world whose z points down is rarer than a wrench of the other sign.
        upside_down = float(recording.gravity[2]) > 0.8 * float(np.linalg.norm(recording.gravity))
    doubt = "" if moved else "; a log at rest cannot tell the sign of the wrench from the sign of gravity"
    if upside_down:
        message = f"{mass}, so gravity points the other way in W; it was turned round{doubt}."
        return replace(recording, gravity=-recording.gravity), (Finding.of("gravity-frame", message),)
    was, now = _sign_words(recording)
    message = f'{mass}, so the wrench has the other sign; it was taken as "{now}" instead of "{was}"{doubt}.'
    return replace(recording, wrench_sign=-recording.wrench_sign), (Finding.of("wrench-sign-flipped", message),)


def _mirrored(
    recording: Recording, view: Glance, pull: Array, reading: Reading
) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with the wrench turned round where an accelerometer cannot sit as its sign asks.

    Turned to the force, an accelerometer gives no mass a sign; but forces of the other sign are its readings mirrored,
    and no turn mirrors more than two directions.
    """
    other = reading_of(replace(view, pull=pull), "", recording.gravity, None).fit
    well = other.sign < 0 and other.torque_share < 1.2 * reading.fit.torque_share + 1e-3
    if not well or reading.fit.force_share < GOOD or other.force_share > MUCH_BETTER * reading.fit.force_share:
        return recording, ()
    was, now = _sign_words(recording)
    message = (
        f'As "{was}" the forces are those of the accelerometer mirrored, which no mounting is; the wrench was taken as '
        f'"{now}": so read, {unexplained(other.force_share, reading.fit.force_share, "the force")}.'
    )
    return replace(recording, wrench_sign=-recording.wrench_sign), (Finding.of("wrench-sign-flipped", message),)


def _sign_words(recording: Recording) -> tuple[str, str]:
    """Return how the wrench was said to be meant, and how it is meant with the other sign."""
    return ("on-object", "on-sensor") if recording.wrench_sign > 0 else ("on-sensor", "on-object")


def _both_signs(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with wrench and gravity turned round where what is accelerated has a negative mass.

    Turned round both, forces at rest stay what they are.
    """
    if _moved_sign(view, reading) >= 0:
        return recording, ()
    message = (
        "The force follows gravity as given, but the acceleration as that of a negative mass: wrench and gravity both "
        "have the other sign; both were turned round."
    )
    remedy = f"Check [log] gravity; {REMEDIES['wrench-sign-flipped'][0].lower()}{REMEDIES['wrench-sign-flipped'][1:]}"
    turned = replace(recording, wrench_sign=-recording.wrench_sign, gravity=-recording.gravity)
    return turned, (Finding("wrench-sign-flipped", message, remedy),)


def _moved_sign(view: Glance, reading: Reading) -> int:
    """Return the sign of the mass that the measured acceleration shows; 0 where none is measured or it is too weak."""
    if view.acceleration is None or reading.rotation is None:
        return 0
    masses, spread, _ = masses_at_a_glance(view, reading.gravity, reading.rotation)
    sure = abs(masses[0]) > 5 * spread[0] and 0.5 * abs(masses[1]) < abs(masses[0]) < 2 * abs(masses[1])
    if sure and masses[0] * masses[1] < 0:
        sure = apart_clearly(view, reading.gravity, reading.rotation)
    return int(np.sign(masses[0])) if sure else 0
