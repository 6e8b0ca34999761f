"""A wrench that no rigid body explains, or none that a robot holds, and the unit in which one does.

Ten free numbers often fit where no body does: forces too small beside the torques show little mass far out, with less
inertia than a point of it there has. The answer is always a body, so that its residuals tell.

A shape of the wrong scale, a gripper in the mass or a wrong unit of force leave a fit that may be good and a density
that nothing has. Hollow things that count as solid are light, so that only what no foam is as light as is named.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.evidence import PartMass
from steelyard.findings import Finding, other_than
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.shape_error import HOLLOW, ShapeError
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.recording import INCH, ROUNDED_GRAVITY
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.readings.levers import UNITS

# Chi-square per degree of freedom above which no body explains a wrench, and what another unit must bring it down to:
# of 150 made logs of sound sensors, on arms that bend and drift, none has more than 1.6.
UNEXPLAINED, SOUND = 2.5, 1.6
# Larger factors explain whatever bends torques, and show by where the centre of mass lies.
LARGEST = 10.0
# A residual is far beyond what a right model leaves above this share of what the weight makes, and so many times what
# scatters from row to row: noise of a table nobody knows, but no reading at rest scatters by more than is said here.
# Torques beside those that the weight makes at this arm [m], which few centres of mass exceed.
MISFIT, NO_NOISE, ARM = 0.2, 5.0, 0.1
_PARTS = {"force": (1.0, 0.1, "N", ""), "torque": (ARM, 0.01, "N m", f" at {ARM:g} m")}
# No arm holds more [kg]; nothing is denser [kg/m^3] than osmium.
HEAVIEST, DENSEST = 500.0, 22600.0

# Half of what the lightest foams weigh [kg/m^3]: an inflated ball that counts as solid has more.
LIGHTEST = 5.0
# Lighter than plastics and most woods [kg/m^3]: what a scan takes for solid is probably hollow.
LIGHT = 600.0
# A part is as light as that where it would be with so many more standard deviations of its mass.
CLEARLY = 2.0
# Standard deviations by which mass and volume together must miss what materials have.
SURE = 3.0
# No shape gives its volume better than this, as a share of it.
LEAST_STD = 0.025
# What most things are between, hollow ones included [kg/m^3]: a scale that leads there is worth a word.
USUAL = (300.0, 12_000.0)
# How many times larger the shape would be, and the mistake that made it small or large.
_SCALES = (
    (10.0, "centimetres taken for millimetres"),
    (1e3 * INCH, "inches taken for millimetres"),
    (1000.0, "metres taken for millimetres"),
    (0.1, "millimetres taken for centimetres"),
    (0.01, "centimetres taken for metres"),
    (INCH, "inches taken for metres"),
    (0.001, "millimetres taken for metres"),
)
_LIGHT_SOLID = (
    "is light for a solid: foam, wood, or hollow, which no scan shows and which makes moments of inertia larger"
)
_TRUSTED = f"is trusted to {100 * HOLLOW:.0f} %"
_REMEDY = (
    "Check the scale of the shape, which must be in metres, the units of force and torque, and that the mass is "
    "the object's alone: take a gripper away with --tool."
)


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
    if chi2 is None or chi2 <= UNEXPLAINED or stands_aside("unit", (*before, *late)):
        return late
    larger = [(1 / u.ratio, u.words) for u in UNITS if 1 < 1 / u.ratio < LARGEST]
    explain = sorted((times, words) for times, words in larger if _left(identify, log, times) < SOUND)
    if not explain:
        return late
    text = (
        f"{_much(chi2)}: no rigid body explains this wrench. With larger forces one does: "
        f"{'; '.join(f'{times:.3g} times, as when {words}' for times, words in explain)}. The answer does not assume "
        "this: mass or centre of mass is wrong by as much."
    )
    unit = replace(Finding.of("force-unit", text), left_in=True)
    return (unit, *other_than(late, "wrench-unexplained"))


def examine_body(
    estimate: Estimate, known: tuple[Finding, ...], gravity: float = ROUNDED_GRAVITY, noise: float = 0.0
) -> tuple[Finding, ...]:
    """Return `wrench-unexplained` where the residuals of the best body are more than noise, and nothing says why.

    gravity  its size [m/s^2]
    noise    of the torque from row to row [N m], zero where the log has no clock
    """
    if stands_aside("body", known):
        return ()
    chi2 = estimate.evidence.chi2_per_dof
    # Noise that nobody declared is told by the residuals, and chi-square then says nothing of those.
    if missed := _missed(estimate, "torque", gravity, noise):
        return missed
    if chi2 is None or chi2 <= UNEXPLAINED:
        return ()
    text = (
        f"{_much(chi2)}: one rigid body does not explain this wrench to its noise; the error bars hold only what "
        "leaving parts of the log out shows."
    )
    return (Finding.of("wrench-unexplained", text),)


def implausible(estimate: Estimate, gravity: float, noise: float = 0.0) -> tuple[Finding, ...]:
    """Return `force-unit`, `length-in-mm` or `wrench-unexplained` where mass, size or forces are those of no held body.

    gravity, noise  as for `examine_body`, the noise that of the force [N]
    """
    mass = estimate.mass
    if mass > HEAVIEST:
        return (Finding.of("force-unit", f"The mass comes out at {mass:.4g} kg, more than an arm holds."),)
    if missed := _missed(estimate, "force", gravity, noise):
        return missed
    if not estimate.identified[4:].all():
        return ()
    # The second moment of a ball of the densest metal is the least that a body of this mass can have.
    ball = (3 * mass / (4 * np.pi * DENSEST)) ** (1 / 3)
    least = 3 * mass * ball**2 / 5
    half_trace = float(np.trace(estimate.parameters.inertia_com)) / 2
    if half_trace + 3 * float(estimate.std[4:].max()) > least:
        return ()
    text = (
        f"The body is denser than any metal: {mass:.3g} kg within {1e3 * np.sqrt(max(half_trace, 0) / mass):.2g} mm. "
        "The torques are too small for the forces, as those in N m are that were declared as N*mm, or forces in N that "
        "were declared as kgf."
    )
    return (Finding.of("length-in-mm", text),)


def _missed(estimate: Estimate, part: str, gravity: float, noise: float) -> tuple[Finding, ...]:
    """Return `wrench-unexplained` where force or torque miss by more than noise and what a right model leaves."""
    arm, quiet, unit, at = _PARTS[part]
    seen, made = estimate.evidence, arm * estimate.mass * gravity
    miss = seen.residual_force_N if part == "force" else seen.residual_torque_Nm
    if miss <= max(MISFIT * made, NO_NOISE * (noise or quiet)):
        return ()
    text = (
        f"The {part} misses by {miss:.2g} {unit} rms where the weight makes {made:.2g} {unit}{at}: one rigid body does "
        "not explain this wrench, and the error bars do not hold."
    )
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


def maybe_hollow(
    error: ShapeError, estimate: Estimate, volume: float, per_mass: Array | None
) -> tuple[ShapeError, str] | None:
    """Return how wrong a scan may be about inertia, being light or light in parts, and why; None where it is not.

    volume    of the whole [m^3]
    per_mass  (10, P) parameters in S of 1 kg of each of the estimate's parts; None where they are not told apart

    A mesh that is given is taken to be solid: its user knows.
    """
    if not 0 < error.stretch < HOLLOW or error.hollow:
        return None
    density = estimate.mass / volume
    if LIGHTEST < density < LIGHT:
        return error.at_least(0.0, HOLLOW), f"{density:.3g} kg/m^3 {_LIGHT_SOLID}; the shape {_TRUSTED} in them"
    light = [k for k, part in enumerate(estimate.parts) if _clearly_light(part)]
    if per_mass is None or not light:
        return None
    parts = [estimate.parts[k] for k in light]
    hollow = tuple(InertialParameters(part.mass * per_mass[:, k]) for k, part in zip(light, parts, strict=True))
    named = " and ".join(f"part {part.label} with {part.density:.3g} kg/m^3" for part in parts)
    return replace(error, hollow=hollow), f"{named} {_LIGHT_SOLID}; the shape of such a part {_TRUSTED} in its own"


def _clearly_light(part: PartMass) -> bool:
    """Say whether a part is lighter than solids are, and the log says so."""
    return part.density > LIGHTEST and (part.mass + CLEARLY * part.std) / part.volume < LIGHT


def impossible_density(
    estimate: Estimate, volume: float, volume_std: float, parts: Sequence[PartMass] = ()
) -> tuple[Finding, ...]:
    """Return `materials-impossible` where the whole, or else some of its parts, have a density that no material has.

    volume      of the whole shape [m^3]
    volume_std  standard deviation of every volume, as a share of it
    parts       those whose masses are the object's alone
    """
    share = max(volume_std, LEAST_STD)
    whole = _no_material(estimate.mass, float(estimate.std[0]), volume, share)
    if whole:
        text = f"The whole, {_said(estimate.mass, float(estimate.std[0]), volume, share)}: {whole}."
        return (Finding("materials-impossible", text + _scale(estimate.mass / volume), _REMEDY),)
    # A part without mass is named as such.
    told = "part-zero-mass" in estimate.codes()
    found = [(part, _no_material(part.mass, part.std, part.volume, share)) for part in parts]
    named = [(part, miss) for part, miss in found if miss and not (told and part.density < LIGHTEST)]
    if not named:
        return ()
    text = " ".join(
        f"Part {part.label}, {_said(part.mass, part.std, part.volume, share)}: {miss}." for part, miss in named
    )
    return (Finding("materials-impossible", text, _REMEDY),)


def _no_material(mass: float, std: float, volume: float, share: float) -> str:
    """Return in words how a density misses what materials have, "" where its bar does not say so."""
    if (mass - SURE * std) / volume > (1 + SURE * share) * DENSEST:
        return f"no material is as dense (osmium, the densest: {DENSEST:.0f})"
    if (mass + SURE * std) / volume < max(1 - SURE * share, 0.0) * LIGHTEST:
        return f"not even foam or a hollow body is as light (below {LIGHTEST:g})"
    return ""


def _said(mass: float, std: float, volume: float, share: float) -> str:
    density = mass / volume
    bar = float(np.hypot(std / volume, share * density))
    return f"{mass:.3g} kg in {1e6 * volume:.3g} cm^3, has a density of {density:.3g} ± {bar:.1g} kg/m^3"


def _scale(density: float) -> str:
    """Return what scale of the shape would leave a usual density."""
    found = ((density / factor**3, factor, mistake) for factor, mistake in _SCALES)
    usual = [each for each in found if USUAL[0] <= each[0] <= USUAL[1]]
    said = " or ".join(f"{would:.3g} with a shape {factor:g} times as large ({why})" for would, factor, why in usual)
    return f" It would be {said}." if usual else ""
