"""The speed bench on a small solid: the same tree as its rival, ratios of the times it prints, one JSON object."""

import json

import pytest
from click.testing import CliRunner

from steelyard.bench import speed
from steelyard.cli.bench import bench
from steelyard.errors import BadValue
from steelyard.parts.clustering import cluster


@pytest.fixture(scope="module")
def result():
    done = CliRunner().invoke(bench, "speed --tets 400 --many 600 --repeats 1 --hull-sets 600 --json")
    assert done.exit_code == 0, done.output
    return json.loads(done.stdout)


def test_ours_and_its_rival_make_the_same_tree_and_ours_is_faster(result):
    stages, ratios = result["stages"], result["ratios"]
    assert stages["same_tree"] is True
    assert abs(stages["tets"] / 400 - 1) < 0.25
    assert stages["hulls_lazy"] < stages["hulls_eager"]
    assert ratios["htc_cold, eager"] == pytest.approx(stages["rival_cold_eager_ms"] / stages["htc_cold_ms"])
    assert ratios["htc_cold, eager"] > 5
    assert ratios["hull of 20 points"] > 2
    assert max(stages[f"hull_{n}_points_error"] for n in speed.POINTS) < 1e-12


def test_hulls_of_every_kind_have_the_volume_that_qhull_says(result):
    found = result["hull_sets"]
    assert sum(found["count"].values()) == found["sets"] == 600
    assert len(found["count"]) == 12
    assert found["largest_error"] == max(found["error"].values()) < 1e-9


def test_table_has_every_number(result):
    text = speed.speed_table(result)
    for name in [*result["stages"], *result["ratios"]]:
        assert name in text


def test_solid_is_one_body():
    mesh = speed.tool_solid(300)
    assert max(cluster(mesh).cost) < float("inf")
    with pytest.raises(BadValue, match="at least 100 tets"):
        speed.run(10)
