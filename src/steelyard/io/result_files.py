"""Results as JSON: written whole or not at all, and read back with checks, as is a data sheet typed by hand.

Parts, evidence, delays and notes may be missing, not wrong.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.evidence import Evidence, PartMass
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters, forms
from steelyard.io.contents import array_of, array_or_none, in_file, load_json, object_of
from steelyard.io.teams.team_results import team_entries, team_of
from steelyard.team.estimate import TeamEstimate
from steelyard.whole_files import write_text

_BIASES = ("force_bias_N", "torque_bias_Nm")
# A team has a sensor for every robot, and often a bias for every recording: these have no one answer.
_OF_ONE_SENSOR = (*_BIASES, "bias_covariance", "cross_covariance")

# Share of the largest entry of an inertia by which what was typed may be off.
ROUNDED = 0.01
_WRITE_ONE = "Write one with: steelyard identify LOG -o FILE."

MOST_PARTS = 100_000
# Evidence that is one number, and what stands for it where it is not known.
_EVIDENCE: dict[str, float | None] = {
    "rank": 0, "condition": math.nan, "samples": 0, "still_samples": 0, "residual_force_N": math.nan,
    "residual_torque_Nm": math.nan, "chi2_per_dof": None, "holdout_force_N": None, "holdout_torque_Nm": None,
}  # fmt: skip
_COUNTS = ("rank", "samples", "still_samples")


def result_dict(estimate: Estimate) -> dict[str, Any]:
    """Return the result as plain values for JSON; numbers that are not finite become None.

    `inertia_com_kgm2` is about the centre of mass in the axes of `frame`, None where the data do not fix it;
    `parameters` (10,) and `covariance` (10, 10) are m, h, I about the origin of `frame`; `bias_covariance` (6, 6) and
    `cross_covariance` (10, 6), torque first, let a later run share the bias. A team's result adds grasps, clock offsets
    and principal frames, and has None for the biases: every robot has its own.
    """
    torque_bias, force_bias = np.split(estimate.wrench_bias, 2)
    torque_std, force_std = np.split(estimate.wrench_bias_std, 2)
    identified = [bool(flag) for flag in estimate.identified]
    values: dict[str, Any] = {
        "mass_kg": estimate.mass,
        "com_m": estimate.com,
        "inertia_com_kgm2": estimate.inertia_com,
        "frame": estimate.frame,
        "method": estimate.method,
        "consistent": estimate.parameters.validity().consistent,
        "std": {**_people(estimate.std), "force_bias_N": force_std, "torque_bias_Nm": torque_std},
        "covariance": estimate.covariance,
        "bias_covariance": estimate.bias_covariance,
        "cross_covariance": estimate.cross_covariance,
        "parameters": estimate.parameters.vector,
        "identified": {"mass": identified[0], "com": identified[1:4], "inertia": identified[4:]},
        "force_bias_N": force_bias,
        "torque_bias_Nm": torque_bias,
        "delays_s": dict(estimate.delays_s),
        "parts": [_part(part) for part in estimate.parts],
        "evidence": _evidence(estimate.evidence),
        "findings": [finding.plain() for finding in estimate.findings],
        "notes": list(estimate.notes),
    }
    if isinstance(estimate, TeamEstimate):
        values |= team_entries(estimate) | dict.fromkeys(_OF_ONE_SENSOR)
        values["std"] |= dict.fromkeys(_BIASES)
    return {key: _plain(value) for key, value in values.items()}


def _part(part: PartMass) -> dict[str, Any]:
    """Return one part under the names of the format."""
    return {
        "label": part.label,
        "mass_kg": part.mass,
        "std_kg": part.std,
        "volume_m3": part.volume,
        "centroid_m": part.centroid,
        "density_kg_m3": part.density,
        "material": part.material,
    }


def _people(values: Array) -> dict[str, Any]:
    """Return (10,) of mass, com, inertia about the CoM under their names; the inertia as a matrix."""
    return {"mass_kg": float(values[0]), "com_m": values[1:4], "inertia_com_kgm2": forms.inertia_matrix(values)}


def _evidence(evidence: Evidence) -> dict[str, Any]:
    jackknife = evidence.jackknife_people
    return {
        **{name: getattr(evidence, name) for name in _EVIDENCE},
        "spread": evidence.spread,
        "jackknife_std": None if jackknife is None else _people(jackknife),
    }


def _plain(value: Any) -> Any:
    """Return arrays as lists, numbers as int or float, and None for what JSON cannot hold."""
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, dict):
        return {str(key): _plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_plain(item) for item in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value


def write_result(estimate: Estimate, path: Path | str) -> None:
    """Write the result as JSON; the file appears complete or not at all. Raises BadFile."""
    write_text(Path(path), json.dumps(result_dict(estimate), indent=1, allow_nan=False) + "\n")


def read_result(path: Path | str) -> Estimate:
    """Return a result; raises BadFile.

    Only `mass_kg`, `com_m` and `inertia_com_kgm2` are needed, so that a data sheet can be typed as a result: it is then
    exact, with everything identified. Where a result has no inertia (null), its best guess is in the parameters. A file
    with grasps comes back as a TeamEstimate.
    """
    path = Path(path)
    values = load_json(path, "a Steelyard result", _WRITE_ONE)
    team = "grasps" in values
    if not team and values.get("frame", "S") != "S":
        raise BadFile(f'{path}: a result must be given in the sensor frame "S"; found "{values["frame"]}".')
    found = Estimate(
        _body(path, values),
        _matrix(path, values, "covariance", (10, 10)),
        str(values.get("method", "given")),
        _read_evidence(path, values),
        _identified(path, values),
        np.concatenate([_matrix(path, values, "torque_bias_Nm", (3,)), _matrix(path, values, "force_bias_N", (3,))]),
        _matrix(path, values, "bias_covariance", (6, 6)),
        _matrix(path, values, "cross_covariance", (10, 6)),
        delays_s=_delays(path, values),
        findings=_findings(path, values),
        parts=_parts(path, values),
        notes=_notes(path, values),
        frame=str(values.get("frame", "S")),
    )
    return team_of(path, values, found) if team else found


def _matrix(path: Path, values: dict[str, Any], key: str, shape: tuple[int, ...]) -> Array:
    """Return an optional entry, zero where it is left out."""
    return np.zeros(shape) if values.get(key) is None else _numbers(path, values, key, shape)


def _identified(path: Path, values: dict[str, Any]) -> np.ndarray[Any, np.dtype[np.bool_]]:
    entry = values.get("identified")
    if entry is None:
        return np.repeat([True, True, values.get("inertia_com_kgm2") is not None], [1, 3, 6])
    try:
        flags = [entry["mass"], *entry["com"], *entry["inertia"]]
    except (KeyError, TypeError):
        flags = []
    if len(flags) != 10 or not all(isinstance(flag, bool) for flag in flags):
        raise BadFile(f'{path}: "identified" must hold mass, three of com and six of inertia, true or false each.')
    return np.array(flags)


def _findings(path: Path, values: dict[str, Any]) -> tuple[Finding, ...]:
    try:
        return tuple(Finding(str(f["code"]), str(f["message"]), str(f["remedy"])) for f in values.get("findings") or ())
    except (KeyError, TypeError):
        raise BadFile(f'{path}: "findings" must be a list of objects with code, message and remedy.') from None


def _body(path: Path, values: dict[str, Any]) -> InertialParameters:
    mass = float(_numbers(path, values, "mass_kg", ()))
    com = _numbers(path, values, "com_m", (3,))
    if values.get("inertia_com_kgm2") is None:
        if "parameters" in values:
            return InertialParameters(_numbers(path, values, "parameters", (10,)))
        return InertialParameters.from_com(mass, com, np.zeros((3, 3)))
    inertia = _numbers(path, values, "inertia_com_kgm2", (3, 3))
    body = in_file(path, lambda: InertialParameters.from_com(mass, com, inertia))
    if "covariance" not in values:
        _require_body(path, body)
    return body


def _require_body(path: Path, body: InertialParameters) -> None:
    """Raise BadFile where what was typed is no body's; what noise leaves of a small one need not be one."""
    # Points, lines and sheets have moments on the edge of what is possible, and data sheets round.
    slack = ROUNDED * np.abs(body.inertia_com).max() + np.finfo(float).tiny
    rounded = InertialParameters.from_com(body.mass, body.com, body.inertia_com + slack * np.eye(3))
    if not rounded.validity().consistent:
        raise BadFile(f"{path}: no body has these parameters: {body.validity()}. Correct mass_kg and inertia_com_kgm2.")


def _numbers(path: Path, values: dict[str, Any], key: str, shape: tuple[int, ...]) -> Array:
    if key not in values:
        raise BadFile(f'{path}: not a Steelyard result: "{key}" is missing. {_WRITE_ONE}')
    return array_of(path, values, key, shape)


def _parts(path: Path, values: Mapping[str, Any]) -> tuple[PartMass, ...]:
    """Return the parts with their masses; raises BadFile."""
    rows = values.get("parts") or []
    if not isinstance(rows, list) or len(rows) > MOST_PARTS or not all(isinstance(row, dict) for row in rows):
        raise BadFile(f'{path}: "parts" must be a list of objects, one per part.')
    return tuple(_read_part(path, row) for row in rows)


def _read_part(path: Path, row: Mapping[str, Any]) -> PartMass:
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


def _read_evidence(path: Path, values: Mapping[str, Any]) -> Evidence:
    """Return the evidence, that of no data where there is none; raises BadFile."""
    seen = object_of(path, values, "evidence")
    found: dict[str, Any] = {}
    for name, unknown in _EVIDENCE.items():
        value = _number(path, seen, name)
        found[name] = unknown if value is None else int(value) if name in _COUNTS else value
    return Evidence(
        **found,
        spread=array_or_none(path, seen, "spread", (10,)),
        jackknife_people=_read_people(path, seen.get("jackknife_std")),
    )


def _read_people(path: Path, entry: Any) -> Array | None:
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


def _delays(path: Path, values: Mapping[str, Any]) -> dict[str, float]:
    """Return the delay [s] of every stream; raises BadFile."""
    entry = object_of(path, values, "delays_s", " of numbers")
    return {str(key): _number(path, entry, key) or 0.0 for key in entry}


def _notes(path: Path, values: Mapping[str, Any]) -> tuple[str, ...]:
    """Return the notes; raises BadFile."""
    entry = values.get("notes") or []
    if not isinstance(entry, list):
        raise BadFile(f'{path}: "notes" must be a list of texts.')
    return tuple(str(note) for note in entry)


def _number(path: Path, entry: Mapping[str, Any], key: str) -> float | None:
    """Return one finite number, None where there is none."""
    found = array_or_none(path, entry, key, ())
    return None if found is None else float(found)
