"""Views that are moved until they agree with the surface they give together: which way there is kept, and when."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from steelyard.shape.carving import carved
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.scene import object_on_table, scene_of
from steelyard.shape.volume import enclose
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build
from steelyard.workshop.finish import painted


@cache
def scanned(tool: str = "pliers") -> Scanned:
    return scan_mesh(painted(build(tool)), 0, count=36)


def volume(scan: Scan) -> float:
    return carved(enclose(scan.cloud), scan.empty).mesh.volume


def test_to_seek_the_object_changes_nothing() -> None:
    scene = scene_of(scanned().views)
    before = dict(vars(scene))
    region = object_on_table(scene)
    assert vars(scene) == before
    assert region.stands.any()
    assert 0 < region.highest < 0.1
    assert np.all(region.mask[region.stands])


@pytest.mark.parametrize("deg", [1.0, 2.0])
def test_views_that_are_turned_about_the_object_are_turned_back(deg: float) -> None:
    views = scanned().views
    up = np.random.default_rng(0).normal(size=(36, 1)) * np.array([0, 0, np.radians(deg)])
    about = np.array([*fuse(views).cloud.xyz.mean(0)[:2], 0.0])
    turn = Rotation.exp(up)
    turned = Pose(turn, about - turn.apply(about)) @ views.X_WC
    found = fuse(views.posed(turned))
    assert found.moved_m is not None
    assert volume(found) == pytest.approx(volume(fuse(views)), rel=0.04)
