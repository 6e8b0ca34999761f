"""An object that is not where it is said to be: the log's centre of mass tells, in millimetres."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.errors import NoMasses
from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.placement import misplaced
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

MASSES = np.array([0.4, 0.1])


def block(size: tuple[float, float, float], centre: tuple[float, float, float]) -> np.ndarray:
    """Ten parameters of a box at 1 kg/m^3."""
    sides = np.array(size)
    volume = float(np.prod(sides))
    inertia = volume / 12 * np.diag((sides**2).sum() - sides**2)
    return np.asarray(InertialParameters.from_com(volume, np.array(centre), inertia).vector)


CLUB = Parts(np.arange(2), np.stack([block((0.03, 0.1, 0.03), (0, 0.2, 0)), block((0.02, 0.2, 0.02), (0, 0.05, 0))]))


def seen(parts: Parts, body: InertialParameters, std: float = 1e-4) -> Effective:
    """What a log says that knows phi to `std`."""
    information = np.eye(10) / std**2
    return Effective(information, information @ body.vector, np.zeros(0), np.zeros((0, 10)))


def moved(shift: tuple[float, float, float]) -> Parts:
    return CLUB.in_frame(Pose(Rotation.identity(), np.array(shift)))


def test_nothing_is_said_where_some_masses_give_the_centre_of_mass() -> None:
    for masses in (MASSES, MASSES[::-1], np.array([1.0, 0.0])):
        assert misplaced(seen(CLUB, CLUB.whole(masses)), CLUB) == ""
    assert misplaced(seen(CLUB, CLUB.whole(MASSES)), moved((0, 0.01, 0))) == ""


@pytest.mark.parametrize("shift", [(0.006, 0, 0), (0, 0, -0.006)])
def test_a_shift_across_the_parts_is_told_in_millimetres(shift: tuple[float, float, float]) -> None:
    said = misplaced(seen(CLUB, CLUB.whole(MASSES)), moved(shift))
    assert "6.0 mm from where any masses of even parts would" in said


def test_a_centre_of_mass_outside_the_object_can_only_be_a_wrong_pose() -> None:
    said = misplaced(seen(CLUB, CLUB.whole(MASSES)), moved((0.055, 0, 0)))
    assert "40.0 mm outside the object: pose_in_sensor is wrong by at least that much." in said


def test_a_gap_within_its_error_is_no_gap() -> None:
    assert misplaced(seen(CLUB, CLUB.whole(MASSES), std=2e-3), moved((0.006, 0, 0))) == ""


SCANNED = ShapeError(com_m=3e-4, inertia_share=3e-3, stretch=0.03)


@pytest.mark.parametrize("noise", ["low", "high"])
@pytest.mark.parametrize(("shift", "said"), [((0, 0, 0), False), ((0.001, 0, 0), False), ((0.02, 0, 0), True)])
def test_a_scan_that_lies_elsewhere_is_named_however_much_less_it_is_trusted(
    shift: tuple[float, float, float], said: bool, noise: str
) -> None:
    log = handling_log(CLUB.whole(MASSES), "paper", noise=noise, seed=0)
    found = PartMasses(moved(shift), shape_error=SCANNED).identify(log)
    assert any("standard deviations apart" in note for note in found.notes) or not said
    named = [f for f in found.findings if f.code == "part-not-homogeneous"]
    assert bool(named) == said
    assert not said or "pose_in_sensor is wrong by at least that much. Shape and log see" in named[0].message


@pytest.mark.parametrize("shift", [(3.0, 0, 0), (2.0, 2.0, 2.0)])
def test_parts_that_can_have_no_mass_where_they_are_said_to_be_are_refused(shift: tuple[float, float, float]) -> None:
    log = handling_log(CLUB.whole(MASSES), "paper", noise="low", seed=0)
    one = Parts(np.arange(1), moved(shift).moments.sum(0, keepdims=True))
    with pytest.raises(NoMasses) as caught:
        PartMasses(one, shape_error=SCANNED).identify(log)
    assert str(caught.value) == (
        "No masses of these parts explain the wrench, that of 0.5 kg: the shape, of 170 cm^3, has another size or "
        "place. Check the unit of its points, pose_in_sensor."
    )


def test_where_a_scan_lies_is_said_once() -> None:
    log = handling_log(CLUB.whole(MASSES), "paper", noise="low", seed=0)
    far = PartMasses(moved((0.6, 0, 0)), shape_error=SCANNED).identify(log)
    assert sum("outside the object" in f.message for f in far.findings) == 1


@pytest.mark.parametrize(("masses", "named"), [((0.4, 0.0), True), ((0.4, 0.004), False)])
def test_a_part_without_mass_is_named_and_a_light_one_is_not(masses: tuple[float, float], named: bool) -> None:
    log = handling_log(CLUB.whole(np.array(masses)), noise="low", seed=0)
    estimate = PartMasses(CLUB, bias="none", density="free").identify(log)
    assert ("part-zero-mass" in estimate.codes()) == named
