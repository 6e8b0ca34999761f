"""Light parts that may be of metal for all the log shows, and bars of the inertia that reach there.

Priors take parts that the log does not tell apart to be alike. A chuck on a driver of plastic is not, and nothing in
the log need show it: the fit is good, and the bar that of a driver of plastic all over. So each light part is asked:
were it of steel, and might the densities of all others give way, would the log object?
Source: own.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.bars.effective import Effective
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses import density_priors
from steelyard.inertia import forms
from steelyard.inertia.people import NAMES, half_trace_com
from steelyard.parts.parts import Parts

# What small dense parts are of, near enough [kg/m^3]; parts with more than half of that are dense as they are.
STEEL = 7850.0
# How far the log density of steel may be off, and those of the other parts from what was found.
SURE, GIVE = 0.03, 0.5
# An objection of three standard deviations: of the log, and of densities that would have to give way, together.
OBJECTION = 9.0
# An inertia is led by the prior where it would move by more standard deviations, and by more of half its trace. Bars
# are made to reach there with as many.
BARS, SHARE = 2.0, 0.05
# Masses [kg] below this are none.
LEAST = 1e-7
REMEDY = (
    "Name what parts may be made of with --materials, or turn the object faster and about more axes, so that the log "
    "shows what each weighs."
)


def reaching_denser(estimate: Estimate, parts: Parts, data: Effective) -> Estimate:
    """Return the estimate with `prior-dominated` and bars that hold it, where a light part may as well be of steel.

    data  what the log says of the body, blurred by the errors of shape and place

    Named only where the log does not object and the inertia would feel it.
    """
    mass = np.array([part.mass for part in estimate.parts])
    steps, said = [], []
    for k in np.flatnonzero(mass < 0.5 * STEEL * parts.volume).tolist():
        other = _of_steel(k, mass, parts, data)
        if other is not None and (words := _felt(k, mass, other, parts, estimate.std[4:])):
            steps.append((other - mass) / BARS)
            said.append(words)
    if not said:
        return estimate
    text = f"{' '.join(said)} Bars were widened to hold that, at {BARS:g} standard deviations."
    finding = Finding("prior-dominated", text, REMEDY)
    return _widened(estimate, parts, np.stack(steps, 1)).with_findings(finding)


def _widened(estimate: Estimate, parts: Parts, steps: Array) -> Estimate:
    """Return the estimate with independent errors of the masses, `steps` (P, K) of one standard deviation each."""
    spread = steps @ steps.T
    own = np.diag([part.std**2 for part in estimate.parts])
    masses = spread + (own if estimate.part_covariance is None else estimate.part_covariance)
    stds = np.sqrt(np.diag(masses))
    return replace(
        estimate,
        covariance=estimate.covariance + parts.per_mass @ spread @ parts.per_mass.T,
        part_covariance=masses,
        parts=tuple(replace(part, std=float(std)) for part, std in zip(estimate.parts, stds, strict=True)),
    )


def _of_steel(k: int, mass: Array, parts: Parts, data: Effective) -> Array | None:
    """Return the masses (P,) that the log would have with part k of steel; None where it objects."""
    B, volume = parts.per_mass, parts.volume
    A, b = B.T @ data.information @ B, B.T @ data.pull
    spread, centre = np.full(len(mass), GIVE), np.log(np.maximum(mass, LEAST) / volume)
    spread[k], centre[k] = SURE, np.log(STEEL)
    y, cost, _ = density_priors.mode(A, b, volume, np.arange(len(mass)), np.diag(spread**-2), centre, centre)
    found = float(mass @ (0.5 * A @ mass - b))
    return np.asarray(volume * np.exp(y)) if 2 * (cost - found) < OBJECTION else None


def _felt(k: int, mass: Array, other: Array, parts: Parts, std: Array) -> str:
    """Return in words how far the inertia would be from that of the masses `mass` (P,); "" where its bars hold that.

    std  (6,) of the inertia about the centre of mass [kg m^2]
    """
    body = parts.whole(mass)
    moved = forms.upper(parts.whole(other).inertia_com - body.inertia_com)
    off = np.abs(moved)
    bars = np.where(off > SHARE * half_trace_com(body.vector.copy()), off / np.maximum(std, 1e-300), 0.0)
    worst = int(np.argmax(bars))
    if bars[worst] <= BARS:
        return ""
    more = "more" if moved[worst] > 0 else "less"
    return (
        f"The log would not object to part {parts.label[k]} of steel, {1e3 * other[k]:.3g} g instead of "
        f"{1e3 * mass[k]:.3g} g, which is mostly the prior's: {NAMES[4 + worst]} would be "
        f"{1e6 * off[worst]:.3g} kg mm^2 {more}, {bars[worst]:.1f} of its standard deviations."
    )
