"""Results as JSON: written whole or not at all."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.evidence import Evidence, PartMass
from steelyard.identify.estimate import Estimate
from steelyard.inertia import forms
from steelyard.io.teams.team_results import team_entries
from steelyard.team.estimate import TeamEstimate
from steelyard.whole_files import write_text

_BIASES = ("force_bias_N", "torque_bias_Nm")
# A team has a sensor for every robot, and often a bias for every recording: these have no one answer.
_OF_ONE_SENSOR = (*_BIASES, "bias_covariance", "cross_covariance")


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
    return {
        "mass_kg": float(values[0]),
        "com_m": values[1:4],
        "inertia_com_kgm2": forms.inertia_matrix(values),
    }


def _evidence(evidence: Evidence) -> dict[str, Any]:
    jackknife = evidence.jackknife_people
    return {
        "rank": evidence.rank,
        "condition": evidence.condition,
        "samples": evidence.samples,
        "still_samples": evidence.still_samples,
        "residual_force_N": evidence.residual_force_N,
        "residual_torque_Nm": evidence.residual_torque_Nm,
        "chi2_per_dof": evidence.chi2_per_dof,
        "holdout_force_N": evidence.holdout_force_N,
        "holdout_torque_Nm": evidence.holdout_torque_Nm,
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
