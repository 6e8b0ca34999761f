"""The right density from a list: box tools with their own densities, a shared tool with the published ones."""

import json

import pytest
from box_tools import write_tools
from click.testing import CliRunner

from steelyard.bench import materials, segment
from steelyard.bench.objects.cases import load_case
from steelyard.bench.objects.part_tables import materials_table
from steelyard.cli.bench import bench
from steelyard.errors import BadValue


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_tools(tmp_path_factory.mktemp("tools"))


def test_folders_of_our_own_have_the_densities_of_the_object(folder):
    own = materials.material_list(load_case(folder / "club", "truth"))
    assert [m.density for m in own] == pytest.approx([700, 7800, 2700])


def test_boxes_get_their_density(folder):
    found = materials.run(folder, 2)
    assert found["overall"]["right_pct"] == 100
    assert found["overall"]["wrong_alone"] == 0
    assert found["objects"]["brick"]["list"] == ["density 2700 2700"]
    assert "brick" in materials_table(found)
    assert materials_table(found).startswith(
        "every part of at least 5 % of the mass has the right density in 4 of 4 runs (100.0 %)"
    )
    with pytest.raises(BadValue, match="at least one seed; got 0"):
        materials.run(folder, 0)


@pytest.mark.parametrize("job", [materials, segment])
def test_an_object_that_is_not_there_is_named(folder, job):
    with pytest.raises(BadValue, match="There is no object 'brik'; there are: brick, club"):
        job.run(folder, objects=("brick", "brik"))


def test_command_prints_one_json_object(folder):
    done = CliRunner().invoke(bench, ["materials", "--data", str(folder), "--seeds", "1", "--json"])
    assert done.exit_code == 0, done.output
    assert json.loads(done.stdout)["overall"]["runs"] == 2


def test_a_shared_tool_gets_the_published_densities(data_dir):
    tools = data_dir / "workshop-tools"
    if not tools.is_dir():
        pytest.skip("the workshop tools are not here")
    found = materials.run(tools, 2, objects=("rubber-mallet", "hammer"))
    assert found["overall"]["right_or_tied_pct"] == 100
    assert found["overall"]["right_pct"] >= 90
