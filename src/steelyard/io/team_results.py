"""What a team's result holds beside the ten numbers: grasps, clock offsets, principal frames; written and read."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, BadInput
from steelyard.identify.estimate import Estimate
from steelyard.io.hinge_results import hinge_entries, hinge_of
from steelyard.spatial import Pose, Rotation
from steelyard.team.estimate import GraspEstimate, TeamEstimate

MOST_ROBOTS = 10_000


def team_entries(estimate: TeamEstimate) -> dict[str, Any]:
    """Return the entries that only a team's result has, as arrays and numbers."""
    return {
        "reference": estimate.reference,
        "grasps": {name: _grasp_entry(grasp) for name, grasp in estimate.grasps.items()},
        "clock_offsets_s": dict(estimate.clock_offsets_s),
        "clock_offset_std_s": dict(estimate.clock_offset_std_s),
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
        hinge=hinge_of(path, values),
    )


def _grasp(path: Path, name: str, entry: Any) -> GraspEstimate:
    if not isinstance(entry, dict):
        raise BadFile(f'{path}: the grasp of "{name}" must be one object with rotation and position_m.')
    where = f'the grasp of "{name}"'
    matrix = _array(path, entry, "rotation", where, lambda s: s == (3, 3))
    try:
        turn = Rotation(matrix)
    except BadInput as error:
        raise BadFile(f"{path}: {where}: {error}") from None
    place = _array(path, entry, "position_m", where, lambda s: s == (3,))
    covariance = np.zeros((6, 6))
    if "covariance" in entry:
        covariance = _array(path, entry, "covariance", where, lambda s: s == (6, 6))
    elif "std_deg" in entry and "std_m" in entry:
        said = [_array(path, entry, key, where, lambda s: s == (3,)) for key in ("std_deg", "std_m")]
        covariance = np.diag(np.concatenate([np.deg2rad(said[0]), said[1]]) ** 2)
    lost = np.zeros((0, 6))
    if entry.get("lost"):
        lost = _array(path, entry, "lost", where, lambda s: len(s) == 2 and s[1] == 6)
    return GraspEstimate(Pose(turn, place), covariance, lost)


def _array(
    path: Path, entry: Mapping[str, Any], key: str, where: str, fits: Callable[[tuple[int, ...]], bool]
) -> Array:
    try:
        array = np.array(entry.get(key), dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if not fits(array.shape) or not np.isfinite(array).all():
        raise BadFile(f'{path}: "{key}" of {where} has the wrong shape, or numbers that are not finite.')
    return array


def _seconds(path: Path, values: Mapping[str, Any], key: str) -> dict[str, float]:
    entry = values.get(key) or {}
    if not isinstance(entry, dict):
        raise BadFile(f'{path}: "{key}" must be one object of numbers.')
    return {str(name): float(_array(path, entry, name, key, lambda s: s == ())) for name in entry}
