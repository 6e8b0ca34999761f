"""Segmentation: a solid in parts, each point of its cloud in one of them, and the tree that they were cut from."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.parts.description import Cuts
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.parts import Parts
from steelyard.shape.cloud import Cloud
from steelyard.shape.eight_bits import Colours
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.spatial import summed


@dataclass(frozen=True, eq=False)
class Segmentation:
    """A solid in P parts.

    mesh        the solid, T tets [m]; those that reached through it from part to part are cut at the border
    labels      (T,) the part 0..P-1 of every tet, by falling volume
    hierarchy   the tree that the parts are cut from
    cuts        the best cut into every number of parts, with its description length; None where `labels` were given
    rgb         (P, 3) mean colour 0..255 of the points of each part, None where the cloud has no colours
    point_part  (N,) the part of every point of the cloud: that of the nearest tet of the point's colour
    names       (P,) what each part is called
    findings    what a reader must know of the cut that was chosen; none of a cut asked for
    inner       how many vertices, the last ones, lie inside, where cells are cut at borders
    """

    mesh: TetMesh
    labels: Integers
    hierarchy: Hierarchy
    cuts: Cuts | None
    rgb: Array | None
    point_part: Integers
    names: tuple[str, ...]
    cloud: Cloud
    nearest: Integers
    findings: tuple[Finding, ...] = ()
    inner: int = 0

    def __len__(self) -> int:
        """Number P of parts."""
        return len(self.names)

    @cached_property
    def parts(self) -> Parts:
        """The parts with their exact moments, in the frame of the solid."""
        return Parts(np.arange(len(self)), self.mesh.moments(self.labels, len(self)), self.rgb)

    @cached_property
    def border_share(self) -> float:
        """Share of the volume that corners of another part say, of cells that reach from one part to another.

        Inside a thick body nothing shows where the border lies. Corners where cells were cut at it count, too: it is
        taken to be flat, which a tang or a plug is not.
        """
        cut = self.mesh.tets >= len(self.mesh.vertices) - self.inner
        foreign = cut | (self._vertex_part[self.mesh.tets] != self.labels[:, None])
        return float((self.mesh.volumes * foreign.mean(1)).sum() / self.mesh.volume)

    @property
    def _vertex_part(self) -> Integers:
        """The part (V,) of every vertex: that of the nearest point."""
        return np.asarray(self.point_part[nearest(self.cloud.xyz, self.mesh.vertices)])

    @property
    def sureness(self) -> Array:
        """Share (K,) of every number of parts 1..K; see `Cuts.sureness`."""
        if self.cuts is None:
            raise BadValue("the parts of this solid were given, not chosen; there is no score of their number.")
        return self.cuts.sureness

    def cut(self, count: int) -> Segmentation:
        """Return the solid in another number of parts: the best cut of the tree into so many."""
        nodes = self.hierarchy.nodes(count) if self.cuts is None else self.cuts.nodes(count)
        return self.cut_at(nodes)

    def cut_at(self, nodes: Sequence[int]) -> Segmentation:
        """Return the solid in the parts that are these nodes of the hierarchy."""
        return self.labelled(self.hierarchy.cut_at(nodes))

    def with_labels(self, labels: Integers) -> Segmentation:
        """Return the solid in the parts of `labels` (T,), any whole numbers; they are numbered by falling volume.

        They are given, not chosen: `cuts` is None then, and a log is offered no others. The cells are those of `mesh`
        of this segmentation: those of the solid that reached over a border between parts were cut. Raises BadValue.
        """
        labels = check.whole("labels", labels)
        if labels.shape != (len(self.mesh),):
            raise BadValue(
                f"labels must be one for each of the {len(self.mesh)} cells of the segmentation's own mesh; got shape "
                f"{labels.shape}. The solid's mesh has others: cells at borders were cut."
            )
        return replace(self.labelled(labels), cuts=None)

    def labelled(self, labels: Integers) -> Segmentation:
        """Return the solid in the parts of `labels` (T,), whole numbers, chosen as those here were."""
        ordered = by_volume(labels, self.mesh)
        point_part = ordered[self.nearest]
        count = int(ordered.max()) + 1
        rgb = _mean_colours(self.cloud.rgb, point_part, count)
        names = tuple(f"part {k}" for k in range(count))
        return replace(self, labels=ordered, rgb=rgb, point_part=point_part, names=names, findings=())

    def merged(self, groups: Sequence[Sequence[int]]) -> Segmentation:
        """Return parts joined: each group lists the parts that are one; it takes the name of its first part."""
        groups = [_group(group) for group in groups]
        named = [k for group in groups for k in group]
        if not all(groups) or len(set(named)) < len(named) or not set(named) <= set(range(len(self))):
            raise BadValue(f"groups must name parts 0..{len(self) - 1}, none twice, none empty; got {groups}.")
        goal = np.arange(len(self))
        for group in groups:
            goal[list(group)] = group[0]
        joined = self.with_labels(goal[self.labels])
        first = np.zeros(len(joined), dtype=np.int64)
        first[joined.labels] = goal[self.labels]
        return replace(joined, names=tuple(self.names[k] for k in first))

    def named(self, names: Sequence[str]) -> Segmentation:
        """Return the same parts under other names (P,)."""
        if len(names) != len(self):
            raise BadValue(f"{len(self)} parts need as many names; got {len(names)}.")
        return replace(self, names=tuple(names))


def _group(parts: Sequence[int]) -> list[int]:
    """Return the numbers of parts that are one."""
    numbers = check.whole("each group", parts)
    if numbers.ndim != 1:
        raise BadValue(f"groups must be lists of parts, such as [[0, 1]]; got {parts!r} as one of them.")
    return [int(k) for k in numbers]


def by_volume(labels: Any, mesh: TetMesh) -> Integers:
    """Return labels (T,) numbered from 0 by falling volume, equal ones by first appearance."""
    _, first, inverse = np.unique(labels, return_index=True, return_inverse=True)
    rank = np.empty(len(first), dtype=np.int64)
    rank[np.lexsort((first, -np.bincount(inverse, mesh.volumes)))] = np.arange(len(first))
    return np.asarray(rank[inverse])


def _mean_colours(rgb: Colours | None, part: Integers, count: int) -> Array | None:
    """Return the mean colour (P, 3) of each part's points; grey where a part has none."""
    if rgb is None:
        return None
    points = np.bincount(part, minlength=count)
    return np.where(points[:, None] > 0, summed(part, rgb, count) / np.maximum(points, 1)[:, None], 128.0)
