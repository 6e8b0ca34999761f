"""Which cut of a shape into parts explains a log."""

from __future__ import annotations

import re

import numpy as np
import pytest

from bent_rows import bent_row
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.identify.part_cuts import PartCuts
from steelyard.identify.part_masses import PartMasses
from steelyard.identify.problem import Problem
from steelyard.logs.log import MotionLog
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log


@pytest.fixture(scope="module")
def rod() -> Parts:
    return bent_row(6)


DENSITY = np.array([7800.0, 7800, 1000, 1000, 1000, 1000])


def log_of(parts: Parts, seed: int, noise: str = "low") -> MotionLog:
    return handling_log(parts.whole(DENSITY * parts.volume), noise=noise, seed=seed)


def cuts(rod: Parts) -> tuple[Parts, ...]:
    right = rod.merged([[0, 1], [2, 3, 4, 5]])
    wrong = rod.merged([[0, 1, 2, 3], [4, 5]])
    return rod.merged([[0, 1, 2, 3, 4, 5]]), wrong, right, rod


def test_the_log_refuses_cuts_that_cannot_give_it(rod: Parts) -> None:
    _, weight = PartCuts(cuts(rod), bias="none").weighed(log_of(rod, 0))
    assert weight.sum() == pytest.approx(1)
    assert weight[0] == weight[1] == 0
    assert weight[2, 0] > 0.2


def test_the_average_is_as_good_as_the_right_cut(rod: Parts) -> None:
    truth = rod.whole(DENSITY * rod.volume).vector
    errors = []
    for seed in range(4):
        log = log_of(rod, seed)
        averaged = PartCuts(cuts(rod), bias="none").identify(log)
        right = PartMasses(cuts(rod)[2], bias="none").identify(log)
        errors.append([np.linalg.norm((e.parameters.vector - truth) / truth[0]) for e in (averaged, right)])
    mean = np.mean(errors, axis=0)
    assert mean[0] < 2 * mean[1] + 1e-6


def test_one_cut_is_the_estimator_of_parts(rod: Parts) -> None:
    log = log_of(rod, 1)
    alone = PartCuts((rod,), bias="none").identify(log)
    plain = PartMasses(rod, bias="none").identify(log)
    np.testing.assert_array_equal(alone.parameters.vector, plain.parameters.vector)


def test_a_prior_tips_the_scale_between_cuts_alike(rod: Parts) -> None:
    right, fine = cuts(rod)[2:]
    log = log_of(rod, 2)
    _, plain = PartCuts((right, fine), bias="none").weighed(log)
    _, tipped = PartCuts((right, fine), np.array([0.0, 2.0]), bias="none").weighed(log)
    assert tipped[1] > plain[1]


@pytest.mark.parametrize(("cut", "said"), [(0, "1 part"), (3, "6 parts")])
def test_a_cut_that_explains_nothing_is_left_out_with_a_word(
    rod: Parts, cut: int, said: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    right, other = cuts(rod)[2], cuts(rod)[cut]
    log, whole = log_of(rod, 2), PartMasses.answered

    def refusing(self: PartMasses, log: MotionLog, problem: Problem) -> Estimate:
        if len(self.parts) == len(other):
            raise CannotAnswer("no masses")
        return whole(self, log, problem)

    monkeypatch.setattr(PartMasses, "answered", refusing)
    monkeypatch.setattr(PartCuts, "_weights", lambda *_: np.array([[0.5], [0.5]]))
    answer, weight = PartCuts((right, other), bias="none").weighed(log)
    assert weight.tolist() == [[1.0], [0.0]]
    assert answer.notes[-1] == f"the cut into {said} explains nothing and was left out"


def test_one_part_is_not_many(rod: Parts) -> None:
    one, _, right, _ = cuts(rod)
    shape = PartCuts((one, right), np.array([2.0, 0.0]), bias="none", shape_error=ShapeError(com_m=1e-2, stretch=0.5))
    log = handling_log(one.whole(np.array([0.5])), noise="high", seed=0)
    assert re.search(r"what the log says of them: 1 part \d+ %, 2 parts \d+ %$", shape.identify(log).notes[-1])


def test_wrong_options_are_named(rod: Parts) -> None:
    with pytest.raises(BadValue, match="at least one cut"):
        PartCuts(())
    with pytest.raises(BadValue, match="2 cuts need as many prior weights"):
        PartCuts((rod, rod), np.zeros(3))
