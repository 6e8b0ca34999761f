"""Is the answer a thing that a robot can hold? Units that no residual shows leave answers of impossible size."""

from __future__ import annotations

import numpy as np

from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate

# No arm holds more [kg]; nothing is denser [kg/m^3] than osmium.
HEAVIEST, DENSEST = 500.0, 22600.0
# The residual is far beyond what the weight lets a right model leave: as a share of the weight's force.
MISFIT = 0.2
# It is no noise either where it is so many times what scatters from sample to sample; of a table nobody knows, but no
# reading at rest scatters by half a newton.
NO_NOISE, QUIET = 5.0, 0.1


def implausible(estimate: Estimate, gravity: float, noise: float = 0.0) -> tuple[Finding, ...]:
    """Return `force-unit`, `length-in-mm` or `wrench-unexplained` where mass, size or residual are no body's.

    gravity  its size [m/s^2]
    noise    of the force from row to row [N], zero where the log has no clock
    """
    mass = estimate.mass
    if mass > HEAVIEST:
        return (Finding.of("force-unit", f"The mass comes out at {mass:.4g} kg, more than an arm holds."),)
    miss, weight = estimate.evidence.residual_force_N, mass * gravity
    if miss > MISFIT * weight and miss > NO_NOISE * (noise or QUIET):
        text = (
            f"The force misses by {miss:.2g} N rms where the weight is {weight:.2g} N: one rigid body does not explain "
            "this wrench, and the error bars do not hold."
        )
        return (Finding.of("wrench-unexplained", text),)
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
