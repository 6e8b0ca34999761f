"""A share by which all that was weighed may be too large: gravity that nobody stated, an accelerometer's gain.

f = m (a - g): where a - g is taken too small by a share, mass and first moment come out too large by the same share.
So do the second moments that a shape draws from its masses; those that torques show, about the origin, do not.
"""

from __future__ import annotations

from dataclasses import replace
from typing import TypeVar

import numpy as np

from steelyard.identify.estimate import Estimate

AnyEstimate = TypeVar("AnyEstimate", bound=Estimate)


def allow_scale(estimate: AnyEstimate, share: float, whole: bool) -> AnyEstimate:
    """Return the estimate with a relative standard deviation `share` of scale in its bars.

    whole  whether second moments scale as well, since they come from the masses of a shape
    """
    if not share:
        return estimate
    vector = estimate.parameters.vector
    slope = share * (vector if whole else np.concatenate([vector[:4], np.zeros(6)]))
    masses = share * np.array([part.mass for part in estimate.parts])
    spread = estimate.part_covariance
    return replace(
        estimate.allowing(slope),
        parts=tuple(replace(p, std=float(np.hypot(p.std, m))) for p, m in zip(estimate.parts, masses, strict=True)),
        part_covariance=None if spread is None else spread + np.outer(masses, masses),
    )
