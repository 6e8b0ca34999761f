"""Rows given by the caller, a tool, parts and a drifting bias: each is honoured beside every other, or refused."""

from __future__ import annotations

from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
import pytest

from bent_rows import bent_row
from steelyard import api
from steelyard.errors import BadFile, BadValue
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.parts.parts import Parts
from steelyard.pipelines.held_object import identify
from steelyard.pipelines.options import Options
from steelyard.simulate.handling import handling_log
from steelyard.spatial import Pose, Rotation

DENSITY = np.array([7800.0, 7800, 1000, 1000])
BIAS = np.array([0.1, -0.2, 0.05, 1.5, -2.0, 0.7])
GRIPPER = InertialParameters.from_com(0.9, [0.001, 0.002, 0.06], np.diag([1.5e-3, 1.6e-3, 8e-4]))


@pytest.fixture(scope="module")
def bar() -> Parts:
    return bent_row(4)


@pytest.fixture(scope="module")
def held(bar: Parts) -> InertialParameters:
    return bar.whole(DENSITY * bar.volume)


def with_gripper(held: InertialParameters, seed: int) -> MotionLog:
    return handling_log(InertialParameters(held.vector + GRIPPER.vector), noise="low", seed=seed)


def drifting(log: MotionLog, end: float) -> MotionLog:
    """Return the log with a force bias that grows to `end` N on every axis."""
    time = np.linspace(0, 1, len(log))
    return replace(log, wrench=log.wrench + end * time[:, None] * np.array([0, 0, 0, 1, 1, 1]))


def test_rows_of_the_caller_are_fitted_with_parts(bar: Parts, held: InertialParameters) -> None:
    log = handling_log(held, noise="low", seed=0)
    found = api.identify(log, parts=bar)
    assert len(found.parts) == 4
    assert (np.abs(found.parameters.vector - held.vector) < 4 * np.sqrt(np.diag(found.covariance))).all()
    plain = api.identify(log)
    assert np.trace(found.people_covariance[4:, 4:]) < 0.1 * np.trace(plain.people_covariance[4:, 4:])


def test_rows_of_the_caller_heed_the_pose_of_the_object(bar: Parts, held: InertialParameters) -> None:
    X_SO = Pose(Rotation.from_rpy([0.3, -0.2, 0.5]), np.array([0.02, 0.0, -0.03]))
    log = handling_log(held.in_frame(X_SO), noise="low", seed=0)
    found = api.identify(log, parts=bar, pose_in_sensor=X_SO)
    np.testing.assert_allclose(found.mass, float(held.mass), rtol=5e-3)
    assert "part-not-homogeneous" not in found.codes()
    assert "part-not-homogeneous" in api.identify(log, parts=bar).codes()


def test_rows_of_the_caller_heed_the_method(held: InertialParameters) -> None:
    log = handling_log(held, noise="low", seed=0)
    assert api.identify(log, Options(method="least-squares")).method == "least-squares"
    with pytest.raises(BadFile):
        api.identify(log, tool="nowhere.json")
    with pytest.raises(BadFile):
        api.identify(log, scan="nothing.ply")
    with pytest.raises(BadValue, match="needs a recording"):
        api.identify(log, Options(gravity="unknown"))


def test_a_method_without_a_shape_refuses_parts(bar: Parts, held: InertialParameters) -> None:
    with pytest.raises(BadValue, match='"least-squares" knows no shape'):
        api.identify(handling_log(held, noise="low", seed=0), Options(method="least-squares"), parts=bar)


@pytest.mark.parametrize("parts_given", [False, True])
def test_the_tool_is_taken_away_with_parts_and_without(bar: Parts, held: InertialParameters, parts_given: bool) -> None:
    off, inertia = [], []
    for seed in range(4):
        tool = api.identify(handling_log(GRIPPER, noise="low", seed=seed))
        found = api.identify(with_gripper(held, 50 + seed), tool=tool, parts=bar if parts_given else None)
        gap = found.parameters.vector - held.vector
        off.append(gap / np.sqrt(np.diag(found.covariance)))
        inertia.append(np.abs(gap[4:]).max())
        assert "part-not-homogeneous" not in found.codes()
        assert len(found.parts) == (4 if parts_given else 0)
        if parts_given:
            np.testing.assert_allclose(sum(p.mass for p in found.parts), found.mass, rtol=1e-6)
    assert np.sqrt(np.mean(np.square(off))) < 1.6
    assert (max(inertia) < 5e-5) == parts_given


@pytest.mark.parametrize(("of_tool", "of_load", "force"), [("none", "free", 2.0), ("free", "none", 0.0)])
def test_a_run_whose_sensor_is_tared_shares_no_bias(
    held: InertialParameters, of_tool: str, of_load: str, force: float
) -> None:
    tool = api.identify(handling_log(GRIPPER, noise="low", seed=0), Options(bias=of_tool))  # type: ignore[arg-type]
    log = with_gripper(held, 50)
    log = replace(log, wrench=log.wrench + force * np.repeat([0.0, 1.0], 3))
    found = api.identify(log, Options(bias=of_load), tool=tool)  # type: ignore[arg-type]
    assert "bias-drift" not in found.codes()
    assert not any("bias is shared" in note for note in found.notes)
    assert (np.abs(found.parameters.vector - held.vector)[:4] < 4 * np.sqrt(np.diag(found.covariance)[:4])).all()


def test_a_bias_that_changed_between_the_runs_is_named_and_not_shared(held: InertialParameters) -> None:
    tool, log = api.identify(handling_log(GRIPPER, noise="low", seed=0)), with_gripper(held, 50)
    found = api.identify(replace(log, wrench=log.wrench + 2.0 * np.repeat([0.0, 1.0], 3)), tool=tool)
    assert "bias-drift" in found.codes()
    assert (np.abs(found.parameters.vector - held.vector)[:4] < 4 * np.sqrt(np.diag(found.covariance)[:4])).all()
    assert any("bias is shared" in note for note in api.identify(log, tool=tool).notes)


def at_rest(body: InertialParameters, sign: int, seed: int) -> Recording:
    """Return a table of still poses whose raw channels have a wrench of this sign, and BIAS."""
    rng = np.random.default_rng(seed)
    turns = Rotation.exp(rng.normal(size=(20, 3)))
    felt = body.wrench(turns.inverse().apply([0.0, 0.0, -9.81]))
    raw = BIAS + sign * np.hstack([felt.torque, felt.force]) + rng.normal(size=(20, 6)) * np.repeat([1e-3, 1e-2], 3)
    channels = {"force": raw[:, 3:], "torque": raw[:, :3], "rotation": turns.matrix}
    return Recording((Stream("poses", channels, poses=True),), np.array([0, 0, -9.81]), wrench_sign=sign)


@pytest.mark.parametrize("sign", [1, -1])
def test_a_shared_bias_is_that_of_the_raw_channels(held: InertialParameters, sign: int) -> None:
    both = InertialParameters(held.vector + GRIPPER.vector)
    found = identify(at_rest(both, sign, 1), tool=at_rest(GRIPPER, sign, 2))
    assert any("bias is shared" in note for note in found.notes)
    np.testing.assert_allclose(found.wrench_bias, BIAS, atol=0.02)
    assert (np.abs(found.parameters.vector - held.vector)[:4] < 4 * np.sqrt(np.diag(found.covariance)[:4])).all()


def test_the_tool_may_be_known_exactly(bar: Parts, held: InertialParameters) -> None:
    tool = replace(api.identify(handling_log(GRIPPER, noise="low", seed=0)), parameters=GRIPPER)
    exact = replace(tool, covariance=np.zeros((10, 10)))
    log = with_gripper(held, 7)
    sharp, blunt = (api.identify(log, tool=known, parts=bar) for known in (exact, tool))
    alone = api.identify(handling_log(held, noise="low", seed=7), parts=bar)
    assert sharp.std[0] < blunt.std[0]
    np.testing.assert_allclose(sharp.std[:4], alone.std[:4], rtol=0.3)
    assert (np.abs(sharp.parameters.vector - held.vector) < 4 * np.sqrt(np.diag(sharp.covariance))).all()


@pytest.mark.parametrize("parts_given", [False, True])
def test_a_drift_is_taken_out_with_parts_and_without(bar: Parts, held: InertialParameters, parts_given: bool) -> None:
    log = drifting(replace(handling_log(held, noise="low", seed=0), noise=None), 2.0)
    parts = bar if parts_given else None
    steady, moving = (api.identify(log, Options(drift=drift), parts=parts) for drift in (False, True))
    assert abs(moving.mass - float(held.mass)) < 4 * moving.std[0] < 0.2 * steady.std[0]
    assert abs(moving.mass - float(held.mass)) < 2e-3


def block_file(path: Path, half: tuple[float, float, float], faces: int = 12) -> Path:
    """Write a mesh of a box about the origin without parts, or only some of its faces."""
    corners = np.array(list(product((-1, 1), repeat=3))) * half
    rows = ["0 1 3", "0 3 2", "4 6 7", "4 7 5", "0 4 5", "0 5 1", "2 3 7", "2 7 6", "0 2 6", "0 6 4", "1 5 7", "1 7 3"]
    header = "ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\nproperty float z\n"
    header += f"element face {faces}\nproperty list uchar int vertex_indices\nend_header\n"
    lines = [" ".join(map(str, row)) for row in corners] + [f"3 {row}" for row in rows[:faces]]
    path.write_text(header + "\n".join(lines) + "\n")
    return path


def test_a_mesh_without_parts_is_one_part_and_a_note_says_so(held: InertialParameters, tmp_path: Path) -> None:
    mesh = block_file(tmp_path / "bar.ply", (0.1, 0.02, 0.02))
    found = api.identify(handling_log(held, noise="low", seed=0), parts=mesh)
    assert any(note.startswith('bar.ply: its faces have no "part"') for note in found.notes)


def test_the_error_of_an_open_mesh_names_its_file(held: InertialParameters, tmp_path: Path) -> None:
    mesh = block_file(tmp_path / "bar.ply", (0.1, 0.02, 0.02), faces=11)
    with pytest.raises(BadFile, match=r"bar\.ply: part 0 is not closed: 3 edges"):
        api.identify(handling_log(held, noise="low", seed=0), parts=mesh)
