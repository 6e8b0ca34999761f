"""Coverage counts what it should, on made-up outcomes with a known answer and on a short real run."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from steelyard.bench import coverage, tables
from steelyard.bench.coverage import HALF_WIDTH, Outcome, object_scale, summary
from steelyard.cli.bench import bench
from steelyard.errors import BadValue
from steelyard.simulate import scenarios
from steelyard.threads import BLAS


def made_up(count, stretch=1.0, identified=10):
    """Outcomes of two objects whose errors are ten times as large for one as for the other."""
    rng = np.random.default_rng(3)
    flags = np.arange(10) < identified
    return [
        Outcome(name, size * rng.standard_normal(10), np.full(10, size * stretch * HALF_WIDTH), flags)
        for _ in range(count)
        for name, size in (("small", 1.0), ("big", 10.0))
    ]


def test_true_intervals_cover_95_percent_with_a_ratio_of_1_96():
    found = summary(made_up(2000))
    for kind in ("mass", "com", "inertia"):
        assert found["kinds"][kind]["coverage_pct"] == pytest.approx(95, abs=1)
        assert found["kinds"][kind]["width_ratio"] == pytest.approx(1.96, rel=0.04)
    assert found["kinds"]["com"]["intervals"] == 3 * 4000


def test_wide_intervals_show_as_wide():
    found = summary(made_up(500, stretch=2.0))["kinds"]["inertia"]
    assert found["coverage_pct"] > 99.9
    assert found["width_ratio"] == pytest.approx(3.92, rel=0.05)


def test_what_is_not_identified_is_not_counted():
    found = summary([*made_up(10, identified=7), "pan, seed 0: no answer"])
    assert found["kinds"]["inertia"]["intervals"] == 3 * 20
    assert found["objects"]["small"] == {"inertia_identified": 3, "all_six_pct": 0}
    assert found["failures"] == ["pan, seed 0: no answer"]
    assert found["logs"] == 21
    nothing = summary(made_up(3, identified=4))["kinds"]["inertia"]
    assert nothing == {"coverage_pct": None, "width_ratio": None, "width_ratio_pooled": None, "intervals": 0}


def test_scales_and_readings_of_a_box():
    body = scenarios.body("bottle").parameters()
    assert body.people[0] == pytest.approx(body.mass)
    np.testing.assert_allclose(body.people[[4, 7, 9]], np.diag(body.inertia_com))
    scale = object_scale(body)
    assert scale[4] == pytest.approx(np.trace(body.inertia_com) / 2)
    assert scale[1] ** 2 * body.mass == pytest.approx(scale[4])


@pytest.mark.parametrize("options", [{}, {"declared": False}, {"bias": "free"}])
def test_short_run(options):
    done = []
    result = coverage.run(10, spectra=("white",), progress=lambda *n: done.append(n), **options)
    case = result["cases"]["white"]
    assert done[-1] == (10, 10)
    assert case["logs"] == 10
    assert case["failures"] == []
    assert case["kinds"]["mass"]["intervals"] == 10
    assert case["kinds"]["mass"]["coverage_pct"] >= 70
    assert set(case["objects"]) == set(scenarios.object_names())
    text = tables.coverage_table(result)
    assert "white (10 logs)" in text
    json.dumps(result, allow_nan=False)


def test_no_seed_is_refused():
    with pytest.raises(BadValue, match="at least one seed; got 0"):
        coverage.run(0)


def test_command_prints_one_json_object(monkeypatch):
    for name in (*BLAS, "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    done = CliRunner().invoke(
        bench, ["coverage", "--json", "--seeds", "2", "--spectrum", "2hz", "--motion", "dyn_fast"]
    )
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert list(found["cases"]) == ["2hz"]
    assert found["motion"] == "dyn_fast"
