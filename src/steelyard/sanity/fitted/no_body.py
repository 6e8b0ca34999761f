"""A wrench that no rigid body explains, and the unit of force or torque with which one does.

Ten free numbers often fit where no body does: forces too small beside the torques show little mass far out, with less
inertia than a point of it there has. The answer is always a body, so that its residuals tell.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, codes
from steelyard.identify.estimate import Estimate
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.recording import ROUNDED_GRAVITY
from steelyard.sanity.readings.torques import UNITS

# Chi-square per degree of freedom above which no body explains a wrench, and what another unit must bring it down to:
# of 150 made logs of sound sensors, on arms that bend and drift, none has more than 1.6.
UNEXPLAINED, SOUND = 2.5, 1.6
# Larger factors explain whatever bends torques, and show by where the centre of mass lies.
LARGEST = 10.0
# Torques are far beyond what a right model leaves above this share of what the weight makes at this arm [m], which few
# centres of mass exceed, and so many times what scatters from row to row, or this [N m] of a table.
MISFIT, ARM, NO_NOISE, QUIET = 0.2, 0.1, 5.0, 0.01
ELSEWHERE = {"weight-compensated", "motion-mismatch", "base-tilted", "force-unit"}
TOLD = {"wrench-unexplained", "noise-level-off", "sensor-turned", "gains-differ"}


def examine_wrench_unit(
    log: MotionLog,
    estimate: Estimate,
    identify: Callable[[MotionLog], Estimate],
    before: tuple[Finding, ...],
    late: tuple[Finding, ...],
) -> tuple[Finding, ...]:
    """Return the findings `late`, with `force-unit` first where another unit makes the wrench that of a body.

    identify  how the estimate was found in the log
    before    findings of before the fit
    """
    chi2 = estimate.evidence.chi2_per_dof
    if chi2 is None or chi2 <= UNEXPLAINED or codes((*before, *late)) & ELSEWHERE:
        return late
    larger = [(1 / factor, words) for factor, words in UNITS if 1 < 1 / factor < LARGEST]
    explain = sorted((times, words) for times, words in larger if _left(identify, log, times) < SOUND)
    if not explain:
        return late
    text = (
        f"{_much(chi2)}: no rigid body explains this wrench. With larger forces one does: "
        f"{'; '.join(f'{times:.3g} times, as when {words}' for times, words in explain)}. The answer does not assume "
        "this: mass or centre of mass is wrong by as much."
    )
    unit = replace(Finding.of("force-unit", text), left_in=True)
    return (unit, *(f for f in late if f.code != "wrench-unexplained"))


def examine_body(
    estimate: Estimate, known: tuple[Finding, ...], gravity: float = ROUNDED_GRAVITY, noise: float = 0.0
) -> tuple[Finding, ...]:
    """Return `wrench-unexplained` where the residuals of the best body are more than noise, and nothing says why.

    gravity  its size [m/s^2]
    noise    of the torque from row to row [N m], zero where the log has no clock
    """
    if codes(known) & (ELSEWHERE | TOLD):
        return ()
    chi2, miss = estimate.evidence.chi2_per_dof, estimate.evidence.residual_torque_Nm
    weight = ARM * estimate.mass * gravity
    # Noise that nobody declared is told by the residuals, and chi-square then says nothing of those.
    if miss > max(MISFIT * weight, NO_NOISE * (noise or QUIET)):
        text = (
            f"The torque misses by {miss:.2g} N m rms where the weight makes {weight:.2g} N m at {ARM:g} m: one rigid "
            "body does not explain these torques, and the error bars do not hold."
        )
    elif chi2 is not None and chi2 > UNEXPLAINED:
        text = (
            f"{_much(chi2)}: one rigid body does not explain this wrench to its noise; the error bars hold only what "
            "leaving parts of the log out shows."
        )
    else:
        return ()
    return (Finding.of("wrench-unexplained", text),)


def _much(chi2: float) -> str:
    return f"The residuals are {np.sqrt(chi2):.2g} times what the channels scatter from row to row"


def _left(identify: Callable[[MotionLog], Estimate], log: MotionLog, times: float) -> float:
    """Return chi-square per degree of freedom with forces so many times larger."""
    larger = np.repeat([1.0, times], 3)
    noise = log.noise and tuple(Noise(n.acceleration, n.wrench * larger**2) for n in log.noise)
    try:
        chi2 = identify(replace(log, wrench=log.wrench * larger, noise=noise)).evidence.chi2_per_dof
    except CannotAnswer:
        chi2 = None
    return np.inf if chi2 is None else chi2
