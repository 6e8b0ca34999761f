"""`steelyard workshop build --views` and `--noise`: views with their place, and logs as noisy sensors show them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

import steelyard as sy
from steelyard.cli.main import cli
from steelyard.io.recordings.description import read_object_pose
from steelyard.io.view_folders import read_views
from steelyard.simulate import workshop
from steelyard.simulate.handling import motion_arrays
from steelyard.simulate.scanning import scan_mesh
from steelyard.simulate.workshop import known_object, scan_of, sensed
from steelyard.workshop.catalogue import build


def test_views_are_written_with_their_place_in_the_sensor(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    pytest.importorskip("PIL")
    monkeypatch.setattr(workshop.scan_of, "__defaults__", (0, 4))
    arguments = ["workshop", "build", str(tmp_path), "--tools", "ruler", "--views", "--seed", "3"]
    done = CliRunner().invoke(cli, arguments)
    assert done.exit_code == 0, done.output
    assert "(seed 3, " in done.output
    views, X_SW = scan_of(known_object(build("ruler"), 3), 3, 4)
    read = read_views(tmp_path / "ruler" / "views")
    assert np.array_equal(read.depth, views.depth)
    assert read.rgb is not None
    placed = read_object_pose(str(tmp_path / "ruler" / "views" / "object.toml")).pose
    np.testing.assert_allclose(placed.matrix(), X_SW.matrix(), atol=1e-11)


def test_the_place_takes_the_true_tool_to_where_the_robot_holds_it() -> None:
    known = known_object(build("ruler"))
    _, X_SW = scan_of(known, 0, 2)
    X_WO = scan_mesh(known.mesh, 0, count=2).X_WO
    np.testing.assert_allclose((X_SW @ X_WO).matrix(), known.X_SO.matrix(), atol=1e-12)


def test_the_log_has_noise_and_the_motion_none(tmp_path: Path) -> None:
    arguments = ["workshop", "build", str(tmp_path), "--tools", "hammer", "--motion", "slow", "--noise", "low"]
    assert CliRunner().invoke(cli, arguments).exit_code == 0
    folder = tmp_path / "hammer"
    assert "low noise, seed 0: 0.05 N, 0.0025 N m" in (folder / "log.toml").read_text()
    with np.load(folder / "log.npz") as log, np.load(folder / "motion.npz") as exact:
        for column, std in (("force_sensor", 0.05), ("torque_sensor", 0.0025), ("position_world", 5e-5)):
            assert float((log[column] - exact[column]).std()) == pytest.approx(std, rel=0.1)
    found = sy.identify(folder / "log.toml", parts=folder / "mesh.ply")
    truth = build("hammer").truth_in_sensor
    assert found.codes() == set()
    assert abs(found.mass - float(truth.mass)) < 3 * found.std[0]


def test_every_tool_has_noise_of_its_own_the_same_each_time() -> None:
    columns = motion_arrays("static", build("hammer").truth_in_sensor)

    def noise(name: str, seed: int = 0) -> np.ndarray:
        return sensed(columns, "high", seed, name)[0]["force_sensor"] - columns["force_sensor"]

    np.testing.assert_array_equal(noise("hammer"), noise("hammer"))
    for other in (noise("ruler"), noise("hammer", 1)):
        assert abs(np.corrcoef(noise("hammer").ravel(), other.ravel())[0, 1]) < 0.1
