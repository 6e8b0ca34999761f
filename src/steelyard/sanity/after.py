"""After the fit: what the residuals and the evidence give away."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, codes
from steelyard.identify.estimate import Estimate
from steelyard.inertia.people import NAMES
from steelyard.logs.alignment import Aligned
from steelyard.logs.clock import median_step
from steelyard.logs.conditioning import noise_std
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.sanity.coverage import coverage
from steelyard.sanity.fitted.biases import Drift
from steelyard.sanity.fitted.gravity import fitted_gravity
from steelyard.sanity.fitted.no_body import implausible
from steelyard.sanity.fitted.sensor_matrix import sensor_matrix

# chi^2 per degree of freedom above this, and declared noise off by this factor, are far from right.
CHI2, NOISE_RATIO = 2.5, 2.5
# A tilt counts beyond 2 degrees and four standard deviations, where it takes 30 % of the squared residual away.
TILT, SURE, TILT_SHARE = np.radians(2.0), 4.0, 0.7
# It is none where a turned sensor, or unlike gains, leave less than this share of what it leaves.
CLEARER = 0.5
# The prior dominates where it brings a standard deviation below half of what the data alone give.
PRIOR_SHARE = 0.5
# Rows come 2.5 times as often as the low-pass has Hz, which leaves this share of white noise up to half their rate.
PASSED = 0.8


def of_answer(log: MotionLog, estimate: Estimate, recording: Recording) -> tuple[Finding, ...]:
    """Return findings about the answer that rows `log` gave: declared noise off, mostly the prior, no body's."""
    size = implausible(estimate, float(np.linalg.norm(recording.gravity)), row_noise(log, recording, "force"))
    return (*_noise_level(estimate, recording), *_prior(estimate), *size)


def of_rows(log: MotionLog, aligned: Aligned, gravity: Array, drift: Drift | None) -> tuple[Finding, ...]:
    """Return findings about the rows `log` that are fitted, which `aligned` gave, whatever they weigh.

    Too few directions, nearly planar, base tilted, bias drift.

    gravity  (3,) [m/s^2] in W as it was used
    drift    that of the bias in the rows
    """
    seen = tuple(f for f in coverage(log.gravity) if f.code not in codes(aligned.findings))
    tilted = _base_tilted(log, aligned, gravity)
    return (*seen, *tilted, *(() if tilted or drift is None else drift.findings))


def _base_tilted(log: MotionLog, aligned: Aligned, gravity: Array) -> tuple[Finding, ...]:
    """Return `base-tilted` where another direction of gravity in W explains the wrench clearly better."""
    rotation = rotation_of(log, aligned)
    found = None if rotation is None else fitted_gravity(log, rotation, gravity, aligned.acceleration_from)
    if found is None or found.angle <= max(TILT, SURE * found.angle_std) or found.left >= TILT_SHARE:
        return ()
    sensor = sensor_matrix(log)
    if sensor is not None and sensor.left < CLEARER * found.left:
        return ()
    message = (
        f"Gravity fits {found.words} off the direction given, with {100 * (1 - found.left):.0f} % less squared "
        "residual; the answer uses the direction given."
    )
    return (Finding.of("base-tilted", message),)


def rotation_of(log: MotionLog, aligned: Aligned) -> Array | None:
    """Return rotations (N, 3, 3) S to W at the rows of a log that may hold fewer rows than `aligned` gave."""
    return None if aligned.rotation is None else _at_rows(log, aligned, aligned.rotation.matrix)


def position_of(log: MotionLog, aligned: Aligned) -> Array | None:
    """Return positions (N, 3) [m] of S in W at the rows of a log that may hold fewer rows than `aligned` gave."""
    return None if aligned.position is None else _at_rows(log, aligned, aligned.position)


def _at_rows(log: MotionLog, aligned: Aligned, values: Array) -> Array | None:
    if len(log) == len(values):
        return values
    if log.time is None or aligned.log.time is None:
        return None
    index = np.searchsorted(aligned.log.time, log.time)
    return np.asarray(values[np.minimum(index, len(values) - 1)])


def _noise_level(estimate: Estimate, recording: Recording) -> tuple[Finding, ...]:
    """Return `noise-level-off` where declared noise is far above or below what the log shows.

    A low-pass lowers the residuals, and with them chi^2, below the noise of the raw samples; too large a declaration is
    therefore told by the raw channel and the residuals, too small a one by chi^2 or the raw channel.
    """
    chi2 = estimate.evidence.chi2_per_dof
    out = []
    residuals = {"force": estimate.evidence.residual_force_N, "torque": estimate.evidence.residual_torque_Nm}
    for quantity, unit in (("force", "N"), ("torque", "N m")):
        declared = recording.noise.get(quantity)
        if declared is None:
            continue
        raw = max((_white(v) for s, _, v in recording.channels(quantity) if s.time is not None), default=0.0)
        most = float(np.hypot(raw, residuals[quantity]))
        if declared > NOISE_RATIO * most or declared * NOISE_RATIO < raw:
            shown = most if declared > most else raw
            out.append(f"{declared:g} {unit} of {quantity} noise are declared, the log shows {shown:.2g} {unit}")
    if not out and chi2 is not None and recording.noise and chi2 > CHI2:
        out.append(f"the residuals are {np.sqrt(chi2):.2g} times what the declared noise explains")
    if not out:
        return ()
    message = "; ".join(out)
    known = "" if chi2 is None else f" (chi^2 per degree of freedom {chi2:.2g})"
    return (Finding.of("noise-level-off", f"{message[0].upper()}{message[1:]}{known}."),)


def row_noise(log: MotionLog, recording: Recording, part: str) -> float:
    """Return the white noise of "force" [N] or "torque" [N m] per axis in the rows of the log; zero for tables."""
    if log.time is None or len(log) < 2:
        return 0.0
    step = median_step(log.time)
    timed = ((s.time, v) for s, _, v in recording.channels(part) if s.time is not None)
    return max((_white(v) * float(np.sqrt(min(1.0, PASSED * (median_step(t) / step)))) for t, v in timed), default=0.0)


def _white(values: Array) -> float:
    """Return the white noise of a timed channel per axis."""
    return float(np.sqrt((noise_std(values) ** 2).mean()))


def _prior(estimate: Estimate) -> tuple[Finding, ...]:
    """Return `prior-dominated` where an inertia that is given out owes its precision to the prior.

    Mass and centre of mass are refused, and an inertia that is not identified is withheld, before a prior could lead.
    An answer that stands on parts has their shape, which is given and not assumed.
    """
    spread = estimate.evidence.spread
    if spread is None or estimate.parts or not estimate.identified.all():
        return ()
    alone = spread / 2
    led = np.isfinite(alone) & (estimate.std < PRIOR_SHARE * alone)
    led[:4] = False
    if not led.any():
        return ()
    worst = int(np.argmax(np.where(led, alone / np.maximum(estimate.std, 1e-300), 0)))
    message = (
        f"The prior decides {', '.join(n for n, own in zip(NAMES, led, strict=True) if own)}: for {NAMES[worst]} the "
        f"data alone have {alone[worst] / max(float(estimate.std[worst]), 1e-300):.1f} times the std shown."
    )
    return (Finding.of("prior-dominated", message),)
