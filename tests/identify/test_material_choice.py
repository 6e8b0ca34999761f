"""Which material each part is made of: draws against all choices, many parts, one that no prior may decide."""

from __future__ import annotations

import itertools
from math import log

import numpy as np
import pytest

from steelyard.identify.masses import material_choice
from steelyard.identify.masses.material_choice import Choices, choose
from steelyard.identify.masses.material_sampling import material_prior
from steelyard.identify.masses.models import Masses
from steelyard.parts.material import Material

LIST = (
    Material("steel", 7820, 0.01),
    Material("zinc", 6600, 0.01),
    Material("brass", 8500, 0.01),
    Material("aluminium", 2700, 0.01),
    Material("PVC", 1360, 0.03),
    Material("ABS", 1050, 0.02),
    Material("rubber", 1150, 0.05),
)
DENSITY = np.array([m.density for m in LIST])
TOLERANCE = np.array([m.tolerance for m in LIST])


def data_of(mass: np.ndarray, seen: int, error: float, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return A and b of a log that sees `seen` combinations of the masses, each up to an error [kg]."""
    R = rng.normal(size=(seen, len(mass))) / error
    return R.T @ R, R.T @ (R @ mass + rng.normal(size=seen))


def listed(A: np.ndarray, b: np.ndarray, volume: np.ndarray, materials: tuple[Material, ...]) -> tuple[Masses, Choices]:
    found = choose(A, b, volume, materials, volume * DENSITY.mean())
    mean, covariance = found.mixture()
    return Masses(mean, covariance), found


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("error", [1e-4, 5e-3])
def test_draws_are_as_likely_as_all_choices_say(seed: int, error: float, monkeypatch: pytest.MonkeyPatch) -> None:
    """The search is checked against trying them all."""
    rng = np.random.default_rng(seed)
    volume = rng.uniform(2e-6, 2e-5, 5)
    A, b = data_of(volume * DENSITY[rng.integers(0, 4, 5)], 4, error, rng)
    all_masses, every = listed(A, b, volume, LIST[:4])
    monkeypatch.setattr(material_choice, "EXHAUSTIVE", 0)
    masses, drawn = listed(A, b, volume, LIST[:4])
    assert len(every.chosen) == 4**5
    np.testing.assert_allclose(drawn.shares(4), every.shares(4), atol=0.1)
    for k in range(4):
        np.testing.assert_allclose(drawn.doubt @ (drawn.chosen == k), every.doubt @ (every.chosen == k), atol=0.1)
    all_std = np.sqrt(np.diag(all_masses.covariance))
    assert (np.abs(masses.mean - all_masses.mean) < 0.3 * all_std).all()
    # Whatever fits is found, however little the prior makes of it; what has a share near the limit may fall either way.
    clear = np.abs(every.shares(4) - material_choice.POSSIBLE) > 0.04
    np.testing.assert_array_equal(drawn.possible(4)[clear], every.possible(4)[clear])


@pytest.mark.parametrize("seen", [4, 9])
def test_many_parts_of_many_materials_are_no_surer_than_they_are(seen: int) -> None:
    """Few materials are likelier, but where many fit as well bars and ties say so."""
    wrong_alone, beyond, right, z = 0, 0, 0, []
    for seed in range(15):
        rng = np.random.default_rng(seed)
        volume = np.exp(rng.uniform(np.log(5e-7), np.log(4e-5), 9))
        true = rng.permutation(np.concatenate([np.arange(7), rng.integers(0, 7, 2)]))
        mass = volume * DENSITY[true] * (1 + 0.3 * TOLERANCE[true] * rng.normal(size=9))
        A, b = data_of(mass, seen, 1e-3, rng)
        masses, found = listed(A, b, volume, LIST)
        off = (masses.mean - mass) / np.sqrt(np.diag(masses.covariance))
        picked, alone = found.shares(7).argmax(1), found.possible(7).sum(1) == 1
        wrong_alone += int((alone & (picked != true)).sum())
        beyond += int((np.abs(off) > 3).sum())
        right += int(found.possible(7)[np.arange(9), true].sum())
        z.append(off)
    assert wrong_alone <= 1
    assert beyond <= 2
    assert right >= 0.97 * 15 * 9
    assert 0.4 < np.sqrt(np.mean(np.square(z))) < 1.2


def test_same_input_same_choice() -> None:
    rng = np.random.default_rng(1)
    volume = rng.uniform(2e-6, 2e-5, 9)
    A, b = data_of(volume * DENSITY[rng.integers(0, 7, 9)], 6, 1e-4, rng)
    one, two = (listed(A, b, volume, LIST)[0] for _ in range(2))
    np.testing.assert_array_equal(one.mean, two.mean)
    np.testing.assert_array_equal(one.covariance, two.covariance)


def test_a_part_that_the_log_fixes_alone_has_one_material() -> None:
    volume = np.full(9, 1e-5)
    true = np.array([0, 1, 2, 3, 4, 6, 0, 1, 3])
    R = np.eye(9) / 1e-5
    masses, found = listed(R.T @ R, R.T @ R @ (volume * DENSITY[true]), volume, LIST)
    np.testing.assert_array_equal(found.shares(7).argmax(1), true)
    assert (found.possible(7).sum(1) == 1).all()
    np.testing.assert_allclose(masses.mean, volume * DENSITY[true], rtol=1e-3)


def test_more_materials_than_parts_keep_the_prior() -> None:
    """The number of a material is not its place among those in use."""
    counts = [np.bincount(choice, minlength=6) for choice in itertools.product(range(6), repeat=3)]
    odds = np.exp([material_prior(count) for count in counts])
    odds /= odds.sum()
    assert odds[[count.max() == 3 for count in counts]].sum() == pytest.approx(2 / 6)
    assert odds[[count.max() == 1 for count in counts]].sum() == pytest.approx(1 / 6)
    assert material_prior(np.array([0, 0, 0, 0, 0, 3])) == pytest.approx(log(2 / 6))
