"""Part masses of a shape that is a scan: what it has wrong must not bend the masses, and the log moves the centre."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.part_masses import PartMasses
from steelyard.identify.shape_error import MEASURED, ShapeError
from steelyard.inertia import solids
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

OFF = np.array([6e-4, -4e-4, 5e-4])


@pytest.fixture(scope="module")
def parts() -> Parts:
    """A heavy head at the end of a light shaft."""
    shaft = solids.box(0.03, 0.2, 0.03, 1.0).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.1, 0.0])))
    head = solids.box(0.12, 0.04, 0.04, 1.0).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.22, 0.01])))
    return Parts(np.arange(2), np.stack([shaft.vector, head.vector]))


def test_a_doubtful_shape_is_put_right_by_the_log(parts: Parts) -> None:
    truth = parts.whole(np.array([0.14, 1.5]))
    seen = parts.in_frame(Pose(Rotation.identity(), OFF))
    log = handling_log(truth, noise="low", seed=3)
    trusted = PartMasses(seen, bias="none", shape_error=MEASURED).identify(log)
    doubted = PartMasses(seen, bias="none", shape_error=ShapeError(com_m=5e-4, inertia_share=0.02)).identify(log)
    assert "part-not-homogeneous" in trusted.codes()  # the shape is wrong by more than a measured one may be
    assert np.abs(doubted.com - truth.com).max() < 1e-4
    assert (np.abs(doubted.com - truth.com) < 3 * doubted.std[1:4]).all()
    assert np.abs(doubted.parameters.inertia_com - truth.inertia_com).max() < 0.04 * np.trace(truth.inertia_com)
    assert "part-not-homogeneous" not in doubted.codes()


def test_without_an_error_the_doubt_costs_little(parts: Parts) -> None:
    truth = parts.whole(np.array([0.14, 1.5]))
    log = handling_log(truth, noise="low", seed=4)
    doubted = PartMasses(parts, bias="none", shape_error=ShapeError(com_m=5e-4, inertia_share=0.02)).identify(log)
    assert np.abs(doubted.com - truth.com).max() < 1e-4
    assert doubted.parameters.validity().consistent
