"""What an answer says of what was noticed on the way: causes before what follows from them, and what helps here."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import AT_REST, BARE, REMEDIES, UNEXPLAINED, UNMEASURED, Finding, other_than
from steelyard.identify.estimate import Estimate
from steelyard.identify.problem import ADD_POSES
from steelyard.logs.recording import Recording
from steelyard.parts.parts import Parts
from steelyard.pipelines.load import WITH_BIAS, Load
from steelyard.pipelines.rows import FitRows
from steelyard.sanity.coverage import coverage
from steelyard.sanity.fitted.load_motion import least_shown

if TYPE_CHECKING:
    from steelyard.pipelines.shape_in_parts import Shape

# Said of a refusal where the poses would do.
FOLLOWS_NOT = (
    "Gravity takes enough directions of the sensor for that, as the log was read, but the forces do not turn with it. "
    "Check form, order, unit and sense of the rotation, the frame and the mount of the wrench, stuck channels, and "
    "whether the clocks are of one run; or nothing is held, a controller takes the weight away, or "
    "it is lost in noise."
)
# Findings after which motion or wrench are no body's.
MISREAD = {"wrench-unexplained", "motion-mismatch", "weight-compensated"}
# Findings of what a load and a bias share: a tared sensor has no bias.
OF_BIAS = {"nearly-planar"}
# Bars so small, of the mass as a share of it and of the centre of mass [m], do not suffer from that.
SMALL_BARS = (0.002, 1e-4)
# A gain of the forces that no calibration rules out, and the share of it below which a bar of the mass says too much.
GAIN, TIGHT = 0.01, 0.5
# A weight that a controller takes away is worth a word where the log would not show this share of the mass that is
# answered; beyond so many times that mass it shows none.
UNSEEN, MOST_SET = 0.1, 5.0
# Units that are named after the fit, and so were not put right before it.
OF_UNITS = {"force-unit", "length-in-mm"}


@dataclass(frozen=True)
class Noticed:
    """Findings by when they were made: before the fit, of the rows after it, and of the sensor beside the answer."""

    before: tuple[Finding, ...]
    late: tuple[Finding, ...]
    of_sensor: tuple[Finding, ...]


def noticed_before(found: tuple[Finding, ...], recording: Recording, rows: FitRows) -> tuple[Finding, ...]:
    """Return what was found before the fit, in words for who has no description, and what the rows to fit show."""
    found = found if recording.described else tuple(finding.instead(BARE) for finding in found)
    return (*found, *rows.units, *(cause.finding for cause in rows.causes))


def sign_found(found: tuple[Finding, ...], recording: Recording) -> tuple[tuple[Finding, ...], tuple[str, ...]]:
    """Return what was found without the sign of a wrench that nothing said, and a note on that: it is no mistake.

    Where gravity was turned round with it, the finding has a remedy of its own and stays.
    """
    code = "wrench-sign-flipped"
    rest = tuple(f for f in found if f.code != code or f.remedy != REMEDIES[code])
    if recording.sign_said or len(rest) == len(found):
        return found, ()
    sign = "on-object" if recording.wrench_sign > 0 else "on-sensor"
    return rest, (
        f'the file does not say the sign of the wrench: it was found to be "{sign}", z of the world taken as up '
        f"(wrench in [log] of a description)",
    )


@contextmanager
def beside(findings: tuple[Finding, ...], gravity: Array) -> Iterator[None]:
    """Say with a refusal what was noticed before: it is the likely cause.

    gravity  (N, 3) [m/s^2] in S at the rows: where it takes enough directions, more of them would not help
    """
    try:
        yield
    except CannotAnswer as error:
        lost, more, rest = str(error).partition(ADD_POSES)
        if more and not rest.endswith(WITH_BIAS) and not coverage(gravity):
            error = CannotAnswer(f"{lost}{FOLLOWS_NOT}")
        if not findings:
            raise error from None
        said = " ".join(f"{f.message} {f.remedy}" for f in findings)
        if any(f.left_in for f in findings):
            # More poses would be as wrong: what was noticed says what to do.
            raise CannotAnswer(f"Noticed before the fit: {said} As the log was read: {lost.rstrip()}") from None
        raise CannotAnswer(f"{error} Noticed before the fit: {said}") from None


def told(estimate: Estimate, noticed: Noticed, rows: FitRows, load: Load, parts: Parts | Shape | None) -> Estimate:
    """Return the estimate with all findings: what is wrong with the log stands before what follows from it."""
    before, late, of_sensor = noticed.before, noticed.late, noticed.of_sensor
    if any(finding.code == "sensor-turned" for finding in of_sensor):
        before = other_than(before, "sensor-turned")  # the fit tells it better
    if not (parts is None or isinstance(parts, Parts)):
        chosen = load.shape is not None  # by the forces of the log, which leave nothing to do about the number of parts
        before = (*before, *(other_than(parts.findings, "parts-unsure") if chosen else parts.findings))
        estimate = estimate.noted(*parts.notes, *(_in_doubt(parts.findings) if chosen else ()))
    # In a wrong unit that was left in, rows only seem touched.
    touched = () if any(f.code in OF_UNITS for f in late) else rows.touched
    found = (*before, *late, *of_sensor, *estimate.findings, *rows.aligned.findings, *touched)
    if not (load.bias.free and _suffers(estimate)):
        found = other_than(found, *OF_BIAS)
    return replace(estimate, findings=()).with_findings(*found)


def _in_doubt(findings: tuple[Finding, ...]) -> list[str]:
    """Return the note on a number of parts that shape and colour left open."""
    return [f"{f.message[:1].lower()}{f.message[1:]}".rstrip(".") for f in findings if f.code == "parts-unsure"]


def _suffers(estimate: Estimate) -> bool:
    """Tell whether bars of mass or centre of mass are so wide that what a load and a bias share may be why."""
    share, far = SMALL_BARS
    return bool(estimate.std[0] > share * estimate.mass or (estimate.std[1:4] > far).any())


def uncalibrated(estimate: Estimate) -> tuple[str, ...]:
    """Return a note on gains, which no log shows, where the bar of the mass is far below what a usual one would do."""
    if float(estimate.std[0]) > TIGHT * GAIN * estimate.mass:
        return ()
    moved = GAIN * estimate.mass
    return (
        f"error bars hold no gain of the sensor: forces {100 * GAIN:.0f} % too large would move the mass by "
        f"{moved:.2g} kg, and no log shows it; weigh a known mass once",
    )


def of_a_controller(estimate: Estimate, rows: FitRows, recording: Recording) -> tuple[str, ...]:
    """Return a note on a payload that is set in a controller, as forces in the axes of the base are mostly from one.

    Motion shows what weight is taken away: nothing is said where it would show much less than is answered.
    """
    stream = recording.stream_of("force")
    if stream is None or not stream.in_world("force") or "weight-compensated" in estimate.codes():
        return ()
    least = np.inf if rows.unmeasured else least_shown(rows.log)
    if least < UNSEEN * estimate.mass:
        return ()
    when = "whatever its mass" if least > MOST_SET * estimate.mass else f"below some {float(f'{least:.1g}'):g} kg"
    return (
        "forces in the axes of the base are mostly a controller's, which takes away the weight of the payload that is "
        f"set in it: {when} this log would not show it, and the answer would be what is left; set none before the run",
    )


def remedied(estimate: Estimate, rows: FitRows) -> Estimate:
    """Return the estimate with remedies that help where motion or wrench are no body's, unmeasured, or all at rest."""
    if "weight-compensated" in estimate.codes():
        estimate = estimate.without_inertia("What a controller leaves of a weight has no inertia of its own.")
    if any(f.left_in for f in estimate.findings) or estimate.codes() & (
        MISREAD if rows.place is None else MISREAD - {"motion-mismatch"}
    ):
        return estimate.with_remedies(UNEXPLAINED)
    if rows.unmeasured and not estimate.parts:
        estimate = estimate.without_inertia(
            "No stream measures the acceleration: what turns about another point than S is accelerated, which looks "
            "like inertia."
        )
    if rows.unmeasured or rows.log.still.all():
        return estimate.with_remedies(UNMEASURED if rows.unmeasured else AT_REST)
    return estimate
