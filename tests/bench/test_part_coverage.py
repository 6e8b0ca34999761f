"""Coverage of part-mass intervals: laws on made-up pairs, box tools in a moment, the shared tools in short."""

import json

import numpy as np
import pytest
from box_tools import write_tools
from click.testing import CliRunner

from steelyard.bench import part_coverage
from steelyard.bench.coverage import HALF_WIDTH
from steelyard.bench.objects.part_tables import part_coverage_table
from steelyard.bench.part_coverage import Outcome, summary
from steelyard.cli.bench import bench
from steelyard.errors import BadValue
from steelyard.threads import BLAS


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return write_tools(tmp_path_factory.mktemp("tools"))


def test_true_intervals_cover_95_percent_and_what_is_never_wrong_is_left_out():
    rng = np.random.default_rng(4)
    errors = np.column_stack([rng.standard_normal(3000), 10 * rng.standard_normal(3000), np.zeros(3000)])
    widths = np.tile(HALF_WIDTH * np.array([1.0, 10.0, 0.0]), (3000, 1))
    pairs = [{"com": np.stack(pair)} for pair in zip(errors, widths, strict=True)]
    found = summary([*(Outcome("club", pair, frozenset()) for pair in pairs), "brick, seed 0: no answer"])
    assert found["kinds"]["com"]["intervals"] == 6000
    assert found["kinds"]["com"]["coverage_pct"] == pytest.approx(95, abs=1)
    assert found["kinds"]["com"]["width_ratio"] == pytest.approx(HALF_WIDTH, rel=0.04)
    assert found["failures"] == ["brick, seed 0: no answer"]


def test_boxes_are_covered_whichever_truth(folder):
    done = []
    found = part_coverage.run(folder, 40, lambda *n: done.append(n), noises=("low",), repeats=0)
    assert done[-1] == (80, 80)
    for case in found["cases"].values():
        assert case["logs"] == 40
        assert not case["failures"]
        assert case["kinds"]["mass"]["coverage_pct"] >= 85
        assert case["kinds"]["com"]["coverage_pct"] >= 85
    # The whole of the boxes is the sum of its parts, so both truths are one, and only the width differs.
    summed, published = (found["cases"][f"low, {truth}"]["kinds"]["com"] for truth in ("summed", "published"))
    assert published["width_ratio_pooled"] > summed["width_ratio_pooled"]
    assert "low, summed (40 logs)" in part_coverage_table(found)
    assert found["cases"]["low, summed"]["objects"]["brick"]["part"]["intervals"] == 2 * 20


def test_choices_are_checked(folder):
    with pytest.raises(BadValue, match="at least one seed; got 0"):
        part_coverage.run(folder, 0)
    with pytest.raises(BadValue, match="no noise scenario 'none' here; there are: low"):
        part_coverage.run(folder, 1, noises=("none",))


def test_command_prints_one_json_object_with_times(folder, monkeypatch):
    for name in (*BLAS, "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    call = ["part-coverage", "--data", str(folder), "--seeds", "2", "--noise", "high", "--workers", "1", "--json"]
    done = CliRunner().invoke(bench, call)
    assert done.exit_code == 0, done.output
    found = json.loads(done.stdout)
    assert list(found["cases"]) == ["high, summed", "high, published"]
    times = found["timing"]["objects"]
    assert set(times) == {"brick", "club"}
    assert times["club"]["folder_ms"] > times["club"]["averaged_ms"] > 0


def test_shared_tools_are_covered(data_dir):
    tools = data_dir / "workshop-tools"
    if not tools.is_dir():
        pytest.skip("the workshop tools are not here")
    found = part_coverage.run(tools / "rubber-mallet", 100, noises=("low",), repeats=0)
    for case in found["cases"].values():
        for kind in ("mass", "com", "inertia"):
            assert case["kinds"][kind]["coverage_pct"] >= 90
