"""Is it the same object: p-values of one body are even, those of another are tiny, the grasp may differ."""

from __future__ import annotations

import numpy as np
import pytest
from bench_logs import bench_log

from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.same import NAMES, Comparison, compare
from steelyard.spatial import Pose, Rotation

ALL = np.ones(10, np.bool_)


def found(seed: int, name: str = "mallet") -> Estimate:
    return NoiseAware(bias="none").identify(bench_log(name, "dyn_fast", "moderate", seed, biased=False))


def compared(one: Estimate, other: Estimate, any_grasp: bool = False) -> Comparison:
    known = one.identified & other.identified
    return compare(one.parameters, one.covariance, other.parameters, other.covariance, known, any_grasp)


@pytest.fixture(scope="module")
def runs() -> list[Estimate]:
    return [found(seed) for seed in range(60)]


@pytest.mark.parametrize("any_grasp", [False, True])
def test_p_values_of_one_body_are_spread_evenly(runs: list[Estimate], any_grasp: bool) -> None:
    values = [compared(a, b, any_grasp).p_value for a, b in zip(runs[::2], runs[1::2], strict=True)]
    assert 0.3 < float(np.mean(values)) < 0.7
    assert min(values) > 1e-3
    assert sum(value < 0.5 for value in values) in range(6, 25)


def test_a_body_is_itself(runs: list[Estimate]) -> None:
    same = compared(runs[0], runs[0])
    assert same.p_value == 1
    assert same.same
    assert same.dof == 10
    assert tuple(name for name, _, _ in same.compared) == NAMES


def test_the_order_of_the_two_is_irrelevant(runs: list[Estimate]) -> None:
    one, other = compared(runs[0], runs[1]), compared(runs[1], runs[0])
    assert one.chi2 == pytest.approx(other.chi2, rel=0.05)  # slopes are taken at either body
    assert [gap for _, gap, _ in one.compared] == [-gap for _, gap, _ in other.compared]


@pytest.mark.parametrize("any_grasp", [False, True])
def test_another_object_is_told_apart(runs: list[Estimate], any_grasp: bool) -> None:
    verdict = compared(runs[0], found(0, "hammer"), any_grasp)
    assert verdict.p_value < 1e-12
    assert not verdict.same


def test_two_percent_more_mass_are_told_apart(runs: list[Estimate]) -> None:
    one = runs[0]
    heavier = type(one.parameters)(one.parameters.vector * 1.02)
    assert not compare(one.parameters, one.covariance, heavier, one.covariance, ALL).same


def test_another_grasp_of_one_object(runs: list[Estimate]) -> None:
    X = Pose(Rotation.exp([0.3, -0.8, 1.9]), np.array([0.05, -0.02, 0.1]))
    A = np.stack([type(runs[0].parameters)(unit).in_frame(X).vector for unit in np.eye(10)], axis=1)
    one, other = runs[0], runs[1]
    moved, covariance = other.parameters.in_frame(X), A @ other.covariance @ A.T
    plain = compare(one.parameters, one.covariance, moved, covariance, ALL)
    free = compare(one.parameters, one.covariance, moved, covariance, ALL, any_grasp=True)
    assert not plain.same
    assert free.same
    assert free.dof == 4
    still = compared(one, other, any_grasp=True)
    assert free.chi2 == pytest.approx(still.chi2, rel=1e-6)
    assert free.p_value == pytest.approx(still.p_value, rel=1e-6)


def test_only_what_both_identify_is_compared(runs: list[Estimate]) -> None:
    known = np.array([True, True, False, True] + 6 * [False])
    one, other = runs[:2]
    verdict = compare(one.parameters, one.covariance, other.parameters, other.covariance, known)
    assert [name for name, _, _ in verdict.compared] == ["mass", "com x", "com z"]
    free = compare(one.parameters, one.covariance, other.parameters, other.covariance, known, any_grasp=True)
    assert [name for name, _, _ in free.compared] == ["mass"]


def test_nothing_to_compare(runs: list[Estimate]) -> None:
    one, other = runs[:2]
    with pytest.raises(CannotAnswer) as caught:
        compare(one.parameters, one.covariance, other.parameters, other.covariance, ~ALL)
    text = "Neither mass nor inertia is identified in both results; there is nothing to compare."
    assert str(caught.value) == text


def test_what_is_no_body_or_no_covariance_is_said(runs: list[Estimate]) -> None:
    body, nothing = runs[0].parameters, np.zeros((10, 10))
    with pytest.raises(BadValue, match="mass zero has no centre of mass"):
        compare(type(body)(np.zeros(10)), nothing, body, nothing, ALL)
    with pytest.raises(BadValue, match="must have no negative variance; these have"):
        compare(body, -np.eye(10), body, nothing, ALL)


def test_exact_results_are_the_same_only_if_they_are(runs: list[Estimate]) -> None:
    body, nothing = runs[0].parameters, np.zeros((10, 10))
    assert compare(body, nothing, body, nothing, ALL).p_value == 1
    heavier = type(body)(body.vector * 1.01)
    verdict = compare(body, nothing, heavier, nothing, ALL)
    assert verdict.p_value == 0
    assert dict((name, gap) for name, gap, _ in verdict.compared)["mass"] == pytest.approx(0.01 * float(body.mass))


def test_a_gap_in_a_direction_that_both_know_exactly_counts(runs: list[Estimate]) -> None:
    """As of two answers with one shape: the mass is free, and all else follows it."""
    body = runs[0].parameters
    sharp = np.outer(body.vector, body.vector) * 1e-4
    assert compare(body, sharp, type(body)(1.005 * body.vector), sharp, ALL).p_value > 0.5
    moved = body.in_frame(Pose(Rotation.identity(), np.array([0.002, 0, 0])))
    assert compare(body, sharp, moved, sharp, ALL).p_value < 1e-6
