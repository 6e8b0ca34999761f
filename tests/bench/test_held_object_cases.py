"""Cuts of solids, parts split and merged, rows, and the bound: against closed forms and laws."""

from dataclasses import replace

import numpy as np
import pytest
from box_tools import BOXES, BRICK, CLUB, boxes_mesh, known_boxes, write_tools

from steelyard.bench.objects import bound
from steelyard.bench.objects.cases import (
    PART_METHODS,
    RIVALS,
    exact_rows,
    load_case,
    methods_for,
    noisy_rows,
    split_parts,
)
from steelyard.bench.objects.cuts import below, interior_points, moments_about, slabs
from steelyard.errors import BadValue
from steelyard.inertia import solids
from steelyard.logs.log import Noise
from steelyard.shape.mesh import part_moments
from steelyard.simulate.handling import noise_std
from steelyard.spatial import Pose, Rotation


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_tools(tmp_path_factory.mktemp("tools"))


def test_a_box_cut_in_half_is_half_a_box():
    corners = boxes_mesh([((0, 0, 0), (0.2, 0.1, 0.4))]).corners
    half = moments_about(below(corners, np.array([0, 0, 1.0]), 0.1), np.array([0, 0, 0.1]))
    expected = solids.box(0.2, 0.1, 0.1, 1.0).in_frame(Pose(Rotation.identity(), np.array([0.1, 0.05, 0.05])))
    np.testing.assert_allclose(half, expected.vector, atol=1e-15)


def test_slabs_across_any_direction_add_up_and_do_not_care_which_way():
    mesh = boxes_mesh(BOXES[:1])
    whole = part_moments(mesh)[0]
    normal = np.array([0.3, -0.5, 0.8]) / np.linalg.norm([0.3, -0.5, 0.8])
    offsets = np.quantile(mesh.vertices @ normal, [0.3, 0.6])
    pieces = slabs(mesh.corners, whole, normal, offsets)
    np.testing.assert_allclose(pieces.sum(0), whole, atol=1e-18)
    backwards = slabs(mesh.corners, whole, -normal, -offsets[::-1])
    np.testing.assert_allclose(backwards[::-1], pieces, rtol=1e-9, atol=1e-18)


def test_points_lie_inside_and_are_spread_evenly():
    mesh = boxes_mesh(BOXES)
    points = interior_points(mesh, 2000)
    inside = [((points >= np.array(low)) & (points <= np.add(low, edges))).all(1) for low, edges in BOXES]
    assert np.any(inside, axis=0).all()
    assert len(points) == pytest.approx(2000, rel=0.2)
    volumes = np.array([np.prod(edges) for _, edges in BOXES])
    np.testing.assert_allclose([i.mean() for i in inside], volumes / volumes.sum(), atol=0.03)


def test_split_parts_are_the_true_parts_in_two_or_three_pieces():
    known = known_boxes(*CLUB)
    pieces, owner = split_parts(known)
    whole = known.parts_in_sensor.moments
    for k in range(len(whole)):
        assert (owner == k).sum() in (2, 3)
        np.testing.assert_allclose(pieces.moments[owner == k].sum(0), whole[k], rtol=1e-9, atol=1e-12)
        share = pieces.volume[owner == k] / whole[k, 0]
        np.testing.assert_allclose(share, 1 / (owner == k).sum(), rtol=1e-6)


def test_merged_parts_are_of_one_density_or_of_two(folder):
    own, merged, mixed = (
        load_case(folder / "club", parts) for parts in ("truth", "truth-merged", "truth-merged-mixed")
    )
    assert [len(case.parts) for case in (own, merged, mixed)] == [4, 3, 3]
    assert own.groups == ((0,), (1, 2), (3,))
    for case in (own, merged, mixed):
        truth = case.known.truth
        assert case.part_masses.sum() == pytest.approx(float(truth.mass))
    np.testing.assert_allclose(merged.parts.whole(merged.part_masses).vector, merged.known.truth.vector, atol=1e-12)
    lost = mixed.parts.whole(mixed.part_masses).vector - mixed.known.truth.vector
    assert np.abs(lost).max() > 1e-3
    assert load_case(folder / "brick", "truth-merged-mixed") is None
    assert len(load_case(folder / "brick", "truth-merged").parts) == 1


def test_halves(folder):
    assert load_case(folder / "club", "truth").known.half == "mixed"
    assert load_case(folder / "brick", "truth").known.half == "uniform"


def test_rows_are_shuffled_and_stripped(folder):
    case = load_case(folder / "club", "truth")
    log = noisy_rows(case, "low", 1)
    assert log.time is None
    assert (log.pose == -1).all()
    assert log.still.sum() == case.log.still.sum() > 100
    again, other = noisy_rows(case, "low", 1), noisy_rows(case, "low", 2)
    np.testing.assert_array_equal(log.wrench, again.wrench)
    assert (np.sort(log.wrench[:, 0]) != np.sort(other.wrench[:, 0])).any()
    clean = noisy_rows(case, "none", 0)
    np.testing.assert_allclose(clean.predicted(case.known.truth.vector), clean.wrench, atol=1e-9)


def test_rows_need_a_motion():
    known = replace(known_boxes(*BRICK), track=None)
    with pytest.raises(BadValue, match=r"brick has no motion\.npz"):
        exact_rows(known)


@pytest.mark.parametrize("name", [*PART_METHODS, *RIVALS])
def test_every_method_answers(folder, name):
    case = load_case(folder / "club", "truth")
    (method,) = methods_for(case, (name,))
    found = method.identify(method.rows(noisy_rows(case, "low", 0)))
    assert found.mass == pytest.approx(float(case.known.truth.mass), rel=0.05)


def test_methods_are_known_by_name(folder):
    with pytest.raises(BadValue, match="There is no method 'magic' here; there are: ours, ours-still, hps"):
        methods_for(load_case(folder / "club", "truth"), ("magic",))


def test_the_bound_of_one_part_at_rest_is_the_closed_form():
    known = known_boxes("brick", BOXES[:1], (2700,), "static")
    noise = Noise.of_std(1.0, 1e-9, 0.33, 0.0067)
    log = exact_rows(known)
    spread = bound.covariance(log, noise, known.truth, known.parts_in_sensor)
    mass, com = float(known.truth.mass), known.truth.com
    # Angular acceleration noise is part of the weight; without it both lines agree to the last digit.
    quiet = bound.covariance(log, Noise.of_std(1e-9, 1e-9, 0.33, 0.0067), known.truth, known.parts_in_sensor)
    torque = (np.cross(com, log.gravity) ** 2).sum() / 0.0067**2
    information = (log.gravity**2).sum() / 0.33**2 + torque
    assert quiet[0, 0] == pytest.approx(1 / information, rel=1e-6)
    assert spread[0, 0] > quiet[0, 0]
    scores = bound.expected_scores(quiet, known.truth, known.box)
    expected = 100 * np.sqrt(2 / np.pi / information) / mass
    assert scores["mass_pct"] == pytest.approx(expected, rel=0.03)
    assert scores["riemannian"] == pytest.approx(expected / 100 * np.sqrt(2), rel=0.03)
    assert scores["com_mm"] == pytest.approx(0, abs=1e-6)


def test_knowing_equal_densities_lowers_the_bound(folder):
    case = load_case(folder / "club", "truth")
    level = Noise.of_std(*noise_std("high"))
    free, groups = (
        bound.covariance(case.log, level, case.known.truth, parts)
        for parts in (case.true_parts, case.true_parts.merged(case.groups))
    )
    assert np.linalg.eigvalsh(free - groups)[0] > -1e-9 * np.linalg.eigvalsh(free)[-1]
