"""Is the answer a thing that a robot can hold? Units that no residual shows leave answers of impossible size."""

from __future__ import annotations

import numpy as np

from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate

# No arm holds more [kg]; nothing is denser [kg/m^3] than osmium.
HEAVIEST, DENSEST = 500.0, 22600.0
# The residual is far beyond what the weight lets a right model leave: as a share of the weight's force.
MISFIT = 0.2
# Chi-square per degree of freedom of a fit whose noise was estimated: far above one, the model does not fit.
CHI2 = 10.0


def implausible(estimate: Estimate, gravity: float) -> tuple[Finding, ...]:
    """Return `force-unit` or `length-in-mm` where mass, size or residual are those of wrong units.

    gravity  its size [m/s^2]
    """
    mass = estimate.mass
    if mass > HEAVIEST:
        return (Finding.of("force-unit", f"The mass comes out at {mass:.4g} kg, more than an arm holds."),)
    chi2 = estimate.evidence.chi2_per_dof or 0.0
    if chi2 > CHI2 and estimate.evidence.residual_force_N > MISFIT * mass * gravity:
        miss, weight = estimate.evidence.residual_force_N, mass * gravity
        text = (
            f"The force misses by {miss:.2g} N rms where the weight is {weight:.2g} N (chi^2 per degree of freedom "
            f"{chi2:.0f}): force and torque do not belong to one body."
        )
        return (Finding.of("force-unit", text),)
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
        "The torques are too small for the forces, as those in N m are that were declared as N*mm."
    )
    return (Finding.of("length-in-mm", text),)
