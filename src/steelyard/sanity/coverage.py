"""Coverage: whether gravity has visited enough directions of S to tell a load from a bias."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.alignment_findings import planar_finding
from steelyard.logs.runs import picked

# Directions closer than this are one [rad]; three are the bare minimum, the fourth is the first check.
APART, FEWEST = np.radians(20.0), 4
_MOST_ROWS = 500


def coverage(gravity: Array) -> tuple[Finding, ...]:
    """Return what there is to say about gravity (N, 3) in S: too few directions, or all in one plane."""
    found = directions(gravity)
    if len(found) >= FEWEST:
        return planar_finding(gravity)
    widest = float(np.degrees(np.arccos(np.clip((found @ found.T).min(), -1.0, 1.0))))
    message = (
        f"Gravity takes {len(found)} direction{'s' if len(found) > 1 else ''} of S that differ by more than "
        f"{np.degrees(APART):.0f} degrees"
        + (f", at most {widest:.0f} degrees apart" if len(found) > 1 else "")
        + f"; {FEWEST} are needed to tell the load from the sensor's bias and to check the answer."
    )
    return (Finding.of("too-few-poses", message),)


def directions(gravity: Array) -> Array:
    """Return unit vectors (K, 3) of gravity (N, 3), each more than 20 degrees from every other."""
    pick = picked(len(gravity), _MOST_ROWS)
    units = gravity[pick] / np.maximum(np.linalg.norm(gravity[pick], axis=1, keepdims=True), 1e-12)
    found = units[:1]
    # Farthest first: each new direction is the one that the others cover least.
    nearest = units @ units[0]
    while nearest.min() < np.cos(APART):
        new = units[int(nearest.argmin())]
        found = np.concatenate([found, new[None]])
        nearest = np.maximum(nearest, units @ new)
    return np.asarray(found)
