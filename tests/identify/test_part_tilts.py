"""The compiled core of freed parts: modes against SciPy, the score against evidence in closed form, points inside."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import minimize

from steelyard.identify.masses import tilting
from steelyard.identify.masses.profiles import FEATURES, Profile
from steelyard.shape.inside import inside
from steelyard.workshop.catalogue import build

CENTRE = float(np.log(2500.0))


def problem():
    parts = build("rubber-mallet").parts
    rng = np.random.default_rng(3)
    root = rng.normal(size=(10, 10))
    size = 0.02 * 3000 * parts.volume.sum() * np.repeat([1.0, 0.1, 0.01], [1, 3, 6])
    information = root @ root.T / np.outer(size, size)
    profile = Profile.of(parts, 1)
    b, _ = profile.tilted(0.4 * rng.normal(size=FEATURES))
    truth = parts.per_mass.copy()
    truth[:, 1] = b
    pull = information @ truth @ (parts.volume * 3000)
    return parts, profile, information, pull


def test_the_mode_is_that_of_a_general_minimiser() -> None:
    parts, profile, information, pull = problem()
    variance, precision = np.full(FEATURES, 0.25), np.eye(2) / 0.1
    y0 = np.full(2, CENTRE)

    def cost(x):
        b, _ = profile.tilted(x[2:])
        B = parts.per_mass.copy()
        B[:, 1] = b
        phi = B @ (parts.volume * np.exp(np.minimum(x[:2], 20)))
        return (
            0.5 * phi @ information @ phi
            - pull @ phi
            + 0.5 * (x[:2] - CENTRE) @ precision @ (x[:2] - CENTRE)
            + 0.5 * (x[2:] ** 2 / variance).sum()
        )

    seen = tilting.Seen(information, pull, parts.per_mass, parts.volume, precision, CENTRE)
    free = tilting.Free(np.array([1]), variance, profile.weight[None], profile.features[None], profile.per_mass[None])
    y, tilts, found, *_ = tilting.fitted(seen, free, y0, np.zeros(FEATURES))
    start = np.concatenate([y0, np.zeros(FEATURES)])
    other = minimize(cost, start, method="BFGS", options={"gtol": 1e-6})
    assert cost(np.concatenate([y, tilts])) == pytest.approx(found, rel=1e-9)
    assert found < other.fun + 1e-2
    assert found < cost(start) - 1.0


def test_the_score_is_the_evidence_of_a_linear_model() -> None:
    rng = np.random.default_rng(5)
    root, J = rng.normal(size=(10, 10)), rng.normal(size=(10, 3))
    information, prior = root @ root.T, np.diag([1.0, 2.0, 3.0])
    slope, width = rng.normal(size=(1, 10, FEATURES)), np.full(FEATURES, 0.3)
    pull = rng.normal(size=10)

    def evidence(columns, precision):
        H = columns.T @ information @ columns + precision
        g = columns.T @ pull
        return 0.5 * g @ np.linalg.solve(H, g) - 0.5 * np.linalg.slogdet(H)[1] + 0.5 * np.linalg.slogdet(precision)[1]

    H = J.T @ information @ J + prior
    phi = J @ np.linalg.solve(H, J.T @ pull)
    masses = np.array([2.0])
    both = np.block([[prior, np.zeros((3, FEATURES))], [np.zeros((FEATURES, 3)), np.diag(width**-2)]])
    expected = evidence(np.hstack([J, 2 * slope[0]]), both) - evidence(J, prior)
    found = tilting.scores(information, pull, phi, J, H, masses, slope, width[None])
    assert found[0, 0] == pytest.approx(expected, rel=1e-9)


def test_points_inside_stand_for_the_volume_and_its_centre() -> None:
    tool = build("hammer")
    parts = tool.parts
    assert parts.interior is not None
    mesh = parts.interior.mesh
    points, volume = inside(mesh, 4000)
    assert volume.sum() == pytest.approx(parts.volume.sum(), rel=0.02)
    centre = parts.moments[:, 1:4].sum(0) / parts.volume.sum()
    np.testing.assert_allclose(volume @ points / volume.sum(), centre, atol=2e-3)
    again = parts.interior.points(0, 150)
    assert parts.interior.points(0, 150)[1] is again[1]
