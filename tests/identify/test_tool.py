"""A gripper taken away from what was held with it: one sensor bias shared by both runs, or said not to be."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import pytest
from bench_logs import BIAS, people

from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.tool import bias_prior, different_bias, shares_bias, without_tool
from steelyard.inertia import InertialParameters, solids
from steelyard.logs.log import MotionLog
from steelyard.simulate import scenarios
from steelyard.simulate.logs import log_of
from steelyard.spatial import Pose, Rotation

GRIPPER = solids.box(0.09, 0.06, 0.12, 1300).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.005, 0.06])))
NAME = "mallet"


def run(body: InertialParameters, seed: int, motion: str = "dyn_slow", bias: np.ndarray = BIAS) -> MotionLog:
    rng = np.random.default_rng(seed)
    return log_of(body, scenarios.motion(motion), scenarios.noise_std("moderate"), rng, bias=bias)


def thing() -> InertialParameters:
    return scenarios.body(NAME).parameters()


@dataclass(frozen=True)
class Pair:
    tool: Estimate
    load: Estimate
    shared: Estimate

    @classmethod
    def of(cls, seed: int) -> Pair:
        tool = NoiseAware().identify(run(GRIPPER, 2 * seed))
        log = run(GRIPPER + thing(), 2 * seed + 1)
        prior = bias_prior(tool)
        assert prior is not None
        return cls(tool, NoiseAware().identify(log), NoiseAware(bias=Bias(prior=prior)).identify(log))


@pytest.fixture(scope="module")
def pair() -> Pair:
    return Pair.of(0)


def test_the_object_is_recovered(pair: Pair) -> None:
    for alone in (without_tool(pair.shared, pair.tool, True), without_tool(pair.load, pair.tool, False)):
        gap = np.abs(people(alone.parameters) - people(thing()))
        assert (gap[:4] < 4 * alone.std[:4]).all()
        assert alone.notes[-1].startswith(f"a tool of {pair.tool.mass:.4g} kg was taken away from a load of ")


def test_sharing_the_bias_is_never_worse(pair: Pair) -> None:
    shared = without_tool(pair.shared, pair.tool, True)
    apart = without_tool(pair.load, pair.tool, False)
    assert shared.std[0] < 0.95 * apart.std[0]
    assert (shared.std < 1.02 * apart.std).all()
    assert (np.linalg.eigvalsh(shared.covariance) > -1e-12 * np.trace(shared.covariance)).all()


def test_error_bars_of_the_difference_cover_the_truth() -> None:
    pairs = [Pair.of(seed) for seed in range(1, 31)]
    alone = [without_tool(p.shared, p.tool, True) for p in pairs]
    inside = np.array([np.abs(people(a.parameters) - people(thing()))[:4] < 1.96 * a.std[:4] for a in alone])
    assert 0.85 <= float(inside.mean()) <= 1
    gaps = np.array([people(a.parameters)[0] - float(thing().mass) for a in alone])
    # Thirty draws fix a standard deviation to 13 %.
    assert float(np.sqrt(np.mean([a.std[0] ** 2 for a in alone])) / np.sqrt((gaps**2).mean())) < 1.6


def test_one_bias_is_recognised(pair: Pair) -> None:
    same, p = shares_bias(pair.tool, pair.load)
    assert same
    assert p > 1e-3


def test_p_values_of_one_bias_are_spread_evenly() -> None:
    values = [shares_bias(*pair)[1] for pair in _pairs(20)]
    assert 0.2 < float(np.mean(values)) < 0.8
    assert min(values) > 1e-4


def _pairs(count: int) -> list[tuple[Estimate, Estimate]]:
    fit = NoiseAware().identify
    return [(fit(run(GRIPPER, 200 + k)), fit(run(GRIPPER + thing(), 300 + k))) for k in range(count)]


def test_another_bias_is_named(pair: Pair) -> None:
    moved = NoiseAware().identify(run(GRIPPER + thing(), 1, bias=BIAS + np.array([0, 0, 0, 0.5, 0, 0])))
    same, p = shares_bias(pair.tool, moved)
    assert not same
    assert p < 1e-4
    finding = different_bias(p)
    assert finding.code == "bias-drift"
    start = "The sensor's bias changed between the tool's run and this one (p = "
    assert finding.message == f"{start}{p:.1g}); it was not shared."


def test_a_tared_tool_run_tells_nothing_of_the_bias() -> None:
    tool = NoiseAware(bias="none").identify(run(GRIPPER, 0, bias=np.zeros(6)))
    assert bias_prior(tool) is None


def test_nothing_is_left(pair: Pair) -> None:
    again = NoiseAware().identify(run(GRIPPER, 5))
    with pytest.raises(CannotAnswer) as caught:
        without_tool(again, pair.tool, False)
    text = str(caught.value)
    assert text.startswith(f"After taking the tool ({pair.tool.mass:.4g} kg) away ")
    assert text.endswith(" kg: no object was held, or the tool is not the one that was recorded.")


def test_what_the_tool_leaves_open_stays_open(pair: Pair) -> None:
    unseen = replace(pair.tool, identified=np.array([True] * 4 + [False] * 6))
    alone = without_tool(pair.load, unseen, False)
    assert alone.identified[:4].all()
    assert alone.inertia_com is None
    assert [finding.message for finding in alone.findings if finding.code == "inertia-not-identified"] == [
        "Of the object the inertia entries xx, xy, xz, yy, yz, zz are left open by the tool's run."
    ]
