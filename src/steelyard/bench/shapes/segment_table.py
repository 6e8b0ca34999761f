"""`bench segment` as text for people."""

from __future__ import annotations

from typing import Any

from steelyard.bench.tables import block

_OURS = (
    ("impurity", "impurity", 3),
    ("GCE", "gce", 3),
    ("ARI", "ari", 2),
    ("parts", "n_parts", 0),
    ("true", "n_true", 0),
    ("volume", "volume_ratio", 3),
    ("true sides", "volume_ratio_true_sides", 3),
    ("true normals", "volume_ratio_true_normals", 3),
    ("IoU", "volume_iou", 3),
    ("Hausdorff mm", "hausdorff_mm", 1),
    ("CPU ms", "cpu_ms", 0),
    ("Table II USE", "use", 3),
    ("its GCE", "paper_gce", 3),
    ("its mm", "paper_mm", 1),
)
_HTC = (
    ("impurity", "impurity", 3),
    ("GCE", "gce", 3),
    ("ARI", "ari", 2),
    ("parts", "n_parts", 1),
    ("CPU s", "cpu_s", 2),
)


def segment_table(result: dict[str, Any]) -> str:
    """Return one line per object, the means, and the rows of Table I."""
    rows = {name: _row(row, result["table_ii"].get(name)) for name, row in result["objects"].items()}
    mean = result["mean"]["objects"]
    rows["mean"] = {key: mean.get(key) for _, key, _ in _OURS} | {"cpu_ms": 1000 * mean["cpu_total_s"]}
    lines = block("object", rows, _OURS)
    stages = ", ".join(f"{key[4:-2]} {1000 * mean[key]:.0f}" for key in mean if key.startswith("cpu_"))
    lines += ["", f"CPU ms, mean: {stages}"]
    lines += [f"{key.replace('_', ' ')}: {value}" for key, value in result["counts"].items()]
    htc = {name: result["mean"][name] for name in ("htc_cold", "htc_warm")}
    lines += ["", *block("the paper's clustering on our solid", htc, _HTC)]
    printed = ", ".join(
        f"{name} USE {row['impurity']:g}, GCE {row['gce']:g}, {row['time_s']:g} s"
        for name, row in result["table_i"].items()
    )
    return "\n".join([*lines, f"  Table I, twenty objects: {printed}", "", result["rules"]])


def _row(row: dict[str, Any], paper: dict[str, Any] | None) -> dict[str, Any]:
    printed = paper or {}
    return row | {
        "cpu_ms": 1000 * row["cpu_s"]["total"],
        "use": printed.get("impurity"),
        "paper_gce": printed.get("gce_own_formula"),
        "paper_mm": printed.get("hausdorff_mm"),
    }
