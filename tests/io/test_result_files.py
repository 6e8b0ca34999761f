"""Results as JSON and back."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.evidence import Evidence
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia.solids import box
from steelyard.io import read_result, result_dict, write_result
from steelyard.spatial import Pose, Rotation


@pytest.fixture
def estimate() -> Estimate:
    body = box(0.1, 0.2, 0.3, 800).in_frame(Pose(Rotation.exp([0.1, 0.2, 0.3]), np.array([0, 0, 0.15])))
    evidence = Evidence(
        10,
        12.0,
        1000,
        640,
        0.1,
        0.01,
        holdout_force_N=np.nan,
        spread=np.ones(10),
        jackknife_people=np.ones(10),
    )
    return Estimate(
        body, np.diag(np.arange(1, 11) * 1e-6), "noise-aware", evidence, np.ones(10, np.bool_),
        wrench_bias=np.arange(6.0), delays_s={"a.csv": 0.0075},
        findings=(Finding.of("outliers", "3 rows were left out."),), notes=("a note",),
    )  # fmt: skip


def test_keys_of_the_format(estimate: Estimate) -> None:
    result = result_dict(estimate)
    assert list(result) == [
        "mass_kg", "com_m", "inertia_com_kgm2", "frame", "method", "consistent", "std", "covariance",
        "bias_covariance", "cross_covariance", "parameters",
        "identified", "force_bias_N", "torque_bias_Nm", "delays_s", "parts", "evidence", "findings", "notes",
    ]  # fmt: skip
    assert result["mass_kg"] == pytest.approx(4.8)
    np.testing.assert_allclose(result["com_m"], [0, 0, 0.15], atol=1e-15)
    np.testing.assert_allclose(result["inertia_com_kgm2"], estimate.parameters.inertia_com)
    assert result["force_bias_N"] == [3, 4, 5]
    assert result["torque_bias_Nm"] == [0, 1, 2]
    assert result["std"]["mass_kg"] == pytest.approx(1e-3)
    assert np.shape(result["std"]["inertia_com_kgm2"]) == (3, 3)
    assert np.shape(result["covariance"]) == (10, 10)
    assert result["identified"] == {"mass": True, "com": [True] * 3, "inertia": [True] * 6}
    assert result["delays_s"] == {"a.csv": 0.0075}
    assert result["evidence"]["rank"] == 10
    assert result["evidence"]["holdout_force_N"] is None
    assert result["evidence"]["jackknife_std"]["com_m"] == [1, 1, 1]
    assert result["findings"][0]["code"] == "outliers"
    assert json.loads(json.dumps(result, allow_nan=False)) == result


def test_inertia_is_null_where_the_data_do_not_fix_it(estimate: Estimate) -> None:
    result = result_dict(replace(estimate, identified=np.arange(10) < 9))
    assert result["inertia_com_kgm2"] is None


def test_entries_that_are_identified_follow_from_the_result_though_the_inertia_is_null(estimate: Estimate) -> None:
    result = result_dict(replace(estimate, identified=np.arange(10) < 9))
    mass, com = result["mass_kg"], np.array(result["com_m"])
    xx, xy, xz, yy, yz, zz = result["parameters"][4:]
    about_origin = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    about_com = about_origin - mass * (com @ com * np.eye(3) - np.outer(com, com))
    assert result["identified"]["inertia"] == [True] * 5 + [False]
    np.testing.assert_allclose(about_com, estimate.parameters.inertia_com, rtol=1e-12, atol=1e-15)
    assert np.all(np.array(result["std"]["inertia_com_kgm2"]) > 0)


def test_round_trip(estimate: Estimate, tmp_path: Path) -> None:
    for identified in (np.ones(10, np.bool_), np.arange(10) < 4):
        write_result(replace(estimate, identified=identified), tmp_path / "r.json")
        back = read_result(tmp_path / "r.json")
        np.testing.assert_allclose(back.parameters.vector, estimate.parameters.vector, rtol=1e-12, atol=1e-15)
        np.testing.assert_allclose(back.covariance, estimate.covariance)
        np.testing.assert_allclose(back.wrench_bias, estimate.wrench_bias)
        np.testing.assert_allclose(back.cross_covariance, estimate.cross_covariance)
        assert back.method == "noise-aware"
        assert (back.identified == identified).all()
        assert back.codes() == estimate.codes()
    assert [path.name for path in tmp_path.iterdir()] == ["r.json"]


def test_a_data_sheet_typed_as_a_tool(tmp_path: Path) -> None:
    (tmp_path / "t.json").write_text('{"mass_kg": 0.5, "com_m": [0, 0, 0.1], "inertia_com_kgm2": null}')
    tool = read_result(tmp_path / "t.json")
    np.testing.assert_allclose(tool.parameters.vector[:4], [0.5, 0, 0, 0.05])
    assert tool.identified[:4].all()
    assert not tool.identified[4:].any()


@pytest.mark.parametrize(
    ("mass", "moments", "why"),
    [
        (-1.0, [1, 1, 1], "mass must be above zero, it is -1 kg"),
        (1.0, [1, 1, 9], "the triangle inequality is broken"),
        (1.0, [-1, 1, 1], "principal moments must be above zero"),
    ],
)
def test_a_data_sheet_of_no_body(tmp_path: Path, mass: float, moments: list[float], why: str) -> None:
    values = {"mass_kg": mass, "com_m": [0, 0, 0], "inertia_com_kgm2": np.diag(moments).tolist()}
    (tmp_path / "t.json").write_text(json.dumps(values))
    with pytest.raises(BadFile, match=f"no body has these parameters: {why}"):
        read_result(tmp_path / "t.json")


@pytest.mark.parametrize("moments", [[0, 0, 0], [0, 1, 1], [1, 1, 2.005]])
def test_a_data_sheet_of_a_point_a_rod_or_a_sheet(tmp_path: Path, moments: list[float]) -> None:
    values = {"mass_kg": 1, "com_m": [0, 0, 0], "inertia_com_kgm2": np.diag(moments).tolist()}
    (tmp_path / "t.json").write_text(json.dumps(values))
    assert read_result(tmp_path / "t.json").mass == 1


def test_nothing_is_left_where_writing_fails(estimate: Estimate, tmp_path: Path) -> None:
    with pytest.raises(BadFile) as caught:
        write_result(estimate, tmp_path / "no" / "r.json")
    assert str(caught.value) == f"{tmp_path}/no/r.json: cannot be written (No such file or directory)."
    (tmp_path / "folder.json").mkdir()
    with pytest.raises(BadFile):
        write_result(estimate, tmp_path / "folder.json")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.json"]


GOOD = {
    "mass_kg": 1, "com_m": [0, 0, 0], "inertia_com_kgm2": np.eye(3).tolist(), "frame": "S",
    "covariance": np.eye(10).tolist(),
}  # fmt: skip


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        (
            "{",
            "not a Steelyard result: not valid JSON (Expecting property name enclosed in double quotes: line 1 column 2 "
            "(char 1)). Write one with: steelyard identify LOG -o FILE.",
        ),
        ("[]", "not a Steelyard result: expected one JSON object. Write one with: steelyard identify LOG -o FILE."),
        ("{}", 'not a Steelyard result: "mass_kg" is missing. Write one with: steelyard identify LOG -o FILE.'),
        (json.dumps(GOOD | {"mass_kg": "1 kg"}), '"mass_kg" must be one finite number; found something else.'),
        (json.dumps(GOOD | {"mass_kg": True}), '"mass_kg" must be one finite number; found something else.'),
        (json.dumps(GOOD | {"mass_kg": "0.7"}), '"mass_kg" must be one finite number; found something else.'),
        (json.dumps(GOOD | {"mass_kg": 10**400}), '"mass_kg" must be one finite number; found something else.'),
        (json.dumps(GOOD | {"com_m": [0, [0], 0]}), '"com_m" must be 3 finite numbers; found something else.'),
        (json.dumps(GOOD | {"com_m": [0, 0]}), '"com_m" must be 3 finite numbers; found something else.'),
        (json.dumps(GOOD | {"covariance": [[np.nan] * 10] * 10}), '"covariance" must be 10 x 10 finite numbers; found something else.'),
        (json.dumps(GOOD | {"inertia_com_kgm2": [[1, 2, 0], [0, 1, 0], [0, 0, 1]]}), "inertia about the centre of mass must be symmetric; it differs from its transpose by 2."),
    ],
)  # fmt: skip
def test_results_that_are_wrong(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "r.json"
    path.write_text(text)
    with pytest.raises(BadFile) as caught:
        read_result(path)
    assert str(caught.value) == f"{path}: {reason}"


def test_a_tool_in_another_frame(tmp_path: Path) -> None:
    path = tmp_path / "r.json"
    path.write_text(json.dumps(GOOD | {"frame": "left"}))
    with pytest.raises(BadFile) as caught:
        read_result(path)
    assert str(caught.value) == f'{path}: a result must be given in the sensor frame "S"; found "left".'


def test_missing_result(tmp_path: Path) -> None:
    with pytest.raises(BadFile) as caught:
        read_result(tmp_path / "r.json")
    assert str(caught.value) == f"{tmp_path}/r.json: cannot be read (No such file or directory)."
