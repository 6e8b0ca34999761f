"""Parts of a solid by the clustering of "The Sum of Its Parts", and how well parts go with a labelled cloud."""

from __future__ import annotations

from steelyard.check import Integers
from steelyard.datasets.known_object import KnownObject
from steelyard.evaluate.segments import SegmentScores, score_segments
from steelyard.parts.clustering import cluster
from steelyard.parts.segment import nearest_cell
from steelyard.parts.supervoxels import pieces_of_points, supervoxels
from steelyard.shape.cloud import Cloud
from steelyard.shape.tets import TetMesh

DEPTH = 2  # of the tree: where the paper cuts it, four parts


def paper_parts(mesh: TetMesh, cloud: Cloud | None) -> Integers:
    """Return the part (T,) of each cell: eq. 8, from the supervoxels (eq. 9) of a cloud, or from single cells."""
    piece = None if cloud is None else pieces_of_points(mesh, cloud, supervoxels(cloud))
    tree = cluster(mesh, piece)
    return tree.cut_at(tree.nodes_at_depth(DEPTH))


def scores_of(known: KnownObject, mesh: TetMesh, labels: Integers) -> SegmentScores:
    """Return the scores of the parts (T,) of a solid against the labels of the object's points."""
    return score_segments(known.cloud.labels, labels[nearest_cell(known.cloud.xyz, mesh.centroids)])
