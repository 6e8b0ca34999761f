"""Several answers about one body side by side, each against the truth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from steelyard.findings import about
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.tables.estimate import columns
from steelyard.tables.numbers import inertia_unit

_GROUPS = (("mass", slice(0, 1), 1e3, "g"), ("CoM", slice(1, 4), 1e3, "mm"), ("inertia", slice(4, 10), 1e6, "kg mm²"))
_UNITS = {"mass": "mass_kg", "CoM": "com_m", "inertia": "inertia_com_kgm2"}


def versus_table(answers: Mapping[str, Estimate], truth: InertialParameters) -> str:
    """Return one row per answer: length of the error of mass, CoM and inertia about it, with the ± that it states."""
    groups = [*_GROUPS[:2], (*_GROUPS[2][:2], *inertia_unit(float(np.abs(truth.inertia_com).max())))]
    rows = [("error (its own ±)", *(f"{name}, {unit}" for name, _, _, unit in groups), "rigid body")]
    for name, estimate in answers.items():
        found = _errors(estimate, truth)
        cells = (
            f"{about(scale * error)} ({about(scale * std)})"
            for (error, std), (*_, scale, _) in zip(found, groups, strict=True)
        )
        rows.append((name, *cells, "yes" if estimate.parameters.validity().consistent else "no"))
    return columns(rows)


def summary(estimate: Estimate, truth: InertialParameters) -> dict[str, Any]:
    """Return mass, CoM, inertia, consistency, and the lengths of the errors with the ± stated, as plain values."""
    errors = zip(_UNITS.values(), _errors(estimate, truth), strict=True)
    return {
        "mass_kg": estimate.mass,
        "com_m": estimate.com.tolist(),
        "inertia_com_kgm2": estimate.parameters.inertia_com.tolist(),
        "consistent": bool(estimate.parameters.validity().consistent),
        "error": {key: {"length": error, "std": std if np.isfinite(std) else None} for key, (error, std) in errors},
    }


def _errors(estimate: Estimate, truth: InertialParameters) -> list[tuple[float, float]]:
    """Return length of the error, and of the standard deviations, of mass, CoM and inertia."""
    gap = estimate.parameters.people - truth.people
    return [(float(np.linalg.norm(gap[part])), float(np.linalg.norm(estimate.std[part]))) for _, part, _, _ in _GROUPS]
