"""Scores against closed forms."""

import numpy as np
import pytest
from scipy.linalg import eigh

from steelyard import evaluate
from steelyard.inertia import InertialParameters, solids
from steelyard.spatial import Pose, Rotation

EDGES = np.array([0.1, 0.2, 0.4])
BOUNDS = np.array([[0, 0, 0], EDGES])
BODY = solids.box(*EDGES, 1000.0).in_frame(Pose(Rotation.identity(), EDGES / 2))


def random_bodies(seed, count):
    theta = np.random.default_rng(seed).normal(0, 0.5, (count, 10))
    return InertialParameters.from_log_cholesky(theta)


def test_truth_scores_zero():
    found = evaluate.score(BODY, BODY, BOUNDS)
    assert (found.mass_pct, found.com_mm, found.com_pct, found.inertia_pct) == (0, 0, 0, 0)
    assert found.riemannian == pytest.approx(0, abs=1e-12)
    assert found.consistent


def test_mass_and_centre_of_mass_in_their_units():
    com = BODY.com + np.array([0.001, 0.002, -0.002])
    moved = InertialParameters.from_com(1.02 * BODY.mass, com, BODY.inertia_com)
    found = evaluate.score(moved, BODY, BOUNDS)
    assert found.mass_pct == pytest.approx(2)
    assert found.com_mm == pytest.approx(3)
    assert found.com_pct == pytest.approx((1 + 1 + 0.5) / 3)


def test_centre_of_mass_percent_is_not_truncated():
    moved = InertialParameters.from_com(BODY.mass, BODY.com + 0.004 * EDGES, BODY.inertia_com)
    assert evaluate.com_pct(moved, BODY, EDGES) == pytest.approx(0.4)


def test_inertia_scale_is_the_box_inertia():
    scale = evaluate.inertia_scale(BODY.mass, EDGES)
    np.testing.assert_allclose(scale[[0, 3, 5]], np.diag(BODY.inertia_com), rtol=1e-12)
    np.testing.assert_allclose(scale[1], -BODY.mass / 12 * EDGES[0] * EDGES[1])


def test_inertia_error_is_the_mean_of_six_entries_about_the_sensor():
    scale = evaluate.inertia_scale(BODY.mass, EDGES)
    change = np.array([0.01, -0.02, 0.03, -0.04, 0.05, 0.06]) * scale
    found = InertialParameters(BODY.vector + np.concatenate([np.zeros(4), change]))
    assert evaluate.inertia_pct(found, BODY, EDGES) == pytest.approx(3.5)


def test_riemannian_of_a_scaled_body_is_known():
    heavier = InertialParameters(1.5 * BODY.vector)
    assert evaluate.riemannian(heavier, BODY) == pytest.approx(np.sqrt(2) * np.log(1.5))


def test_riemannian_is_a_metric_that_does_not_see_frames():
    one, two, three = random_bodies(1, 3)[:, None].vector
    one, two, three = (InertialParameters(v[0]) for v in (one, two, three))
    here = evaluate.riemannian(one, two)
    assert here == pytest.approx(evaluate.riemannian(two, one))
    assert here <= evaluate.riemannian(one, three) + evaluate.riemannian(three, two)
    away = Pose(Rotation.exp([0.3, -0.5, 0.9]), np.array([0.3, 0.1, -0.7]))
    assert evaluate.riemannian(one.in_frame(away), two.in_frame(away)) == pytest.approx(here)
    stretch = np.diag([1000.0, 1000.0, 1000.0, 1.0])
    scaled = (InertialParameters.from_pseudo_inertia(stretch @ b.pseudo_inertia @ stretch) for b in (one, two))
    assert evaluate.riemannian(*scaled) == pytest.approx(here)


def test_riemannian_batch_agrees_with_generalised_eigenvalues():
    found, true = random_bodies(2, 6), random_bodies(3, 6)
    expected = [
        np.sqrt(0.5 * np.sum(np.log(eigh(t.pseudo_inertia, f.pseudo_inertia, eigvals_only=True)) ** 2))
        for f, t in ((found[i], true[i]) for i in range(6))
    ]
    np.testing.assert_allclose(evaluate.riemannian(found, true), expected, rtol=1e-9)


def test_inconsistent_body_has_no_distance():
    broken = InertialParameters(BODY.vector * np.array([1, 1, 1, 1, -1, 1, 1, 1, 1, 1]))
    found = evaluate.score(broken, BODY, BOUNDS)
    assert not found.consistent
    assert found.riemannian is None
    assert found.inertia_pct > 0
