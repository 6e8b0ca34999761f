"""Torques that do not belong to the forces: other axes, another point, order or sign of columns, another unit."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from synthetic import Kind, write
from traps import edited

from sanity.held_poses import BODY, recorded
from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine
from steelyard.spatial import Rotation

KINDS = {"hammer": Kind(noise=0.5), "box": Kind("box_tool", 0.2, 2), "drill": Kind("drill", 1.0, 5)}
LBF, KGF = 4.44822, 9.80665


@pytest.fixture(scope="module", params=KINDS)
def made(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Recording:
    recording = read_recording(write(tmp_path_factory.mktemp("torques"), KINDS[request.param]))
    streams = tuple(s for s in recording.streams if "specific_force" not in s.channels)
    return Recording(streams, recording.gravity, recording.wrench_sign)


def named(recording: Recording) -> str:
    (found,) = examine(recording)[1]
    assert found.code == "force-unit"
    return found.message


def test_torques_that_belong_to_the_forces_are_silent(made: Recording) -> None:
    assert examine(made)[1] == ()


@pytest.mark.parametrize(
    ("matrix", "words"),
    [
        ([[0, 1, 0], [1, 0, 0], [0, 0, 1]], "Tx = Ty, Ty = Tx, Tz = Tz"),
        ([[0, 0, 1], [0, 1, 0], [1, 0, 0]], "Tx = Tz, Ty = Ty, Tz = Tx"),
        ([[1, 0, 0], [0, -1, 0], [0, 0, 1]], "Tx = Tx, Ty = -Ty, Tz = Tz"),
        ([[0, 1, 0], [0, 0, 1], [1, 0, 0]], "Tx = Tz, Ty = Tx, Tz = Ty"),
    ],
)
def test_columns_in_another_order(made: Recording, matrix: list[list[int]], words: str) -> None:
    read = edited(made, torque=lambda v: v @ np.array(matrix, float).T)
    assert f"read as {words}: so" in named(read)


def test_the_other_sign(made: Recording) -> None:
    (unit,) = (f for f in identify(edited(made, torque=np.negative)).findings if f.code == "force-unit")
    assert "sign opposite to that of the forces" in unit.message


@pytest.mark.parametrize(
    ("factor", "words"),
    [(LBF, "in N are read as lbf"), (1 / KGF, "in kgf are read as N"), (KGF, "in N are read as kgf")],
)
def test_forces_in_another_unit(made: Recording, factor: float, words: str) -> None:
    assert words in named(edited(made, force=lambda v: factor * v))


def test_newton_metres_declared_as_newton_millimetres(made: Recording) -> None:
    read, (found,) = examine(edited(made, torque=lambda v: v / 1000))
    assert found.code == "length-in-mm"
    (was,), (now,) = ([s.channels["torque"] for s in r.streams if "torque" in s.channels] for r in (made, read))
    np.testing.assert_allclose(now, was)


def still(order: list[int]) -> Recording:
    """Return twelve still poses whose torque columns stand in this order."""
    rng = np.random.default_rng(3)
    pull = rng.normal(size=(12, 3))
    pull *= 9.81 / np.linalg.norm(pull, axis=1)[:, None]
    torque = np.cross([0.01, -0.02, 0.09], -pull) + 1e-4 * rng.normal(size=(12, 3))
    force = -1.3 * pull + 1e-2 * rng.normal(size=(12, 3))
    channels = {"force": force, "torque": torque[:, order], "gravity": pull}
    return Recording((Stream("poses", channels),), np.array([0, 0, -9.81]), 1)


def test_a_table_of_still_poses_tells_the_order() -> None:
    assert examine(still([0, 1, 2]))[1] == ()
    assert "read as Tx = Ty, Ty = Tx, Tz = Tz" in named(still([1, 0, 2]))


def turned(in_world: str = "", declared: str = "", about_world: bool = False) -> Recording:
    """Return sixteen still poses with rotation and position, torque or force in W, or said to be."""
    rng = np.random.default_rng(5)
    rotation = Rotation.exp(rng.normal(0, 1.2, (16, 3)))
    pull, place = rotation.inverse().apply(np.array([0, 0, -9.81])), rng.normal(0, 0.4, (16, 3))
    torque, force = np.cross([0.01, -0.02, 0.09], -pull), -1.3 * pull
    if about_world:
        torque = torque + np.cross(rotation.inverse().apply(place), force)
    felt = {"torque": torque + 1e-3 * rng.normal(size=(16, 3)), "force": force + 1e-2 * rng.normal(size=(16, 3))}
    felt = {part: rotation.apply(v) if part == in_world else v for part, v in felt.items()}
    channels = {**felt, "rotation": rotation.matrix, "position": place}
    frames = {declared: "W"} if declared else {}
    return Recording((Stream("poses", channels, frames=frames, poses=True),), np.array([0, 0, -9.81]), 1)


@pytest.mark.parametrize("part", ["", "torque", "force"])
def test_parts_of_the_wrench_in_axes_of_their_own_are_silent(part: str) -> None:
    assert examine(turned(part, part))[1] == ()


@pytest.mark.parametrize(
    ("in_world", "declared", "named", "frame"),
    [("torque", "", "W (the base)", "W"), ("", "torque", "S", "S")],
)
def test_torques_in_other_axes_than_forces_are_put_right(in_world: str, declared: str, named: str, frame: str) -> None:
    read, (found,) = examine(turned(in_world, declared))
    assert found.code == "gravity-frame"
    assert f"torques are in the axes of {named}: so read" in found.message
    assert found.remedy == f'Set frame = "{frame}" in the torque of this stream.'
    assert read.streams[0].frames["torque"] == frame


@pytest.mark.parametrize(
    ("in_world", "declared", "frames"),
    [
        ("force", "", {"force": "W", "torque": "S"}),
        ("force", "torque", {"force": "W", "torque": "S"}),
        ("torque", "force", {"force": "S", "torque": "W"}),
    ],
)
def test_forces_in_other_axes_leave_torques_where_they_belong(
    in_world: str, declared: str, frames: dict[str, str]
) -> None:
    """Torques that had gone along with the forces fitted no body, or another reading of the rotations."""
    read, (found,) = examine(turned(in_world, declared))
    assert found.code == "gravity-frame"
    other = {"force": "torque", "torque": "force"}[in_world]
    assert f"The {in_world}s are in the axes of W (the base), the {other}s in S; so read" in found.message
    assert found.remedy.startswith(f'Set frame = "{frames["force"]}" in its force and frame = "{frames["torque"]}"')
    assert read.streams[0].frames == frames


def test_torques_about_the_origin_of_the_world_are_named() -> None:
    _, (found,) = examine(turned(about_world=True))
    assert found.code == "wrench-unexplained"
    assert "about the origin of W, not of S: so read" in found.message
    assert "position x force" in found.remedy


def test_an_order_that_leaves_little_unexplained_is_told_too() -> None:
    """What lies nearly along x changes little where y and z are exchanged."""
    rng = np.random.default_rng(4)
    pull = rng.normal(size=(24, 3))
    pull *= 9.81 / np.linalg.norm(pull, axis=1)[:, None]
    torque = np.cross([0.002, -0.03, 0.06], -pull) + 1e-4 * rng.normal(size=(24, 3))
    channels = {"force": -1.3 * pull + 1e-2 * rng.normal(size=(24, 3)), "torque": torque, "gravity": pull}
    kept = Recording((Stream("poses", channels),), np.array([0, 0, -9.81]), 1)
    assert examine(kept)[1] == ()
    assert "read as Tx = Tx, Ty = Tz, Tz = Ty: so" in named(edited(kept, torque=lambda v: v[:, [0, 2, 1]]))


def test_no_row_passes_for_touched_where_columns_are_mixed_up() -> None:
    """Nothing fits one body then: rows were left out without a word, and the mass was 6 % off."""
    recording = recorded("paper", 0)
    (stream,) = recording.streams
    mixed = {**stream.channels, "torque": stream.channels["torque"][:, [1, 0, 2]]}
    found = identify(replace(recording, streams=(replace(stream, channels=mixed),)))
    assert found.codes() == {"force-unit"}
    assert found.mass == pytest.approx(BODY.mass, rel=0.002)


def test_contact_is_told_beside_a_unit_that_was_put_right() -> None:
    recording = recorded("paper", 0)
    (stream,) = recording.streams
    force = stream.channels["force"].copy()
    force[300:420] += [0.0, 8.0, 5.0]
    for factor, unit in ((1.0, set()), (1e-3, {"force-unit"})):
        felt = {**stream.channels, "force": factor * force}
        found = identify(replace(recording, streams=(replace(stream, channels=felt),)))
        assert {"contact", *unit} <= found.codes()
        assert found.mass == pytest.approx(BODY.mass, rel=0.002)
