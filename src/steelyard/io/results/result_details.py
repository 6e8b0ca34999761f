"""What a result file says beside its numbers: parts, evidence, delays, notes; each may be missing, not wrong."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.evidence import Evidence, PartMass
from steelyard.inertia import forms
from steelyard.io.json_arrays import array_or_none

MOST_PARTS = 100_000


def parts_of(path: Path, values: Mapping[str, Any]) -> tuple[PartMass, ...]:
    """Return the parts with their masses; raises BadFile."""
    rows = values.get("parts") or []
    if not isinstance(rows, list) or len(rows) > MOST_PARTS or not all(isinstance(row, dict) for row in rows):
        raise BadFile(f'{path}: "parts" must be a list of objects, one per part.')
    return tuple(_part(path, row) for row in rows)


def _part(path: Path, row: Mapping[str, Any]) -> PartMass:
    label, material = row.get("label"), row.get("material")
    if isinstance(label, bool) or not isinstance(label, int) or abs(label) > 2**53:
        raise BadFile(f'{path}: every part needs a whole number as its "label"; found {str(label)[:40]!r}.')
    where = f"part {label}"
    volume = _required(path, row, "volume_m3", where)
    if volume <= 0:
        raise BadFile(f'{path}: "volume_m3" of {where} must be above zero; found {volume:g}.')
    centroid = array_or_none(path, row, "centroid_m", (3,))
    if centroid is None:
        raise BadFile(f'{path}: "centroid_m" of {where} must be 3 finite numbers.')
    std = max(_required(path, row, "std_kg", where), 0.0)
    mass = _required(path, row, "mass_kg", where)
    return PartMass(label, mass, std, volume, centroid, None if material is None else str(material))


def _required(path: Path, row: Mapping[str, Any], key: str, where: str) -> float:
    value = _number(path, row, key)
    if value is None:
        raise BadFile(f'{path}: "{key}" of {where} is missing.')
    return value


def evidence_of(path: Path, values: Mapping[str, Any]) -> Evidence:
    """Return the evidence, that of no data where there is none; raises BadFile."""
    seen = values.get("evidence") or {}
    if not isinstance(seen, dict):
        raise BadFile(f'{path}: "evidence" must be one object.')
    return Evidence(
        rank=_count(path, seen, "rank"),
        condition=_known(path, seen, "condition"),
        samples=_count(path, seen, "samples"),
        still_samples=_count(path, seen, "still_samples"),
        residual_force_N=_known(path, seen, "residual_force_N"),
        residual_torque_Nm=_known(path, seen, "residual_torque_Nm"),
        chi2_per_dof=_number(path, seen, "chi2_per_dof"),
        holdout_force_N=_number(path, seen, "holdout_force_N"),
        holdout_torque_Nm=_number(path, seen, "holdout_torque_Nm"),
        spread=array_or_none(path, seen, "spread", (10,)),
        jackknife_people=_people(path, seen.get("jackknife_std")),
    )


def _count(path: Path, entry: Mapping[str, Any], key: str) -> int:
    """Return a whole number, 0 where there is none."""
    return int(_number(path, entry, key) or 0)


def _known(path: Path, entry: Mapping[str, Any], key: str) -> float:
    """Return a number, NaN where there is none."""
    value = _number(path, entry, key)
    return float("nan") if value is None else value


def _people(path: Path, entry: Any) -> Array | None:
    """Return standard deviations (10,) of mass, com, inertia about the CoM."""
    if entry is None:
        return None
    if not isinstance(entry, dict):
        raise BadFile(f'{path}: "jackknife_std" must be one object.')
    mass = _number(path, entry, "mass_kg")
    com = array_or_none(path, entry, "com_m", (3,))
    inertia = array_or_none(path, entry, "inertia_com_kgm2", (3, 3))
    if mass is None or com is None or inertia is None:
        return None
    return np.concatenate([[mass], com, forms.upper(inertia)])


def delays_of(path: Path, values: Mapping[str, Any]) -> dict[str, float]:
    """Return the delay [s] of every stream; raises BadFile."""
    entry = values.get("delays_s") or {}
    if not isinstance(entry, dict):
        raise BadFile(f'{path}: "delays_s" must be one object of numbers.')
    return {str(key): _number(path, entry, key) or 0.0 for key in entry}


def notes_of(path: Path, values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the notes; raises BadFile."""
    entry = values.get("notes") or []
    if not isinstance(entry, list):
        raise BadFile(f'{path}: "notes" must be a list of texts.')
    return tuple(str(note) for note in entry)


def _number(path: Path, entry: Mapping[str, Any], key: str) -> float | None:
    """Return one finite number, None where there is none."""
    found = array_or_none(path, entry, key, ())
    return None if found is None else float(found)
