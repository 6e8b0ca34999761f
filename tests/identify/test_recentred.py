"""Mass and centre follow the log where shape and grasp are uncertain: against dense matrices, and on made logs."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.recentred import apart, recentred
from steelyard.identify.masses.shape_error import MEASURED, ShapeError
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters, solids
from steelyard.inertia.people import parameter_jacobian, people_jacobian
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

BODY = solids.box(0.1, 0.06, 0.04, 0.8).in_frame(Pose(Rotation.exp([0.1, 0.4, 0.2]), np.array([0.02, -0.03, 0.15])))
GRASP = ShapeError(grasp_m=0.003, grasp_rad=0.03, com_m=1e-4, inertia_share=3e-3)

DENSITIES = np.array([700.0, 7800.0, 1100.0])
HAMMER = Parts(
    np.arange(3),
    np.stack(
        [
            solids.box(*size, 1.0).in_frame(Pose(Rotation.identity(), np.array(centre))).vector
            for size, centre in (
                ([0.03, 0.03, 0.22], [0, 0, 0.15]),
                ([0.12, 0.04, 0.04], [0.01, 0, 0.28]),
                ([0.035, 0.035, 0.05], [0, 0, 0.03]),
            )
        ]
    ),
)


def told(truth: InertialParameters, std: float) -> Effective:
    """Return a log that knows mass, centre and inertia to a multiple `std` of sizes natural for a hand tool."""
    people = people_jacobian(truth.vector)
    sizes = std * np.array([0.1, *[0.01] * 3, *[1e-4] * 6])
    information = people.T @ np.diag(1 / sizes**2) @ people
    return Effective(information, information @ truth.vector, np.zeros(0), np.zeros((0, 10)))


def shifted(by: float) -> InertialParameters:
    return InertialParameters.from_com(float(BODY.mass), BODY.com + by * np.array([1, -1, 0.5]), BODY.inertia_com)


def test_a_precise_log_decides_and_a_vague_one_does_not() -> None:
    truth, error = shifted(0.005), GRASP.with_grasp(BODY)
    near = recentred(told(truth, 1e-3), BODY, error)
    np.testing.assert_allclose(near.body.com, truth.com, atol=2e-5)
    assert (
        np.sqrt(np.diag(people_jacobian(BODY.vector) @ near.error @ people_jacobian(BODY.vector).T))[1:4].max() < 2e-5
    )
    far = recentred(told(truth, 1e3), BODY, error)
    np.testing.assert_allclose(far.body.com, BODY.com, atol=1e-7)
    np.testing.assert_allclose(far.error, error, atol=1e-5 * np.abs(error).max())
    np.testing.assert_allclose(near.body.inertia_com, BODY.inertia_com)


def test_it_is_the_conditional_mean_of_mass_and_centre() -> None:
    """e ~ N(0, G) and a log of mass and centre with covariance P: mean and covariance of e given both."""
    data, error = told(shifted(0.002), 0.3), GRASP.with_grasp(BODY) + 1e-6 * np.diag([1, *[0] * 9])
    people, slopes = people_jacobian(BODY.vector)[:4], parameter_jacobian(BODY.vector)
    half = np.trace(BODY.inertia_com) / 2
    inertia = np.diag([0.0] * 4 + [1 / half**2] * 6)  # the inertia may be off by half its trace
    of_log = np.linalg.inv(slopes.T @ data.information @ slopes + inertia)
    seen = (of_log @ slopes.T @ (data.pull - data.information @ BODY.vector))[:4]
    P, G = of_log[:4, :4], people @ error @ people.T
    gain = G @ np.linalg.inv(G + P)
    found = recentred(data, BODY, error)
    moved = np.append(found.body.mass - BODY.mass, found.body.com - BODY.com)
    np.testing.assert_allclose(moved, gain @ seen, rtol=1e-6, atol=1e-12)
    np.testing.assert_allclose(people @ found.error @ people.T, G - gain @ G, rtol=1e-6, atol=1e-14)
    assert np.linalg.eigvalsh(found.error).min() > -1e-12 * np.abs(found.error).max()


def test_its_slope_is_that_of_the_move() -> None:
    data, error = told(shifted(0.002), 0.3), GRASP.with_grasp(BODY)
    step = 1e-4 * data.pull
    there = recentred(replace(data, pull=data.pull + step), BODY, error).body
    here = recentred(data, BODY, error)
    np.testing.assert_allclose(there.vector - here.body.vector, here.gain @ step, rtol=1e-2, atol=1e-9)


@pytest.mark.parametrize("std", [0.01, 0.08])
def test_how_far_apart_shape_and_log_are_is_one_where_both_say_how_wrong_they_are(std: float) -> None:
    body, rng = InertialParameters(1000 * BODY.vector), np.random.default_rng(0)
    error = ShapeError(com_m=1e-3, stretch=0.075).covariance(body)
    people, found = people_jacobian(body.vector)[1:4], []
    for off in rng.multivariate_normal(np.zeros(3), people @ error @ people.T, 400):
        noise = rng.normal(0, std * 0.01, 3)
        truth = InertialParameters.from_com(float(body.mass), body.com + off + noise, body.inertia_com)
        found.append(apart(told(truth, std), body, error))
    assert 0.93 < np.sqrt(np.mean(np.square(found))) < 1.07
    assert apart(told(InertialParameters(2 * body.vector), 1e3), body, error) == 0.0  # a log that sees nothing


SCANNED = ShapeError(com_m=1e-4, inertia_share=3e-3, stretch=0.075)


@pytest.mark.parametrize("motion", ["static", "paper"])
def test_a_scan_leaves_the_centre_to_the_log_rows_at_rest_too(motion: str) -> None:
    """The scan has the head a tenth too large: its centre is millimetres off, and the log knows better."""
    truth, drawn = (HAMMER.whole(HAMMER.volume * 2000.0 * np.array([1.0, by, 1.0])) for by in (1.0, 1.1))
    scan = Parts(np.arange(1), drawn.vector[None] / 2000.0)
    assert np.linalg.norm(drawn.com - truth.com) > 3e-3
    bars, score = [], []
    for seed in range(6):
        log = handling_log(truth, motion, noise="low", seed=seed)
        found = PartMasses(scan, bias="none", shape_error=SCANNED).identify(log)
        bars.append(found.std[1:4].max())
        score.append((found.com - truth.com) / found.std[1:4])
    assert max(bars) < 3e-4
    assert np.sqrt(np.mean(np.square(score))) < 1.5


def test_a_log_that_knows_the_inertia_better_than_the_scan_takes_it_over() -> None:
    truth, drawn = (HAMMER.whole(HAMMER.volume * 2000.0 * np.array([1.0, by, 1.0])) for by in (1.0, 1.4))
    scan = Parts(np.arange(1), drawn.vector[None] / 2000.0)
    log = handling_log(truth, "paper", noise=(1e-3, 1e-4, 1e-3, 5e-5), seed=0)
    found = PartMasses(scan, bias="none", shape_error=SCANNED).identify(log)
    wrong = np.linalg.norm(drawn.inertia_com * float(truth.mass / drawn.mass) - truth.inertia_com)
    assert np.linalg.norm(found.parameters.inertia_com - truth.inertia_com) < 0.2 * wrong
    upper = np.triu_indices(3)
    assert (np.abs((found.parameters.inertia_com - truth.inertia_com)[upper]) < 3 * found.std[4:]).all()


@pytest.mark.parametrize("noise", ["none", "low"])
def test_masses_of_a_scans_parts_bear_their_borders(noise: str) -> None:
    """The head is drawn a millimetre off. A log without noise is no harder than one with it."""
    truth = HAMMER.volume * DENSITIES
    log = handling_log(HAMMER.whole(truth), "paper", noise=noise, seed=0)
    there = replace(HAMMER, label=np.arange(1), moments=HAMMER.moments[1:2])
    head = there.in_frame(Pose(Rotation.identity(), np.array([0, 0, -1e-3]))).moments
    drawn = replace(HAMMER, moments=np.concatenate([HAMMER.moments[:1], head, HAMMER.moments[2:]]))
    found = PartMasses(drawn, bias="none", shape_error=SCANNED).identify(log)
    mass, std = np.array([(part.mass, part.std) for part in found.parts]).T
    assert (np.abs(mass - truth) < 3 * std).all()
    assert std.max() < 0.1 * truth.sum()


def test_a_scan_far_from_what_the_log_sees_is_trusted_less() -> None:
    truth, drawn = (HAMMER.whole(HAMMER.volume * 2000.0 * np.array([1.0, by, 1.0])) for by in (1.0, 1.5))
    log = handling_log(truth, "static", noise="low", seed=0)
    bars = {}
    for name, body in (("right", truth), ("wrong", drawn)):
        scan = Parts(np.arange(1), body.vector[None] / 2000.0)
        found = PartMasses(scan, bias="none", shape_error=SCANNED).identify(log)
        bars[name] = found.std[4:]
        assert any("standard deviations apart" in note for note in found.notes) == (name == "wrong")
    assert (bars["wrong"] > 2 * bars["right"]).all()


@pytest.mark.parametrize(("metres", "degrees"), [(5e-4, 0.3), (3e-3, 2.0)])
@pytest.mark.parametrize("noise", ["low", "high"])
def test_an_uncertain_grasp_leaves_the_centre_to_the_log(metres: float, degrees: float, noise: str) -> None:
    parts, rng = HAMMER, np.random.default_rng(0)
    given = replace(MEASURED, grasp_m=metres, grasp_rad=np.radians(degrees))
    score, error, alone, told = [], [], [], []
    for seed in range(8):
        X = Pose(Rotation.exp(rng.normal(size=3) * given.grasp_rad), rng.normal(size=3) * metres)
        truth = parts.whole(parts.volume * DENSITIES).in_frame(X)
        log = handling_log(truth, "paper", noise=noise, seed=seed)
        found = PartMasses(parts, bias="none", shape_error=given).identify(log)
        told += [f.code for f in found.findings]  # a place as wrong as it was said to be is none
        score.append((found.com - truth.com) / found.std[1:4])
        error.append(np.linalg.norm(found.com - truth.com))
        alone.append(np.linalg.norm(parts.whole(parts.volume * DENSITIES).com - truth.com))
    assert np.sqrt(np.mean(np.square(score))) < 1.5
    assert told == []
    assert np.median(error) < 0.5 * np.median(alone)
