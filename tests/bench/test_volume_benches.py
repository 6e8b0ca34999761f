"""The benches of volume and parts on a tool or two: their counts follow from their rows, and the tables hold them."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from steelyard.bench.scan import scan_table
from steelyard.bench.shapes.segment_table import segment_table
from steelyard.bench.sheets import WITHIN, sheets_table
from steelyard.cli.bench import bench
from steelyard.cli.workshop import workshop


def result_of(*arguments: str) -> dict[str, Any]:
    done = CliRunner().invoke(bench, [*arguments, "--json"])
    assert done.exit_code == 0, done.output
    found: dict[str, Any] = json.loads(done.stdout)
    return found


def test_sheets_are_counted_by_kind() -> None:
    result = result_of("sheets", "--count", "6", "--seed", "1")
    rows, counts = result["sheets"], result["counts"]
    assert [counts[kind]["count"] for kind in ("channel", "plate", "tube", "all")] == [2, 2, 2, 6]
    assert counts["all"]["hits"] == sum(WITHIN[0] <= row["volume_ratio"] <= WITHIN[1] for row in rows)
    assert counts["all"]["hits"] >= 4
    assert counts["all"]["misses"] == counts["all"]["misses_warned"]
    assert "channel" in sheets_table(result)


def test_scans_of_two_tools() -> None:
    result = result_of("scan", "--tools", "file", "--tools", "rubber-mallet", "--views", "32")
    assert [row["name"] for row in result["objects"]] == ["file", "rubber-mallet"]
    assert result["within"] == result["of"] == 2
    for row in result["objects"]:
        assert row["cpu_s"]["total"] == pytest.approx(sum(v for k, v in row["cpu_s"].items() if k != "total"))
        assert 0.9 < row["reach_ratio"] < 1.5
    assert "2 of 2 volumes" in scan_table(result)


def test_no_normals_show_what_is_hollow_inside(tmp_path: Path) -> None:
    CliRunner().invoke(workshop, ["build", str(tmp_path), "--tools", "measuring-tape"])
    row = result_of("segment", "--data", str(tmp_path))["objects"]["measuring-tape"]
    assert row["volume_ratio_true_normals"] > 2


def test_segments_of_a_built_tool(tmp_path: Path) -> None:
    CliRunner().invoke(workshop, ["build", str(tmp_path), "--tools", "rubber-mallet"])
    result = result_of("segment", "--data", str(tmp_path))
    row = result["objects"]["rubber-mallet"]
    assert row["repeats"]
    assert row["volume_ratio"] == pytest.approx(1, abs=0.1)
    assert row["impurity"] < 0.1
    assert row["n_true"] == 2
    assert result["counts"]["volume_within_10_pct"] == 1
    for told in ("sides", "normals"):  # little is gained where ours are right
        assert row[f"volume_ratio_true_{told}"] == pytest.approx(row["volume_ratio"], abs=0.02)
    assert result["mean"]["objects"]["gce"] == row["gce"]
    assert "rubber-mallet" in segment_table(result)
