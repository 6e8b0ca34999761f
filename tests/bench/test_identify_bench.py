"""The identification bench has the shape of its format and scores what it says."""

import json

import numpy as np
import pytest
from click.testing import CliRunner

from steelyard.bench import identify, tables, timing
from steelyard.bench.logs import peers
from steelyard.bench.logs.methods import Method, choose, own_methods
from steelyard.cli.bench import bench
from steelyard.errors import BadValue, CannotAnswer
from steelyard.inertia import InertialParameters
from steelyard.threads import BLAS

ROW = {
    "object", "motion", "noise", "seed", "method", "mass_pct", "com_mm", "com_pct", "inertia_pct",
    "riemannian", "consistent", "solve_ms", "identify_ms",
}  # fmt: skip
OURS = ("noise-aware", "least-squares", "geodesic")


@pytest.fixture
def no_peers(monkeypatch):
    monkeypatch.setattr(peers, "_installed", lambda *modules: False)


@pytest.fixture(scope="module")
def result():
    return identify.run(
        range(2),
        OURS,
        objects=("hammer", "pan"),
        motions=("stop_go",),
        noises=("high",),
        repeats=2,
        million=3000,
    )


def test_rows_and_medians_have_the_names_of_the_format(result):
    assert len(result["rows"]) == 2 * 2 * 3
    assert all(set(row) == ROW for row in result["rows"])
    entry = result["median"]["stop_go"]["high"]["noise-aware"]
    assert {
        "mass_pct",
        "com_mm",
        "com_pct",
        "inertia_pct",
        "riemannian",
        "consistent_pct",
        "solve_ms",
    } <= set(entry)
    assert entry["consistent_pct"] == 100
    assert entry["failures"] == 0
    masses = [row["mass_pct"] for row in result["rows"] if row["method"] == "noise-aware"]
    assert entry["mass_pct"] == pytest.approx(np.median(masses))


def test_seeds_and_rules_are_said(result):
    assert result["seeds"] == [0, 1]
    assert "no method estimates one" in result["rules"]


def test_only_the_first_seed_is_timed(result):
    timed = {row["seed"] for row in result["rows"] if row["solve_ms"] is not None}
    assert timed == {0}
    assert {row["object"] for row in result["rows"] if row["identify_ms"] is not None} == {"hammer"}


def test_long_log_is_the_same_in_chunks(result):
    assert result["million"]["samples"] == 3000
    assert result["million"]["mass_pct"] < 0.1
    assert result["million"]["samples_per_s"] > 0
    assert result["chunks"]["count"] == 1000
    assert result["chunks"]["scatter_rel"] < 1e-12
    assert result["chunks"]["answer_rel"] < 1e-8


def test_bench_repeats_itself():
    options = {
        "objects": ("drill",),
        "motions": ("dyn_slow",),
        "noises": ("high",),
        "repeats": 1,
        "million": 0,
    }
    one, two = (identify.run([7], ("noise-aware",), **options)["rows"][0] for _ in range(2))
    assert {k: v for k, v in one.items() if not k.endswith("_ms")} == {
        k: v for k, v in two.items() if not k.endswith("_ms")
    }


def test_result_is_plain_json_and_the_table_names_every_method(result):
    assert json.loads(json.dumps(result, allow_nan=False)) == result
    text = tables.identify_table(result)
    assert "stop_go, high" in text
    assert "seeds 0..1; 2 objects" in text
    for name in OURS:
        assert name in text
    heads = next(line for line in text.splitlines() if line.startswith("stop_go, high"))
    row = next(line for line in text.splitlines() if line.startswith("  noise-aware"))
    assert len(heads) == len(row)


def test_a_failure_is_a_row_without_scores():
    def refuse(_):
        raise CannotAnswer("nothing fits")

    never = Method("never", refuse, lambda log: log, refuse, "nothing")
    log, true = identify.simulate_log("pan", "stop_go", "high", 0)
    row = identify._row(never, log, true, identify.bounds("pan"))
    assert row["failure"] == "nothing fits"
    assert row["mass_pct"] is None
    head = {"object": "pan", "motion": "stop_go", "noise": "high", "seed": 0}
    entry = identify.medians([head | row])["stop_go"]["high"]["never"]
    assert (entry["failures"], entry["consistent_pct"], entry["mass_pct"]) == (1, 0, None)


def test_speed_is_the_ratio_to_ours():
    entries = {"noise-aware": {"solve_ms": 0.5}, "other": {"solve_ms": 2.0}, "untimed": {"solve_ms": None}}
    assert identify.speed({"stop_go": {"high": entries}}) == {"other / noise-aware": 4.0}


def test_absent_peers_are_left_out_and_said(no_peers):
    methods, notes = peers.peer_methods()
    assert not methods
    assert [note.split()[0] for note in notes] == ["Pinocchio", "rigeo"]


def test_unknown_method_is_refused(no_peers):
    with pytest.raises(BadValue, match="no method 'magic' here; there are: noise-aware, least-squares"):
        identify.run([0], ("magic",))
    assert list(choose(own_methods(), ())) == list(OURS)


def test_command_prints_one_json_object(no_peers, monkeypatch):
    for name in (*BLAS, "NUMBA_NUM_THREADS"):
        monkeypatch.setenv(name, "1")
    options = "identify --json --seeds 1 --objects hammer --motions stop_go --noise moderate --methods noise-aware"
    done = CliRunner().invoke(bench, [*options.split(), "--million", "0"])
    assert done.exit_code == 0
    found = json.loads(done.stdout)
    assert found["rows"][0]["object"] == "hammer"
    assert "Pinocchio is not installed" in done.stderr


def test_thread_time_counts_work():
    body = InertialParameters(np.ones(10))
    assert timing.thread_ms(lambda: body.pseudo_inertia, repeats=3) > 0
