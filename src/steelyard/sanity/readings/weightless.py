"""Forces that do not follow gravity at all: nothing is held, its weight is taken away, or the sensor is dead."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.sanity.coverage import FEWEST, directions
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.static_fit import StaticFit

# Gravity explains less than this share of the force's variance, by a mass surely below this [kg].
EXPLAINED, LIGHTEST, SURE = 0.05, 0.005, 5.0
# No sensor's noise is below this [N].
FROZEN = 1e-9


def require_weight(view: Glance, gravity: Array, rotation: Array | None, found: StaticFit) -> None:
    """Raise CannotAnswer where gravity (3,) takes enough directions of S, and the force shows no weight."""
    most = abs(found.mass) + SURE * found.mass_std
    if any(view.dead) or found.force_share < 1 - EXPLAINED or most > LIGHTEST:
        return
    pull = view.seen(gravity, rotation).pull
    if not np.linalg.norm(pull, axis=1).any() or len(directions(pull)) < FEWEST:
        return
    spread = float(view.wrench[:, 3:].std(0).max())
    weight = f"varies by {spread:.2g} N rms, a weight of {1e3 * abs(found.mass):.2g} ± {1e3 * found.mass_std:.1g} g"
    raise CannotAnswer(
        f"The force shows no weight: gravity takes {len(directions(pull))} directions of S, and the force "
        f"{'stands still' if spread < FROZEN else weight}. Nothing is held, a controller takes the weight away (set "
        "its payload to zero), or the sensor or its driver is dead."
    )
