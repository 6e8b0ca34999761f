"""The hinge of a result file: null is a number that is not known, anything but a number is refused."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io.teams.team_results import hinge_of

HINGE: dict[str, Any] = {
    "axis": [0, 0, 1], "point_m": [0.1, 0, 0], "swing_deg": 20, "std": {"axis_deg": 0.1, "point_m": 0.001},
}  # fmt: skip
BODY: dict[str, Any] = {
    "robots": ["left"], "mass_range_kg": None, "hinge_moment_kgm2": 0.02, "first_moment_kgm": [0.1, None, 0],
    "std": {"hinge_moment_kgm2": 0.001},
}  # fmt: skip


def test_null_is_not_known() -> None:
    hinge = hinge_of(Path("r.json"), {"hinge": HINGE, "bodies": [BODY, BODY]})
    assert hinge is not None
    assert hinge.swing == pytest.approx(np.radians(20))
    body = hinge.bodies[0]
    assert (body.hinge_moment, body.hinge_moment_std) == (0.02, 0.001)
    assert np.isnan([*body.first_moment, *body.mass_range, body.lever_std]).all()


@pytest.mark.parametrize(
    ("hinge", "body", "reason"),
    [
        ({"axis": [0, 0, True]}, {}, '"axis" must be 3 numbers or null; found something else.'),
        ({"swing_deg": "20"}, {}, '"swing_deg" must be one number or null; found something else.'),
        ({}, {"mass_range_kg": [1]}, '"mass_range_kg" must be 2 numbers or null; found something else.'),
        ({"point_m": None}, {}, '"axis" and "point_m" of the hinge must be three finite numbers each.'),
    ],
)
def test_what_is_no_number_is_refused(hinge: dict[str, Any], body: dict[str, Any], reason: str) -> None:
    with pytest.raises(BadFile) as caught:
        hinge_of(Path("r.json"), {"hinge": HINGE | hinge, "bodies": [BODY, BODY | body]})
    assert str(caught.value) == f"r.json: {reason}"
