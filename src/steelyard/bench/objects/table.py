"""The held-object bench as text for people, the paper's Table IV beside it."""

from __future__ import annotations

from typing import Any

from steelyard.bench.objects.conditions import condition_lines
from steelyard.bench.objects.summary import HALVES
from steelyard.bench.tables import block

_COLUMNS = (
    ("mass %", "mass_pct", 3),
    ("CoM %", "com_pct", 3),
    ("CoM % floored", "com_pct_floored", 2),
    ("CoM mm", "com_mm", 3),
    ("inertia %", "inertia_pct", 2),
    ("Riemannian", "riemannian", 3),
    ("consistent %", "consistent_pct", 0),
    ("zero parts", "zeroed", 0),
    ("solve ms", "solve_ms", 2),
)

WITH_TABLE_IV = ("truth", "segmented")


def held_object_table(result: dict[str, Any]) -> str:
    """Return means of `bench held-object`, a block per scenario and half, then the medians over all objects."""
    lines = [_head(result)]
    for noise, halves in result["mean"].items():
        for half in HALVES:
            if any(row["runs"] for row in halves[half].values()):
                lines += ["", *block(f"{noise}, {half}: mean", _rows(result, noise, half), _COLUMNS)]
        lines += ["", *block(f"{noise}, all: median", result["median"][noise]["all"], _COLUMNS)]
    for method, scores in result.get("rank_correlation", {}).items():
        said = ", ".join(f"{name} {'-' if value is None else format(value, '.2f')}" for name, value in scores.items())
        lines += ["", f"rank correlation with the Riemannian error at low noise, {method}: {said}"]
    if "mixed_merge" in result:
        lines += ["", "the two heaviest parts of different density joined:", held_object_table(result["mixed_merge"])]
        lines += [_found(result["mixed_merge"])]
    return "\n".join(lines)


def _head(result: dict[str, Any]) -> str:
    seeds = f", {len(result['seeds'])} seeds" if "seeds" in result else ""
    lines = [
        f"parts: {result['parts']}; {len(result['objects'])} objects{seeds}",
        "CoM % floored: to whole percents per axis, as the paper counts. zero parts: wrongly at zero mass, all runs.",
    ]
    if result["parts"] in WITH_TABLE_IV:
        lines.append("Table IV: as printed in the paper, over its own twenty objects.")
    return "\n".join([*lines, *condition_lines(result["condition"])])


def _rows(result: dict[str, Any], noise: str, half: str) -> dict[str, dict[str, Any]]:
    """Return the methods, the bounds, and for true parts and all objects the rows of Table IV."""
    blank = dict.fromkeys(key for _, key, _ in _COLUMNS)
    rows = dict(result["mean"][noise][half])
    limits = result["bound"].get(noise, {}).get(half)
    if limits:
        rows["bound, parts known"] = blank | {k: v for k, v in limits.items() if k != "groups"}
        rows["bound, equal densities known"] = blank | limits["groups"]
    if half == "all" and result["parts"] in WITH_TABLE_IV:
        for name, row in result.get("table_iv", {}).get(noise, {}).items():
            rows[f"Table IV {name}"] = blank | row
    return rows


def _found(result: dict[str, Any]) -> str:
    """Return how many of our runs at a declared noise say that a part is not homogeneous."""
    rows = [row for row in result["rows"] if row["method"] == "ours" and row["noise"] != "none" and "findings" in row]
    said = sum("part-not-homogeneous" in row["findings"] for row in rows)
    return f"part-not-homogeneous found in {said} of {len(rows)} runs of ours"
