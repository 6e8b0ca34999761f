"""Is there a material as dense, or as light, as log and shape together say?

A shape of the wrong scale, a gripper in the mass or a wrong unit of force leave a fit that may be good and a density
that nothing has. Hollow things that count as solid are light, so that only what no foam is as light as is named.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.evidence import PartMass
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.sanity.fitted.no_body import DENSEST

# Half of what the lightest foams weigh [kg/m^3]: an inflated ball that counts as solid has more.
LIGHTEST = 5.0
# Lighter than plastics and most woods [kg/m^3]: what a scan takes for solid is probably hollow, and then has up to half
# as much again of each second moment about its centre (a shell, for one that is three quarters empty).
LIGHT, HOLLOW = 600.0, 0.35
# Standard deviations by which mass and volume together must miss what materials have.
SURE = 3.0
# No shape gives its volume better than this, as a share of it.
LEAST_STD = 0.025
# What most things are between, hollow ones included [kg/m^3]: a scale that leads there is worth a word.
USUAL = (300.0, 12_000.0)
# How many times larger the shape would be, and the mistake that made it small or large.
_SCALES = (
    (10.0, "centimetres taken for millimetres"),
    (25.4, "inches taken for millimetres"),
    (1000.0, "metres taken for millimetres"),
    (0.1, "millimetres taken for centimetres"),
    (0.01, "centimetres taken for metres"),
    (0.0254, "inches taken for metres"),
    (0.001, "millimetres taken for metres"),
)
_REMEDY = (
    "Check the scale of the shape, which must be in metres, the units of force and torque, and that the mass is "
    "the object's alone: take a gripper away with --tool."
)


def maybe_hollow(error: ShapeError, mass: float, volume: float) -> tuple[ShapeError, str] | None:
    """Return how wrong the scan of this volume [m^3] may be about inertia, being light, and why; None where it is not.

    A mesh that is given is taken to be solid: its user knows.
    """
    density = mass / volume
    if not 0 < error.stretch < HOLLOW or not LIGHTEST < density < LIGHT:
        return None
    return error.at_least(0.0, HOLLOW), (
        f"{density:.3g} kg/m^3 is light for a solid: foam, wood, or hollow, which no scan shows and which makes "
        f"moments of inertia larger; the shape is trusted to {100 * HOLLOW:.0f} % in them"
    )


def impossible_density(
    estimate: Estimate, volume: float, volume_std: float, parts: Sequence[PartMass] = ()
) -> tuple[Finding, ...]:
    """Return `materials-impossible` where the whole, or else some of its parts, have a density that no material has.

    volume      of the whole shape [m^3]
    volume_std  standard deviation of every volume, as a share of it
    parts       those whose masses are the object's alone
    """
    share = max(volume_std, LEAST_STD)
    whole = _missed(estimate.mass, float(estimate.std[0]), volume, share)
    if whole:
        text = f"The whole, {_said(estimate.mass, float(estimate.std[0]), volume, share)}: {whole}."
        return (Finding("materials-impossible", text + _scale(estimate.mass / volume), _REMEDY),)
    # A part without mass is named as such.
    told = "part-zero-mass" in estimate.codes()
    found = [(part, _missed(part.mass, part.std, part.volume, share)) for part in parts]
    named = [(part, miss) for part, miss in found if miss and not (told and part.density < LIGHTEST)]
    if not named:
        return ()
    text = " ".join(
        f"Part {part.label}, {_said(part.mass, part.std, part.volume, share)}: {miss}." for part, miss in named
    )
    return (Finding("materials-impossible", text, _REMEDY),)


def _missed(mass: float, std: float, volume: float, share: float) -> str:
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
    factors: Array = np.array([factor for factor, _ in _SCALES])
    found = density / factors**3
    fits = [k for k in range(len(_SCALES)) if USUAL[0] <= found[k] <= USUAL[1]]
    if not fits:
        return ""
    said = " or ".join(f"{found[k]:.3g} with a shape {_SCALES[k][0]:g} times as large ({_SCALES[k][1]})" for k in fits)
    return f" It would be {said}."
