"""The team bench: names of its figures, what it refuses, and that an answer's errors are scored as they should be."""

from __future__ import annotations

import json

import numpy as np
import pytest
from click.testing import CliRunner

from steelyard.bench import team
from steelyard.bench.teams.table import team_table
from steelyard.cli.bench import bench
from steelyard.errors import BadValue
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import case
from steelyard.spatial import Pose, Rotation


def test_one_trial_has_every_figure() -> None:
    told: list[tuple[int, int]] = []
    result = team.run(1, lambda *step: told.append(step), cases=["A"], methods=["paper"], sizes=(2, 3))
    assert told == [(1, 1)]
    figures = result["cases"]["A"]["paper"]
    assert set(team.METRICS) < set(figures)
    assert figures["answered"] == 1
    assert len(figures["inertia_pct"]) == 3
    assert figures["rotation_deg"] < 0.05
    assert figures["position_mm"] < 1
    assert figures["mass_pct"] < 0.1
    assert [row["n"] for row in result["scale"]] == [2, 3]
    assert result["published"]["inertia_pct"] == [6.824, 3.999, 0.973]
    assert "case A" in team_table(json.loads(json.dumps(result)))


def test_errors_are_scored_against_the_truth() -> None:
    truth = simulate_team(case("A"), 100).truth
    place = truth.grasps.position + np.array([[0, 0, 0], [0.003, 0, 0], [0, 0.001, 0]])
    turn = truth.grasps.rotation @ Rotation.exp(np.deg2rad([[0, 0, 0], [0.2, 0, 0], [0, 0.4, 0]]))
    angle, distance, share = team.grasp_errors(truth, Pose(turn, place))
    far = np.linalg.norm(truth.grasps.position[1:], axis=1)
    assert angle == pytest.approx(0.3)
    assert distance == pytest.approx(2.0)
    assert share == pytest.approx(100 * np.mean([0.003, 0.001] / far))


def test_unknown_names_are_refused() -> None:
    with pytest.raises(BadValue, match=r"There is no case 'E'; there are: A, B, C, D."):
        team.run(1, cases=["E"])
    with pytest.raises(BadValue, match=r"There is no method 'magic'; there are: paper"):
        team.run(1, methods=["magic"])
    with pytest.raises(BadValue, match="at least one trial"):
        team.run(0)


def test_the_verb_prints_one_json_object() -> None:
    found = CliRunner().invoke(
        bench,
        ["team", "--trials", "1", "--cases", "B", "--methods", "paper", "--sizes", "2", "--workers", "1", "--json"],
    )
    assert found.exit_code == 0
    assert json.loads(found.stdout)["cases"]["B"]["paper"]["trials"] == 1
