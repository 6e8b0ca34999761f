"""Nothing hangs on how a cloud was given: turned, moved and in another order it becomes the same solid."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.shape.canonical import canonical
from steelyard.shape.cloud import Cloud
from steelyard.shape.volume import enclose
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build
from steelyard.workshop.sampling import surface_cloud


@pytest.mark.parametrize("seed", range(3))
def test_the_frame_belongs_to_the_points(seed: int) -> None:
    rng = np.random.default_rng(seed)
    xyz = rng.gamma(2.0, [0.05, 0.03, 0.01], (200, 3))
    moved, rows = Pose(Rotation.exp(rng.normal(size=3)), rng.normal(size=3)), rng.permutation(200)
    (X, order), (Y, other) = canonical(xyz), canonical(moved.apply(xyz)[rows])
    np.testing.assert_allclose(X.apply(xyz[order]), Y.apply(moved.apply(xyz)[rows][other]), atol=1e-14)
    assert np.array_equal(order, rows[other])
    assert np.linalg.det(X.rotation.matrix) == pytest.approx(1)
    assert (np.diff(np.std(X.apply(xyz), axis=0)) < 0).all()


def test_a_turned_cloud_in_another_order_becomes_the_same_solid() -> None:
    cloud = surface_cloud(build("adjustable-wrench"))
    bare = Cloud(cloud.xyz)
    rng = np.random.default_rng(5)
    rows = rng.permutation(len(bare))
    turned = bare.in_frame(Pose(Rotation.exp(rng.normal(size=3)), rng.normal(size=3))).chosen(rows)
    first, second = enclose(bare), enclose(turned)
    assert second.mesh.volume == pytest.approx(first.mesh.volume, rel=1e-9)
    same = {frozenset(tet) for tet in first.mesh.tets.tolist()}
    again = {frozenset(tet) for tet in rows[second.mesh.tets].tolist()}
    assert len(same & again) > 0.999 * len(same)
    assert np.array_equal(first.cloud.xyz, bare.xyz)
