"""The same clustering in plain Python, a Qhull call per hull: the rival of `bench speed`, the oracle of tests."""

from __future__ import annotations

import heapq
import time
from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.htc.merging import GRAIN
from steelyard.shape.hull import qhull
from steelyard.shape.tets import TetMesh

Edge = tuple[int, int]


@dataclass
class PlainClustering:
    """Clusters of a solid, their edges with bounds or values of their hulls, and the time spent in Qhull.

    With `lazy` a hull is made when its bound, the largest of earlier hulls, costs least; else at once, as published.
    """

    mesh: TetMesh
    piece: Integers
    lazy: bool = True
    hulls: int = 0
    hull_s: float = 0.0
    corners: dict[int, Integers] = field(default_factory=dict)
    volume: dict[int, float] = field(default_factory=dict)
    hull: dict[int, float] = field(default_factory=dict)
    tets: dict[int, int] = field(default_factory=dict)
    known: dict[Edge, tuple[float, bool]] = field(default_factory=dict)
    made: dict[Edge, Integers] = field(default_factory=dict)

    def run(self) -> Hierarchy:
        """Return the tree."""
        self._begin()
        count = len(self.volume)
        merges: list[Edge] = []
        costs: list[tuple[bool, float, float]] = []
        neighbours: dict[int, set[int]] = {k: set() for k in range(count)}
        for a, b in np.unique(np.sort(self.piece[self.mesh.dual], axis=1), axis=0).tolist():
            if a != b:
                neighbours[a].add(b)
                neighbours[b].add(a)
                self._bound((a, b), max(self.hull[a], self.hull[b]))
        heap = [(self._key(edge), edge, exact) for edge, (_, exact) in self.known.items()]
        heapq.heapify(heap)
        while heap:
            key, edge, exact = heapq.heappop(heap)
            if self.known.get(edge, (0.0, not exact))[1] != exact:
                continue
            if not exact:
                self._make(edge)
                heapq.heappush(heap, (self._key(edge), edge, True))
                continue
            a, b = edge
            c = count + len(merges)
            merges.append(edge)
            costs.append(key)
            self._join(a, b, c)
            neighbours[c] = (neighbours.pop(a) | neighbours.pop(b)) - {a, b}
            del self.known[edge]
            for k in neighbours[c]:
                bound = max(self.hull[c], self.hull[k])
                for old in (a, b):
                    pair = (min(old, k), max(old, k))
                    bound = max(bound, self.known.pop(pair, (0.0, False))[0])
                neighbours[k] = (neighbours[k] - {a, b}) | {c}
                self._bound((k, c), bound)
                heapq.heappush(heap, (self._key((k, c)), (k, c), self.known[k, c][1]))
        return self._tree(merges, costs)

    def _begin(self) -> None:
        for k in range(int(self.piece.max()) + 1):
            own = self.piece == k
            self.corners[k] = np.unique(self.mesh.tets[own])
            self.volume[k] = float(self.mesh.volumes[own].sum())
            self.tets[k] = int(own.sum())
            self.hull[k] = self.volume[k] if len(self.corners[k]) == 4 else self._hull_of(k)

    def _hull_of(self, k: int) -> float:
        volume, kept = self._timed(self.mesh.vertices[self.corners[k]])
        self.corners[k] = self.corners[k][kept]
        return volume

    def _timed(self, points: Array) -> tuple[float, Integers]:
        start = time.thread_time()
        answer = qhull(points)
        self.hull_s += time.thread_time() - start
        self.hulls += 1
        return answer

    def _bound(self, edge: Edge, bound: float) -> None:
        self.known[edge] = bound, False
        if not self.lazy:
            self._make(edge)

    def _make(self, edge: Edge) -> None:
        rows = np.union1d(self.corners[edge[0]], self.corners[edge[1]])
        volume, kept = self._timed(self.mesh.vertices[rows])
        self.known[edge] = volume, True
        self.made[edge] = rows[kept]

    def _join(self, a: int, b: int, c: int) -> None:
        self.hull[c] = self.known[a, b][0]
        self.corners[c] = self.made.pop((a, b))
        self.volume[c] = self.volume[a] + self.volume[b]
        self.tets[c] = self.tets[a] + self.tets[b]

    def _key(self, edge: Edge) -> tuple[bool, float, float]:
        """Return what orders merges: a concave union after a convex one, cost, volume."""
        a, b = edge
        hull, exact = self.known[edge]
        both = self.volume[a] + self.volume[b]
        grains = (hull - both) / (GRAIN * self.mesh.volume)
        hollow = GRAIN * max(0.0, np.rint(grains if exact else grains - 1e-3))
        if hollow > 0:
            return True, hollow, both
        return False, self.tets[a] ** 2 + self.tets[b] ** 2, both

    def _tree(self, merges: list[Edge], costs: list[tuple[bool, float, float]]) -> Hierarchy:
        used = self.mesh.vertices[np.unique(self.mesh.tets)]
        unit = float(np.linalg.norm(np.ptp(used, axis=0))) ** 3
        values = [1 + c * self.mesh.volume / unit if concave else c / len(self.mesh) ** 2 for concave, c, _ in costs]
        nodes = range(len(self.volume))
        return Hierarchy(
            self.piece,
            np.array(merges),
            np.array(values),
            np.array([self.volume[k] for k in nodes]),
            np.array([self.hull[k] for k in nodes]),
        )


def plain_cluster(mesh: TetMesh, piece: Integers | None = None, lazy: bool = True) -> tuple[Hierarchy, PlainClustering]:
    """Return the tree of merges and what it took; one body only."""
    leaf = np.arange(len(mesh)) if piece is None else np.unique(piece, return_inverse=True)[1]
    run = PlainClustering(mesh, leaf, lazy)
    return run.run(), run
