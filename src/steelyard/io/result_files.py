"""Results as JSON (formats, section 5): written whole or not at all, read back with checks."""

from __future__ import annotations

import contextlib
import json
import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile, BadInput
from steelyard.identify.estimate import Estimate, Evidence
from steelyard.inertia import InertialParameters, forms

_LARGEST = 64_000_000
_WRITE_ONE = "Write one with: steelyard identify LOG -o FILE."


def result_dict(estimate: Estimate) -> dict[str, Any]:
    """Return the result as plain values for JSON; numbers that are not finite become None.

    `inertia_com_kgm2` is about the centre of mass in the axes of `frame`, None where the data do not fix it;
    `parameters` (10,) and `covariance` (10, 10) are m, h, I about the origin of `frame`.
    """
    torque_bias, force_bias = np.split(estimate.wrench_bias, 2)
    torque_std, force_std = np.split(estimate.wrench_bias_std, 2)
    identified = [bool(flag) for flag in estimate.identified]
    values = {
        "mass_kg": estimate.mass,
        "com_m": estimate.com,
        "inertia_com_kgm2": estimate.inertia_com,
        "frame": estimate.frame,
        "method": estimate.method,
        "consistent": estimate.parameters.validity().consistent,
        "std": {**_people(estimate.std), "force_bias_N": force_std, "torque_bias_Nm": torque_std},
        "covariance": estimate.covariance,
        "parameters": estimate.parameters.vector,
        "identified": {"mass": identified[0], "com": identified[1:4], "inertia": identified[4:]},
        "force_bias_N": force_bias,
        "torque_bias_Nm": torque_bias,
        "delays_s": dict(estimate.delays_s),
        "evidence": _evidence(estimate.evidence),
        "findings": [{"code": f.code, "message": f.message, "remedy": f.remedy} for f in estimate.findings],
        "notes": list(estimate.notes),
    }
    return {key: _plain(value) for key, value in values.items()}


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


def write_text(path: Path, text: str) -> None:
    """Write a text file by way of a temporary one beside it; raises BadFile where that is not possible."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_text(text, encoding="utf-8")
        temporary.replace(path)
    except OSError as error:
        raise BadFile(f"{path}: cannot be written ({error.strerror}).") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


def read_result(path: Path | str) -> tuple[InertialParameters, Array, dict[str, Any]]:
    """Return the body, its covariance (10, 10) and the whole result as written; raises BadFile.

    Where the result has no inertia (`inertia_com_kgm2` null), it is the best guess that
    the result carries in `parameters`, or zero: look at `identified`.
    """
    path = Path(path)
    values = _load_json(path)
    return _body(path, values), _numbers(path, values, "covariance", (10, 10)), values


def read_result_parameters(path: Path | str) -> InertialParameters:
    """Return the body of a result in the sensor frame, to be subtracted as a tool; raises BadFile.

    Only `mass_kg`, `com_m` and `inertia_com_kgm2` are needed, so that a data sheet can be typed as a result.
    """
    path = Path(path)
    values = _load_json(path)
    body = _body(path, values)
    if values.get("frame", "S") != "S":
        raise BadFile(f'{path}: a tool must be given in the sensor frame "S"; found "{values["frame"]}".')
    return body


def _body(path: Path, values: dict[str, Any]) -> InertialParameters:
    mass = float(_numbers(path, values, "mass_kg", ()))
    com = _numbers(path, values, "com_m", (3,))
    if values.get("inertia_com_kgm2") is None:
        if "parameters" in values:
            return InertialParameters(_numbers(path, values, "parameters", (10,)))
        return InertialParameters.from_com(mass, com, np.zeros((3, 3)))
    inertia = _numbers(path, values, "inertia_com_kgm2", (3, 3))
    try:
        return InertialParameters.from_com(mass, com, inertia)
    except BadInput as error:
        raise BadFile(f"{path}: {error}") from None


def _load_json(path: Path) -> dict[str, Any]:
    try:
        size = path.stat().st_size
        if size > _LARGEST:
            raise BadFile(f"{path}: a result is a small JSON text; this file has {size} bytes.")
        values = json.loads(path.read_text(encoding="utf-8-sig"))
    except OSError as error:
        raise BadFile(f"{path}: cannot be read ({error.strerror}).") from None
    except UnicodeDecodeError:
        raise BadFile(f"{path}: expected a JSON result; found a binary file.") from None
    except (json.JSONDecodeError, RecursionError) as error:
        raise BadFile(f"{path}: not valid JSON: {error}.") from None
    if not isinstance(values, dict):
        raise BadFile(f"{path}: not a Steelyard result: expected one JSON object. {_WRITE_ONE}")
    return values


def _numbers(path: Path, values: dict[str, Any], key: str, shape: tuple[int, ...]) -> Array:
    if key not in values:
        raise BadFile(f'{path}: not a Steelyard result: "{key}" is missing. {_WRITE_ONE}')
    try:
        array = np.array(values[key], dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        array = np.empty(0)
    if array.shape != shape or not np.isfinite(array).all():
        wanted = " x ".join(map(str, shape)) + " finite numbers" if shape else "one finite number"
        raise BadFile(f'{path}: "{key}" must be {wanted}; found something else.')
    return array
