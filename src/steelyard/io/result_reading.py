"""Results read back from JSON with checks: what `result_files` wrote, or a data sheet typed by hand."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.io.documents import load_json
from steelyard.io.in_file import in_file
from steelyard.io.json_arrays import array_of
from steelyard.io.results.result_details import delays_of, evidence_of, notes_of, parts_of
from steelyard.io.results.team_results import team_of

# Share of the largest entry of an inertia by which what was typed may be off.
ROUNDED = 0.01
_WRITE_ONE = "Write one with: steelyard identify LOG -o FILE."


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
        evidence_of(path, values),
        _identified(path, values),
        np.concatenate([_matrix(path, values, "torque_bias_Nm", (3,)), _matrix(path, values, "force_bias_N", (3,))]),
        _matrix(path, values, "bias_covariance", (6, 6)),
        _matrix(path, values, "cross_covariance", (10, 6)),
        delays_s=delays_of(path, values),
        findings=_findings(path, values),
        parts=parts_of(path, values),
        notes=notes_of(path, values),
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
