"""Force columns of another order or sign: no turn of the sensor explains them, but a reflection of its axes does."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.static_fit import beside, solve
from steelyard.sanity.readings.tilt import force_and_weight
from steelyard.spatial import signed_axes, signed_columns


@dataclass(frozen=True, eq=False)
class Mirror:
    """How the columns of the force would have to be read, and the share of the force variance that is then left."""

    words: str
    force_share: float


# The 24 (24, 3, 3) that turn a right hand into a left one.
REFLECTIONS = np.stack([X for X in signed_axes() if np.linalg.det(X) < 0])


def mirrored(view: Glance, gravity: Array, sign: float) -> Mirror | None:
    """Return the exchange of axes and signs that explains the force best; None without rotations or all forces.

    gravity  (3,) [m/s^2] in W
    sign     that of the mass as read, 0 where it is not sure
    """
    if view.rotation is None or any(view.dead[3:]):
        return None
    seen = view.still.seen(gravity, view.rotation)
    force, down = force_and_weight(seen, sign)
    # force = X m down: the trace with X is largest for the right one.
    X = max(REFLECTIONS, key=lambda X: float((X * (force.T @ down)).sum()))
    _, _, share = solve(beside((down @ X.T)[:, :, None], seen.lever), force, view.block)
    return Mirror(in_words(X, "F"), share)


def in_words(X: Array, letter: str) -> str:
    """Say what columns must be read as whose numbers are X (3, 3) times those meant: "Fx = -Fy, Fy = .."."""
    # meant_k = sum_i X_ik read_i
    pairs = zip("xyz", signed_columns(X.T, letter), strict=True)
    return ", ".join(f"{letter}{name} = {read}" for name, read in pairs)
