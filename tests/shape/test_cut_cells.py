"""Cells cut where edges are: the solid stays the same, and cells still meet in whole faces."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.shape.cells.cut_cells import crossing_edges, cut_cells
from steelyard.shape.tets import FACES, TetMesh


def cube(points: int = 60, seed: int = 0) -> TetMesh:
    """A cube of 0.1 m with points inside."""
    corners = np.array(np.meshgrid(*[[0.0, 0.1]] * 3)).reshape(3, -1).T
    xyz = np.concatenate([corners, np.random.default_rng(seed).uniform(0.005, 0.095, (points, 3))])
    return TetMesh(xyz, Delaunay(xyz).simplices)


def outside(mesh: TetMesh) -> float:
    """Area of all faces that belong to one cell only."""
    faces = np.sort(mesh.tets[:, FACES].reshape(-1, 3), axis=1)
    once = np.unique(faces, axis=0, return_counts=True)
    a, b, c = np.moveaxis(mesh.vertices[once[0][once[1] == 1]], 1, 0)
    return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum() / 2)


def test_a_solid_cut_along_a_plane_has_the_plane_between_its_cells():
    mesh = cube()
    height = mesh.vertices @ [0.2, -0.3, 0.933] - 0.043
    edges = crossing_edges(mesh, (height > 0).astype(np.int64))
    assert (height[edges[:, 0]] < 0).all()
    assert (height[edges[:, 1]] > 0).all()
    below, above = height[edges].T
    cut = cut_cells(mesh, edges, below / (below - above))
    near_an_end = (np.minimum(-below, above) / (above - below) < 0.01).sum()
    now = np.concatenate([height, np.zeros(len(edges))])[cut.mesh.tets]
    assert ((now > -1e-12).all(1) | (now < 1e-12).all(1)).all()
    assert near_an_end < 0.05 * len(edges)
    volume = cut.mesh.volumes[(now < 1e-12).all(1)].sum()
    grid = np.moveaxis(np.mgrid[0.0005:0.1:0.001, 0.0005:0.1:0.001, 0.0005:0.1:0.001], 0, -1)
    assert volume / 1e-3 == pytest.approx((grid @ [0.2, -0.3, 0.933] < 0.043).mean(), rel=3e-3)


def test_volume_faces_and_owners_of_cut_cells():
    mesh = cube()
    label = np.random.default_rng(1).integers(0, 4, len(mesh.vertices))
    edges = crossing_edges(mesh, label)
    cut = cut_cells(mesh, edges, np.random.default_rng(2).uniform(0.1, 0.9, len(edges)))
    assert len(cut.mesh) > 2 * len(mesh)
    np.testing.assert_allclose(np.bincount(cut.cell, cut.mesh.volumes, len(mesh)), mesh.volumes, rtol=1e-9)
    np.testing.assert_allclose([outside(mesh), outside(cut.mesh)], 0.06, rtol=1e-9)
    corners = np.concatenate([label, np.full(len(edges), -1)])[cut.mesh.tets]
    most = corners.max(1, keepdims=True)
    assert ((corners == most) | (corners < 0)).all()


def test_cells_far_from_the_cuts_stay_in_their_order():
    mesh = cube()
    label = (mesh.vertices[:, 0] > 0.09).astype(np.int64)
    edges = crossing_edges(mesh, label)[:3]
    cut = cut_cells(mesh, edges, np.full(3, 0.5))
    whole = np.bincount(cut.cell)[cut.cell] == 1
    np.testing.assert_array_equal(cut.mesh.tets[whole], mesh.tets[cut.cell[whole]])
    assert len(cut.mesh.vertices) == len(mesh.vertices) + 3
