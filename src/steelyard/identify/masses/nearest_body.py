"""The body nearest to what a log says among those that keep a share of every second moment of a given shape."""

from __future__ import annotations

import numpy as np
from scipy.linalg import eigh

from steelyard.check import Array
from steelyard.inertia import InertialParameters

# Of the shape's second moment in every direction: at least this much stays.
LEAST_SHARE = 0.3


def nearest_body(inside: Array, target: Array) -> InertialParameters:
    """Return the mass and centre of `target` (10,) with as much of its inertia as stays well inside the bodies.

    Between the inertia of `inside` (10,), scaled to the mass, and that of `target` the farthest point counts where no
    principal second moment falls below a share of the former's.
    """
    shape, aim = InertialParameters(inside), InertialParameters(target)
    if not aim.mass > 0:
        return shape
    central = shape.inertia_com * (aim.mass / shape.mass)
    for step in np.linspace(1.0, 0.0, 21):
        body = InertialParameters.from_com(aim.mass, aim.com, central + step * (aim.inertia_com - central))
        if step == 0.0 or _least_share(body, InertialParameters.from_com(aim.mass, aim.com, central)) > LEAST_SHARE:
            break
    return body


def _least_share(body: InertialParameters, other: InertialParameters) -> float:
    """Return the least ratio of second moments of two bodies in any direction."""
    return float(eigh(body.pseudo_inertia, other.pseudo_inertia, eigvals_only=True)[0])
