"""What points of a surface say of one another's sides: neighbours on one sheet, and sheets that face each other."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.cells.complex import Complex

STEEP = 0.35  # cosine between an edge and a normal, at both ends, above which the edge leaves the surface there
_SEEN = 0.3  # cosine between a point's plane and a facet of the hull above which the facet shows its outer side


@dataclass(frozen=True, eq=False)
class Ties:
    """How much each point's side depends on those of others, and on its being seen from outside.

    index    (N, K) neighbours
    link     (N, K) how much a neighbour lies on the same sheet; negative where its normal has the other sign
    start    (N + 1,) and other, faced: point other[k] faces point i from across a wall or a gap by faced[k],
             negative where the two normals must not both keep their sign; k from start[i] to start[i + 1]
    outward  (N,) how much the normal is one that leaves the hull of all, negative where it enters it
    """

    index: Integers
    link: Array
    start: Integers
    other: Integers
    faced: Array
    outward: Array

    @classmethod
    def of(cls, xyz: Array, normals: Array, index: Integers, link: Array, near: Complex, spacing: float) -> Ties:
        """Return the ties between points (N, 3) whose normals (N, 3) may have either sign.

        An edge of the Delaunay complex meets no surface between its ends. Where it leaves the surface at both, all of
        it is in the solid or all of it outside, so that both normals point along it or neither. And what the hull of
        all points shows is the outer side; facets narrower than the spacing have no direction to rely on.
        """
        start, other, faced = _faced(xyz, normals, near.start, near.other)
        twice = np.linalg.norm(near.across, axis=1)
        seen = np.einsum("fkd,fd->fk", normals[near.hull], near.across / np.maximum(twice, 1e-30)[:, None])
        seen *= (np.abs(seen) > _SEEN) * np.minimum(twice / spacing**2, 1)[:, None]
        outward = np.asarray(np.bincount(near.hull.ravel(), seen.ravel(), len(xyz)), float)
        return cls(index, link, start, other, faced, outward)

    def told(self, outward: Array) -> Ties:
        """Return the same ties, where something else says too how much (N,) each normal leaves the solid."""
        return replace(self, outward=self.outward + outward)

    def spread(self, values: Array, sweeps: int, kept: float) -> Array:
        """Return values (N,) pulled toward what their ties say in `sweeps`; `kept` weighs a point's own."""
        return self._swept(values, sweeps, kept, 1.0)

    def settled(self, sweeps: int, kept: float) -> Array:
        """Return 1 for each point (N,) whose normal agrees with its ties, -1 where it is to be turned."""
        return np.where(self._swept(np.ones(len(self.index)), sweeps, kept, 2.0) < 0, -1.0, 1.0)

    def _swept(self, values: Array, sweeps: int, kept: float, gain: float) -> Array:
        # Numbers as unsigned ones, or numba asks of each whether it counts from the end.
        index: Any = self.index.view(np.uint64)
        other: Any = self.other.view(np.uint64)
        ties = index, self.link, self.start, other, self.faced, self.outward
        return np.asarray(_swept(values, *ties, sweeps, kept, gain))

    @property
    def torn(self) -> float:
        """Share of the ties between points, by weight, that contradict the normals they were made from."""
        broken = -(np.minimum(self.link, 0).sum() + np.minimum(self.faced, 0).sum())
        return float(broken / max(np.abs(self.link).sum() + np.abs(self.faced).sum(), 1e-30))


@numba.njit(cache=True, nogil=True)
def _faced(xyz: Array, normals: Array, start: Integers, other: Integers) -> tuple[Integers, Integers, Array]:
    """Return the edges (start, other) that leave the surface at both ends, and by how much (E,)."""
    count = 0
    first, kept, faced = np.zeros(len(start), np.int64), np.empty(len(other), np.int64), np.empty(len(other))
    for i in range(len(xyz)):
        for k in range(start[i], start[i + 1]):
            j = other[k]
            square, here, there = 0.0, 0.0, 0.0
            for d in range(3):
                away = xyz[j, d] - xyz[i, d]
                square += away * away
                here += normals[i, d] * away
                there -= normals[j, d] * away
            least = min(abs(here), abs(there))
            if square > 0 and least * least > STEEP * STEEP * square:
                kept[count] = j
                faced[count] = np.sign(here * there) * least / np.sqrt(square)
                count += 1
        first[i + 1] = count
    return first, kept[:count].copy(), faced[:count].copy()


@numba.njit(cache=True, nogil=True)
def _swept(
    values: Array, index: Integers, link: Array, start: Integers, other: Integers, faced: Array, outward: Array,
    sweeps: int, kept: float, gain: float,
) -> Array:  # fmt: skip
    old, new, weight = values.astype(np.float64), np.empty(len(values)), np.empty(len(values))
    for i in range(len(values)):
        weight[i] = kept + abs(outward[i])
        for a in range(index.shape[1]):
            weight[i] += abs(link[i, a])
        for k in range(start[i], start[i + 1]):
            weight[i] += abs(faced[k])
    for _ in range(sweeps):
        for i in range(len(values)):
            total = kept * values[i] + outward[i]
            for a in range(index.shape[1]):
                total += link[i, a] * old[index[i, a]]
            for k in range(start[i], start[i + 1]):
                total += faced[k] * old[other[k]]
            new[i] = min(1.0, max(-1.0, gain * total / weight[i]))
        old, new = new, old
    return old
