"""Thin sheets enclosed from bare points: is the volume right, and is every wrong one said to be?"""

from __future__ import annotations

from typing import Any

from steelyard.bench.jobs import Progress, told
from steelyard.bench.tables import block
from steelyard.shape.volume import enclose
from steelyard.workshop.sheets import KINDS, sheets

WITHIN = (0.85, 1.15)
WARNING = "thin-thickened"
RULES = (
    "U channels of 3 to 20 mm gap and 1.2 to 2 mm wall, plates of 1 to 2 mm, tubes with open ends of 8 to 40 mm, each "
    "80 to 200 mm long; 2 000 points spread evenly over the surface, without colours or normals. volume_ratio = volume "
    f"of the solid / true volume; a hit is within {WITHIN[0]} to {WITHIN[1]}; warned: the finding {WARNING} is there."
)
_COLUMNS = (("count", "count", 0), ("hits", "hits", 0), ("misses warned", "misses_warned", 0), ("of", "misses", 0),
            ("hits warned", "hits_warned", 0))  # fmt: skip


def run(count: int = 60, seed: int = 0, progress: Progress | None = None) -> dict[str, Any]:
    """Return a row per sheet, and per kind and for all: hits, misses, and how many of each carry the warning."""
    rows: list[dict[str, Any]] = []
    for sheet in told(sheets(count, seed), count, progress):
        solid = enclose(sheet.cloud)
        ratio = solid.mesh.volume / sheet.volume
        rows.append({
            "name": sheet.name,
            "volume_ratio": ratio,
            "hit": WITHIN[0] <= ratio <= WITHIN[1],
            "warned": any(finding.code == WARNING for finding in solid.findings),
        })  # fmt: skip
    kinds = {kind: [row for row in rows if row["name"].startswith(kind)] for kind in KINDS}
    counts = {kind: _counts(chosen) for kind, chosen in {**kinds, "all": rows}.items()}
    return {"sheets": rows, "counts": counts, "seed": seed, "rules": RULES}


def _counts(rows: list[dict[str, Any]]) -> dict[str, int]:
    hits = [row for row in rows if row["hit"]]
    return {
        "count": len(rows),
        "hits": len(hits),
        "misses": len(rows) - len(hits),
        "misses_warned": sum(row["warned"] and not row["hit"] for row in rows),
        "hits_warned": sum(row["warned"] for row in hits),
    }


def sheets_table(result: dict[str, Any]) -> str:
    """Return the counts as a table for people, and the misses by name."""
    lines = block(f"volume of thin sheets, seed {result['seed']}", result["counts"], _COLUMNS)
    lines += ["", f"outside {WITHIN[0]} to {WITHIN[1]}:"]
    missed = [row for row in result["sheets"] if not row["hit"]]
    lines += [
        f"  {row['volume_ratio']:6.2f}  {row['name']}{'' if row['warned'] else '  (no warning)'}" for row in missed
    ] or ["  none"]
    return "\n".join(lines)
