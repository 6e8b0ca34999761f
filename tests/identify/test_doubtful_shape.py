"""Part masses of a shape that is a scan: what it has wrong must not bend the masses, and the log moves the centre."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.identify.masses.shape_error import CORE, MEASURED, ShapeError
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters, solids
from steelyard.inertia.parameters import frame_change
from steelyard.inertia.people import people_jacobian
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

BODY = InertialParameters.from_com(
    2.0, [0.1, -0.2, 0.05], [[0.3, 0.02, -0.01], [0.02, 0.28, 0.04], [-0.01, 0.04, 0.07]]
)
OFF = np.array([6e-4, -4e-4, 5e-4])


@pytest.fixture(scope="module")
def parts() -> Parts:
    """A heavy head at the end of a light shaft."""
    shaft = solids.box(0.03, 0.2, 0.03, 1.0).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.1, 0.0])))
    head = solids.box(0.12, 0.04, 0.04, 1.0).in_frame(Pose(Rotation.identity(), np.array([0.0, 0.22, 0.01])))
    return Parts(np.arange(2), np.stack([shaft.vector, head.vector]))


def test_a_doubtful_shape_is_put_right_by_the_log(parts: Parts) -> None:
    truth = parts.whole(np.array([0.14, 1.5]))
    seen = parts.in_frame(Pose(Rotation.identity(), OFF))
    log = handling_log(truth, noise="low", seed=3)
    trusted = PartMasses(seen, bias="none", shape_error=MEASURED).identify(log)
    doubted = PartMasses(seen, bias="none", shape_error=ShapeError(com_m=5e-4, inertia_share=0.02)).identify(log)
    assert "part-not-homogeneous" in trusted.codes()  # the shape is wrong by more than a measured one may be
    assert np.abs(doubted.com - truth.com).max() < 1e-4
    assert (np.abs(doubted.com - truth.com) < 3 * doubted.std[1:4]).all()
    assert np.abs(doubted.parameters.inertia_com - truth.inertia_com).max() < 0.04 * np.trace(truth.inertia_com)
    assert "part-not-homogeneous" not in doubted.codes()


def test_without_an_error_the_doubt_costs_little(parts: Parts) -> None:
    truth = parts.whole(np.array([0.14, 1.5]))
    log = handling_log(truth, noise="low", seed=4)
    doubted = PartMasses(parts, bias="none", shape_error=ShapeError(com_m=5e-4, inertia_share=0.02)).identify(log)
    assert np.abs(doubted.com - truth.com).max() < 1e-4
    assert doubted.parameters.validity().consistent


def test_a_shape_that_is_turned_as_a_whole_errs_as_turns_make_it() -> None:
    error, turns = ShapeError(turn_rad=0.02), np.random.default_rng(0).normal(0, 0.02, (20_000, 3))
    R = Rotation.exp(turns).matrix
    drawn = R @ BODY.inertia_com @ R.swapaxes(1, 2)
    jacobian = people_jacobian(BODY.vector)
    std = np.sqrt(np.diag(jacobian @ error.covariance(BODY) @ jacobian.T))
    assert std[:4] == pytest.approx(0, abs=1e-12)  # about its centre
    np.testing.assert_allclose(std[4:], drawn[:, *np.triu_indices(3)].std(0), rtol=0.05)


def test_where_a_scan_lies_widens_bars_and_leaves_the_rule_as_it_is(parts: Parts) -> None:
    """Inertia still goes as the log says, and does so where a grasp is declared to be unsure."""
    truth = parts.whole(np.array([0.14, 1.5]))
    log = handling_log(truth, noise="low", seed=3)
    scan = ShapeError(com_m=2e-4, stretch=0.1)
    sure, hardly, unsure, grasped = (
        PartMasses(parts, bias="none", shape_error=error).identify(log)
        for error in (scan, scan.laid(1e-5, 1e-5), scan.laid(1e-3, 0.05), scan.placed(1e-5, 1e-5))
    )
    off = np.abs(hardly.parameters.vector - sure.parameters.vector) / sure.std
    assert off.max() < 0.01
    assert (np.abs(grasped.parameters.vector - sure.parameters.vector) / sure.std).max() < 0.01
    assert (unsure.std[4:] > 1.1 * sure.std[4:]).any()


def test_an_unsure_grasp_of_a_scan_makes_no_answer_worse_than_the_log_alone(parts: Parts) -> None:
    """Bars had been ten times those of the log: a grasp of which the log knows better had been kept."""
    X = Pose(Rotation.exp(np.radians([0.5, -0.4, 0.6])), np.array([0.9e-3, -1.1e-3, 0.7e-3]))
    truth = parts.whole(np.array([0.14, 1.5])).in_frame(X)
    log = handling_log(truth, noise="low", seed=3)
    error = ShapeError(com_m=2e-4, stretch=0.1).placed(1e-3, np.radians(0.5))
    found = PartMasses(parts, bias="none", shape_error=error).identify(log)
    alone = NoiseAware(bias="none").identify(log)
    assert found.codes() == set()
    assert (found.std[1:] < 1.1 * alone.std[1:]).all()
    off = (found.parameters.people - truth.people) / found.std
    assert np.sqrt(np.mean(off**2)) < 2


def test_a_grasp_turns_about_the_origin_of_the_object_where_that_is_said() -> None:
    at, error = np.array([0.3, 0.0, 0.0]), ShapeError(grasp_rad=0.01)
    here, there = (error.placed(0.0, 0.0, place).with_grasp(BODY) for place in (BODY.com, BODY.com + at))
    jacobian = people_jacobian(BODY.vector)[1:4]
    std = [np.sqrt(np.diag(jacobian @ covariance @ jacobian.T)) for covariance in (here, there)]
    assert std[0] == pytest.approx(np.zeros(3), abs=1e-4)
    assert std[1] == pytest.approx([0.0, 0.003, 0.003], abs=1e-4)


def test_a_stretch_errs_alike_in_every_frame() -> None:
    X = Pose(Rotation.exp(np.array([0.4, -1.1, 0.7])), np.array([0.3, 0.0, -0.2]))
    error, change = ShapeError(stretch=0.1), frame_change(X)
    expected = change @ error.covariance(BODY) @ change.T
    np.testing.assert_allclose(error.covariance(BODY.in_frame(X)), expected, rtol=1e-9, atol=1e-15)


def test_a_stretch_is_a_share_of_each_second_moment() -> None:
    rod = solids.box(0.01, 1.0, 0.02, 3000.0)
    std = np.sqrt(np.diag(ShapeError(stretch=0.1).covariance(rod)))[4:]
    x, y, z = np.sort(0.5 * np.trace(rod.inertia_com) - np.diag(rod.inertia_com))
    # The longest axis of the box is y. Across it a core may hide, along it none.
    dx, dy, dz = (v * np.hypot(0.1, CORE * (1 - np.sqrt(v / z))) for v in (x, z, y))
    # Ixx = y + z, Iyy = x + z, Izz = x + y; products come from both of their axes.
    expected = [
        np.hypot(dy, dz),
        0.1 * np.sqrt(x * z / 2),
        0.1 * np.sqrt(x * y / 2),
        np.hypot(dx, dz),
        0.1 * np.sqrt(z * y / 2),
        np.hypot(dx, dy),
    ]
    np.testing.assert_allclose(std, expected, rtol=1e-9)


def test_a_core_that_nobody_sees_is_within_the_bars_of_a_long_scan_and_not_of_a_ball() -> None:
    """A steel rod in a handle of plastic, taken for one body of their mean density."""
    grip, tang = solids.cylinder(0.014, 0.1, 1300.0), solids.cylinder(0.003, 0.1, 7800.0 - 1300.0)
    true = grip + tang
    drawn = solids.cylinder(0.014, 0.1, 1300.0 * float(true.mass / grip.mass))
    jacobian = people_jacobian(drawn.vector)[4:]
    std = np.sqrt(np.diag(jacobian @ ShapeError(stretch=0.04).covariance(drawn) @ jacobian.T))
    off = np.abs(drawn.inertia_com - true.inertia_com)[np.triu_indices(3)]
    assert off[5] > 0.2 * true.inertia_com[2, 2]
    assert (off < 3 * std + 1e-12).all()
    ball = solids.sphere(0.03, 1000.0)
    assert np.sqrt(ShapeError(stretch=0.04).covariance(ball)[4, 4]) < 0.06 * ball.inertia_com[0, 0]


def test_a_stretch_is_what_random_strains_do() -> None:
    """Against draws: lengths that change by a small share e in the body's own axes change second moments by 2 e."""
    inertia, jacobian = BODY.inertia_com, people_jacobian(BODY.vector)
    moments = np.linalg.eigvalsh(0.5 * np.trace(inertia) * np.eye(3) - inertia)
    share = np.hypot(0.01, CORE * (1 - np.sqrt(moments / moments[-1])))
    strain = np.random.default_rng(0).normal(0, share / 2, (20_000, 3))
    size = (moments * (1 + strain) ** 2).sum(1)  # the trace of the second moments, half that of the inertia
    half = np.array([0, 0, 0, 0, 0.5, 0, 0, 0.5, 0, 0.5])
    covariance = jacobian @ ShapeError(stretch=0.01).covariance(BODY) @ jacobian.T
    assert half @ covariance @ half == pytest.approx(np.var(size), rel=0.03)


def test_a_grasp_that_may_be_far_off_moves_the_body_as_drawn_turns_do() -> None:
    """In second order, too: along the arm that turns the centre stays behind, and by first order alone it would not."""
    body = InertialParameters.from_com(0.6, [0.0, 0.2, 0.0], np.diag([1e-3, 2e-4, 1e-3]))
    error, rad = ShapeError(com_m=0.0, inertia_share=0.0, grasp_rad=0.3), 0.3
    draws = rad * np.random.default_rng(0).normal(size=600)
    moved = np.zeros((10, 10))
    for axis in np.eye(3):
        off = np.stack([body.in_frame(Pose(Rotation.exp(u * axis), np.zeros(3))).vector for u in draws]) - body.vector
        moved += off.T @ off / len(off)
    found = np.diag(error.with_grasp(body))
    np.testing.assert_allclose(found[1:4], np.diag(moved)[1:4], rtol=0.25, atol=1e-8)
