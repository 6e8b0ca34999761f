"""What a result holds of a team alone: grasps, clock offsets, principal frames, a hinge; written and read."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, BadInput
from steelyard.identify.estimate import Estimate
from steelyard.io.contents import array_of, array_or_none, arrays_of
from steelyard.spatial import Pose, Rotation
from steelyard.team.estimate import BodyEstimate, GraspEstimate, HingeEstimate, TeamEstimate

MOST_ROBOTS = 10_000


def team_entries(estimate: TeamEstimate) -> dict[str, Any]:
    """Return the entries that only a team's result has, as arrays and numbers."""
    return {
        "reference": estimate.reference,
        "grasps": {name: _grasp_entry(grasp) for name, grasp in estimate.grasps.items()},
        "clock_offsets_s": dict(estimate.clock_offsets_s),
        "clock_offset_std_s": dict(estimate.clock_offset_std_s),
        "wrench_biases": dict(estimate.wrench_biases),
        "wrench_maps": dict(estimate.wrench_maps),
        "principal_moments_kgm2": estimate.principal_moments,
        "principal_frame": {
            name: {"rotation": pose.rotation.matrix, "position_m": pose.position}
            for name, pose in estimate.principal_frames.items()
        },
        **hinge_entries(estimate.hinge),
    }


def _grasp_entry(grasp: GraspEstimate) -> dict[str, Any]:
    return {
        "rotation": grasp.pose.rotation.matrix,
        "position_m": grasp.pose.position,
        "std_deg": grasp.std_deg,
        "std_m": grasp.std_m,
        "covariance": grasp.covariance,
        "lost": grasp.lost,
    }


def team_of(path: Path, values: Mapping[str, Any], plain: Estimate) -> TeamEstimate:
    """Return the team's result whose ten numbers are `plain`; raises BadFile."""
    grasps = values.get("grasps")
    if not isinstance(grasps, dict) or not 0 < len(grasps) <= MOST_ROBOTS:
        raise BadFile(f'{path}: "grasps" must be one object with a grasp of every robot.')
    reference = values.get("reference", plain.frame)
    if reference not in grasps:
        raise BadFile(f'{path}: the reference must be one of the grasps; found "{str(reference)[:40]}".')
    known = {f.name: getattr(plain, f.name) for f in fields(Estimate)}
    return TeamEstimate(
        **known,
        reference=str(reference),
        grasps={str(name): _grasp(path, str(name), entry) for name, entry in grasps.items()},
        clock_offsets_s=_seconds(path, values, "clock_offsets_s"),
        clock_offset_std_s=_seconds(path, values, "clock_offset_std_s"),
        wrench_biases=arrays_of(path, values, "wrench_biases", (6,), " with six numbers for every recording"),
        wrench_maps=_maps(path, values),
        hinge=hinge_of(path, values),
    )


def _grasp(path: Path, name: str, entry: Any) -> GraspEstimate:
    if not isinstance(entry, dict):
        raise BadFile(f'{path}: the grasp of "{name}" must be one object with rotation and position_m.')
    of = f' of the grasp of "{name}"'
    matrix = array_of(path, entry, "rotation", (3, 3), of)
    try:
        turn = Rotation(matrix)
    except BadInput as error:
        raise BadFile(f'{path}: "rotation"{of}: {error}') from None
    place = array_of(path, entry, "position_m", (3,), of)
    covariance = np.zeros((6, 6))
    if "covariance" in entry:
        covariance = array_of(path, entry, "covariance", (6, 6), of)
    elif "std_deg" in entry and "std_m" in entry:
        said = [array_of(path, entry, key, (3,), of) for key in ("std_deg", "std_m")]
        covariance = np.diag(np.concatenate([np.deg2rad(said[0]), said[1]]) ** 2)
    lost = np.zeros((0, 6))
    if entry.get("lost"):
        lost = array_of(path, entry, "lost", (None, 6), of)
    return GraspEstimate(Pose(turn, place), covariance, lost)


def _maps(path: Path, values: Mapping[str, Any]) -> dict[str, Array]:
    """Return what (6, 6) makes of each wrench taken otherwise than given what it was taken for; raises BadFile."""
    maps = arrays_of(path, values, "wrench_maps", (6, 6), " with 6 x 6 numbers for every robot")
    for name, taken in maps.items():
        if not all(np.linalg.det(block) for block in (taken[:3, :3], taken[3:, 3:])):
            raise BadFile(f'{path}: "{name}" of wrench_maps must leave something of moment and force; found zeros.')
    return maps


def _seconds(path: Path, values: Mapping[str, Any], key: str) -> dict[str, float]:
    return {name: float(value) for name, value in arrays_of(path, values, key, (), " of numbers").items()}


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
    axis, point = _numbers_or_nan(path, hinge, "axis", 3), _numbers_or_nan(path, hinge, "point_m", 3)
    spread = [float(_numbers_or_nan(path, std, key)) for key in ("axis_deg", "point_m")]
    swing = float(np.deg2rad(_numbers_or_nan(path, hinge, "swing_deg")))
    if not (np.isfinite(axis).all() and np.isfinite(point).all()):
        raise BadFile(f'{path}: "axis" and "point_m" of the hinge must be three finite numbers each.')
    return HingeEstimate(axis, point, spread[0], spread[1], swing, (made[0], made[1]))


def _body(path: Path, body: Any) -> BodyEstimate:
    if not isinstance(body, dict) or not isinstance(body.get("robots"), list):
        raise BadFile(f'{path}: each of "bodies" must be one object with its robots.')
    std = _inner(body)
    return BodyEstimate(
        tuple(str(name) for name in body["robots"]),
        float(_numbers_or_nan(path, body, "hinge_moment_kgm2")), float(_numbers_or_nan(path, std, "hinge_moment_kgm2")),
        _numbers_or_nan(path, body, "first_moment_kgm", 3), _numbers_or_nan(path, std, "first_moment_kgm", 3),
        float(_numbers_or_nan(path, std, "lever_kgm")), _numbers_or_nan(path, body, "mass_range_kg", 2),
    )  # fmt: skip


def _inner(entry: Mapping[str, Any]) -> Mapping[str, Any]:
    """Return the standard deviations of an entry, empty where it has none."""
    std = entry.get("std")
    return std if isinstance(std, dict) else {}


def _numbers_or_nan(path: Path, entry: Mapping[str, Any], key: str, *shape: int) -> Array:
    """Return numbers of a shape, NaN where there are none."""
    found = array_or_none(path, entry, key, shape)
    return np.full(shape, np.nan) if found is None else found
