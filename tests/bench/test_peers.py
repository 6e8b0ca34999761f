"""The peers get the right equations: without noise each finds the truth (where they are installed)."""

import numpy as np
import pytest

from steelyard import evaluate
from steelyard.bench.logs import peers
from steelyard.inertia.regressor import basis
from steelyard.simulate import bounds, simulate_log

METHODS, NOTES = peers.peer_methods()
needs_pinocchio = pytest.mark.skipif("pinocchio-ols" not in METHODS, reason="Pinocchio is not installed")
needs_rigeo = pytest.mark.skipif("rigeo-psd" not in METHODS, reason="rigeo is not installed")


def expected_rows(log):
    """Our own regressor (N, 6, 10), rows [tau, f]."""
    x, y, z = log.angular_velocity.T
    squares = np.stack([x * x, x * y, x * z, y * y, y * z, z * z], 1)
    features = np.concatenate([log.angular_acceleration, log.acceleration - log.gravity, squares], 1)
    return np.einsum("pij,nj->nip", basis(), features)


@pytest.mark.parametrize(
    "row",
    [
        pytest.param("_pinocchio_row", marks=needs_pinocchio),
        pytest.param("_rigeo_row", marks=needs_rigeo),
    ],
)
def test_regressors_agree_with_ours(row):
    log, _ = simulate_log("drill", "dyn_fast", "none", 0)
    log = log.rows(slice(0, 20))
    stacked = peers._stacked(log, getattr(peers, row), whiten=False)
    np.testing.assert_allclose(stacked.matrix.reshape(-1, 6, 10), expected_rows(log), atol=1e-12)


@pytest.mark.parametrize(
    ("name", "tolerance"),
    [
        pytest.param("pinocchio-ols", 1e-6, marks=needs_pinocchio),
        pytest.param("pinocchio-log-cholesky", 1e-3, marks=needs_pinocchio),
        pytest.param("rigeo-psd", 0.1, marks=needs_rigeo),
    ],
)
def test_truth_is_found_without_noise(name, tolerance):
    log, true = simulate_log("drill", "dyn_fast", "none", 0)
    found = evaluate.score(METHODS[name].identify(log), true, bounds("drill"))
    assert found.mass_pct < tolerance
    assert found.inertia_pct < tolerance


@needs_rigeo
def test_prior_keeps_the_answer_inside():
    log, _ = simulate_log("screwdriver", "dyn_slow", "high", 0)
    found = {name: METHODS[name].identify(log) for name in ("rigeo-psd", "rigeo-entropic")}
    least = {name: float(np.linalg.eigvalsh(body.pseudo_inertia)[0]) for name, body in found.items()}
    assert least["rigeo-entropic"] > max(0.0, 10 * least["rigeo-psd"])


def test_compression_keeps_the_least_squares_answer():
    rng = np.random.default_rng(0)
    system = peers.System(rng.normal(size=(60, 10)), rng.normal(size=60), 10)
    whole, ten = peers._ordinary(system), peers._ordinary(system.compressed())
    np.testing.assert_allclose(ten.vector, whole.vector, atol=1e-12)
