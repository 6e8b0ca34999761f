"""Laws of the part-mass estimator on made objects: truth, priors, materials, shape error, articulation, findings."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.identify.articulated import moved
from steelyard.identify.masses.shape_error import EXACT, ShapeError
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters, forms, solids
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts
from steelyard.simulate.logs import simulate_log
from steelyard.spatial import Pose, Rotation

SIZES = np.array([[0.03, 0.03, 0.12], [0.03, 0.03, 0.14], [0.12, 0.04, 0.04], [0.02, 0.05, 0.03]])
CENTRES = np.array([[0, 0, 0.08], [0, 0, 0.21], [0.01, 0, 0.30], [-0.02, 0.03, 0.25]])
DENSITIES = np.array([700.0, 700.0, 7800.0, 2700.0])


def boxes() -> Parts:
    bodies = [
        solids.box(*size, 1.0).in_frame(Pose(Rotation.identity(), centre))
        for size, centre in zip(SIZES, CENTRES, strict=True)
    ]
    return Parts(np.arange(4), np.stack([b.vector for b in bodies]))


def log_of(truth: InertialParameters, noise: str, seed: int) -> MotionLog:
    """Return a bench log with the wrench of another body: same motion, same noise."""
    _, body = simulate_log("hammer", "stop_go", noise, seed)
    clean, _ = simulate_log("hammer", "stop_go", "none", seed, shuffled=False)
    if noise == "none":
        return replace(clean, wrench=clean.predicted(truth.vector))
    ordered, _ = simulate_log("hammer", "stop_go", noise, seed, shuffled=False)
    extra = clean.predicted(truth.vector) - clean.predicted(body.vector)
    return replace(ordered, wrench=ordered.wrench + extra)


def people(body: InertialParameters) -> np.ndarray:
    return np.concatenate([[body.mass], body.com, forms.upper(body.inertia_com)])


MASSES = boxes().volume * DENSITIES
TRUTH = boxes().whole(MASSES)


@pytest.mark.parametrize("density", ["free", "averaged"])
@pytest.mark.parametrize("bias", ["free", "none"])
def test_truth_without_noise(density: str, bias: str) -> None:
    found = PartMasses(boxes(), bias=bias, density=density, shape_error=EXACT).identify(log_of(TRUTH, "none", 0))
    np.testing.assert_allclose([p.mass for p in found.parts], MASSES, rtol=1e-4)
    np.testing.assert_allclose(found.parameters.vector, TRUTH.vector, rtol=1e-4, atol=1e-7)


def test_averaging_beats_free_masses_under_noise() -> None:
    errors = {"free": [], "averaged": []}
    for seed in range(12):
        for density in errors:
            found = PartMasses(boxes(), bias="none", density=density).identify(log_of(TRUTH, "high", seed))
            errors[density].append([p.mass for p in found.parts] - MASSES)
    spread = {density: np.sqrt((np.array(e) ** 2).mean(0)).sum() for density, e in errors.items()}
    assert spread["averaged"] < 0.9 * spread["free"]


@pytest.mark.parametrize("error", [EXACT, ShapeError(stretch=0.04)])
def test_no_bar_is_narrower_than_leaving_blocks_out_shows(error: ShapeError) -> None:
    """Stretches in which one torque is a little off: a shape hides that no more than the log alone does."""
    wider = 0
    for seed in range(4):
        log = log_of(TRUTH, "moderate", seed)
        stretch = np.arange(len(log)) * 20 // len(log)
        wrong = np.zeros((len(log), 6))
        wrong[:, 0] = np.random.default_rng(seed).normal(0, 0.02, 20)[stretch]
        log = replace(log, wrench=log.wrench + wrong, pose=stretch)
        found = PartMasses(boxes(), shape_error=error).identify(log)
        jackknife = found.evidence.jackknife_people
        assert jackknife is not None
        assert (found.std > 0.999 * jackknife).all()
        wider += int((found.std > 1.001 * jackknife).sum())
    assert wider  # a bar that is wider for its own reasons stays so


@pytest.mark.parametrize("error", [EXACT, ShapeError(com_m=1e-3, inertia_share=0.05)])
def test_leave_one_out_is_that_of_real_refits_with_the_shape(error: ShapeError) -> None:
    """Not that of the log alone."""
    log = log_of(TRUTH, "high", 5)
    model = PartMasses(boxes(), bias="none", density="free", shape_error=error)
    moments = Moments.of_log(log)
    moved = [
        people(model.solve(moments.where(moments.block != pose)).parameters)
        for pose in np.unique(log.pose[log.pose >= 0])
    ]
    count = len(moved)
    real = np.sqrt((count - 1) / count * ((moved - np.mean(moved, axis=0)) ** 2).sum(0))
    found = model.solve(moments)
    said = found.evidence.jackknife_people
    assert said is not None
    np.testing.assert_allclose(said[:4], real[:4], rtol=0.35)
    np.testing.assert_allclose(np.linalg.norm(said[4:]), np.linalg.norm(real[4:]), rtol=0.5)
    assert not any("leaving blocks out" in note for note in found.notes)


def test_a_uniform_object_is_found_uniform() -> None:
    uniform = boxes().whole(boxes().volume * 2700.0)
    found = PartMasses(boxes(), bias="none").identify(log_of(uniform, "high", 3))
    density = np.array([p.density for p in found.parts])
    assert density.std() / density.mean() < 0.02


def test_intervals_hold_the_truth_and_are_not_idle() -> None:
    errors, stds = [], []
    for seed in range(40):
        found = PartMasses(boxes(), bias="none", shape_error=EXACT).identify(log_of(TRUTH, "moderate", seed))
        masses = np.array([[p.mass, p.std] for p in found.parts])
        errors.append(np.concatenate([people(found.parameters) - people(TRUTH), masses[:, 0] - MASSES]))
        stds.append(np.concatenate([found.std, masses[:, 1]]))
    inside = np.abs(errors) < 1.96 * np.array(stds)
    assert inside.mean() > 0.9
    width = 1.96 * np.mean(stds, 0) / np.sqrt(np.mean(np.square(errors), 0))
    assert np.median(width) < 3.0, width


def test_same_input_same_answer_and_order_of_rows_does_not_matter() -> None:
    log = log_of(TRUTH, "moderate", 1)
    log = replace(log, time=None)
    one, again = (PartMasses(boxes()).identify(log).parameters.vector for _ in range(2))
    np.testing.assert_array_equal(one, again)
    shuffled = log.rows(np.random.default_rng(0).permutation(len(log)))
    np.testing.assert_allclose(PartMasses(boxes()).identify(shuffled).parameters.vector, one, rtol=1e-7, atol=1e-10)


def test_materials_are_named_and_ties_too() -> None:
    materials = tuple(Material(n, d, 0.02) for n, d in (("oak", 700), ("steel", 7800), ("aluminium", 2700)))
    found = PartMasses(boxes(), bias="none", materials=materials).identify(log_of(TRUTH, "low", 0))
    assert [p.material for p in found.parts] == ["oak", "oak", "steel", "aluminium"]
    assert "materials-tied" not in found.codes()
    twins = (*materials, Material("other steel", 7790, 0.02))
    tied = PartMasses(boxes(), bias="none", materials=twins).identify(log_of(TRUTH, "low", 0))
    assert tied.parts[2].material in {"steel?", "other steel?"}
    assert "materials-tied" in tied.codes()


def test_a_list_that_cannot_give_the_mass_is_a_finding() -> None:
    materials = (Material("cork", 200, 0.02), Material("balsa", 160, 0.02))
    found = PartMasses(boxes(), bias="none", materials=materials).identify(log_of(TRUTH, "low", 0))
    assert "materials-impossible" in found.codes()


def test_a_wrong_grasp_is_in_the_error_bars() -> None:
    log = log_of(TRUTH, "low", 0)
    sure = PartMasses(boxes(), bias="none").identify(log)
    loose = PartMasses(boxes(), bias="none", shape_error=ShapeError(grasp_m=0.002, grasp_rad=0.02)).identify(log)
    assert (loose.std[4:] > 2 * sure.std[4:]).any()  # the log alone knows the centre better
    shifted = boxes().in_frame(Pose(Rotation.exp([0.01, 0, 0]), np.array([0.001, 0, 0])))
    off = PartMasses(shifted, bias="none", shape_error=ShapeError(grasp_m=0.002, grasp_rad=0.02)).identify(log)
    assert (np.abs(people(off.parameters) - people(TRUTH)) < 4 * off.std).all()


def test_a_density_gradient_is_named() -> None:
    """A part that is heavy at one end has its centre off: homogeneous parts cannot give that wrench."""
    lump = InertialParameters.from_point_masses([0.1], [[0.05, 0.0, 0.30]])
    found = PartMasses(boxes(), bias="none").identify(log_of(TRUTH + lump, "low", 0))
    assert "part-not-homogeneous" in found.codes()
    assert "part-not-homogeneous" not in PartMasses(boxes(), bias="none").identify(log_of(TRUTH, "low", 0)).codes()


def test_more_parts_than_still_poses_can_tell() -> None:
    flat = boxes().in_frame(Pose.identity())
    log = log_of(TRUTH, "high", 0)
    still = log.rows(log.still)
    still = replace(still, acceleration=0 * still.acceleration, angular_acceleration=0 * still.acceleration)
    pieces = Parts(np.arange(8), np.concatenate([flat.moments, flat.moments]) / 2)
    found = PartMasses(pieces, bias="none").identify(still)
    assert "more-parts-than-rank" in found.codes()
    assert abs(found.mass / float(TRUTH.mass) - 1) < 0.01


def test_one_combination_is_not_many() -> None:
    half = Parts(np.arange(2), np.tile(boxes().moments.sum(0) / 2, (2, 1)))
    body = half.whole(half.volume * 1000.0)
    found = PartMasses(half, bias="none").identify(log_of(body, "low", 0))
    (told,) = [f.message for f in found.findings if f.code == "more-parts-than-rank"]
    assert told == "The data tell 1 combination of the masses of 2 parts apart; the rest is the prior's."


def test_moved_parts_keep_their_masses() -> None:
    parts = boxes()
    found = PartMasses(parts, bias="none", shape_error=EXACT).identify(log_of(TRUTH, "none", 0))
    swing = Pose(Rotation.exp([0, 0.7, 0]), np.array([0.02, 0.0, 0.01]))
    later = moved(found, parts, {2: swing})
    body = InertialParameters(parts.moments[2] * DENSITIES[2])
    expected = TRUTH - body + body.in_frame(swing)
    np.testing.assert_allclose(later.parameters.vector, expected.vector, rtol=1e-4, atol=1e-7)
    assert later.mass == pytest.approx(found.mass)
    with pytest.raises(BadValue, match=r"^There is no part 9 to move; the object has parts \[0, 1, 2, 3\]\.$"):
        moved(found, parts, {9: swing})


def test_parts_that_make_no_sense() -> None:
    with pytest.raises(BadValue, match=r"^part 0 has a volume of -1 m\^3; volumes must be above zero\."):
        Parts(np.array([0]), np.array([[-1.0, *np.zeros(9)]]))
    with pytest.raises(BadValue, match=r"^density must be averaged or free; got 'both'\.$"):
        PartMasses(boxes(), density="both")  # type: ignore[arg-type]
