"""Tools bent of sheet: how thick their wall is, and what that says of the sides of their points.

Where walls and gaps are both narrow, no field tells which is which. But a wall is as thick in one place as in another:
the distances across what is taken for wall have a mode, and what lies between sheets so far apart is wall everywhere.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.shape.cells.complex import Complex
from steelyard.shape.sides.ties import STEEP

_PARALLEL = 0.8  # cosine between planes whose distance counts
_FLAT = 3.0  # links of a point on a flat piece
_THIN, _THICK = 0.25, 1.25  # distances looked at, in spacings: nearer is noise, and thicker walls need no help
_BIN, _WIDTH = 0.05, 5  # of them, in spacings, and how many make a mode
_COMMON = 0.02  # edges across the mode for every point, at least
_LEAST, _MOST = 0.4, 1.5  # thicknesses between which a distance is one wall's
_WEIGHT = 6.0  # of an edge across the wall beside a tie that says only that its ends agree


@dataclass(frozen=True, eq=False)
class Wall:
    """A wall of one thickness, and the edges of a Delaunay complex, some of which cross it.

    thickness  in the units of the points
    start      (E,) and other (E,): an edge goes from point start[k] to point other[k], another goes back
    along      (E, 3) from the one to the other
    """

    thickness: float
    start: Integers
    other: Integers
    along: Array

    @classmethod
    def of(cls, xyz: Array, normals: Array, planes: Array, link: Array, near: Complex, spacing: float) -> Wall | None:
        """Return the wall of points (N, 3) on planes (N, 3) with links (N, K) along them; None where there is no mode.

        normals  (N, 3) as found without it: what lies between two sheets is taken for wall where both leave it, for a
                 gap where both enter it; distances across gaps count against a mode
        """
        start, other = np.repeat(np.arange(len(xyz)), np.diff(near.start)), near.other
        made = cls(0.0, start, other, xyz[other] - xyz[start])
        flat = np.abs(link).sum(1) > _FLAT
        chosen = flat[start] & flat[other] & (np.abs((planes[start] * planes[other]).sum(1)) > _PARALLEL)
        _, distance, steep = made._across(planes)
        leaves = -np.sign((normals[start] * made.along).sum(1)) + np.sign((normals[other] * made.along).sum(1))
        edges = np.arange(_THIN, _THICK + _BIN / 2, _BIN)
        counted = np.histogram(distance / spacing, edges, weights=leaves / 4 * (chosen & steep))[0]  # each edge twice
        found = np.convolve(counted, np.ones(_WIDTH), "valid")
        most = int(np.argmax(found))
        if found[most] < _COMMON * len(xyz):
            return None
        return replace(made, thickness=float(edges[most] + _WIDTH * _BIN / 2) * spacing)

    def outward(self, normals: Array) -> Array:
        """Return how much (N,) edges across the wall say that normals (N, 3) leave it; negative where they enter it."""
        here, distance, steep = self._across(normals)
        crosses = steep & (distance > _LEAST * self.thickness) & (distance < _MOST * self.thickness)
        weight = _WEIGHT * distance[crosses] / np.linalg.norm(self.along[crosses], axis=1)
        leaves = -np.sign(here[crosses]) * weight
        return np.asarray(np.bincount(self.start[crosses], leaves, len(normals)), float)

    def _across(self, normals: Array) -> tuple[Array, Array, Mask]:
        """Return how far edges (E,) rise over the plane of their start, the least over both ends, and if steep."""
        here = (normals[self.start] * self.along).sum(1)
        least = np.minimum(np.abs(here), np.abs((normals[self.other] * self.along).sum(1)))
        return here, least, least > STEEP * np.linalg.norm(self.along, axis=1)
