"""Exact moments of closed surfaces: closed forms, laws, voids, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest
from meshes import ball_mesh, box_mesh, joined, without

from columns import column_moments
from steelyard.errors import BadValue
from steelyard.inertia import solids
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.shape.mesh import TriangleMesh, open_edges, part_moments, require_closed
from steelyard.shape.nesting import overlap_finding, overlaps, solids_of, winding_number
from steelyard.spatial import Pose, Rotation

BOX = box_mesh((-0.01, -0.02, -0.03), (0.01, 0.02, 0.03))


def test_a_box_has_the_moments_of_the_closed_form() -> None:
    np.testing.assert_allclose(part_moments(BOX)[0], solids.box(0.02, 0.04, 0.06, 1.0).vector, rtol=1e-13, atol=1e-22)


def test_a_fine_ball_comes_near_the_closed_form() -> None:
    found = part_moments(ball_mesh(0.03, (0.0, 0.0, 0.0), 20_000))[0]
    np.testing.assert_allclose(found, solids.sphere(0.03, 1.0).vector, rtol=2e-3, atol=1e-12)


@pytest.mark.parametrize("far", [0.0, 1.0, 1e3])
def test_moments_move_with_the_frame_even_far_from_the_origin(far: float) -> None:
    X = Pose(Rotation.from_rpy(np.array([0.3, -0.8, 2.0])), far * np.array([1.0, -2.0, 0.5]))
    here = solids_of(BOX).moments[0]
    there = solids_of(BOX.in_frame(X)).moments[0]
    back = parts_of_mesh(BOX.in_frame(X)).in_frame(X.inverse()).moments[0]
    assert there[0] == pytest.approx(here[0], rel=1e-9)
    np.testing.assert_allclose(back, here, rtol=1e-9, atol=1e-11 * (1 + far**2) * abs(here).max())


def test_parts_add_up_to_the_whole() -> None:
    left, right = box_mesh((0, 0, 0), (0.02, 0.03, 0.04), 0), box_mesh((0.02, 0, 0), (0.05, 0.03, 0.04), 1)
    whole = box_mesh((0, 0, 0), (0.05, 0.03, 0.04))
    np.testing.assert_allclose(part_moments(joined(left, right)).sum(0), part_moments(whole)[0], rtol=1e-13)


def test_a_void_is_taken_from_the_part_around_it() -> None:
    mesh = joined(box_mesh((0, 0, 0), (0.1, 0.1, 0.1), 3), box_mesh((0.02,) * 3, (0.05,) * 3, 5, inward=True))
    found = solids_of(mesh)
    assert found.label.tolist() == [3]
    assert (found.void.tolist(), found.parent.tolist()) == ([5], [3])
    assert found.moments[0, 0] == pytest.approx(1e-3 - 27e-6)
    np.testing.assert_allclose(parts_of_mesh(mesh).moments, found.moments)


def test_a_void_belongs_to_the_smallest_part_around_it() -> None:
    mesh = joined(
        box_mesh((0, 0, 0), (0.1, 0.1, 0.1), 0),
        box_mesh((0.01,) * 3, (0.09,) * 3, 1, inward=True),
        box_mesh((0.02,) * 3, (0.08,) * 3, 2),
        box_mesh((0.03,) * 3, (0.05,) * 3, 3, inward=True),
    )
    found = solids_of(mesh)
    assert dict(zip(found.void.tolist(), found.parent.tolist(), strict=True)) == {1: 0, 3: 2}
    np.testing.assert_allclose(found.moments[:, 0], [1e-3 - 0.08**3, 0.06**3 - 0.02**3])
    assert overlap_finding(mesh) is None


def test_moments_agree_with_columns() -> None:
    mesh = joined(box_mesh((0, 0, 0), (0.1, 0.1, 0.08)), box_mesh((0.02,) * 3, (0.05,) * 3, inward=True))
    np.testing.assert_allclose(column_moments(mesh), part_moments(mesh)[0], rtol=2e-3)


def test_winding_numbers_tell_inside_from_outside() -> None:
    assert winding_number(BOX.corners, np.zeros(3)) == pytest.approx(1)
    assert winding_number(BOX.corners, np.array([0.1, 0, 0])) == pytest.approx(0, abs=1e-12)


def test_open_edges_are_counted_per_part() -> None:
    mesh = joined(BOX, without(box_mesh((1, 1, 1), (2, 2, 2), 1), 0, 5))
    assert open_edges(mesh).tolist() == [0, 6]
    assert open_edges(BOX).tolist() == [0]


def test_a_turned_triangle_is_as_bad_as_a_missing_one() -> None:
    turned = BOX.triangles.copy()
    turned[4] = turned[4, ::-1]
    assert open_edges(TriangleMesh(BOX.vertices, turned, BOX.part)).tolist() == [6]


def test_parts_that_touch_or_share_a_sliver_are_told_from_those_that_overlap() -> None:
    touching = joined(box_mesh((0, 0, 0), (0.02, 0.03, 0.04), 0), box_mesh((0.02, 0, 0), (0.05, 0.03, 0.04), 1))
    assert overlaps(touching) == ()
    small = joined(box_mesh((0, 0, 0), (0.1, 0.1, 0.1), 0), box_mesh((0.09, 0, 0), (0.12, 0.02, 0.02), 1))
    finding = overlap_finding(small)
    assert finding is not None
    assert finding.message == "Parts 0 and 1 share 4 cm^3 of space (33.3 % of the smaller, 0.4 % of the whole)."


MESSAGES = {
    "open": (
        lambda: require_closed(without(BOX, 3)),
        "part 0 is not closed: 3 edges lack a neighbour that runs the other way. "
        "Close the surface, weld equal vertices, and turn all triangles outward.",
    ),
    "inside out": (
        lambda: solids_of(box_mesh((0, 0, 0), (0.1, 0.1, 0.1), 2, inward=True)),
        "part 2 has a volume of -0.001 m^3, below zero, and lies in no other part. Turn its triangles outward.",
    ),
    "flat": (
        lambda: solids_of(joined(BOX, box_mesh((0, 0, 0), (0.1, 0.1, 0.0), 1))),
        "part 1 has a volume of 0 m^3, next to nothing. Leave it out, or give it thickness.",
    ),
    "overlap": (
        lambda: overlap_finding(joined(BOX, box_mesh((0, 0, 0), (0.015, 0.02, 0.03), 1))),
        "parts 0 and 1 share 6 cm^3 of space (66.7 % of the smaller, 10.5 % of the whole). "
        "Cut one out of the other, so that they only touch.",
    ),
    "no triangles": (
        lambda: TriangleMesh(np.zeros((3, 3)), np.zeros((0, 3)), np.zeros(0)),
        "a mesh needs vertices (V, 3) and triangles (F, 3), F > 0; got (3, 3) and (0, 3).",
    ),
    "labels": (
        lambda: TriangleMesh(BOX.vertices, BOX.triangles, np.zeros(3)),
        "each of the 12 triangles needs one part label; got (3,).",
    ),
    "colours": (
        lambda: TriangleMesh(BOX.vertices, BOX.triangles, BOX.part, np.zeros((3, 3))),
        "each of the 12 triangles needs one colour; got (3, 3).",
    ),
    "vertex numbers": (
        lambda: TriangleMesh(BOX.vertices, BOX.triangles + 1, BOX.part),
        "triangles must name vertices 0..7; got 1..8.",
    ),
}  # fmt: skip


def test_colours_of_triangles_may_be_floats_from_0_to_1() -> None:
    colours = np.tile([0.0, 0.5, 1.0], (12, 1))
    coloured = TriangleMesh(BOX.vertices, BOX.triangles, BOX.part, colours)
    assert coloured.rgb[0].tolist() == [0, 128, 255]


@pytest.mark.parametrize("case", MESSAGES)
def test_each_wrong_mesh_has_one_clear_error(case: str) -> None:
    make, text = MESSAGES[case]
    with pytest.raises(BadValue) as caught:
        make()
    assert str(caught.value) == text
