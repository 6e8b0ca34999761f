"""How sure the object's place in the sensor is, where only the log can tell."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import multivariate_normal

from bent_rows import bent_row
from steelyard.errors import NoMasses
from steelyard.identify.bars.effective import Effective
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.shape_error import MEASURED
from steelyard.identify.part_cuts import PartCuts
from steelyard.identify.part_masses import PartMasses
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.parts.parts import Parts
from steelyard.pipelines.load import PLACES
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

ROW = bent_row(4)
DENSITY = np.array([7800.0, 7800, 1000, 2700])
TRUTH = ROW.whole(DENSITY * ROW.volume)
LOGS = range(6)


def moved(seed: int, length_m: float, angle_deg: float) -> Parts:
    """The row as it is said to lie, in any direction from where it does."""
    rng = np.random.default_rng([11, seed])
    shift, turn = (v / np.linalg.norm(v) for v in rng.standard_normal((2, 3)))
    turned = Rotation.exp(np.radians(angle_deg) * turn)
    com = np.asarray(TRUTH.com)
    return ROW.in_frame(Pose(turned, com - turned.apply(com) + length_m * shift))


def answer(parts: Parts, seed: int, places: tuple[tuple[float, float], ...]) -> tuple[Estimate, np.ndarray]:
    found, weight = PartCuts((parts,), bias="none", places=places).weighed(handling_log(TRUTH, noise="low", seed=seed))
    return found, weight[0]


def off(found: Estimate) -> np.ndarray:
    """How many bars (10,) mass, centre of mass and inertia about it are off."""
    return np.abs(found.parameters.people - TRUTH.people) / found.std


def test_the_cost_of_an_error_makes_evidence_of_the_wider_gaussian() -> None:
    rng = np.random.default_rng(5)
    root, one, other = rng.standard_normal((3, 10, 10))
    F, at, phi = root @ root.T + np.eye(10), *rng.standard_normal((2, 10))
    data = Effective(F, F @ at, np.zeros(0), np.zeros((0, 10)))

    def evidence(G: np.ndarray) -> float:
        wide = data.blurred(G)
        return float(wide.pull @ phi - 0.5 * phi @ wide.information @ phi) - data.cost_of(G)

    errors = one @ one.T, 0.1 * other @ other.T
    density = [multivariate_normal(phi, np.linalg.inv(F) + G).logpdf(at) for G in errors]
    assert evidence(errors[0]) - evidence(errors[1]) == pytest.approx(density[0] - density[1], rel=1e-9)


@pytest.mark.parametrize("seed", LOGS)
def test_a_place_that_the_log_confirms_answers_as_if_it_were_known(seed: int) -> None:
    known, _ = answer(ROW, seed, (KNOWN_PLACE,))
    found, weight = answer(ROW, seed, PLACES)
    assert weight[0] > 0.5
    assert (np.abs(found.parameters.people - known.parameters.people) < found.std).all()


def test_bars_hold_a_place_that_is_off_and_of_which_nothing_is_said() -> None:
    wrong = [moved(seed, 3e-3, 1.0) for seed in LOGS]
    believed = np.array([off(answer(parts, seed, (KNOWN_PLACE,))[0]) for seed, parts in enumerate(wrong)])
    found = np.array([off(answer(parts, seed, PLACES)[0]) for seed, parts in enumerate(wrong)])
    assert np.sqrt((believed**2).mean()) > 3
    assert np.sqrt((found**2).mean()) < 1.5
    assert found.max() < 4


def test_masses_of_parts_hold_it_too() -> None:
    true = DENSITY * ROW.volume
    z = []
    for seed in LOGS:
        parts = answer(moved(seed, 3e-3, 1.0), seed, PLACES)[0].parts
        z.append([(part.mass - mass) / part.std for part, mass in zip(parts, true, strict=True)])
    assert np.sqrt(np.square(z).mean()) < 1.5


def test_a_place_that_is_off_is_told_from_one_that_is_not() -> None:
    assert answer(moved(0, 3e-3, 1.0), 0, PLACES)[1][0] == 0


def test_one_spread_is_that_of_the_shape_error() -> None:
    log, std = handling_log(TRUTH, noise="low", seed=1), (2e-3, 0.01)
    one = PartCuts((ROW,), bias="none", places=(std,)).identify(log)
    other = PartMasses(ROW, bias="none", shape_error=MEASURED.placed(*std)).identify(log)
    np.testing.assert_array_equal(one.parameters.vector, other.parameters.vector)
    np.testing.assert_array_equal(one.covariance, other.covariance)


def aside(length_m: float, angle_deg: float) -> Parts:
    """The row as it is said to lie, so far along y and turned about y."""
    return ROW.in_frame(Pose(Rotation.exp(np.radians([0, angle_deg, 0])), np.array([0, length_m, 0])))


@pytest.mark.parametrize("length_m", [0.025, 0.08])
def test_a_place_far_beyond_what_a_grasp_allows_is_named_and_not_believed(length_m: float) -> None:
    log = handling_log(TRUTH, "paper", noise="high", seed=1)
    grasp = MEASURED.placed(2e-3, np.radians(1.0))
    found = PartMasses(aside(length_m, 20), shape_error=grasp).identify(log)
    assert "part-not-homogeneous" in found.codes()
    assert off(found).max() < 3


def test_parts_that_cannot_be_where_the_log_sees_them_are_refused_however_much_less_they_are_trusted() -> None:
    log = handling_log(TRUTH, "paper", noise="high", seed=1)
    with pytest.raises(NoMasses):
        PartMasses(aside(0.3, 20)).identify(log)
