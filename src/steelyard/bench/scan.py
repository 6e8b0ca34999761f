"""Tools scanned by simulated views on a table: is the volume right, and what does each stage cost?"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from steelyard.shape.carving import carved
from steelyard.shape.nesting import solids_of
from steelyard.shape.scan import fuse
from steelyard.shape.volume import enclose
from steelyard.simulate.camera import VIEWS, DepthNoise
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.workshop.catalogue import FAMILIES, build
from steelyard.workshop.finish import painted

WITHIN = (0.85, 1.15)
RULES = (
    "Every built tool lies on a table on its most stable side and is seen in 640 x 480 from a wrist's arc above it, "
    "with depth noise, lost and flying pixels. volume_ratio = volume of the solid / true volume of the parts; "
    "reach_ratio = volume of all space that the same views leave unseen without noise / true volume: hollows and what "
    "of the underside no view reaches. cpu_s = CPU of the thread from decoded images to solid, warm."
)


def run(
    tools: Sequence[str] = (),
    *,
    seed: int = 0,
    count: int = VIEWS,
    pose_std: tuple[float, float] = (0.0, 0.0),
    progress: Callable[[int, int], None] | None = None,
) -> dict[str, Any]:
    """Return rows per tool, how many volumes are within bounds, and the median time of each stage."""
    names = tuple(tools) or tuple(FAMILIES)
    rows = []
    for done, name in enumerate(names, start=1):
        rows.append(_row(name, seed, count, pose_std, warm=done == 1))
        if progress:
            progress(done, len(names))
    ratios = np.array([row["volume_ratio"] for row in rows])
    stages = {stage: float(np.median([row["cpu_s"][stage] for row in rows])) for stage in rows[0]["cpu_s"]}
    return {
        "objects": rows,
        "within": int(((ratios >= WITHIN[0]) & (ratios <= WITHIN[1])).sum()),
        "of": len(rows),
        "stages": stages,
        "rules": RULES,
    }


def _row(name: str, seed: int, count: int, pose_std: tuple[float, float], warm: bool) -> dict[str, Any]:
    mesh = painted(build(name))
    scanned = scan_mesh(mesh, seed, count=count, noise=DepthNoise(), pose_std=pose_std)
    if warm:
        fuse(scanned.views)
    true = float(solids_of(mesh).moments[:, 0].sum())
    scan = fuse(scanned.views)
    laps = dict(scan.stages)
    begun = time.thread_time()
    solid = carved(enclose(scan.cloud), scan.empty)
    laps["volume"] = time.thread_time() - begun
    laps["total"] = sum(laps.values())
    return {
        "name": name,
        "volume_ratio": solid.mesh.volume / true,
        "reach_ratio": _unseen(scanned, mesh.in_frame(scanned.X_WO).bounds) / true,
        "points": len(scan.cloud),
        "spacing_mm": 1e3 * scan.spacing,
        "table_off_mm": 1e3 * abs(scan.table.offset),
        "noise_mm": 1e3 * scan.noise_std,
        "disagreement": scan.disagree,
        "moved_mm": None if scan.moved_m is None else 1e3 * scan.moved_m,
        "cpu_s": laps,
        "findings": [finding.code for finding in (*scan.findings, *solid.findings)],
    }


def _unseen(scanned: Scanned, bounds: Any, samples: int = 20_000) -> float:
    """Return the volume [m^3] over the table that the views leave unseen, by exact depth at the true poses."""
    from steelyard.shape.depth_images import seen_past

    views = scanned.exact
    points = np.random.default_rng(0).uniform(bounds[0], bounds[1], (samples, 3))
    R, p = views.X_WC.rotation.matrix.copy(), views.X_WC.position.copy()
    lens = views.intrinsics.vector
    past = seen_past(views.depth, views.depth_unit, lens, R, p, points, views.depth_unit, 0.0, 1)
    return float((past == 0).mean() * np.prod(bounds[1] - bounds[0]))


def scan_table(result: dict[str, Any]) -> str:
    """Return the result as a table for people."""
    heads = ("volume", 7), ("reach", 7), ("points", 6), ("spacing", 8), ("noise", 8), ("spread", 6), ("CPU s", 6)
    lines = [f"{'tool':20s} " + " ".join(f"{head:>{width}s}" for head, width in heads) + "  findings"]
    for row in result["objects"]:
        lines.append(
            f"{row['name']:20s} {row['volume_ratio']:7.3f} {row['reach_ratio']:7.3f} {row['points']:6d} "
            f"{row['spacing_mm']:5.2f} mm {row['noise_mm']:5.2f} mm {row['disagreement']:6.2f} "
            f"{row['cpu_s']['total']:6.2f}  {', '.join(row['findings'])}"
        )
    stages = ", ".join(f"{name} {value:.3f}" for name, value in result["stages"].items())
    lines += [
        "",
        f"{result['within']} of {result['of']} volumes within {WITHIN[0]} to {WITHIN[1]}.",
        f"CPU s: {stages}.",
    ]
    return "\n".join(lines)
