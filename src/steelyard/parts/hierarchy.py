"""The tree of a clustering: which pieces of a solid were joined in which order, and cuts of it into parts."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue


@dataclass(frozen=True, eq=False)
class Hierarchy:
    """N pieces of a solid of T tetrahedra, joined two at a time until one is left.

    The pieces are nodes 0..N-1, merge k makes node N+k, and the last node is the whole.

    piece    (T,) the piece, 0..N-1, of every tet
    merges   (N-1, 2) the two nodes joined, the lower number first
    cost     (N-1,) cost of each merge; inf where nothing touches any more and separate bodies were joined
    volume   (2N-1,) volume of every node [m^3], None where it is not known
    hull     (2N-1,) volume of the convex hull of every node [m^3], None where it is not known
    """

    piece: Integers
    merges: Integers
    cost: Array
    volume: Array | None = None
    hull: Array | None = None

    def __post_init__(self) -> None:
        piece, merges = check.whole("piece", self.piece), check.whole("merges", self.merges).reshape(-1, 2)
        cost = check.frozen(self.cost)
        count = len(merges) + 1
        if piece.ndim != 1 or not len(piece) or len(np.unique(piece)) != count or piece.min() or piece.max() >= count:
            raise BadValue(f"a tree of {len(merges)} merges needs one of the pieces 0..{count - 1} per tet, each used.")
        made = count + np.arange(len(merges))
        if not np.array_equal(np.sort(merges.ravel()), np.arange(2 * count - 2)) or (merges >= made[:, None]).any():
            raise BadValue("every node but the last must be joined once, after it was made; these merges are no tree.")
        if cost.shape != (count - 1,) or np.isnan(cost).any():
            raise BadValue(f"a tree of {count - 1} merges needs a cost (inf allowed) for each; got {cost.shape}.")
        for name, column in (("piece", piece), ("merges", merges), ("cost", cost)):
            object.__setattr__(self, name, column)
        for name in ("volume", "hull"):
            if getattr(self, name) is not None:
                column = check.finite(f"{name} of the nodes", getattr(self, name))
                if column.shape != (2 * count - 1,):
                    raise BadValue(f"{name} needs a number for each of {2 * count - 1} nodes; got {column.shape}.")
                object.__setattr__(self, name, column)

    def __len__(self) -> int:
        """Number N of pieces."""
        return len(self.merges) + 1

    @property
    def root(self) -> int:
        """The node that is the whole."""
        return 2 * len(self) - 2

    @cached_property
    def parent(self) -> Integers:
        """The node (2N-1,) that each node was joined into, -1 for the whole."""
        parent = np.full(2 * len(self) - 1, -1)
        parent[self.merges.ravel()] = np.repeat(len(self) + np.arange(len(self.merges)), 2)
        return parent

    def of_cells(self, piece: Integers, volumes: Array) -> Hierarchy:
        """Return the same tree over other cells: their pieces (T,) and volumes (T,) [m^3]; hulls are not known then."""
        volume = np.concatenate([np.bincount(piece, volumes, len(self)), np.zeros(len(self.merges))])
        for k, (a, b) in enumerate(self.merges):
            volume[len(self) + k] = volume[a] + volume[b]
        return Hierarchy(piece, self.merges, self.cost, volume)

    def children(self, node: int) -> tuple[int, int] | None:
        """Return the two nodes that `node` was made of, None for a piece."""
        below = self.merges[self._node(node) - len(self)] if node >= len(self) else None
        return None if below is None else (int(below[0]), int(below[1]))

    def leaves(self, node: int) -> Integers:
        """Return the numbers (k,) of the pieces inside a node, rising."""
        return np.flatnonzero(self._above([self._node(node)])[: len(self)] >= 0)

    def nodes(self, count: int) -> list[int]:
        """Return the `count` nodes, rising, that are left when the last count - 1 merges are undone."""
        count = int(check.whole("the number of parts", count))
        if not 1 <= count <= len(self):
            raise BadValue(f"this tree has {len(self)} pieces and can be cut into 1 to {len(self)} parts, not {count}.")
        kept = self.root - (count - 1)
        alive = (self.parent > kept) | (self.parent < 0)
        return [int(n) for n in np.flatnonzero(alive[: kept + 1])]

    def nodes_at_depth(self, depth: int) -> list[int]:
        """Return the nodes `depth` joins below the whole, and the pieces met on the way.

        Source: the published code of "The Sum of Its Parts" takes depth 2: four parts, or three or two of few pieces.
        """
        found = [self.root]
        for _ in range(depth):
            found = [n for node in found for n in (self.children(node) or (node,))]
        return sorted(found)

    def cut(self, count: int) -> Integers:
        """Return the part (T,), 0..count-1, of every tet with the last count - 1 merges undone; see `cut_at`."""
        return self.cut_at(self.nodes(count))

    def cut_at(self, nodes: Iterable[int]) -> Integers:
        """Return the part (T,) of every tet where each of `nodes` is a part; they must share and leave out nothing.

        Parts are numbered by falling volume (equal or unknown volumes: by first appearance among the tets).
        """
        chosen = np.array(sorted(self._node(n) for n in nodes), dtype=np.int64)
        above = self._above(chosen)
        owner, over = above[: len(self)], self.parent[chosen]
        inner = (above[over[over >= 0]] >= 0).any()
        if inner or (owner < 0).any() or len(np.unique(chosen)) != len(chosen):
            raise BadValue(
                "nodes to cut at must hold every piece exactly once; "
                f"{int((owner < 0).sum())} of {len(self)} pieces are in none"
                f"{', and some nodes lie in or equal others' if inner or len(set(chosen)) != len(chosen) else ''}."
            )
        labels = owner[self.piece]
        first = np.unique(labels, return_index=True)[1]
        volume = np.zeros(len(chosen)) if self.volume is None else self.volume[chosen]
        rank = np.empty(len(chosen), dtype=np.int64)
        rank[np.lexsort((first, -volume))] = np.arange(len(chosen))
        return np.asarray(rank[labels])

    def _node(self, node: int) -> int:
        if not 0 <= node <= self.root:
            raise BadValue(f"nodes of this tree are 0..{self.root}; got {node}.")
        return int(node)

    def _above(self, chosen: Sequence[int] | Integers) -> Integers:
        """Return which of the nodes `chosen` each node (2N-1,) is or lies in, -1 for none, the innermost of two."""
        place = np.full(self.root + 1, -1)
        place[chosen] = np.arange(len(chosen))
        up = np.where((place >= 0) | (self.parent < 0), np.arange(self.root + 1), self.parent)
        while not np.array_equal(up, higher := up[up]):
            up = higher
        return np.asarray(place[up])
