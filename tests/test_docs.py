"""The documentation keeps its promises: an FAQ entry for each finding, and no page outside the site."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from scipy.spatial.transform import Rotation as SciPyRotation

import steelyard as sy
from steelyard.cli.main import cli
from steelyard.findings import AT_REST, REMEDIES, UNMEASURED, Finding
from steelyard.io import write_team
from steelyard.simulate import scenarios
from steelyard.simulate.handling import motion_arrays
from steelyard.simulate.three_omnids import three_omnids

ROOT = Path(__file__).parents[1]
FAQ = (ROOT / "docs" / "findings.md").read_text()
ENTRIES = re.split(r"^### ", FAQ, flags=re.MULTILINE)[1:]


def test_every_finding_has_one_entry_and_every_entry_a_finding() -> None:
    assert sorted(entry.splitlines()[0] for entry in ENTRIES) == sorted(REMEDIES)


def test_the_table_at_the_top_links_every_entry_in_order() -> None:
    linked = re.findall(r"^\| \[`([a-z-]+)`\]\(#\1\) \| \S", FAQ, flags=re.MULTILINE)
    assert linked == [entry.splitlines()[0] for entry in ENTRIES]


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.splitlines()[0])
def test_an_entry_says_what_it_means_how_it_is_seen_and_what_to_do(entry: str) -> None:
    assert [word for word in ("**Means**", "**Seen**", "**Do**") if word not in entry] == []


@pytest.mark.parametrize("entry", ENTRIES, ids=lambda entry: entry.splitlines()[0])
def test_the_table_says_of_the_answer_what_the_entry_says(entry: str) -> None:
    """How a finding is seen is folded under a line with what became of the answer; the table has it in a word."""
    said = {"": "", "corrected": "Corrected: ", "named": "Only named: ", "either": "Corrected or only named: "}
    row = re.search(rf"^\| \[`{entry.splitlines()[0]}`\].*\| ?(\w*) \|$", FAQ, re.MULTILINE)
    assert row is not None
    assert re.findall(r"<summary>(.*)how it is seen", entry) == ([said[row[1]]] if row[1] else [])


@pytest.mark.parametrize("code", REMEDIES)
def test_codes_are_words_and_remedies_are_sentences(code: str) -> None:
    assert re.fullmatch(r"[a-z]+(-[a-z]+)*", code)
    assert REMEDIES[code].endswith(".")
    assert Finding.of(code, "Numbers.") == Finding(code, "Numbers.", REMEDIES[code])


def test_other_remedies_are_those_of_known_codes() -> None:
    assert set(AT_REST) | set(UNMEASURED) <= set(REMEDIES)


def test_every_page_is_in_the_navigation() -> None:
    navigation = (ROOT / "mkdocs.yml").read_text()
    pages = [str(path.relative_to(ROOT / "docs")) for path in (ROOT / "docs").rglob("*.md")]
    assert [page for page in pages if page not in navigation] == []


def test_every_decision_is_in_the_index() -> None:
    folder = ROOT / "docs" / "decisions"
    index = (folder / "index.md").read_text()
    assert [path.name for path in folder.glob("[0-9]*.md") if path.name not in index] == []


@pytest.mark.parametrize("page", ["parts.md", "shape.md"])
def test_code_of_a_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    made = CliRunner().invoke(cli, ["workshop", "build", str(tmp_path), "--tools", "hammer", "--noise", "low"])
    assert made.exit_code == 0, made.output
    monkeypatch.chdir(tmp_path / "hammer")
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / page).read_text(), re.MULTILINE | re.DOTALL)
    assert blocks
    for block in blocks:
        exec(block.replace("cloud.ply", "points.npz"), {})


def test_code_of_the_python_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Its blocks are one story, in the folder of a tool with the files of a team."""
    made = CliRunner().invoke(cli, ["workshop", "build", str(tmp_path), "--tools", "hammer", "--noise", "moderate"])
    assert made.exit_code == 0, made.output
    monkeypatch.chdir(tmp_path / "hammer")
    gripper = {"mass_kg": 0.1, "com_m": [0, 0, 0], "inertia_com_kgm2": [[1e-4, 0, 0], [0, 1e-4, 0], [0, 0, 1e-4]]}
    Path("gripper.json").write_text(json.dumps(gripper))
    team = three_omnids(0)
    write_team(team.log, Path("team.toml"), team.joints)
    for recording in team.log.recordings:
        name = "moves" if recording.kind == "motion" else recording.name
        for robot, track in recording.tracks.items():
            np.savez(f"{robot}_{name}.npz", time=track.time, **track.channels)
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / "python.md").read_text(), re.MULTILINE | re.DOTALL)
    names: dict[str, object] = {}
    for block in blocks:
        exec(block.replace("cloud.ply", "points.npz"), names)
    assert {"recording", "again", "team"} <= names.keys()


def test_code_of_the_team_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """All of it but for a payload of two bodies."""
    monkeypatch.chdir(tmp_path)
    team = three_omnids(0)
    write_team(team.log, Path("team.toml"), team.joints)
    blocks = re.findall(r"^```python\n(.*?)^```", (ROOT / "docs" / "team.md").read_text(), re.MULTILINE | re.DOTALL)
    names: dict[str, Any] = {}
    for block in blocks:
        if "hinge" not in block:
            exec(block, names)
    assert names["fit"].matrix.shape == (3, 3)


def test_code_of_the_mujoco_page_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What its first block writes, with MuJoCo at hand, is made here: force on the load, quaternions with w first."""
    monkeypatch.chdir(tmp_path)
    body = scenarios.body("wrench").parameters()
    made = motion_arrays(body=body)
    turns = SciPyRotation.from_matrix(made["rotation_world_from_sensor"].copy()).as_quat(scalar_first=True)
    run = {"ft_force": made["force_sensor"], "ft_torque": made["torque_sensor"], "ft_pos": made["position_world"]}
    np.savez("run.npz", time=made["time"], ft_quat=turns, **run)
    page = (ROOT / "docs" / "mujoco.md").read_text()
    blocks = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    for block in blocks:
        compile(block, "mujoco.md", "exec")
    names: dict[str, Any] = {}
    exec(next(block for block in blocks if "import mujoco" not in block), names)
    Path("run.toml").write_text(re.findall(r"^```toml\n(.*?)^```", page, re.MULTILINE | re.DOTALL)[0])
    for log in (names["recording"], "run.toml"):
        estimate = sy.identify(log)
        assert estimate.mass == pytest.approx(body.mass, rel=1e-3)
        assert "wrench-sign-flipped" not in estimate.codes()
