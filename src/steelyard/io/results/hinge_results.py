"""The hinge of a jointed payload and its two bodies in a result file."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.io.json_arrays import array_or_none
from steelyard.team.estimate import BodyEstimate, HingeEstimate


def hinge_entries(hinge: HingeEstimate | None) -> dict[str, Any]:
    """Return "hinge" and "bodies", nothing for one rigid body; null where the motion does not show a number."""
    if hinge is None:
        return {}
    return {
        "hinge": {
            "axis": hinge.axis, "point_m": hinge.point, "swing_deg": float(np.rad2deg(hinge.swing)),
            "std": {"axis_deg": hinge.axis_std_deg, "point_m": hinge.point_std_m},
        },
        "bodies": [
            {
                "robots": list(body.robots),
                "mass_kg": None, "com_m": None, "inertia_com_kgm2": None,
                "mass_range_kg": _shown(body.mass_range),
                "hinge_moment_kgm2": _shown(body.hinge_moment), "first_moment_kgm": _shown(body.first_moment),
                "std": {
                    "hinge_moment_kgm2": _shown(body.hinge_moment_std),
                    "first_moment_kgm": _shown(body.first_moment_std), "lever_kgm": _shown(body.lever_std),
                },
            }
            for body in hinge.bodies
        ],
    }  # fmt: skip


def _shown(values: Array | float) -> Any:
    return values if np.isfinite(values).all() else None


def hinge_of(path: Path, values: Mapping[str, Any]) -> HingeEstimate | None:
    """Return the hinge of a result file, None where it has none; raises BadFile."""
    hinge, bodies = values.get("hinge"), values.get("bodies")
    if hinge is None:
        return None
    if not isinstance(hinge, dict) or not isinstance(bodies, list) or len(bodies) != 2:
        raise BadFile(f'{path}: "hinge" must be one object, with "bodies" a list of two.')
    made = [_body(path, body) for body in bodies]
    std = _inner(hinge)
    axis, point = _numbers(path, hinge, "axis", 3), _numbers(path, hinge, "point_m", 3)
    spread = [float(_numbers(path, std, key)) for key in ("axis_deg", "point_m")]
    swing = float(np.deg2rad(_numbers(path, hinge, "swing_deg")))
    if not (np.isfinite(axis).all() and np.isfinite(point).all()):
        raise BadFile(f'{path}: "axis" and "point_m" of the hinge must be three finite numbers each.')
    return HingeEstimate(axis, point, spread[0], spread[1], swing, (made[0], made[1]))


def _body(path: Path, body: Any) -> BodyEstimate:
    if not isinstance(body, dict) or not isinstance(body.get("robots"), list):
        raise BadFile(f'{path}: each of "bodies" must be one object with its robots.')
    std = _inner(body)
    return BodyEstimate(
        tuple(str(name) for name in body["robots"]),
        float(_numbers(path, body, "hinge_moment_kgm2")), float(_numbers(path, std, "hinge_moment_kgm2")),
        _numbers(path, body, "first_moment_kgm", 3), _numbers(path, std, "first_moment_kgm", 3),
        float(_numbers(path, std, "lever_kgm")), _numbers(path, body, "mass_range_kg", 2),
    )  # fmt: skip


def _inner(entry: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the standard deviations of an entry, empty where it has none."""
    std = entry.get("std")
    return std if isinstance(std, dict) else {}


def _numbers(path: Path, entry: Mapping[str, Any], key: str, *shape: int) -> Array:
    """Return numbers of a shape, NaN where there are none."""
    found = array_or_none(path, entry, key, shape)
    return np.full(shape, np.nan) if found is None else found
