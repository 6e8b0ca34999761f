"""Results read back whole: parts, evidence, delays and notes as they were written, each wrong entry named."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.evidence import Evidence, PartMass
from steelyard.identify.estimate import Estimate
from steelyard.inertia.solids import box
from steelyard.io import read_result, result_dict, write_result

PART: dict[str, Any] = {
    "label": 3, "mass_kg": 0.5, "std_kg": 0.1, "volume_m3": 1e-4, "centroid_m": [1, 2, 3], "material": "steel?",
}  # fmt: skip


@pytest.fixture
def estimate() -> Estimate:
    evidence = Evidence(
        9, 12.5, 1000, 640, 0.1, 0.01, chi2_per_dof=1.1, holdout_force_N=0.2, holdout_torque_Nm=np.nan,
        spread=np.arange(10.0), jackknife_people=np.arange(10.0),
    )  # fmt: skip
    parts = (PartMass(3, 0.5, 0.1, 1e-4, np.array([1.0, 2, 3]), "steel?"), PartMass(4, 0, 0, 1e-6, np.zeros(3)))
    return Estimate(
        box(0.1, 0.2, 0.3, 800), np.eye(10), "part-masses", evidence, np.ones(10, np.bool_), parts=parts,
        delays_s={"a.csv": 0.0075}, notes=("one", "two"),
    )  # fmt: skip


def test_everything_written_is_read(estimate: Estimate, tmp_path: Path) -> None:
    write_result(estimate, tmp_path / "r.json")
    back = read_result(tmp_path / "r.json")
    assert result_dict(back) == result_dict(estimate)


def test_a_result_without_evidence_has_none(tmp_path: Path) -> None:
    (tmp_path / "r.json").write_text('{"mass_kg": 1, "com_m": [0, 0, 0], "inertia_com_kgm2": null}')
    back = read_result(tmp_path / "r.json")
    assert (back.parts, back.notes, dict(back.delays_s)) == ((), (), {})
    assert (back.evidence.rank, back.evidence.samples, back.evidence.chi2_per_dof) == (0, 0, None)


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"parts": 3}, '"parts" must be a list of objects, one per part.'),
        ({"parts": [3]}, '"parts" must be a list of objects, one per part.'),
        ({"parts": [PART | {"label": "x"}]}, "every part needs a whole number as its \"label\"; found 'x'."),
        ({"parts": [PART | {"label": True}]}, "every part needs a whole number as its \"label\"; found 'True'."),
        ({"parts": [PART | {"mass_kg": None}]}, '"mass_kg" of part 3 is missing.'),
        ({"parts": [PART | {"mass_kg": "1"}]}, '"mass_kg" must be one number or null; found something else.'),
        ({"evidence": {"spread": [1.0] * 9 + [True]}}, '"spread" must be 10 numbers or null; found something else.'),
        ({"evidence": {"spread": [1.0] * 9 + [None]}}, None),
        ({"parts": [PART | {"volume_m3": 0}]}, '"volume_m3" of part 3 must be above zero; found 0.'),
        ({"parts": [PART | {"centroid_m": None}]}, '"centroid_m" of part 3 must be 3 finite numbers.'),
        ({"parts": [PART | {"centroid_m": [0, 0]}]}, '"centroid_m" must be 3 numbers or null; found something else.'),
        ({"evidence": []}, None),
        ({"evidence": [1]}, '"evidence" must be one object.'),
        ({"evidence": {"rank": "ten"}}, '"rank" must be one number or null; found something else.'),
        ({"evidence": {"condition": {}}}, '"condition" must be one number or null; found something else.'),
        ({"evidence": {"spread": [1]}}, '"spread" must be 10 numbers or null; found something else.'),
        ({"evidence": {"rank": 1e999}}, '"rank" must be one number or null; found something else.'),
        ({"evidence": {"jackknife_std": 1}}, '"jackknife_std" must be one object.'),
        ({"delays_s": [1]}, '"delays_s" must be one object of numbers.'),
        ({"notes": "a note"}, '"notes" must be a list of texts.'),
    ],
)
def test_wrong_details_are_named(
    estimate: Estimate, tmp_path: Path, changed: dict[str, Any], reason: str | None
) -> None:
    path = tmp_path / "r.json"
    path.write_text(json.dumps(result_dict(replace(estimate, parts=())) | changed))
    if reason is None:
        read_result(path)
        return
    with pytest.raises(BadFile) as caught:
        read_result(path)
    assert str(caught.value) == f"{path}: {reason}"
