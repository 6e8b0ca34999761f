"""What is left after the tool is judged by its own size: a feather's inertia is not known because its gripper's is."""

from __future__ import annotations

import numpy as np
from bench_logs import BIAS

from steelyard.identify.estimate import Estimate
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.tool import without_tool
from steelyard.inertia import InertialParameters, solids
from steelyard.simulate import scenarios
from steelyard.simulate.logs import log_of
from steelyard.spatial import Pose, Rotation

GRIPPER = solids.box(0.09, 0.06, 0.12, 1300).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.005, 0.06])))
FEATHER = solids.box(0.02, 0.02, 0.04, 1500).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.0, 0.14])))


def run(body: InertialParameters, seed: int) -> Estimate:
    rng = np.random.default_rng(seed)
    log = log_of(body, scenarios.motion("stop_go"), scenarios.noise_std("moderate"), rng, bias=BIAS)
    return NoiseAware().identify(log)


def test_the_inertia_of_a_feather_is_withheld() -> None:
    load, tool = run(GRIPPER + FEATHER, 1), run(GRIPPER, 2)
    assert load.identified.all()
    assert tool.identified.all()
    alone = without_tool(load, tool, shared=False)
    assert alone.identified[0]
    assert alone.inertia_com is None
    assert [f.code for f in alone.findings].count("inertia-not-identified") == 1
