"""Scores of a segmentation: N labelled points, true part against found segment, and the gap between two surfaces.

Source: "The Sum of Its Parts", Table II; its USE is the impurity here, and its GCE is not the textbook one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue

UNIT_DIAGONAL_MM = 1000.0


@dataclass(frozen=True)
class SegmentScores:
    """How far found segments are from true parts.

    impurity           share of points outside the true part that most of their segment belongs to (the paper's USE)
    undersegmentation  Levinshtein's error: how much segments leak out of true parts, 0 = none, unbounded
    gce                global consistency error: 0 = one is a refinement of the other, below 1
    ari                adjusted Rand index: 1 = the same partition, 0 = no better than chance
    n_true, n_parts    true parts and segments that have points
    """

    impurity: float
    undersegmentation: float
    gce: float
    ari: float
    n_true: int
    n_parts: int


def score_segments(true: ArrayLike, found: ArrayLike) -> SegmentScores:
    """Score the found labels (N,) of points whose true labels (N,) are known."""
    table = contingency(true, found)
    return SegmentScores(
        impurity=impurity(table),
        undersegmentation=undersegmentation(table),
        gce=global_consistency(table),
        ari=adjusted_rand(table),
        n_true=table.shape[0],
        n_parts=table.shape[1],
    )


def contingency(true: ArrayLike, found: ArrayLike) -> Array:
    """Return the number of points (G, S) in every pair of true part and segment; neither has an empty one.

    true, found  (N,) label of the part, and of the segment, that each point lies in

    Raises BadValue where the two are not of one length, or of no point.
    """
    labels = [np.asarray(values) for values in (true, found)]
    if labels[0].ndim != 1 or labels[0].shape != labels[1].shape or not len(labels[0]):
        raise BadValue(
            f"true and found labels must be two lists of the same length, at least one point; "
            f"got {labels[0].shape} and {labels[1].shape}."
        )
    (names_true, row), (names_found, column) = (np.unique(values, return_inverse=True) for values in labels)
    table = np.zeros((len(names_true), len(names_found)))
    np.add.at(table, (row, column), 1)
    return table


def impurity(table: Array) -> float:
    """Return 1 - sum_s max_g M_gs / N of a contingency table M (G, S): what the paper calls USE."""
    return float(1 - table.max(0).sum() / table.sum())


def undersegmentation(table: Array) -> float:
    """Return the mean over true parts of (points of all segments that touch the part - its points) / its points.

    table  (G, S) points of true part g in segment s

    Source: Levinshtein et al. 2009, "TurboPixels", eq. 17.
    """
    parts, segments = table.sum(1), table.sum(0)
    covered = (table > 0) @ segments
    return float(np.mean((covered - parts) / parts))


def global_consistency(table: Array) -> float:
    """Return min over direction of the mean share of a point's own part that lies outside its other part.

    table  (G, S) points of true part g in segment s

    Source: Martin et al. 2001, "A database of human segmented natural images", eq. 2.
    """
    parts, segments, points = table.sum(1, keepdims=True), table.sum(0, keepdims=True), table.sum()
    refinement = (table * (parts - table) / parts).sum(), (table * (segments - table) / segments).sum()
    return float(min(refinement) / points)


def adjusted_rand(table: Array) -> float:
    """Return the Rand index less what chance would give, scaled so that equal partitions score 1.

    Source: Hubert and Arabie 1985, eq. 5. Two partitions without any choice (all in one, or all apart) score 1.
    """

    def pairs(count: Array) -> float:
        return float((count * (count - 1)).sum() / 2)

    together, of_parts, of_segments = pairs(table), pairs(table.sum(1)), pairs(table.sum(0))
    everything = pairs(table.sum(keepdims=True))
    chance = of_parts * of_segments / everything if everything else 0.0
    most = (of_parts + of_segments) / 2
    return 1.0 if most == chance else float((together - chance) / (most - chance))


def hausdorff_mm(found: ArrayLike, true: ArrayLike) -> float:
    """Return the farthest that a point of either surface is from the other [mm], the true one's diagonal being 1000.

    found, true  points (M, 3) and (N, 3) [m] in one frame; both are scaled by the diagonal of the true points' box

    Points stand for the surface: their spacing is the smallest gap that can be seen.
    """
    from scipy.spatial import cKDTree

    one, two = check.vectors("found points", found), check.vectors("true points", true)
    diagonal = float(np.linalg.norm(np.ptp(two, axis=0)))
    scale = UNIT_DIAGONAL_MM / check.positive("the diagonal of the true points' box", diagonal)
    there, back = cKDTree(two).query(one)[0], cKDTree(one).query(two)[0]
    return float(scale * max(there.max(), back.max()))
