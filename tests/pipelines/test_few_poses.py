"""Two or three still poses: what a fit takes of so few rows must not look like a wrench that no body explains."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from numpy.typing import NDArray

import steelyard as sy
from steelyard.errors import CannotAnswer
from steelyard.logs.recording import Recording, Stream
from steelyard.spatial import Rotation

MASS, CENTRE = 2.1, np.array([0.012, -0.021, 0.083])
# Rotation vectors, each to a direction of gravity of its own in S.
TURNS = np.radians([[0, 0, 0], [90, 0, 0], [0, 90, 0], [180, 0, 0]])


def weighed(poses: int, seed: int, loud: float = 1.0) -> Recording:
    """Return a table of still poses of a load, with so many times the noise of a good wrist sensor."""
    rng = np.random.default_rng(seed)
    turns: NDArray[np.float64] = Rotation.exp(TURNS[:poses]).matrix
    force = MASS * np.einsum("nji,j->ni", turns, [0.0, 0.0, 9.81])
    channels = {
        "rotation": turns,
        "force": force + rng.normal(0, 0.03 * loud, force.shape),
        "torque": np.cross(CENTRE, force) + rng.normal(0, 0.002 * loud, force.shape),
    }
    return Recording((Stream("poses", channels),), np.array([0, 0, -9.81]), wrench_sign=1)


@pytest.mark.parametrize(("poses", "bias"), [(2, "none"), (3, "none"), (3, "free"), (4, "free")])
def test_perfect_poses_are_explained(poses: int, bias: str) -> None:
    for seed in range(4):
        estimate = sy.identify(weighed(poses, seed), options=sy.Options(bias=bias))  # type: ignore[arg-type]
        assert "wrench-unexplained" not in estimate.codes()
        assert not any("no stream measures" in note for note in estimate.notes)
        assert 0.8 < (estimate.evidence.chi2_per_dof or 0) < 1.2


@pytest.mark.parametrize("loud", [1.0, 5.0])
def test_only_a_free_bias_looks_like_a_load(loud: float) -> None:
    free = sy.identify(weighed(3, 0, loud))
    tared = sy.identify(weighed(3, 0, loud), options=sy.Options(bias="none"))
    assert "nearly-planar" in free.codes()
    assert "nearly-planar" not in tared.codes()


def test_what_looks_like_a_load_does_no_harm_where_bars_are_small() -> None:
    assert "nearly-planar" not in sy.identify(weighed(3, 0, 0.03)).codes()


def untared(poses: int, seed: int, force: float) -> Recording:
    """Return the table as a sensor shows it that reads `force` [N] on every axis without a load."""
    made = weighed(poses, seed)
    (table,) = made.streams
    channels = {**table.channels, "force": np.array(table.channels["force"]) + force}
    return replace(made, streams=(replace(table, channels=channels),))


@pytest.mark.parametrize("force", [0.3, -5.0])
def test_a_sensor_that_is_not_tared_is_named(force: float) -> None:
    found = sy.identify(untared(4, 0, force), sy.Options(bias="none"))
    (told,) = (finding for finding in found.findings if finding.code == "wrench-unexplained")
    assert told.message.startswith(f"The sensor is not tared: it reads up to {abs(force):.1g}")
    assert told.remedy == "Leave out --bias none, or tare the sensor without a load before."


@pytest.mark.parametrize("poses", [2, 3, 4])
def test_a_tared_sensor_is_believed(poses: int) -> None:
    for seed in range(40):
        assert "wrench-unexplained" not in sy.identify(weighed(poses, seed), sy.Options(bias="none")).codes()


def test_a_refusal_says_that_a_bias_would_answer() -> None:
    with pytest.raises(CannotAnswer, match=r"With a bias estimated the data answer: leave out --bias none\.$"):
        sy.identify(untared(4, 0, 60.0), sy.Options(bias="none"))
