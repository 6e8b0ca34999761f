"""Two or three still poses: what a fit takes of so few rows must not look like a wrench that no body explains."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

import steelyard as sy
from steelyard.logs.recording import Recording, Stream
from steelyard.spatial import Rotation

MASS, CENTRE = 2.1, np.array([0.012, -0.021, 0.083])
# Rotation vectors, each to a direction of gravity of its own in S.
TURNS = np.radians([[0, 0, 0], [90, 0, 0], [0, 90, 0], [180, 0, 0]])


def weighed(poses: int, seed: int) -> Recording:
    """Return a table of still poses of a load, with the noise of a good wrist sensor."""
    rng = np.random.default_rng(seed)
    turns: NDArray[np.float64] = Rotation.exp(TURNS[:poses]).matrix
    force = MASS * np.einsum("nji,j->ni", turns, [0.0, 0.0, 9.81])
    channels = {
        "rotation": turns,
        "force": force + rng.normal(0, 0.03, force.shape),
        "torque": np.cross(CENTRE, force) + rng.normal(0, 0.002, force.shape),
    }
    return Recording((Stream("poses", channels),), np.array([0, 0, -9.81]), wrench_sign=1)


@pytest.mark.parametrize(("poses", "bias"), [(2, "none"), (3, "none"), (3, "free"), (4, "free")])
def test_perfect_poses_are_explained(poses: int, bias: str) -> None:
    for seed in range(4):
        estimate = sy.identify(weighed(poses, seed), options=sy.Options(bias=bias))  # type: ignore[arg-type]
        assert "wrench-unexplained" not in estimate.codes()
        assert 0.8 < (estimate.evidence.chi2_per_dof or 0) < 1.2


def test_only_a_free_bias_looks_like_a_load() -> None:
    free = sy.identify(weighed(3, 0))
    tared = sy.identify(weighed(3, 0), options=sy.Options(bias="none"))
    assert "nearly-planar" in free.codes()
    assert "nearly-planar" not in tared.codes()
