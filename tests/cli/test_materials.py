"""`identify --materials`: every part takes one of a list; wrong lists have one clear error."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner

from steelyard.cli.main import cli
from steelyard.errors import BadValue
from steelyard.parts.material import Material, materials_of


@pytest.fixture(scope="module")
def hammer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("tools")
    made = CliRunner().invoke(cli, ["workshop", "build", str(folder), "--tools", "hammer", "--noise", "low"])
    assert made.exit_code == 0, made.output
    return folder / "hammer"


def test_parts_take_materials_of_a_list(hammer: Path) -> None:
    listed = "steel=7850+-1%, aluminium=2700+-1%, rubber=1150+-5%, oak=700"
    asked = ["identify", str(hammer / "log.toml"), "--parts", str(hammer / "mesh.ply"), "--json"]
    done = CliRunner().invoke(cli, [*asked, "--materials", listed])
    parts = json.loads(done.stdout)["parts"]
    assert [part["material"] for part in parts] == ["aluminium", "steel", "rubber"]
    # What a part is made of says more of its mass than the wrench does.
    free = json.loads(CliRunner().invoke(cli, asked).stdout)["parts"]
    assert all(part["std_kg"] < other["std_kg"] for part, other in zip(parts, free, strict=True))


def test_materials_need_a_shape(hammer: Path) -> None:
    done = CliRunner().invoke(cli, ["identify", str(hammer / "log.toml"), "--materials", "steel=7850"])
    assert isinstance(done.exception, BadValue)
    assert "give parts or a scan with them" in str(done.exception)


def test_a_place_needs_a_shape(hammer: Path) -> None:
    place = "{ position = [0, 0, 0], rotation = [1, 0, 0, 0], form = 'quaternion-wxyz' }"
    done = CliRunner().invoke(cli, ["identify", str(hammer / "log.toml"), "--pose-in-sensor", place])
    assert isinstance(done.exception, BadValue)
    assert "give parts or a scan with it" in str(done.exception)


def test_a_log_of_the_tool_has_no_materials(hammer: Path) -> None:
    asked = [
        "identify",
        str(hammer / "log.toml"),
        "--parts",
        str(hammer / "mesh.ply"),
        "--tool",
        str(hammer / "log.toml"),
    ]
    done = CliRunner().invoke(cli, [*asked, "--materials", "steel=7850"])
    # The tool is the same as the load, of which nothing is left; but it was weighed.
    assert not isinstance(done.exception, BadValue), done.exception


def test_a_name_stands_for_one_density() -> None:
    with pytest.raises(BadValue, match='"steel" is listed twice'):
        materials_of("steel=7850, oak=700, steel=7700")


def test_a_list_is_read() -> None:
    assert materials_of("steel=7850, cast iron=7.2e3 +- 3%,oak=700±8%") == (
        Material("steel", 7850.0), Material("cast iron", 7200.0, 0.03), Material("oak", 700.0, 0.08),
    )  # fmt: skip


@pytest.mark.parametrize("wrong", ["", "steel", "steel:7850", "steel=heavy", "steel=7850+-x%", "steel=7850, ", "=7850"])
def test_wrong_lists_say_how_they_are_written(wrong: str) -> None:
    with pytest.raises(BadValue, match="must be NAME=DENSITY or NAME=DENSITY"):
        materials_of(wrong)


@pytest.mark.parametrize("wrong", ["steel=-7850", "steel=0", "steel=7850+-0%", "steel=inf"])
def test_wrong_numbers_are_named(wrong: str) -> None:
    with pytest.raises(BadValue, match="of steel"):
        materials_of(wrong)
