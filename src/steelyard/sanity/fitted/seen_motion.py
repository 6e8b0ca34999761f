"""How well a log shows the motion of its load: rows that are accelerated, and the noise of their acceleration."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.logs.log import MotionLog

# Noise of an acceleration hides what follows it by its share of the variance; so many times that is allowed. Where
# masses and points lie is judged below the second share only.
NOISE, CALM = 3.0, 0.05
_FEWEST_ROWS = 50


def moves(log: MotionLog) -> bool:
    """Tell whether all channels measure, and enough rows are seen to be accelerated."""
    return not log.dead.any() and (~log.still).sum() >= _FEWEST_ROWS and bool(log.acceleration.any())


def at_rest(log: MotionLog) -> MotionLog:
    """Return the log as if nothing moved: gravity alone is left."""
    nothing = np.zeros_like(log.gravity)
    return replace(log, acceleration=nothing, angular_velocity=nothing, angular_acceleration=nothing)


def noise_share(log: MotionLog) -> float:
    """Return the share of its uncertainty in the squared acceleration of moving rows, linear or angular, the larger."""
    moving = ~log.still
    if log.noise is None or not moving.any():
        return 0.0
    variance = np.stack([n.acceleration + n.taken for n in log.noise])[log.noise_class][moving]
    sizes = np.concatenate([log.angular_acceleration, log.acceleration], 1)[moving] ** 2
    shares = [variance[:, part].sum() / max(float(sizes[:, part].sum()), 1e-300) for part in (slice(0, 3), slice(3, 6))]
    return float(max(shares))
