"""Moments: the statistic equals the plain sum, adds, scales, and refuses what it cannot add."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steelyard.errors import BadValue
from steelyard.identify.noise_aware import NoiseAware
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments, features
from steelyard.simulate.logs import simulate_log

QUIET, LOUD = Noise.of_std(0.1, 0.01, 0.02, 0.001), Noise.of_std(0.8, 0.1, 0.3, 0.01)


def random_log(rows: int, seed: int = 0, run: int = 1) -> MotionLog:
    """Rows of random numbers in 2 classes, still or not, poses -1 to 3; groups change every `run` rows."""
    rng = np.random.default_rng(seed)
    label = np.repeat(rng.integers(0, 20, -(-rows // run)), run)[:rows]
    return MotionLog(
        wrench=rng.normal(size=(rows, 6)),
        gravity=rng.normal(size=(rows, 3)) * 9.81,
        acceleration=rng.normal(size=(rows, 3)),
        angular_velocity=rng.normal(size=(rows, 3)),
        angular_acceleration=rng.normal(size=(rows, 3)),
        still=label % 2 == 1,
        pose=label % 5 - 1,
        noise_class=(label >= 10).astype(np.int64),
        noise=(QUIET, LOUD),
    )


def plain_features(log: MotionLog) -> np.ndarray:
    """z (N, 19) row by row, as section 4 of the design writes it."""
    rows = []
    for n in range(len(log)):
        w = log.angular_velocity[n]
        squares = np.outer(w, w)[np.triu_indices(3)]
        rows.append(
            np.concatenate(
                [log.angular_acceleration[n], log.acceleration[n] - log.gravity[n], squares, log.wrench[n], [1]]
            )
        )
    return np.array(rows)


def sizes(matrix: np.ndarray) -> np.ndarray:
    """The natural size of every entry: the product of the norms of its two columns."""
    root = np.sqrt(np.diag(matrix))
    return np.outer(root, root)


@pytest.mark.parametrize("run", [1, 7, 400])
@pytest.mark.parametrize("rows", [1, 2, 127, 128, 129, 1000])
def test_equals_the_plain_sum_in_every_group(rows: int, run: int) -> None:
    log = random_log(rows, run=run)
    z = plain_features(log)
    moments = Moments.of_log(log)
    np.testing.assert_allclose(features(log), z, rtol=1e-15)
    keys = list(zip(moments.noise_class, moments.still, moments.block, strict=True))
    assert len(set(keys)) == len(keys)
    there = set(zip(log.noise_class.tolist(), log.still.tolist(), log.pose.tolist(), strict=True))
    assert {(int(c), bool(s), int(b)) for c, s, b in keys} == there
    for scatter, (c, s, b) in zip(moments.scatter, keys, strict=True):
        chosen = z[(log.noise_class == c) & (log.still == s) & (log.pose == b)]
        expected = chosen.T @ chosen
        assert (np.abs(scatter - expected) <= 1e-13 * sizes(expected)).all()
        assert np.array_equal(scatter, scatter.T)
    assert moments.samples == rows
    assert moments.noise == (QUIET, LOUD)


@given(seed=st.integers(0, 1000))
def test_order_of_rows_is_irrelevant(seed: int) -> None:
    log = random_log(300, seed, run=40)
    one = Moments.of_log(log)
    other = Moments.of_log(log.rows(np.random.default_rng(seed).permutation(300)))
    for name in ("noise_class", "block", "still"):
        assert np.array_equal(getattr(one, name), getattr(other, name))
    assert (np.abs(one.scatter - other.scatter) <= 1e-13 * sizes(one.sum)).all()


def test_without_blocks_there_is_one_group_per_class_and_stillness() -> None:
    log = random_log(800, run=5)
    coarse, fine = Moments.of_log(log, by_block=False), Moments.of_log(log)
    assert (coarse.block == -1).all()
    groups = list(zip(coarse.noise_class, coarse.still, strict=True))
    assert len(set(groups)) == len(groups)
    for scatter, (kind, still) in zip(coarse.scatter, groups, strict=True):
        summed = fine.where((fine.noise_class == kind) & (fine.still == still)).sum
        np.testing.assert_allclose(summed, scatter, rtol=0, atol=1e-12 * np.abs(coarse.sum).max())
    assert coarse.counts.sum() == 800


def test_a_thousand_chunks_are_the_whole_log() -> None:
    log, _ = simulate_log("mallet", "stop_go", "moderate", 0, shuffled=False, bias=[0.1, 0, 0.2, 3, 1, -2])
    log = replace(log, still=log.still, noise=(log.noise[0],))
    whole = Moments.of_log(log)
    chunks = [Moments.of_log(log.rows(chunk)) for chunk in np.array_split(np.arange(len(log)), 1000)]
    assert len(chunks) == 1000
    total = Moments.total(chunks)
    assert (np.abs(total.sum - whole.sum) <= 1e-9 * sizes(whole.sum)).all()
    one, other = NoiseAware().solve(whole), NoiseAware().solve(total)
    assert float(np.abs(one.parameters.vector / other.parameters.vector - 1).max()) < 1e-9
    np.testing.assert_allclose(one.std, other.std, rtol=1e-7)
    np.testing.assert_allclose(one.wrench_bias, other.wrench_bias, rtol=1e-9, atol=1e-9)


def test_a_long_log_in_a_thousand_chunks() -> None:
    log, _ = simulate_log("hammer", "stop_go", "high", 1, shuffled=False, repeats=50)
    whole = Moments.of_log(log)
    chunks = [Moments.of_log(log.rows(slice(50 * k, 50 * k + 50))) for k in range(1000)]
    one, other = NoiseAware().solve(whole), NoiseAware().solve(Moments.total(chunks))
    assert float(np.abs(one.parameters.vector - other.parameters.vector).max()) < 1e-9 * one.mass


def test_adding_is_commutative_associative_and_adds_the_counts() -> None:
    a, b, c = (Moments.of_log(random_log(100 + k, k)) for k in range(3))
    left, right = (a + b) + c, a + (c + b)
    for name in ("noise_class", "block", "still"):
        assert np.array_equal(getattr(left, name), getattr(right, name))
    np.testing.assert_allclose(left.scatter, right.scatter, rtol=1e-12, atol=1e-10)
    assert left.samples == 303
    np.testing.assert_allclose(left.sum, a.sum + b.sum + c.sum, rtol=1e-12, atol=1e-10)


def test_scaled_weighs_every_row() -> None:
    log = random_log(200)
    moments = Moments.of_log(log)
    np.testing.assert_array_equal(moments.scaled(0.25).scatter, 0.25 * moments.scatter)
    assert moments.scaled(0.25).samples == pytest.approx(50)
    np.testing.assert_allclose((moments.scaled(2.0)).sum, (moments + moments).sum)


def test_where_keeps_groups() -> None:
    moments = Moments.of_log(random_log(500))
    still, moving = moments.where(moments.still), moments.where(~moments.still)
    assert still.still.all()
    assert not moving.still.any()
    assert still.samples + moving.samples == 500
    np.testing.assert_allclose((still + moving).scatter, moments.scatter)


DIFFERENT = "Statistics can be added only where their noise classes are the same; these differ."


@pytest.mark.parametrize("noise", [None, (QUIET,), (QUIET, QUIET), (LOUD, QUIET)])
def test_different_noise_is_not_added(noise: tuple[Noise, ...] | None) -> None:
    log = replace(random_log(50), noise_class=np.zeros(50, np.int64))
    one, other = Moments.of_log(log), Moments.of_log(replace(log, noise=noise))
    for pair in ((one, other), (other, one)):
        with pytest.raises(BadValue) as caught:
            Moments.total(pair)
        assert str(caught.value) == DIFFERENT


def test_equal_noise_of_another_object_is_added() -> None:
    log = random_log(50)
    again = tuple(Noise(np.array(n.acceleration), np.array(n.wrench)) for n in (QUIET, LOUD))
    assert (Moments.of_log(log) + Moments.of_log(replace(log, noise=again))).samples == 100


def test_nothing_to_add() -> None:
    with pytest.raises(BadValue) as caught:
        Moments.total([])
    assert str(caught.value) == "There must be at least one statistic to add; got none."


def test_empty_log() -> None:
    empty, full = Moments.of_log(random_log(0)), Moments.of_log(random_log(30))
    assert empty.scatter.shape == (0, 19, 19)
    assert empty.samples == 0
    assert not empty.sum.any()
    assert np.array_equal((empty + full).scatter, full.scatter)
    assert (empty + empty).samples == 0
