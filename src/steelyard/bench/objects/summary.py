"""Means, medians and bounds of the held-object bench, and the paper's Table IV."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from steelyard.bench.middles import middle_of

HALVES = ("all", "mixed", "uniform")
SCORES = ("mass_pct", "com_pct", "com_mm", "inertia_pct", "riemannian", "com_pct_floored")
Row = dict[str, Any]
Bounds = dict[str, dict[str, dict[str, float]]]
# Means over 20 objects as printed: consistent %, mass %, CoM % (floored), inertia %, Riemannian. 500 is a cap.
TABLE_IV: dict[str, dict[str, tuple[float, float, float, float, float | None]]] = {
    "none": {
        "ols": (100, 0.1, 0.1, 0.09, 0.03),
        "geo-published-prior": (100, 0.1, 1.35, 53.22, 1.14),
        "hps": (100, 0.27, 0.1, 10.28, 0.72),
    },
    "low": {
        "ols": (14, 0.19, 2.13, 500, None),
        "geo-published-prior": (100, 0.18, 1.34, 52.79, 1.14),
        "hps": (100, 0.40, 0.32, 11.12, 0.74),
    },
    "moderate": {
        "ols": (4.5, 0.36, 5.33, 500, None),
        "geo-published-prior": (100, 0.35, 1.37, 51.73, 1.14),
        "hps": (100, 0.74, 0.48, 11.81, 0.77),
    },
    "high": {
        "ols": (2, 0.69, 10.11, 500, None),
        "geo-published-prior": (100, 0.64, 1.58, 48.49, 1.13),
        "hps": (100, 2.79, 1.07, 15.00, 0.87),
    },
}
_TABLE_IV_COLUMNS = ("consistent_pct", "mass_pct", "com_pct_floored", "inertia_pct", "riemannian")


def _in_half(half: str, wanted: str) -> bool:
    return wanted in ("all", half)


def summary(
    rows: Sequence[Row], noises: Sequence[str], methods: Sequence[str], middle: Callable[[Any], Any]
) -> dict[str, dict[str, dict[str, Row]]]:
    """Return <noise>.<half>.<method> with the `middle` (mean, median) of every score, and counts."""
    out: dict[str, dict[str, dict[str, Row]]] = {}
    for noise in noises:
        for half in HALVES:
            here = [row for row in rows if row["noise"] == noise and _in_half(row["half"], half)]
            out.setdefault(noise, {})[half] = {
                name: _of_group([row for row in here if row["method"] == name], middle) for name in methods
            }
    return out


def _of_group(rows: list[Row], middle: Callable[[Any], Any]) -> Row:
    """Return the mean or median of every score that there is, and counts."""
    out: Row = {key: middle_of([row[key] for row in rows], middle) for key in (*SCORES, "solve_ms")}
    out["consistent_pct"] = 100 * sum(row["consistent"] for row in rows) / len(rows) if rows else None
    out["zeroed"] = sum(row.get("zeroed") or 0 for row in rows)
    return out | {"failures": sum("failure" in row for row in rows), "runs": len(rows)}


def bound_means(objects: Sequence[tuple[str, Bounds]]) -> dict[str, dict[str, Any]]:
    """Return <noise>.<half> with the mean bound for free masses, and under `groups` with equal densities known.

    `objects` holds the half and the bounds <noise>.<free|groups> of every object.
    """
    out: dict[str, dict[str, Any]] = {}
    for noise in objects[0][1] if objects else ():
        for half in HALVES:
            here = [bounds[noise] for found, bounds in objects if _in_half(found, half)]
            if here:
                free, groups = (_mean([bounds[name] for bounds in here]) for name in ("free", "groups"))
                out.setdefault(noise, {})[half] = free | {"groups": groups}
    return out


def _mean(scores: Sequence[dict[str, float]]) -> dict[str, Any]:
    return {key: float(np.mean([s[key] for s in scores])) for key in scores[0]}


def table_iv() -> dict[str, dict[str, dict[str, float | None]]]:
    """Return <noise>.<method> of the paper's Table IV."""
    return {
        noise: {name: dict(zip(_TABLE_IV_COLUMNS, row, strict=True)) for name, row in methods.items()}
        for noise, methods in TABLE_IV.items()
    }
