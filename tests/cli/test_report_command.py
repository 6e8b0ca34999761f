"""`steelyard report`: a page from files, with what they give and no more."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import html
import json
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.cli.main import main
from steelyard.evidence import Evidence, PartMass
from steelyard.identify.estimate import Estimate
from steelyard.io import write_result
from steelyard.io.object_folders import write_object
from steelyard.io.ply_files import write_mesh
from steelyard.io.recordings.recording_files import write_recording
from steelyard.io.shapes.parts_files import SavedParts, write_parts
from steelyard.report import Report
from steelyard.shape.tets import TetMesh
from steelyard.simulate import hammer
from steelyard.simulate.workshop import known_object


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A result that knows the truth exactly, its log, its mesh, an object folder, and parts.npz of the true object."""
    made, where = hammer.recording(0), tmp_path_factory.mktemp("report")
    parts = made.tool.parts.in_frame(made.tool.X_OS.inverse())
    rows = zip(parts.label, made.tool.masses, parts.volume, parts.centroid, strict=True)
    weighed = tuple(PartMass(int(k), float(m), 1e-3 * float(m), float(v), c, "steel?") for k, m, v, c in rows)
    estimate = Estimate(
        made.truth, 1e-9 * np.eye(10), "part-masses", Evidence(10, 3.0, 100, 50, 0.1, 0.01), np.ones(10, np.bool_),
        wrench_bias=hammer.BIAS, parts=weighed,
    )  # fmt: skip
    write_result(estimate, where / "result.json")
    write_result(replace(estimate, parts=(), method="OLS"), where / "ols.json")
    write_recording(made.recording, where)
    write_mesh(made.tool.mesh, where / "hammer.ply")
    known = known_object(made.tool)
    write_object(known, where / "hammer")
    points = known.cloud.xyz[:150]
    solid = TetMesh(points, Delaunay(points).simplices)
    labels = np.digitize(solid.centroids[:, 2], np.quantile(solid.centroids[:, 2], [0.3, 0.7]))
    write_parts(SavedParts(solid, labels, names=("<b>one</b>", "two", "three")), where / "parts.npz")
    return where


def run(capsys: pytest.CaptureFixture[str], folder: Path, *arguments: str) -> tuple[int, str, str]:
    """Exit status, standard output, standard error; `@` stands for the folder."""
    with pytest.raises(SystemExit) as end:
        main(["report", *(argument.replace("@", f"{folder}/") for argument in arguments)])
    seen = capsys.readouterr()
    return int(end.value.code or 0), seen.out, seen.err


def test_everything_at_once(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    status, out, err = run(
        capsys, folder, "@result.json", "--parts", "@hammer.ply", "--log", "@log.toml", "--truth", "@hammer/truth.json",
        "--rival", "OLS=@ols.json", "--title", "My hammer", "-o", "@out.html", "--json",
    )  # fmt: skip
    assert (status, err) == (0, "")
    page = (folder / "out.html").read_text(encoding="utf-8")
    assert json.loads(out) == {
        "report": f"{folder}/out.html", "bytes": len(page.encode()), "parts_drawn": 3, "placed": True,
    }  # fmt: skip
    for said in ("My hammer", "What is left over", "Against the truth", "OLS", "head", "grip", "truth 3", "<canvas"):
        assert said in page, said
    # The result is exact, so what is left over is the made noise and no more.
    rms = [float(page.split(f'<b class="{axis}">{axis}</b>')[1].split()[0]) for axis in "xyz"]
    assert 0 < max(rms) < 1.2 * hammer.FORCE_STD


def test_the_page_tells_the_command_as_a_shell_takes_it(
    capsys: pytest.CaptureFixture[str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(sys, "argv", ["/usr/bin/steelyard", "report", "my result.json", "--title", "The 'new' $one"])
    assert run(capsys, folder, "@result.json", "-o", "@out.html")[0] == 0
    page = html.unescape((folder / "out.html").read_text(encoding="utf-8"))
    assert """<dd>steelyard report 'my result.json' --title 'The '"'"'new'"'"' $one'</dd>""" in page


def test_parts_of_a_segmentation_with_a_pose(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    pose = '{ position = [0, 0, 0.12], unit = "m", rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix" }'
    status, out, err = run(
        capsys, folder, "@ols.json", "--parts", "@parts.npz", "--pose-in-sensor", pose, "-o", "@out.html"
    )
    assert (status, out) == (0, "")
    assert err.startswith(f"{folder}/out.html (")
    page = (folder / "out.html").read_text(encoding="utf-8")
    assert "&lt;b&gt;one&lt;/b&gt;" in page
    assert "<b>one" not in page


def test_a_scan_gives_points_and_colours(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    pytest.importorskip("steelyard.io.cloud_files")
    run(capsys, folder, "@ols.json", "--parts", "@parts.npz", "-o", "@out.html")
    without = (folder / "out.html").read_text(encoding="utf-8")
    run(capsys, folder, "@ols.json", "--parts", "@parts.npz", "--scan", "@hammer/points.npz", "-o", "@out.html")
    page = (folder / "out.html").read_text(encoding="utf-8")
    for said in ('data-show="points"', "Own colours"):
        assert said in page
        assert said not in without


def test_a_scan_alone_is_cut_into_the_parts_to_draw(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    scan = "@hammer/points.npz"
    status, out, _ = run(capsys, folder, "@ols.json", "--scan", scan, "-o", "@out.html", "--json")
    assert status == 0
    assert json.loads(out)["parts_drawn"] >= 1
    assert 'data-show="points"' in (folder / "out.html").read_text(encoding="utf-8")


def test_only_the_shape_where_nothing_says_where_it_sits(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    status, _, err = run(capsys, folder, "@ols.json", "--parts", "@parts.npz", "-o", "@out.html")
    assert status == 0
    assert err.startswith("Where the object sits in the sensor is not known: only its shape is drawn.")


@pytest.mark.parametrize(("x", "said", "placed"), [(0.0, False, True), (0.01, True, False), (0.2, True, False)])
def test_a_pose_that_is_not_the_results_is_passed_over(
    capsys: pytest.CaptureFixture[str], folder: Path, x: float, said: bool, placed: bool
) -> None:
    X = hammer.recording(0).tool.X_OS.inverse()
    turn = ", ".join(map(str, X.rotation.matrix.ravel()))
    p = X.position + np.array([x, 0, 0])
    pose = f'{{ position = [{p[0]}, {p[1]}, {p[2]}], unit = "m", rotation = [{turn}], form = "matrix" }}'
    arguments = ("@result.json", "--parts", "@hammer.ply", "--pose-in-sensor", pose, "-o", "@out.html", "--json")
    status, out, err = run(capsys, folder, *arguments)
    assert (status, json.loads(out)["placed"]) == (0, placed)
    assert (f"put the parts up to {1e3 * x:.0f} mm from where the result has them, and were passed over" in err) == said


def test_a_truth_that_is_no_body_is_named(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    facts = json.loads((folder / "hammer" / "truth.json").read_text())
    (folder / "wrong.json").write_text(json.dumps(facts | {"mass_kg": -1.0}))
    status, _, error = run(capsys, folder, "@result.json", "--truth", "@wrong.json", "-o", "@wrong.html")
    assert status == 2
    assert error.startswith(f"steelyard: {folder}/wrong.json: These inertial parameters are not those of a rigid body")


def test_truth_names_only_parts_that_are_the_same(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    changed = json.loads((folder / "result.json").read_text())
    changed["parts"][0]["volume_m3"] *= 1.5
    (folder / "other.json").write_text(json.dumps(changed))
    run(capsys, folder, "@other.json", "--truth", "@hammer/truth.json", "-o", "@out.html")
    page = (folder / "out.html").read_text(encoding="utf-8")
    assert "part 0" in page
    assert "part 1" not in page


def test_what_is_said_of_the_place_comes_first_then_the_log_then_the_truth(
    capsys: pytest.CaptureFixture[str], folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    pages: list[Report] = []
    monkeypatch.setattr("steelyard.report.write_report", lambda page, path: (pages.append(page), path.touch()))
    pose = '{ position = [0.5, 0, 0.12], unit = "m", rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix" }'
    drawn = ("@ols.json", "--parts", "@hammer.ply", "-o", "@out.html")
    for more in (
        ("--truth", "@hammer/truth.json", "--log", "@log.toml", "--pose-in-sensor", pose),
        ("--log", "@log.toml"),
        ("--truth", "@hammer/truth.json"),
        (),
    ):
        assert run(capsys, folder, *drawn, *more)[0] == 0
    given, of_log, of_truth, bare = (None if page.scene is None else page.scene.X_SO for page in pages)
    X = hammer.recording(0).tool.X_OS.inverse()
    assert given is not None
    assert given.position.tolist() == [0.5, 0, 0.12]
    for found in (of_log, of_truth):
        assert found is not None
        np.testing.assert_allclose(found.position, X.position, atol=1e-9)
    assert bare is None


def test_parts_on_a_line_do_not_say_where_the_object_sits(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    arguments = ("@result.json", "--parts", "@hammer.ply", "-o", "@out.html", "--json")
    status, out, err = run(capsys, folder, *arguments)
    assert (status, err, json.loads(out)["placed"]) == (0, "", False)


def test_a_log_that_is_not_the_results_is_told(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    changed = json.loads((folder / "ols.json").read_text())
    (folder / "untared.json").write_text(json.dumps(changed | {"force_bias_N": [0.0, 0.0, 0.0]}))
    for name, told in (("ols", False), ("untared", True)):
        status, _, err = run(capsys, folder, f"@{name}.json", "--log", "@log.toml", "-o", "@out.html")
        assert status == 0
        assert ("log.toml leaves much more than the result says: was it made of another log" in err) == told


@pytest.mark.parametrize(("change", "told"), [("fitted", True), ("none", False)])
def test_masses_of_true_parts_may_be_fitted_or_unknown(
    capsys: pytest.CaptureFixture[str], folder: Path, change: str, told: bool
) -> None:
    facts = json.loads((folder / "hammer" / "truth.json").read_text())
    for part in facts["parts"]:
        mass = part.pop("mass_kg", None) or part.pop("mass_fitted_kg")
        part.pop("mass_fitted_kg", None)
        part |= {"mass_fitted_kg": mass} if change == "fitted" else {"mass_kg": None}
    (folder / "changed.json").write_text(json.dumps(facts))
    status, _, err = run(capsys, folder, "@result.json", "--truth", "@changed.json", "-o", "@out.html")
    assert status == 0, err
    assert (" · truth " in (folder / "out.html").read_text(encoding="utf-8")) == told


def test_parts_of_another_object_are_refused(capsys: pytest.CaptureFixture[str], folder: Path) -> None:
    changed = json.loads((folder / "result.json").read_text())
    changed["parts"][0]["volume_m3"] *= 1.5
    (folder / "other.json").write_text(json.dumps(changed))
    for parts in ("hammer.ply", "parts.npz"):
        status, out, err = run(capsys, folder, "@other.json", "--parts", f"@{parts}", "-o", "@none.html")
        assert (status, out) == (2, "")
        assert err.startswith(f"steelyard: {folder}/{parts}: ")
        assert "that the result was made with." in err
        assert not (folder / "none.html").exists()


@pytest.mark.parametrize(
    ("arguments", "error"),
    [
        (("@none.json",), "@none.json: cannot be read (No such file or directory)."),
        (("@result.json", "--rival", "ols.json"), "--rival needs NAME=FILE, as in --rival OLS=ols.json; got 'ols.json'."),
        (("@result.json", "--scan", "@c.ply"), "@c.ply: no such file."),
        (("@result.json", "--parts", "@result.json"), "@result.json: expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez."),
        (("@result.json", "-o", "@no/r.html"), "@no/r.html: cannot be written: there is no folder @no. Make it first."),
    ],
)  # fmt: skip
def test_wrong_calls(capsys: pytest.CaptureFixture[str], folder: Path, arguments: tuple[str, ...], error: str) -> None:
    status, out, err = run(capsys, folder, *arguments)
    assert (status, out) == (2, "")
    assert err == f"steelyard: {error.replace('@', f'{folder}/')}\n"
