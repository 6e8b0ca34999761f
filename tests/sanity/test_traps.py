"""Every trap x every kind of log: the one code that is true is named, and none where nothing is wrong."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from synthetic import Kind, write
from traps import TIMED_TRAPS, TRAPS, delayed, edited, tilted

from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines import held_object
from steelyard.sanity.before import examine
from steelyard.simulate import scenarios
from steelyard.spatial import Rotation

REAL = ("kuka_static", "kuka_run1", "kuka_run2")
KINDS = {
    "plain": Kind(),
    "noisy, turned imu, no position": Kind("wrench", 3.0, 1, imu_turned=True, with_position=False),
    "quiet": Kind("box_tool", 0.2, 2, imu_turned=True),
    "light": Kind("screwdriver", 1.0, 3),
    "without noise": Kind("pan", 0.0, 4, with_position=False),
}
MISTAKES: dict[str, tuple[dict[str, Any], set[str]]] = {
    "none": ({}, set()),
    "sign": ({"sign_flipped": True}, {"wrench-sign-flipped"}),
    "transposed": ({"transposed": True}, {"gravity-frame"}),
    "quaternion": ({"quaternion_swapped": True}, {"quaternion-order"}),
    "accelerometer in g": ({"accelerometer_in_g": True}, {"gravity-in-g"}),
    "gravity in g": ({"gravity": (0, 0, -1)}, {"gravity-in-g"}),
    "gravity up": ({"gravity": (0, 0, 9.81)}, {"gravity-frame"}),
    "gravity along x": ({"gravity": (9.81, 0, 0)}, {"gravity-frame"}),
    "torque in N mm": ({"torque_scale": 1e3}, {"length-in-mm"}),
    "tilt": ({"tilt_deg": (20, 0)}, {"base-tilted"}),
    "tilt about two axes": ({"tilt_deg": (-12, 16)}, {"base-tilted"}),
    "small tilt": ({"tilt_deg": (3.5, 0)}, {"base-tilted"}),
    "late": ({"imu_late": 0.02}, set()),  # alignment names it
    "repeated, same stamps": ({"repeated": "same"}, {"rows-duplicated"}),
    "repeated, new stamps": ({"repeated": "new"}, {"rows-duplicated"}),
}


def codes(findings: tuple[Finding, ...]) -> set[str]:
    return {f.code for f in findings}


@cache
def real(name: str, examples: Path, data: Path) -> Recording:
    return read_recording(examples / f"{name}.toml", data=data)


@cache
def right_on_poses(examples: Path, data: Path) -> Estimate:
    return held_object.identify(real("kuka_static", examples, data))


def made(folder: Path, kind: Kind, **mistake: Any) -> Recording:
    return read_recording(write(folder, replace(kind, **mistake)))


def assert_same_body(estimate: Estimate, kind: Kind, mass_share: float, com_mm: float) -> None:
    truth = scenarios.body(kind.object).parameters()
    assert abs(estimate.mass / float(truth.mass) - 1) < mass_share
    assert np.linalg.norm(estimate.com - truth.com) * 1e3 < com_mm


@pytest.mark.parametrize("name", REAL)
def test_real_logs_are_clean(name: str, examples_dir: Path, data_dir: Path) -> None:
    recording = real(name, examples_dir, data_dir)
    same, findings = examine(recording)
    assert findings == ()
    assert same.wrench_sign == recording.wrench_sign
    assert all(a.channels == b.channels for a, b in zip(same.streams, recording.streams, strict=True))


@pytest.mark.parametrize("trap", TRAPS)
@pytest.mark.parametrize("name", REAL)
def test_real_logs_with_a_trap(name: str, trap: str, examples_dir: Path, data_dir: Path) -> None:
    edit, code = TRAPS[trap]
    assert codes(examine(edit(real(name, examples_dir, data_dir)))[1]) == {code}


@pytest.mark.parametrize("trap", TIMED_TRAPS)
@pytest.mark.parametrize("name", REAL[1:])
def test_real_motions_with_a_trap(name: str, trap: str, examples_dir: Path, data_dir: Path) -> None:
    edit, code = TIMED_TRAPS[trap]
    assert codes(examine(edit(real(name, examples_dir, data_dir)))[1]) == {code}


@pytest.mark.parametrize("mistake", MISTAKES)
@pytest.mark.parametrize("kind", KINDS)
def test_made_logs(kind: str, mistake: str, tmp_path: Path) -> None:
    change, expected = MISTAKES[mistake]
    assert codes(examine(made(tmp_path, KINDS[kind], **change))[1]) == expected


@pytest.mark.parametrize("kind", ["plain", "quiet"])
def test_positions_in_millimetres(kind: str, tmp_path: Path) -> None:
    recording, findings = examine(made(tmp_path, KINDS[kind], position_scale=1e3))
    assert codes(findings) == {"length-in-mm"}
    position = next(s.channels["position"] for s in recording.streams if "position" in s.channels)
    assert np.abs(position).max() < 2


@pytest.mark.parametrize("object_name", scenarios.object_names())
def test_clean_logs_stay_clean(object_name: str, tmp_path: Path) -> None:
    for seed, noise in ((10, 0.0), (12, 5.0)):
        recording = made(tmp_path, Kind(object_name, noise, seed))
        assert examine(recording)[1] == ()
        assert examine(delayed(recording, "rotation", 0.1))[1] == ()
        coarse = edited(recording, force=lambda v: np.round(v, 1), torque=lambda v: np.round(v, 2))
        assert examine(coarse)[1] == ()


@pytest.mark.parametrize(
    "trap",
    [
        "sign",
        "transposed",
        "w first",
        "w last",
        "gravity along y",
        "torque in N mm",
        "tilt 20",
        "rows twice, same stamps",
        "rotation vector, radians as degrees",
        "wrench in W",
        "force and torque exchanged",
    ],
)
def test_the_answer_survives_on_poses(trap: str, examples_dir: Path, data_dir: Path) -> None:
    right = right_on_poses(examples_dir, data_dir)
    found = held_object.identify(TRAPS[trap][0](real("kuka_static", examples_dir, data_dir)))
    assert abs(found.mass - right.mass) < 1e-3
    assert np.linalg.norm(found.com - right.com) < 3e-4
    assert TRAPS[trap][1] in found.codes()


def test_tilt_is_given_in_degrees(examples_dir: Path, data_dir: Path) -> None:
    recording, findings = examine(tilted(real("kuka_static", examples_dir, data_dir), 20, 0, 0))
    assert "Gravity fits 20" in findings[0].message
    assert np.degrees(np.arccos(-recording.gravity[2] / 9.82)) < 1


def test_rest_cannot_tell_wrench_from_gravity(examples_dir: Path, data_dir: Path) -> None:
    finding = examine(TRAPS["sign"][0](real("kuka_static", examples_dir, data_dir)))[1][0]
    assert "cannot tell the sign of the wrench from the sign of gravity" in finding.message


def test_motion_can(tmp_path: Path) -> None:
    for mistake in ({"sign_flipped": True}, {"gravity": (0, 0, 9.81)}):
        finding = examine(made(tmp_path, KINDS["plain"], **mistake))[1][0]
        assert "cannot tell" not in finding.message


@pytest.mark.parametrize("tilt", [0.0, 1.0, 3.0])
def test_a_flipped_wrench_is_seen_in_turns_about_one_axis(tilt: float) -> None:
    """Half a turn of S about that axis does as the flip does, and takes a tilt in as well."""
    time = np.arange(0, 30, 0.01)
    turns = Rotation.exp(np.outer(1.2 * np.sin(0.5 * time) + 0.3 * np.sin(1.3 * time), [1, 0, 0]))
    gravity = Rotation.exp(np.radians([tilt, 0, 0])).apply(np.array([0, 0, -9.81]))
    force = -2.0 * turns.inverse().apply(gravity)
    torque, rng = np.cross([0.02, 0.01, 0.08], force), np.random.default_rng(0)
    channels = {
        "rotation": turns.matrix,
        "force": -force + 0.05 * rng.normal(size=force.shape),
        "torque": -torque + 0.0025 * rng.normal(size=force.shape),
    }
    _, findings = examine(Recording((Stream("log", channels, time),), np.array([0, 0, -9.81])))
    assert "wrench-sign-flipped" in codes(findings)


def test_the_axes_of_the_wrench_are_said(examples_dir: Path, data_dir: Path) -> None:
    recording = real("kuka_static", examples_dir, data_dir)
    for trap, right in (("wrench in W", "W"), ("wrench said to be in W", "S")):
        read, (finding,) = examine(TRAPS[trap][0](recording))
        assert f"The wrench is in the axes of {right}" in finding.message
        assert f'frame = "{right}"' in finding.remedy
        assert read.streams[0].frames["force"] == right


def test_a_weight_taken_away_is_in_no_other_axes(examples_dir: Path, data_dir: Path) -> None:
    recording = real("kuka_static", examples_dir, data_dir)
    noise = np.random.default_rng(5)
    for bias in ([0.0, 0.0, 8.0], [0.0, 0.0, -8.0]):
        empty = edited(
            recording,
            force=lambda v, bias=bias: noise.normal(bias, 0.1, v.shape),
            torque=lambda v: noise.normal(0, 0.005, v.shape),
        )
        assert not [f for f in examine(empty)[1] if "axes" in f.message]


def test_two_mistakes(examples_dir: Path, data_dir: Path) -> None:
    both = TRAPS["sign"][0](TRAPS["transposed"][0](real("kuka_static", examples_dir, data_dir)))
    assert codes(examine(both)[1]) == {"wrench-sign-flipped", "gravity-frame"}


@pytest.mark.parametrize(
    ("mistake", "expected"),
    [
        ({}, set()),
        ({"imu_late": 0.02}, {"stream-delayed"}),
        ({"drift": 0.3}, {"bias-drift"}),
        ({"sign_flipped": True}, {"wrench-sign-flipped"}),
        ({"tilt_deg": (20, 0)}, {"base-tilted"}),
    ],
)
def test_whole_pipeline(mistake: dict[str, Any], expected: set[str], tmp_path: Path) -> None:
    estimate = held_object.identify(made(tmp_path, KINDS["plain"], **mistake))
    assert estimate.codes() - {"inertia-not-identified"} == expected
    if "drift" not in mistake:
        assert_same_body(estimate, KINDS["plain"], 0.003, 0.5)


@pytest.mark.parametrize(
    ("declared", "expected"), [(0.06, set()), (0.3, {"noise-level-off"}), (0.004, {"noise-level-off"})]
)
def test_declared_noise(declared: float, expected: set[str], tmp_path: Path) -> None:
    estimate = held_object.identify(made(tmp_path, KINDS["plain"], declared_force=declared))
    assert estimate.codes() - {"inertia-not-identified"} == expected


def test_real_motion_with_a_late_accelerometer(examples_dir: Path, data_dir: Path) -> None:
    recording = delayed(real("kuka_run1", examples_dir, data_dir), "specific_force", 0.02)
    estimate = held_object.identify(recording)
    assert estimate.codes() - {"inertia-not-identified"} == {"stream-delayed", "imu-rotated", "nearly-planar"}
    late = next(v for k, v in estimate.delays_s.items() if "accel" in k)
    assert 0.024 < late < 0.031


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("kuka_static", set()),
        ("kuka_run1", {"stream-delayed", "imu-rotated", "nearly-planar"}),
        ("kuka_run2", {"stream-delayed", "imu-rotated", "nearly-planar", "outliers"}),
    ],
)
def test_real_logs_carry_what_is_true(name: str, expected: set[str], examples_dir: Path, data_dir: Path) -> None:
    estimate = held_object.identify(real(name, examples_dir, data_dir))
    assert estimate.codes() - {"inertia-not-identified"} == expected


def test_a_drift_that_was_put_right_leaves_the_declared_noise_alone(tmp_path: Path) -> None:
    kind = Kind("box_tool", 1.0, 2, drift=0.2)
    declared = held_object.identify(made(tmp_path, kind, declared_force=0.06))
    assert "bias-drift" in declared.codes()
    assert "noise-level-off" not in declared.codes()
    assert 0.2 < (declared.evidence.chi2_per_dof or 0.0) < 1.5
