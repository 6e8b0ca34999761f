"""Parts that may as well be of steel: named where the log would allow it, with bars that hold it."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters, forms, solids
from steelyard.logs.log import MotionLog
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

# A staff along z with a knob at one end and a ferrule at the other: all turn about one line.
RADII, LOW, HIGH = (0.011, 0.014, 0.005), (-0.1, -0.12, 0.16), (0.16, -0.1, 0.173)
WOOD, PLASTIC, STEEL = 700.0, 1200.0, 7800.0


def staff() -> Parts:
    bodies = [
        solids.cylinder(r, high - low, 1.0).in_frame(Pose(Rotation.identity(), np.array([0, 0, (low + high) / 2])))
        for r, low, high in zip(RADII, LOW, HIGH, strict=True)
    ]
    return Parts(np.arange(3), np.stack([body.vector for body in bodies]))


def body(tip: float) -> InertialParameters:
    return staff().whole(staff().volume * [WOOD, PLASTIC, tip])


def log_of(truth: InertialParameters, seed: int = 0) -> MotionLog:
    return handling_log(truth, "slow", "moderate", seed)


def named(estimate: Estimate) -> list[Finding]:
    return [finding for finding in estimate.findings if finding.code == "prior-dominated"]


def bars_off(estimate: Estimate, truth: InertialParameters) -> np.ndarray:
    off = forms.upper(estimate.parameters.inertia_com - truth.inertia_com)
    return np.asarray(np.abs(off) / estimate.std[4:])


@pytest.mark.parametrize("seed", range(4))
def test_a_tip_of_steel_that_the_log_does_not_show_is_named_and_within_the_bars(seed: int) -> None:
    truth = body(STEEL)
    found = PartMasses(staff()).identify(log_of(truth, seed))
    (finding,) = named(found)
    assert "part 2 of steel" in finding.message
    assert "--materials" in finding.remedy
    assert bars_off(found, truth).max() < 2.5
    assert abs(found.parts[2].mass - staff().volume[2] * STEEL) < 2.5 * found.parts[2].std
    covariance = found.part_covariance
    assert covariance is not None
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), [part.std for part in found.parts])


def test_what_the_log_does_not_tell_is_named_whatever_is_true() -> None:
    assert named(PartMasses(staff()).identify(log_of(body(WOOD))))


def test_a_list_of_materials_answers_it() -> None:
    truth = body(STEEL)
    materials = (Material("wood", WOOD, 0.05), Material("plastic", PLASTIC, 0.05), Material("steel", 7850.0, 0.01))
    found = PartMasses(staff(), materials=materials).identify(log_of(truth))
    assert not named(found)
    assert "prior-dominated" not in found.codes()


def test_a_tip_that_sticks_out_shows_itself() -> None:
    """Beside the line of the others it moves the centre of mass: the log objects to what it is not."""
    moments = staff().moments.copy()
    moments[2] = InertialParameters(moments[2]).in_frame(Pose(Rotation.identity(), np.array([0.06, 0, 0]))).vector
    beside = Parts(np.arange(3), moments)
    for tip in (WOOD, STEEL):
        truth = beside.whole(beside.volume * [WOOD, PLASTIC, tip])
        found = PartMasses(beside, bias="none").identify(handling_log(truth, "paper", "low"))
        assert not named(found)
        assert bars_off(found, truth).max() < 3


def test_masses_without_a_prior_are_not_led_by_one() -> None:
    assert not named(PartMasses(staff(), density="free").identify(log_of(body(STEEL))))
