"""Views that are moved until they agree with the surface they give together: which way there is kept, and when."""

from __future__ import annotations

from functools import cache

import numpy as np

from steelyard.shape.scene import object_on_table, scene_of
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.workshop.catalogue import build
from steelyard.workshop.finish import painted


@cache
def pliers() -> Scanned:
    return scan_mesh(painted(build("pliers")), 0, count=36)


def test_to_seek_the_object_changes_nothing() -> None:
    scene = scene_of(pliers().views)
    before = dict(vars(scene))
    region = object_on_table(scene)
    assert vars(scene) == before
    assert region.stands.any()
    assert 0 < region.highest < 0.1
    assert np.all(region.mask[region.stands])
