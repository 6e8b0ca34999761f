"""Objects of the held-object bench as they are seen: parts by our own segmentation of the cloud, and by the paper's."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.bench.shapes.paper_parts import paper_parts, scores_of
from steelyard.check import Array, Integers
from steelyard.datasets.known_object import KnownObject
from steelyard.evaluate.segments import hausdorff_mm
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.parts.parts import Parts
from steelyard.pipelines.shape_in_parts import shape_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.published_surface import published_surface
from steelyard.shape.tets import TetMesh

SCORES = ("impurity", "gce", "hausdorff_mm")


@dataclass(frozen=True, eq=False)
class Segmented:
    """What the cloud of an object gives, labels unseen.

    parts   in S, as shape and colour alone say
    cuts    in S, among which a log may choose, with the log weight `prior` of each beforehand
    error   how wrong the shape may be
    paper   in S, by the paper's route: ball pivoting, thickening, its clustering from supervoxels, four parts
    scores  "ours" and "paper-route" -> volume ratio, impurity, GCE, Hausdorff, parts
    """

    parts: Parts
    cuts: tuple[Parts, ...]
    prior: Array
    error: ShapeError
    paper: Parts
    scores: dict[str, dict[str, Any]]


def segmented(known: KnownObject) -> Segmented:
    """Return both segmentations of the object's cloud without its labels."""
    cloud = Cloud(known.cloud.xyz, known.cloud.rgb)
    shape = shape_of(cloud)
    thick = published_surface(cloud)
    labels = paper_parts(thick, cloud)
    paper = Parts(np.arange(labels.max() + 1), thick.moments(labels, int(labels.max()) + 1))
    made, cuts = shape.segmentation, shape.cuts()
    return Segmented(
        parts=shape.parts.in_frame(known.X_SO),
        cuts=tuple(cut.in_frame(known.X_SO) for cut in cuts.parts),
        prior=cuts.prior,
        error=shape.error,
        paper=paper.in_frame(known.X_SO),
        scores={
            "ours": _scores(known, made.mesh, made.labels),
            "paper-route": _scores(known, thick, labels),
        },
    )


def _scores(known: KnownObject, mesh: TetMesh, labels: Integers) -> dict[str, Any]:
    """Return the scores of parts of a solid against the labelled cloud."""
    scores = scores_of(known, mesh, labels)
    true = float(known.parts.volume.sum())
    return {
        "volume_ratio": mesh.volume / true,
        "impurity": scores.impurity,
        "gce": scores.gce,
        "hausdorff_mm": hausdorff_mm(mesh.vertices[mesh.surface].reshape(-1, 3), known.cloud.xyz),
        "n_parts": int(labels.max()) + 1,
        "n_true": scores.n_true,
    }


def rank_correlations(rows: list[dict[str, Any]], riemannian: dict[str, float]) -> dict[str, float | None]:
    """Return Spearman's rank correlation of each score with the Riemannian error over objects (the paper's section VI).

    rows        one per object: "object" and the scores
    riemannian  object -> its mean error
    """
    from scipy.stats import spearmanr

    errors = [riemannian[row["object"]] for row in rows]
    out: dict[str, float | None] = {}
    for name in SCORES:
        values = [row[name] for row in rows]
        spread = len(rows) > 2 and len(set(values)) > 1 and len(set(errors)) > 1
        out[name] = float(spearmanr(values, errors).statistic) if spread else None
    return out
