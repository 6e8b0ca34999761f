"""What must be shown on the real recordings: still poses, and two runs with three clocks and a turned, late IMU."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard import api
from steelyard.identify.estimate import Estimate
from steelyard.identify.least_squares import LeastSquares
from steelyard.io import read_recording, result_dict
from steelyard.logs.alignment import align
from steelyard.sanity.before import examine

MASS = 0.932
IMU = "accel.csv"


@cache
def answered(log: Path, data: Path) -> Estimate:
    return api.identify(log, data=data)


@pytest.fixture
def static(data_dir: Path, examples_dir: Path) -> Estimate:
    return answered(examples_dir / "kuka_static.toml", data_dir)


@pytest.fixture(params=[1, 2])
def run(request: pytest.FixtureRequest, data_dir: Path, examples_dir: Path) -> tuple[int, Estimate]:
    return request.param, answered(examples_dir / f"kuka_run{request.param}.toml", data_dir)


def imu_delay(found: Estimate) -> float:
    (delay,) = [value for name, value in found.delays_s.items() if name.endswith(IMU)]
    return delay


def test_static_mass_com_and_bias(static: Estimate) -> None:
    assert abs(static.mass - MASS) < 0.004
    assert float(np.linalg.norm(static.com - [0, 0, 0.044])) < 0.0006
    assert float(np.abs(static.wrench_bias[3:] - [9.08, -1.02, 9.99]).max()) < 0.1
    assert static.evidence.samples == static.evidence.still_samples == 24


def test_static_leave_one_out_agrees_with_the_formal_std(static: Estimate) -> None:
    jackknife = static.evidence.jackknife_people
    assert jackknife is not None
    ratio = static.std[:4] / jackknife[:4]
    assert (ratio < 2.5).all()
    assert (ratio > 1 / 2.5).all()


def test_static_does_not_tell_the_inertia(static: Estimate) -> None:
    written: dict[str, Any] = result_dict(static)
    assert written["inertia_com_kgm2"] is None
    assert written["identified"] == {"mass": True, "com": [True] * 3, "inertia": [False] * 6}
    assert written["evidence"]["jackknife_std"]["mass_kg"] > 0
    assert static.codes() == {"inertia-not-identified"}
    assert static.evidence.rank == 4


def gravity_only(log: Path, data: Path) -> float:
    """The mass of a fit that takes every row for a still one."""
    recording, _ = examine(read_recording(log, data))
    moving = align(recording).log
    zero = np.zeros_like(moving.acceleration)
    still = replace(moving, acceleration=zero, angular_velocity=zero, angular_acceleration=zero, noise=None)
    return LeastSquares().identify(still).mass


def test_run_mass_is_nearer_than_that_of_gravity_alone(
    run: tuple[int, Estimate], data_dir: Path, examples_dir: Path
) -> None:
    number, found = run
    assert abs(found.mass - MASS) < 0.01 * MASS
    plain = gravity_only(examples_dir / f"kuka_run{number}.toml", data_dir)
    assert abs(found.mass - MASS) < abs(plain - MASS)


def test_run_com_is_that_of_the_still_poses(run: tuple[int, Estimate]) -> None:
    _, found = run
    assert float(np.linalg.norm(found.com - [0, 0, 0.044])) < 0.002


def test_run_finds_the_delay_and_the_mount(run: tuple[int, Estimate]) -> None:
    _, found = run
    assert 0.0055 <= imu_delay(found) <= 0.009
    (turned,) = [f.message for f in found.findings if f.code == "imu-rotated"]
    assert IMU in turned
    assert "its x, y, z axes lie along -z, -x, +y" in turned
    degrees = re.search(r"turned by ([\d.]+)", turned)
    assert degrees is not None
    assert float(degrees.group(1)) == pytest.approx(120, abs=2)


def test_both_runs_find_one_delay(data_dir: Path, examples_dir: Path) -> None:
    one, other = (imu_delay(answered(examples_dir / f"kuka_run{k}.toml", data_dir)) for k in (1, 2))
    assert abs(one - other) < 0.0015


def test_run_findings(run: tuple[int, Estimate]) -> None:
    """Each code where it is true, and no other: the taps are those of run 2."""
    number, found = run
    expected = {"stream-delayed", "imu-rotated", "nearly-planar", "inertia-not-identified"}
    assert found.codes() == (expected | {"outliers"} if number == 2 else expected)


def test_taps_are_reported_and_left_out(data_dir: Path, examples_dir: Path) -> None:
    log = examples_dir / "kuka_run2.toml"
    found = answered(log, data_dir)
    (message,) = [f.message for f in found.findings if f.code == "outliers"]
    assert re.match(
        r"Found \d+ short bursts? \(taps or knocks\) at [\d., ]+ s; \d+ of \d+ rows were left out\.", message
    )
    calm = answered(examples_dir / "kuka_run1.toml", data_dir)
    assert found.evidence.residual_force_N < 1.5 * calm.evidence.residual_force_N
    assert found.evidence.samples < calm.evidence.samples


def test_answers_are_rigid_bodies(run: tuple[int, Estimate], static: Estimate) -> None:
    for found in (run[1], static):
        assert found.parameters.validity().consistent
        assert found.evidence.holdout_force_N is not None
        assert found.evidence.holdout_force_N < 1.5 * found.evidence.residual_force_N
