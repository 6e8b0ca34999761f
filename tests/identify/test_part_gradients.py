"""Parts that are not homogeneous: profiles, recovery, the part named, and silence about homogeneous objects."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from steelyard.identify.masses.profiles import Profile
from steelyard.identify.part_masses import PartMasses
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.parts.parts import Parts
from steelyard.simulate.logs import simulate_log
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build, build_graded
from steelyard.workshop.tools import Tool


@cache
def even(name: str) -> Tool:
    return build(name)


def in_sensor(tool: Tool) -> Parts:
    return tool.parts.in_frame(tool.X_OS.inverse())


@cache
def motion(noise: str, seed: int) -> tuple[MotionLog, MotionLog, InertialParameters]:
    ordered, body = simulate_log("hammer", "stop_go", noise, seed, shuffled=False)
    clean, _ = simulate_log("hammer", "stop_go", "none", seed, shuffled=False)
    return ordered, clean, body


def log_of(truth: InertialParameters, noise: str, seed: int) -> MotionLog:
    """Return a bench log with the wrench of another body: same motion, same noise."""
    ordered, clean, body = motion(noise, seed)
    return replace(ordered, wrench=ordered.wrench + clean.predicted(truth.vector) - clean.predicted(body.vector))


@pytest.mark.parametrize("interior", [True, False])
def test_an_even_profile_has_the_moments_of_the_part_and_true_slopes(interior: bool) -> None:
    parts = in_sensor(even("hammer"))
    parts = parts if interior else replace(parts, interior=None)
    tilt = np.array([0.3, -0.2, 0.5, 0.1, -0.1, 0.05, 0.2, 0.0, -0.1])
    for k in range(len(parts)):
        profile = Profile.of(parts, k)
        b, slope = profile.tilted(np.zeros(9))
        np.testing.assert_allclose(b, parts.per_mass[:, k], rtol=1e-9, atol=1e-12)
        _, slope = profile.tilted(tilt)
        for i, step in enumerate(1e-6 * np.eye(9)):
            by_differences = (profile.tilted(tilt + step)[0] - profile.tilted(tilt - step)[0]) / 2e-6
            np.testing.assert_allclose(slope[:, i], by_differences, atol=1e-6 * np.abs(slope).max())


def test_every_profile_is_a_body_within_the_part() -> None:
    parts = in_sensor(even("rubber-mallet"))
    rng = np.random.default_rng(0)
    profile = Profile.of(parts, 1)
    reach = np.abs(profile.place).max(0)
    for size in (0.1, 1.0, 5.0):
        tilt = size * rng.normal(size=9)
        b, _ = profile.tilted(tilt)
        InertialParameters(b).require_consistent()
        assert (np.abs(profile.shift(tilt)) < reach).all()


def test_profiles_turn_with_the_frame_and_join_with_the_parts() -> None:
    parts = in_sensor(even("hammer"))
    X = Pose(Rotation.exp([0.3, -0.5, 0.2]), np.array([0.02, 0.05, -0.01]))
    turned = parts.in_frame(X)
    assert parts.interior is not None
    assert turned.interior is not None
    here, there = parts.interior.points(1, 50)[0], turned.interior.points(1, 50)[0]
    np.testing.assert_allclose(there, X.apply(here), atol=1e-12)
    joined = parts.merged([[0, 1], [2]])
    assert joined.interior is not None
    points, volume = joined.interior.points(0, 400)
    assert volume.sum() == pytest.approx(joined.volume[0], rel=0.1)
    np.testing.assert_allclose(volume @ points / volume.sum(), joined.centroid[0], atol=6e-3)


def test_a_graded_part_is_recovered_without_noise() -> None:
    tool = build_graded("box-wrench")
    log = log_of(tool.truth_in_sensor, "none", 0)
    found = PartMasses(in_sensor(tool), bias="none").identify(log)
    truth = tool.truth_in_sensor
    assert "part-not-homogeneous" in found.codes()
    np.testing.assert_allclose(found.parameters.com, truth.com, atol=1e-5)
    np.testing.assert_allclose(
        found.parameters.inertia_com, truth.inertia_com, atol=0.01 * np.diag(truth.inertia_com).max()
    )


@pytest.mark.parametrize("name", ["box-wrench", "rubber-mallet"])
def test_the_graded_part_is_named_and_the_answer_is_better(name: str) -> None:
    tool = build_graded(name)
    truth = tool.truth_in_sensor
    part = next(k for k, words in enumerate(tool.gradings) if words)
    found = PartMasses(in_sensor(tool), bias="none").identify(log_of(truth, "low", 1))
    (message,) = [f.message for f in found.findings if f.code == "part-not-homogeneous"]
    assert f"Part {part}" in message
    assert "from one end to the other" in message
    assert found.parameters.validity().consistent
    off = np.abs(found.parameters.com - truth.com)
    assert (off < np.maximum(4 * found.std[1:4], 1e-6)).all()
    assert off.max() < 5e-4
    masses = np.array([p.mass for p in found.parts])
    np.testing.assert_allclose(masses, tool.masses, rtol=0.15)


def test_two_densities_in_one_part_are_better_than_a_uniform_part() -> None:
    tool = even("rubber-mallet")
    merged = in_sensor(tool).merged([[0, 1]])
    truth = tool.truth_in_sensor
    found = PartMasses(merged, bias="none").identify(log_of(truth, "low", 2))
    uniform = merged.whole(np.array([float(truth.mass)]))
    assert "part-not-homogeneous" in found.codes()
    error = np.abs(found.parameters.inertia - truth.inertia).max()
    assert error < 0.2 * np.abs(uniform.inertia - truth.inertia).max()


@pytest.mark.parametrize("name", ["hammer", "box-wrench"])
@pytest.mark.parametrize("noise", ["low", "high"])
def test_homogeneous_objects_are_never_called_uneven(name: str, noise: str) -> None:
    tool = even(name)
    estimator = PartMasses(in_sensor(tool), bias="none")
    for seed in range(20):
        found = estimator.identify(log_of(tool.truth_in_sensor, noise, seed))
        assert "part-not-homogeneous" not in found.codes()
