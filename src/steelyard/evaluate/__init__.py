"""The papers' scores, done right, and as they were published for comparison."""

from steelyard.evaluate.bodies import (
    Scores,
    box_edges,
    com_mm,
    com_pct,
    consistent,
    inertia_pct,
    inertia_scale,
    mass_pct,
    riemannian,
    score,
)
from steelyard.evaluate.published import score_as_published
from steelyard.evaluate.segments import (
    SegmentScores,
    adjusted_rand,
    contingency,
    global_consistency,
    hausdorff_mm,
    impurity,
    score_segments,
    undersegmentation,
)

__all__ = [
    "Scores",
    "SegmentScores",
    "adjusted_rand",
    "box_edges",
    "com_mm",
    "com_pct",
    "consistent",
    "contingency",
    "global_consistency",
    "hausdorff_mm",
    "impurity",
    "inertia_pct",
    "inertia_scale",
    "mass_pct",
    "riemannian",
    "score",
    "score_as_published",
    "score_segments",
    "undersegmentation",
]
