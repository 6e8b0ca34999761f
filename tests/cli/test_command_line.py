"""The command line as a user meets it: tables, JSON, files, and one clear line with the right exit status."""

from __future__ import annotations

import io
import json
import re
import resource
import shutil
import subprocess
import sys
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np
import pytest

from steelyard.cli.main import VERBS, main
from steelyard.evidence import Evidence
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.io import read_recording, read_result, write_result
from steelyard.io.recordings.recording_files import write_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.shape import scan
from steelyard.simulate import hammer
from steelyard.spatial import Rotation
from steelyard.tables.numbers import plus_minus

ENTRY = Path(sys.executable).with_name("steelyard")
BODY = hammer.body()
KEYS = {
    "mass_kg", "com_m", "inertia_com_kgm2", "frame", "method", "consistent", "std", "covariance", "identified",
    "force_bias_N", "torque_bias_Nm", "delays_s", "evidence", "findings",
}  # fmt: skip
EVIDENCE = {
    "rank", "condition", "samples", "still_samples", "residual_force_N", "residual_torque_Nm", "chi2_per_dof",
    "holdout_force_N", "spread",
}  # fmt: skip


@dataclass(frozen=True)
class Run:
    status: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """The one JSON object on stdout."""
        value = json.loads(self.out, parse_constant=lambda name: pytest.fail(f"{name} is not JSON"))
        assert isinstance(value, dict)
        return value

    def failed(self, status: int) -> str:
        """The one line on stderr of a run that failed with this status and said nothing on stdout."""
        assert self.status == status
        assert self.out == ""
        lines = self.err.splitlines()
        assert len(lines) == 1
        assert lines[0].startswith("steelyard: ")
        return lines[0].removeprefix("steelyard: ")


class _Terminal(io.StringIO):
    """Text that was typed, or a screen: not a terminal."""


def steelyard(*arguments: object, typed: str | None = None, monkeypatch: pytest.MonkeyPatch | None = None) -> Run:
    """Run the command line in this process."""
    out, err = io.StringIO(), io.StringIO()
    status = 0
    if typed is not None:
        assert monkeypatch is not None
        monkeypatch.setattr(sys, "stdin", _Terminal(typed))
    with redirect_stdout(out), redirect_stderr(err):
        try:
            main([str(a) for a in arguments])
        except SystemExit as end:
            status = int(end.code or 0)
    return Run(status, click.unstyle(out.getvalue()), err.getvalue())


@pytest.fixture(scope="session")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_recording(hammer.recording(1).recording, tmp_path_factory.mktemp("hammer"))


@pytest.fixture(scope="session")
def answer(made: Path) -> dict[str, Any]:
    run = steelyard("identify", made, "--json")
    assert run.status == 0
    return run.json


def test_help_is_quick_and_lists_the_verbs() -> None:
    before = resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime
    run = subprocess.run([ENTRY, "--help"], capture_output=True, text=True, check=True)
    assert resource.getrusage(resource.RUSAGE_CHILDREN).ru_utime - before < 0.5  # 0.1 s on a quiet machine
    for verb, (_, line) in VERBS.items():
        assert f"  {verb}" in run.stdout
        assert line.split(",")[0] in run.stdout
    assert run.stderr == ""


@pytest.mark.parametrize("argument", ["--help", "--version"])
def test_help_imports_nothing_heavy(argument: str) -> None:
    code = (
        "import sys\nfrom steelyard.cli.main import main\n"
        f"try: main(['{argument}'])\nexcept SystemExit: pass\n"
        "print([m for m in ('numpy', 'scipy', 'numba') if m in sys.modules], file=sys.stderr)"
    )
    run = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert run.stderr.strip() == "[]"


@pytest.mark.parametrize("verb", VERBS)
def test_every_verb_has_help(verb: str) -> None:
    run = steelyard(verb, "--help")
    assert run.status == 0
    assert f"Usage: steelyard {verb}" in run.out


def test_the_table_holds_the_numbers_and_the_file_is_the_json(
    made: Path, answer: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "result.json"
    run = steelyard("identify", made, "-o", path)
    assert run.status == 0
    assert json.loads(path.read_text()) == answer
    assert [p.name for p in tmp_path.iterdir()] == ["result.json"]
    assert read_result(path).mass == answer["mass_kg"]
    assert run.err == ""
    mass, std = answer["mass_kg"], answer["std"]["mass_kg"]
    places = int(1 - np.floor(np.log10(std)))
    assert f"{mass:.{places}f} ± {std:.{places}f} kg" in run.out
    for word in ("mass", "com x", "com y", "com z", "Ixx", "Izz", "method", "residual", "left out", "bias", "note"):
        assert f"  {word}" in run.out
    for finding in answer["findings"]:
        assert f"{finding['code']}: {finding['message']}" in run.out
        assert f"-> {finding['remedy']}" in run.out


@pytest.mark.parametrize(("std", "said"), [(0.02, "1.000 ± 0.020 g"), (2.5e-11, "1.000000000 ± 2.5e-11 g")])
def test_no_spread_is_rounded_to_nothing(std: float, said: str) -> None:
    assert plus_minus(1.0, std, "g") == said


def test_json_has_the_fixed_keys(answer: dict[str, Any]) -> None:
    assert set(answer) >= KEYS
    assert set(answer["evidence"]) >= EVIDENCE
    assert set(answer["std"]) >= {"mass_kg", "com_m", "inertia_com_kgm2"}
    assert np.shape(answer["covariance"]) == (10, 10)
    assert np.shape(answer["inertia_com_kgm2"]) == (3, 3)
    assert {k: np.shape(v) for k, v in answer["identified"].items()} == {"mass": (), "com": (3,), "inertia": (6,)}
    assert answer["consistent"] is True
    assert answer["frame"] == "S"
    for finding in answer["findings"]:
        assert set(finding) == {"code", "message", "remedy"}


def close_to_the_hammer(answer: dict[str, Any]) -> None:
    assert abs(answer["mass_kg"] - float(BODY.mass)) < 4 * answer["std"]["mass_kg"]
    gap = np.abs(np.array(answer["com_m"]) - BODY.com)
    assert (gap < 4 * np.array(answer["std"]["com_m"])).all()


def test_the_answer_is_right(answer: dict[str, Any]) -> None:
    close_to_the_hammer(answer)
    bias = np.concatenate([answer["torque_bias_Nm"], answer["force_bias_N"]])
    assert float(np.abs(bias - hammer.BIAS)[3:].max()) < 0.05
    assert float(np.abs(bias - hammer.BIAS)[:3].max()) < 0.01


@pytest.mark.parametrize("method", ["noise-aware", "least-squares", "geodesic"])
def test_methods(made: Path, method: str) -> None:
    run = steelyard("identify", made, "--json", "--method", method)
    assert run.status == 0
    assert run.json["method"] == method
    assert run.json["mass_kg"] == pytest.approx(float(BODY.mass), rel=0.01)


def test_auto_says_what_it_chose(answer: dict[str, Any]) -> None:
    assert answer["method"] == "noise-aware"
    assert any(note.startswith("method: auto chose noise-aware, because ") for note in answer["notes"])


def test_the_installed_command_prints_one_json_object(made: Path, answer: dict[str, Any]) -> None:
    run = subprocess.run([ENTRY, "identify", made, "--json"], capture_output=True, text=True, check=False)
    assert run.returncode == 0
    assert run.stderr == ""
    assert json.loads(run.stdout) == answer


# Bad input: exit status 2, nothing on stdout, one line on stderr, nothing written.


def test_a_missing_file(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    text = steelyard("identify", tmp_path / "nothing.toml", "-o", out, "--json").failed(2)
    assert text.startswith(f"{tmp_path / 'nothing.toml'}: ")
    assert list(tmp_path.iterdir()) == []


def test_the_installed_command_fails_with_status_2(tmp_path: Path) -> None:
    run = subprocess.run([ENTRY, "identify", tmp_path / "no.toml"], capture_output=True, text=True, check=False)
    Run(run.returncode, run.stdout, run.stderr).failed(2)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("this is = = not toml", ["not valid TOML"]),
        ("[log]\ngravty = [0, 0, -9.81]\n", ["gravty", "gravity"]),
    ],
)
def test_a_bad_description(tmp_path: Path, content: str, words: list[str]) -> None:
    log, out = tmp_path / "log.toml", tmp_path / "out.json"
    log.write_text(content)
    text = steelyard("identify", log, "-o", out).failed(2)
    for word in words:
        assert word in text
    assert not out.exists()


@pytest.mark.parametrize("content", ["", "[log]\ngravity = [0, 0, -9.81]\nwrench = 'on-sensor'\n"])
def test_a_description_without_streams_is_shown_a_complete_one(tmp_path: Path, content: str) -> None:
    (tmp_path / "log.toml").write_text(content)
    run = steelyard("identify", tmp_path / "log.toml", "--json")
    assert run.status == 2
    assert run.out == ""
    first, *example = run.err.splitlines()
    assert first.endswith(": no [[stream]] is given, so there are no data. A complete description:")
    assert "[[stream]]" in example


@pytest.mark.parametrize("arguments", [["identify"], ["identify", "log.toml", "--pendant"]])
def test_a_log_or_the_pendant(arguments: list[str]) -> None:
    text = steelyard(*arguments).failed(2)
    assert text == "Give either a LOG or --pendant. Example: steelyard identify log.toml"


def test_a_bare_table_that_can_be_read_is_described_on_request(tmp_path: Path) -> None:
    header = "t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz"
    (tmp_path / "a.csv").write_text("\n".join([header, *(f"{k / 100},1,2,3,4,5,6,1,0,0,0" for k in range(20))]))
    run = steelyard("identify", tmp_path / "a.csv", "--describe", "-o", tmp_path / "none.json")
    assert (run.status, run.err) == (0, "")
    assert run.out.startswith("[log]\n")
    assert run.out.endswith('rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n')
    assert [path.name for path in tmp_path.iterdir()] == ["a.csv"]


def test_an_object_of_no_size(made: Path) -> None:
    text = steelyard("identify", made, "--object-size", "0").failed(2)
    assert text == "object_size must be 0.005 to 5 m; got 0.0."


@pytest.mark.parametrize("arguments", [["identify", "--method", "magic", "x"], ["weigh"], ["identify", "--nonsense"]])
def test_a_wrong_option(arguments: list[str]) -> None:
    run = steelyard(*arguments)
    assert run.status == 2
    assert run.out == ""
    assert "Error: " in run.err


def test_an_output_folder_that_is_not_there(made: Path, tmp_path: Path) -> None:
    path = tmp_path / "no" / "out.json"
    text = steelyard("identify", made, "-o", path, "--json").failed(2)
    assert text == f"{path}: cannot be written: there is no folder {path.parent}. Make it first."


def test_what_is_read_is_not_written_over(made: Path, tool: tuple[Path, Path]) -> None:
    before = made.read_bytes()
    assert steelyard("identify", made, "-o", made).failed(2) == f"{made}: a result is written as .json."
    text = steelyard("identify", made, "--tool", tool[1], "-o", tool[1]).failed(2)
    assert text == f"{tool[1]} is what is read; give a result another name."
    assert made.read_bytes() == before


# Sound data that do not answer: exit status 3.


def poses(angles: list[list[float]], rows: int = 5) -> str:
    """Readings typed by hand, on-sensor: the hammer's wrench at roll pitch yaw [deg], with the sensor's bias."""
    lines = []
    for k, angle in enumerate(np.repeat(np.array(angles, float), rows, axis=0)):
        rotation = Rotation.from_rpy(np.radians(angle))
        force = -float(BODY.mass) * rotation.inverse().apply(np.array([0, 0, -9.80665]))
        wrench = -np.concatenate([np.cross(BODY.com, force), force]) + hammer.BIAS
        wrench = wrench + 1e-3 * np.sin([7 * k, 11 * k, 13 * k, 17 * k, 19 * k, 23 * k])
        lines.append(" ".join(f"{v:.6f}" for v in [*angle, *wrench[3:], *wrench[:3]]))
    return "\n".join(lines) + "\n"


MANY = [[0, 0, 0], [90, 0, 0], [0, 90, 0], [180, 0, 0], [0, -60, 30], [45, 45, 0]]


def test_pendant(monkeypatch: pytest.MonkeyPatch) -> None:
    run = steelyard("identify", "--pendant", "--json", typed=poses(MANY), monkeypatch=monkeypatch)
    assert run.status == 0
    assert run.json["mass_kg"] == pytest.approx(float(BODY.mass), rel=1e-3)
    assert np.abs(np.array(run.json["com_m"]) - BODY.com).max() < 1e-3
    assert run.json["inertia_com_kgm2"] is None
    table = steelyard("identify", "--pendant", typed=poses(MANY), monkeypatch=monkeypatch)
    assert table.out.startswith("pendant: what the robot holds")
    assert "inertia    not identified by these data" in table.out


@pytest.mark.parametrize(
    ("typed", "start"),
    [
        ("", "no pose was typed. Each line holds nine numbers: "),
        ("1 2 3\n", "line 1: got 3 numbers. Each line holds nine finite numbers: "),
        ("0 0 0 a 0 0 0 0 0\n", "line 1: could not convert string to float: 'a'. "),
    ],
)
def test_pendant_typing_errors(typed: str, start: str, monkeypatch: pytest.MonkeyPatch) -> None:
    text = steelyard("identify", "--pendant", typed=typed, monkeypatch=monkeypatch).failed(2)
    assert text.startswith(start)


@pytest.mark.parametrize(("angles", "lost"), [([[0, 0, 0]], "the mass"), ([[0, 0, 0], [180, 0, 0]], "along z")])
def test_too_few_poses(angles: list[list[float]], lost: str, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    run = steelyard("identify", "--pendant", "-o", out, "--json", typed=poses(angles), monkeypatch=monkeypatch)
    text = run.failed(3)
    assert text.startswith("The data do not fix ")
    assert lost in text
    assert "Add still poses that turn gravity to other axes of the sensor" in text
    assert not out.exists()


def write(recording: Recording, folder: Path) -> Path:
    return write_recording(recording, folder)


def test_one_pose_in_files(tmp_path: Path) -> None:
    made = hammer.recording(2).recording
    cut = tuple(
        replace(s, time=s.time[s.time < 1.5], channels={k: v[s.time < 1.5] for k, v in s.channels.items()})
        for s in made.streams
        if s.time is not None
    )
    run = steelyard("identify", write(replace(made, streams=cut), tmp_path), "-o", tmp_path / "out.json")
    run.failed(3)
    assert not (tmp_path / "out.json").exists()


def without_clock(folder: Path) -> Path:
    """The hammer's log with every stream's clock lost, rows matched."""
    made = hammer.recording(2).recording
    wrench, pose = (replace(s, time=None) for s in made.streams)
    thin = {k: v[::4] for k, v in wrench.channels.items()}
    return write(replace(made, streams=(replace(wrench, channels=thin), pose)), folder)


def test_without_a_clock_rows_are_still_poses(tmp_path: Path) -> None:
    run = steelyard("identify", without_clock(tmp_path), "--json")
    assert run.status == 0
    assert run.json["inertia_com_kgm2"] is None
    assert "clock-missing" in {f["code"] for f in run.json["findings"]}
    # The rows between the stops move, and are taken for still ones.
    assert run.json["mass_kg"] == pytest.approx(float(BODY.mass), rel=0.02)


def test_no_clock_for_dynamics(tmp_path: Path) -> None:
    out = tmp_path / "out.json"
    text = steelyard("identify", without_clock(tmp_path), "--drift", "--json", "-o", out).failed(3)
    assert text == "A drifting bias needs a clock; the log has none. Record a time column."
    assert not out.exists()


def test_streams_without_a_clock_and_of_different_lengths(tmp_path: Path) -> None:
    made = hammer.recording(2).recording
    bare: tuple[Stream, ...] = tuple(replace(s, time=None) for s in made.streams)
    text = steelyard("identify", write(replace(made, streams=bare), tmp_path), "--json").failed(2)
    assert text.endswith(
        'streams without time are matched by row, but their lengths differ: "wrench.csv" 4900, "pose.csv" 1225 rows.'
    )


# A tool, and comparison.


def gripper() -> Recording:
    """The same sensor and motion with half the hammer's mass on it: a tool."""
    made = hammer.recording(7)
    wrench = made.recording.streams[0]
    full = {k: np.array(v) for k, v in wrench.channels.items()}
    bias = {"force": hammer.BIAS[3:], "torque": hammer.BIAS[:3]}
    rng = np.random.default_rng(5)
    std = {"force": hammer.FORCE_STD, "torque": hammer.TORQUE_STD}
    exact = {k: 0.5 * (v - bias[k]) + bias[k] for k, v in full.items()}
    noisy = {k: v + 0.75**0.5 * std[k] * rng.normal(size=v.shape) for k, v in exact.items()}
    return replace(made.recording, streams=(replace(wrench, channels=noisy), *made.recording.streams[1:]))


@pytest.fixture(scope="session")
def tool(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Path]:
    """The gripper's description and its result."""
    folder = tmp_path_factory.mktemp("gripper")
    log = write_recording(gripper(), folder)
    result = folder / "gripper.json"
    assert steelyard("identify", log, "-o", result).status == 0
    return log, result


def test_a_tool_is_taken_away(made: Path, tool: tuple[Path, Path]) -> None:
    half = InertialParameters(0.5 * BODY.vector)
    answers = [steelyard("identify", made, "--tool", path, "--json").json for path in tool]
    for found in answers:
        assert abs(found["mass_kg"] - float(half.mass)) < 5 * found["std"]["mass_kg"]
        assert (np.abs(np.array(found["com_m"]) - half.com) < 5 * np.array(found["std"]["com_m"])).all()
        assert any("was taken away from a load of" in note for note in found["notes"])
        assert any("sensor bias is shared" in note for note in found["notes"])
    assert answers[0]["mass_kg"] == pytest.approx(answers[1]["mass_kg"], rel=1e-6)


def test_a_result_is_known_by_its_ending_in_capitals_too(made: Path, tool: tuple[Path, Path], tmp_path: Path) -> None:
    loud = tmp_path / "TOOL.JSON"
    shutil.copy(tool[1], loud)
    assert any("was taken away" in note for note in steelyard("identify", made, "--tool", loud, "--json").json["notes"])


def test_a_tool_named_in_the_description(made: Path, tool: tuple[Path, Path], tmp_path: Path) -> None:
    for path in (*made.parent.glob("*.csv"), tool[1]):
        shutil.copy(path, tmp_path)
    described = made.read_text().replace("[log]\n", '[log]\ntool = "gripper.json"\n')
    (tmp_path / "log.toml").write_text(described)
    named = steelyard("identify", tmp_path / "log.toml", "--json")
    assert named.status == 0
    given = steelyard("identify", made, "--tool", tool[1], "--json").json
    assert named.json["mass_kg"] == given["mass_kg"]


def test_what_was_noticed_in_the_tools_run_is_said(made: Path, tmp_path: Path) -> None:
    """The answer leans on the tool's: a sign that was put right there must not go without a word."""
    run = gripper()
    wrench = run.streams[0]
    flipped = {name: -np.array(values) for name, values in wrench.channels.items()}
    log = write_recording(replace(run, streams=(replace(wrench, channels=flipped), *run.streams[1:])), tmp_path)
    found = steelyard("identify", made, "--tool", log, "--json").json["findings"]
    (told,) = (finding["message"] for finding in found if finding["code"] == "wrench-sign-flipped")
    assert told.startswith("In the tool's run: ")


def test_a_description_to_start_from_can_be_saved(tmp_path: Path) -> None:
    """It alone is on stdout, and reads as it stands; with --json nothing is there but an answer."""
    path = tmp_path / "ur.csv"
    names = [f"actual_TCP_{what}_{k}" for what in ("pose", "force") for k in range(6)]
    path.write_text(",".join(["timestamp", *names]) + "\n" + "".join(f"{t},{'0,' * 6}1,2,3,4,5,6\n" for t in range(3)))
    run = steelyard("identify", path)
    assert run.status == 2
    assert run.err.startswith(f"steelyard: {path}: needs a description: ")
    (tmp_path / "log.toml").write_text(run.out)
    assert len(read_recording(tmp_path / "log.toml").streams[0]) == 3
    as_json = steelyard("identify", path, "--json")
    assert (as_json.status, as_json.out) == (2, "")
    assert run.out in as_json.err


def test_a_shape_without_a_place_is_refused_before_it_is_read(tmp_path: Path) -> None:
    log = write_recording(replace(hammer.recording(1).recording, object_pose=None), tmp_path)
    text = steelyard("identify", log, "--scan", tmp_path / "none.ply").failed(2)
    assert text == (
        "parts and scans need the place of the object in the sensor: give --pose-in-sensor (in Python "
        "pose_in_sensor=), or [object] pose_in_sensor in the description."
    )


def test_what_the_tools_run_cannot_answer_is_said_of_it(made: Path, tmp_path: Path) -> None:
    run = gripper()
    short = tuple(replace(s, channels={k: v[:5] for k, v in s.channels.items()}, time=s.time[:5]) for s in run.streams)
    text = steelyard("identify", made, "--tool", write_recording(replace(run, streams=short), tmp_path)).failed(3)
    assert text.startswith("In the tool's run: ")


def test_a_tool_of_a_tool_is_refused(made: Path, tool: tuple[Path, Path], tmp_path: Path) -> None:
    for path in tool[0].parent.iterdir():
        shutil.copy(path, tmp_path)
    log = tmp_path / tool[0].name
    log.write_text(log.read_text().replace("[log]\n", '[log]\ntool = "gripper.json"\n'))
    text = steelyard("identify", made, "--tool", log).failed(2)
    assert text == (
        f'{log.name}, [log]: a tool\'s run cannot have a "tool" taken away itself: the load weighs both. '
        "Leave the key out of this description."
    )


def test_a_tool_that_is_no_result(made: Path, tmp_path: Path) -> None:
    broken = tmp_path / "tool.json"
    broken.write_text("{}")
    text = steelyard("identify", made, "--tool", broken).failed(2)
    assert str(broken) in text


def test_nothing_but_the_tool(tool: tuple[Path, Path]) -> None:
    text = steelyard("identify", tool[0], "--tool", tool[1]).failed(3)
    assert text.startswith("After taking the tool (")


def test_compare(made: Path, tool: tuple[Path, Path], tmp_path: Path) -> None:
    first, second = tmp_path / "a.json", tmp_path / "b.json"
    again = write_recording(hammer.recording(3).recording, tmp_path / "again")
    assert steelyard("identify", made, "-o", first).status == 0
    assert steelyard("identify", again, "-o", second).status == 0
    same = steelyard("compare", first, second)
    assert same.status == 0
    assert same.out.startswith("the same object: p = ")
    verdict = steelyard("compare", first, second, "--json").json
    assert verdict["same"] is True
    assert verdict["p_value"] > 0.01
    other = steelyard("compare", first, tool[1], "--json").json
    assert other["same"] is False
    assert other["p_value"] < 1e-9
    assert steelyard("compare", first, tool[1]).out.startswith("not the same object: p = ")
    grasp = steelyard("compare", first, second, "--any-grasp", "--json").json
    assert grasp["dof"] == 4
    steelyard("compare", first, tmp_path / "none.json").failed(2)


def test_compare_says_large_moments_in_large_units_in_columns(tmp_path: Path) -> None:
    paths = []
    for mass in (200.0, 210.0):
        body = InertialParameters.from_com(mass, np.array([0.0, 0.4, 0.01]), mass * np.diag([0.6, 0.04, 0.58]))
        evidence = Evidence(10, 3.0, 100, 20, 0.01, 0.002)
        paths.append(tmp_path / f"{mass:.0f}.json")
        write_result(Estimate(body, 1e-2 * np.eye(10), "noise-aware", evidence, np.ones(10, np.bool_)), paths[-1])
    lines = steelyard("compare", *paths).out.splitlines()[1:]
    assert lines[0] == "  mass    10.00 ± 0.14 kg     71 standard deviations"
    assert [line.split(" ± ")[0] for line in lines if line.startswith("  I")] == [
        "  Ixx     6.00", "  Ixy     0.00", "  Ixz     0.00", "  Iyy     0.40", "  Iyz     0.00", "  Izz     5.80",
    ]  # fmt: skip


def test_compare_says_how_far_only_of_what_is_far(tmp_path: Path) -> None:
    def result(name: str, mass: float) -> Path:
        body = InertialParameters.from_com(mass, np.array([0.0, 0.4, 0.01]), np.diag([0.6, 0.04, 0.58]))
        evidence = Evidence(10, 3.0, 100, 20, 0.01, 0.002)
        write_result(
            Estimate(body, 1e-14 * np.eye(10), "noise-aware", evidence, np.ones(10, np.bool_)), tmp_path / name
        )
        return tmp_path / name

    one, same, other = result("a.json", 1.0), result("b.json", 1.0 + 1e-7), result("c.json", 2.0)
    near = steelyard("compare", one, same).out
    assert re.match(r"the same object: p = [\d.e-]+ \(chi² \d+\.\d, 10 degrees of freedom\)\n", near)
    assert "standard deviations" not in near
    assert "far beyond" not in near
    far = steelyard("compare", one, other).out
    assert re.match(r"not the same object: p = 0 to rounding \(chi² \d\.\de\+\d+, 10 degrees of freedom\)\n", far)
    assert re.search(r"  mass .*   far beyond both bars\n", far)


def test_doctor() -> None:
    run = steelyard("doctor", "--json")
    assert run.status == 0
    assert run.json["healthy"] is True
    assert set(run.json["packages"]) >= {"numpy", "scipy", "numba", "click"}
    table = steelyard("doctor")
    assert table.status == 0
    assert "identification of a known body: worst error" in table.out
    # The pip is named that belongs to this installation; another would fetch a stranger of this name, or nothing.
    assert (f"{sys.executable} -m pip install 'steelyard[" in table.out) == ("not installed" in table.out)


SCANNED, FUSED = cache(hammer.scanned), cache(scan.fuse)


@pytest.fixture
def scanned_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """The demo's hammer is seen and fused once for all tests: views are the same object, which `fuse` knows again."""
    monkeypatch.setattr(hammer, "scanned", SCANNED)
    monkeypatch.setattr(scan, "fuse", FUSED)


@pytest.mark.usefixtures("scanned_once")
def test_demo(tmp_path: Path) -> None:
    page, kept = tmp_path / "report.html", tmp_path / "log"
    run = steelyard("demo", "--json", "-o", page, "--keep", kept)
    assert run.status == 0
    assert run.json["method"] == "part-masses"
    assert run.json["findings"] == []
    np.testing.assert_allclose(run.json["truth"], BODY.vector)
    assert run.json["mass_kg"] == pytest.approx(float(BODY.mass), rel=1e-3)
    off = np.abs(np.array(run.json["inertia_com_kgm2"]) - BODY.inertia_com)
    assert (off < 4 * np.array(run.json["std"]["inertia_com_kgm2"])).all()
    for rival in ("without_scan", "ols", "geo"):
        assert run.json[rival]["error"]["inertia_com_kgm2"]["length"] > np.linalg.norm(np.triu(off))
    assert 2 <= len(run.json["parts"]) <= 6
    text = page.read_text()
    assert "A hammer, scanned and weighed" in text
    assert ">without the scan<" in text
    assert "http://" not in text.replace("http://www.w3.org", "")
    seen = steelyard("scan", kept / "views", "-o", tmp_path / "seen.ply", "--json")
    assert (seen.status, seen.json["views"], seen.json["findings"]) == (0, 36, [])
    anew = steelyard("identify", kept / "log.toml", "--scan", kept / "views", "--json")
    volumes = [[part["volume_m3"] for part in answer["parts"]] for answer in (anew.json, run.json)]
    assert volumes[0] == pytest.approx(volumes[1], rel=1e-3)
    again = steelyard("identify", kept / "log.toml", "--scan", kept / "hammer.ply", "--json")
    assert again.status == 0
    assert again.json["mass_kg"] == pytest.approx(run.json["mass_kg"], rel=1e-4)
    with_parts = steelyard("identify", kept / "log.toml", "--parts", kept / "parts.npz", "--json")
    assert len(with_parts.json["parts"]) >= 2
    cut = steelyard("segment", kept / "hammer.ply", "--parts", 2, "-o", tmp_path / "two.npz", "--json")
    assert len(cut.json["parts"]) == 2
    assert (tmp_path / "two.npz").exists()
    assert "How many parts, by shape and colour" in steelyard("segment", kept / "hammer.ply").out


@pytest.mark.usefixtures("scanned_once")
def test_without_pillow_the_demo_keeps_all_but_the_views(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "PIL.Image", None)
    run = steelyard("demo", "-o", tmp_path / "report.html", "--keep", tmp_path)
    assert run.status == 0
    assert "The views are not kept: that needs pip install 'steelyard[images]'." in run.err
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        "hammer.ply", "log.toml", "parts.npz", "pose.csv", "report.html", "result.json", "wrench.csv",
    ]  # fmt: skip


def test_the_demo_is_slow_enough_beside_people() -> None:
    seen = hammer.motion().at(np.linspace(0, hammer.DURATION, 5001))
    far = float(np.linalg.norm(hammer.tool().X_OS.inverse().apply(hammer.tool().mesh.vertices), axis=1).max())
    speed = np.linalg.norm(seen.velocity, axis=1) + far * np.linalg.norm(seen.angular_velocity, axis=1)
    assert float(speed.max()) < 0.25


def test_bench_identify() -> None:
    choice = ["--seeds", 1, "--objects", "hammer", "--motions", "stop_go", "--noise", "moderate", "--million", 0]
    methods = [a for m in ("noise-aware", "least-squares", "geodesic") for a in ("--methods", m)]
    run = steelyard("bench", "identify", *choice, *methods, "--json")
    assert run.status == 0
    rows = {row["method"]: row for row in run.json["rows"]}
    assert set(rows) == {"noise-aware", "least-squares", "geodesic"}
    assert set(rows["noise-aware"]) >= {
        "object", "motion", "noise", "seed", "mass_pct", "com_mm", "com_pct", "inertia_pct", "riemannian", "consistent",
        "solve_ms",
    }  # fmt: skip
    assert rows["noise-aware"]["consistent"] is True
    assert run.json["median"]["stop_go"]["moderate"]["noise-aware"]["mass_pct"] < 0.2
    assert steelyard("bench", "identify", *choice, *methods).status == 0


def test_bench_refuses_names_it_does_not_know() -> None:
    text = steelyard("bench", "identify", "--objects", "spoon", "--million", 0).failed(2)
    assert "'spoon'" in text


def test_an_answer_is_exported(answer: dict[str, Any], tmp_path: Path) -> None:
    (tmp_path / "result.json").write_text(json.dumps(answer))
    run = steelyard("export", tmp_path / "result.json", "--to", "ur", "--pose-of-sensor", "{ position = [0, 0, 0.1] }")
    assert (run.status, run.err) == (0, "")
    assert f"{answer['com_m'][2] + 0.1:.9g}]" in run.out
    known = answer["identified"] | {"inertia": [False] * 6}
    (tmp_path / "result.json").write_text(json.dumps(answer | {"identified": known, "inertia_com_kgm2": None}))
    run = steelyard("export", tmp_path / "result.json", "--to", "urdf", "--guess")
    assert run.status == 0
    assert "<inertial>" in run.out
    assert "best guess" in run.err
