"""The rivals of the held-object table: HPS as published, point masses, and GEO with the shape as prior."""

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.evaluate import riemannian
from steelyard.identify.geodesic_shape import ShapeGeodesic, published_prior
from steelyard.identify.part_masses_published import PublishedPartMasses
from steelyard.identify.point_masses import PointMasses
from steelyard.inertia import InertialParameters, solids
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

CENTRES = np.array([[0.0, 0.02, 0.1], [0.04, 0.0, 0.16], [-0.05, -0.03, 0.2], [0.01, 0.06, 0.24], [-0.02, 0.01, 0.3]])
SIZES = np.array([[0.03, 0.04, 0.05], [0.06, 0.02, 0.03], [0.02, 0.05, 0.04], [0.03, 0.03, 0.03], [0.04, 0.02, 0.06]])
MASSES = np.array([0.3, 0.1, 0.5, 0.2, 0.4])


def boxes(count):
    moments = [
        solids.box(*size, 1.0).in_frame(Pose(Rotation.identity(), centre)).vector
        for size, centre in zip(SIZES[:count], CENTRES[:count], strict=True)
    ]
    return Parts(np.arange(count), np.stack(moments))


def object_of(count):
    parts = boxes(count)
    return parts, parts.whole(MASSES[:count])


def test_hps_recovers_four_parts_at_rest_without_noise():
    parts, body = object_of(4)
    found = PublishedPartMasses(parts).identify(handling_log(body, "static", "none"))
    np.testing.assert_allclose([p.mass for p in found.parts], MASSES[:4], rtol=1e-6)
    np.testing.assert_allclose(found.parameters.vector, body.vector, atol=1e-6)
    assert found.evidence.rank == 4
    assert not found.covariance.any()


def test_hps_takes_more_than_four_parts_and_tells_the_rank():
    parts, body = object_of(5)
    found = PublishedPartMasses(parts).identify(handling_log(body, "static", "none"))
    assert found.evidence.rank == 4
    assert len(found.parts) == 5
    assert found.mass == pytest.approx(float(body.mass))
    np.testing.assert_allclose(found.com, body.com, atol=1e-9)


def test_hps_leaves_out_the_acceleration_of_the_rows_it_uses():
    parts, body = object_of(4)
    found = PublishedPartMasses(parts).identify(handling_log(body, "paper", "none"))
    assert 1e-5 < riemannian(found.parameters, body) < 0.2


def test_hps_gates_on_the_noisy_acceleration():
    parts, body = object_of(4)
    quiet, loud = (handling_log(body, "static", noise) for noise in ("none", "high"))
    hps = PublishedPartMasses(parts)
    assert hps.rows(quiet).all()
    # The length of three standard normals is below 1 in 19.9 % of the draws.
    assert hps.rows(loud).mean() == pytest.approx(0.199, abs=0.04)
    assert hps.identify(loud).evidence.samples == hps.rows(loud).sum()


def test_hps_masses_are_never_negative_and_their_spread_is_that_of_the_noise():
    parts, body = object_of(4)
    hps = PublishedPartMasses(parts)
    found = [hps.identify(handling_log(body, "static", "low", seed=seed)) for seed in range(200)]
    masses = np.array([[p.mass for p in estimate.parts] for estimate in found])
    assert (masses >= 0).all()
    std = np.array([[p.std for p in estimate.parts] for estimate in found])
    np.testing.assert_allclose(masses.std(0), std.mean(0), rtol=0.2)


def test_hps_says_what_stops_it():
    parts, body = object_of(2)
    log = handling_log(body, "static", "none")
    with pytest.raises(CannotAnswer, match="No row has both accelerations below 1"):
        PublishedPartMasses(parts).identify(replace(log, acceleration=log.acceleration + 2))
    with pytest.raises(CannotAnswer, match="no part carries mass"):
        PublishedPartMasses(parts).identify(replace(log, wrench=-log.wrench))


def grid(parts):
    lattice = np.stack(np.meshgrid(*[np.linspace(-0.5, 0.5, 5)] * 3, indexing="ij"), -1).reshape(-1, 3)
    return np.concatenate([centre + size * lattice for centre, size in zip(CENTRES, SIZES, strict=True)][: len(parts)])


def test_point_masses_match_the_wrench_and_are_always_a_body():
    parts, body = object_of(4)
    estimator = PointMasses(grid(parts))
    exact = estimator.identify(handling_log(body, "paper", "none")).parameters
    np.testing.assert_allclose(exact.vector, body.vector, atol=1e-6)
    for noise in ("low", "high"):
        found = estimator.identify(handling_log(body, "paper", noise)).parameters
        assert np.linalg.eigvalsh(found.pseudo_inertia)[0] >= -1e-12
        assert float(found.mass) == pytest.approx(float(body.mass), rel=0.05)


def test_point_masses_need_a_shape():
    with pytest.raises(BadValue, match="at least 4 points"):
        PointMasses(np.zeros((3, 3)))


def test_geo_with_the_shape_is_nearly_exact_for_one_density():
    parts = boxes(4)
    body = parts.uniform(1.1)
    log = handling_log(body, "paper", "high")
    for mass, weighted in ((None, False), (1.1, False), (None, True)):
        found = ShapeGeodesic(parts.uniform(), mass, weighted=weighted).identify(log)
        assert riemannian(found.parameters, body) < 0.25
    assert parts.uniform(1.1).mass == pytest.approx(1.1)


def test_published_prior_has_the_parallel_axis_term_twice():
    points = np.array([[0.0, 0.0, 0.1], [0.1, 0.0, 0.2], [0.0, 0.1, 0.3], [0.05, 0.05, 0.2]])
    right = InertialParameters.from_point_masses(np.full(4, 0.25), points)
    wrong = published_prior(points)
    assert wrong.mass == 1.0
    np.testing.assert_allclose(wrong.com, right.com)
    moved = InertialParameters.from_com(1.0, right.com, np.zeros((3, 3)))
    np.testing.assert_allclose(wrong.vector[4:], (right + moved).vector[4:])
