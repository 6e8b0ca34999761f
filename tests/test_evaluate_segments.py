"""Segmentation scores against cases worked by hand, brute force and known relations; errors as published."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from steelyard import evaluate
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, solids

# Two true parts of 6 and 4 points; segment 2 holds one point of each.
TRUE = [0, 0, 0, 0, 0, 0, 1, 1, 1, 1]
FOUND = [7, 7, 7, 7, 7, 2, 2, 5, 5, 5]
LABELS = st.lists(st.tuples(st.integers(0, 4), st.integers(0, 4)), min_size=2, max_size=40)


def test_a_case_by_hand():
    scores = evaluate.score_segments(TRUE, FOUND)
    assert scores.impurity == pytest.approx(0.1)
    assert scores.undersegmentation == pytest.approx((1 / 6 + 1 / 4) / 2)
    # The found segments lie in the true parts but for segment 2: its two points lose a half each.
    assert scores.gce == pytest.approx(0.1)
    assert (scores.n_true, scores.n_parts) == (2, 3)


def test_truth_is_perfect_whatever_its_names():
    scores = evaluate.score_segments(TRUE, [9 - label for label in TRUE])
    assert (scores.impurity, scores.undersegmentation, scores.gce, scores.ari) == (0, 0, 0, 1)


def test_splitting_costs_only_in_the_rand_index():
    scores = evaluate.score_segments(TRUE, range(len(TRUE)))
    assert (scores.impurity, scores.undersegmentation, scores.gce) == (0, 0, 0)
    assert scores.ari == 0


def test_one_segment_for_all():
    scores = evaluate.score_segments(TRUE, np.zeros(10))
    assert scores.impurity == pytest.approx(0.4)
    assert scores.undersegmentation == pytest.approx((4 / 6 + 6 / 4) / 2)
    assert scores.gce == 0
    assert scores.ari == 0


def gce_by_point(true, found):
    true, found = np.array(true), np.array(found)
    directions = []
    for one, two in ((true, found), (found, true)):
        losses = [np.mean(two[one == one[k]] != two[k]) for k in range(len(one))]
        directions.append(np.mean(losses))
    return min(directions)


def ari_by_pairs(true, found):
    same = [
        (true[i] == true[j], found[i] == found[j]) for i in range(len(true)) for j in range(i)
    ]  # fmt: skip
    both = sum(a and b for a, b in same)
    parts, segments = sum(a for a, _ in same), sum(b for _, b in same)
    chance = parts * segments / len(same)
    most = (parts + segments) / 2
    return 1.0 if most == chance else (both - chance) / (most - chance)


@given(LABELS)
def test_against_brute_force(pairs):
    true, found = zip(*pairs, strict=True)
    scores = evaluate.score_segments(true, found)
    assert scores.gce == pytest.approx(gce_by_point(true, found), abs=1e-12)
    assert scores.ari == pytest.approx(ari_by_pairs(true, found), abs=1e-12)
    assert 0 <= scores.impurity < 1
    assert scores.undersegmentation >= 0


@given(LABELS)
def test_gce_and_ari_do_not_care_which_is_true(pairs):
    true, found = zip(*pairs, strict=True)
    here, there = evaluate.score_segments(true, found), evaluate.score_segments(found, true)
    assert here.gce == pytest.approx(there.gce)
    assert here.ari == pytest.approx(there.ari)


def test_labels_must_match():
    with pytest.raises(BadValue, match=r"same length, at least one point; got \(2,\) and \(3,\)"):
        evaluate.score_segments([0, 1], [0, 1, 2])
    with pytest.raises(BadValue, match="at least one point"):
        evaluate.score_segments([], [])


def test_hausdorff_distance_is_in_thousandths_of_the_true_diagonal():
    square = np.array([[x, y, 0.0] for x in np.linspace(0, 3, 31) for y in np.linspace(0, 4, 41)])
    gap = evaluate.hausdorff_mm(square + np.array([0, 0, 0.05]), square)
    assert gap == pytest.approx(10)
    spike = np.vstack([square, [0, 0, 1.0]])
    assert evaluate.hausdorff_mm(spike, square) == pytest.approx(200)
    assert evaluate.hausdorff_mm(square, spike) == pytest.approx(200 * 5 / np.sqrt(26))


def test_published_errors_are_floored_and_use_the_estimated_box():
    edges = np.array([0.1, 0.2, 0.4])
    body = solids.box(*edges, 1000.0)
    moved = InertialParameters.from_com(body.mass, body.com + np.array([0.0019, 0.001, 0.0124]), body.inertia_com)
    found = evaluate.score_as_published(moved, body, edges)
    assert found.com_pct == pytest.approx((1 + 0 + 3) / 3)
    right = evaluate.score(moved, body, np.stack([np.zeros(3), edges]))
    assert right.com_pct == pytest.approx((1.9 + 0.5 + 3.1) / 3)
    assert (found.mass_pct, found.inertia_pct) == (right.mass_pct, right.inertia_pct)
    thick = evaluate.score_as_published(moved, body, 2 * edges)
    assert thick.inertia_pct == pytest.approx(found.inertia_pct / 4)
    assert thick.com_pct == pytest.approx((0 + 0 + 1) / 3)
