"""Tools scanned by simulated views on a table, then weighed: volume, answer, and what each stage costs."""

from __future__ import annotations

import time
from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard.bench.jobs import Progress, told
from steelyard.bench.middles import middle_of
from steelyard.evaluate import score
from steelyard.identify.estimate import Estimate
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.part_cuts import PartCuts
from steelyard.logs.log import MotionLog
from steelyard.parts.segment import segment
from steelyard.pipelines.shape_in_parts import Shape
from steelyard.shape.carving import carved
from steelyard.shape.nesting import solids_of
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.volume import enclose
from steelyard.simulate.camera import VIEWS, DepthNoise
from steelyard.simulate.handling import handling_log
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.spatial import Pose
from steelyard.workshop.catalogue import FAMILIES, build
from steelyard.workshop.finish import painted

WITHIN = (0.85, 1.15)
NOISE = "high"  # Table III
_SAMPLES = 20_000  # points that tell how much the views leave unseen
SCORES = ("mass_pct", "com_pct", "inertia_pct", "riemannian")
RULES = (
    "Every built tool lies on a table on its most stable side and is seen in 640 x 480 from a wrist's arc above it, "
    "with depth noise, lost and flying pixels. volume_ratio = volume of the solid / true volume of the parts; "
    "reach_ratio = volume of all space that the same views leave unseen without noise / true volume: hollows and what "
    "of the underside no view reaches. Then it is handled as in the paper's section V-A at the noise of its Table III: "
    "errors of the answer from shape and log, as in bench held-object, beside those of the same log without the shape. "
    "cpu_s = CPU of the thread from decoded images to that answer, warm."
)


def run(
    tools: Sequence[str] = (),
    *,
    seed: int = 0,
    count: int = VIEWS,
    pose_std: tuple[float, float] = (0.0, 0.0),
    progress: Progress | None = None,
) -> dict[str, Any]:
    """Return rows per tool, how many volumes are within bounds, and the median time of each stage."""
    names = tuple(tools) or tuple(FAMILIES)
    rows: list[dict[str, Any]] = []
    for name in told(names, len(names), progress):
        rows.append(_row(name, seed, count, pose_std, warm=not rows))
    ratios = np.array([row["volume_ratio"] for row in rows])
    stages = {stage: float(np.median([row["cpu_s"][stage] for row in rows])) for stage in rows[0]["cpu_s"]}
    answers = {
        key: {name: middle_of([row[key][name] for row in rows]) for name in SCORES}
        for key in ("answer", "without_shape")
    }
    return {
        "objects": rows,
        "mean": answers,
        "within": int(((ratios >= WITHIN[0]) & (ratios <= WITHIN[1])).sum()),
        "of": len(rows),
        "stages": stages,
        "rules": RULES,
    }


def _row(name: str, seed: int, count: int, pose_std: tuple[float, float], warm: bool) -> dict[str, Any]:
    mesh = painted(build(name))
    scanned = scan_mesh(mesh, seed, count=count, noise=DepthNoise(), pose_std=pose_std)
    if warm:
        _shape(scanned)
    true = float(solids_of(mesh).moments[:, 0].sum())
    tool = build(name)
    X_SW = tool.X_OS.inverse() @ scanned.X_WO.inverse()
    log = handling_log(tool.truth_in_sensor, noise=NOISE, seed=seed)
    scan, shape, laps = _shape(scanned)
    if warm:
        _answer(shape, X_SW, log)
    begun = time.thread_time()
    found = _answer(shape, X_SW, log)
    laps["identification"] = time.thread_time() - begun
    laps["total"] = sum(laps.values())
    solid = shape.solid
    bounds = mesh.in_frame(tool.X_OS.inverse()).bounds
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
        "parts": len(shape.segmentation),
        "answer": vars(score(found.parameters, tool.truth_in_sensor, bounds)),
        "without_shape": vars(score(NoiseAware(bias="none").identify(log).parameters, tool.truth_in_sensor, bounds)),
        "cpu_s": laps,
        "findings": sorted({finding.code for finding in (*shape.findings, *found.findings)}),
    }


def _shape(scanned: Scanned) -> tuple[Scan, Shape, dict[str, float]]:
    """Return the fused views, the solid in parts, and the CPU time [s] of every stage."""
    scan = fuse(scanned.views)
    marks = [time.thread_time()]
    solid = carved(enclose(scan.cloud, one=True), scan.space)
    marks.append(time.thread_time())
    shape = Shape(solid, segment(solid.cloud, solid), scan)
    marks.append(time.thread_time())
    volume, parts = np.diff(marks).tolist()
    return scan, shape, {**scan.stages, "volume": volume, "parts": parts}


def _answer(shape: Shape, X_SW: Pose, log: MotionLog) -> Estimate:
    """Return the answer of a log with the cuts of the shape to choose from."""
    cuts = shape.cuts()
    placed = tuple(cut.in_frame(X_SW) for cut in cuts.parts)
    return PartCuts(placed, cuts.prior, bias="none", shape_error=shape.error).identify(log)


def _unseen(scanned: Scanned, bounds: Any) -> float:
    """Return the volume [m^3] over the table that the views leave unseen, by exact depth at the true poses."""
    from steelyard.shape.scans.depth_images import Images
    from steelyard.shape.scans.sight_lines import seen_past

    views = scanned.exact
    points = np.random.default_rng(0).uniform(bounds[0], bounds[1], (_SAMPLES, 3))
    R, p = views.X_WC.rotation.matrix.copy(), views.X_WC.position.copy()
    lens = views.intrinsics.vector
    images = Images(views.depth, views.depth_unit, lens, R, p)
    past = seen_past(images, points, views.depth_unit, 0.0, 1)[:, 0]
    return float((past == 0).mean() * np.prod(bounds[1] - bounds[0]))


def scan_table(result: dict[str, Any]) -> str:
    """Return the result as a table for people."""
    heads = (
        ("volume", 7), ("reach", 7), ("spacing", 8), ("noise", 8), ("spread", 6), ("CPU s", 6), ("parts", 5),
        ("mass / CoM / inertia %, Riem.", 30), ("without the shape", 30),
    )  # fmt: skip
    lines = [f"{'tool':20s} " + " ".join(f"{head:>{width}s}" for head, width in heads) + "  findings"]
    for row in result["objects"]:
        lines.append(
            f"{row['name']:20s} {row['volume_ratio']:7.3f} {row['reach_ratio']:7.3f} "
            f"{row['spacing_mm']:5.2f} mm {row['noise_mm']:5.2f} mm {row['disagreement']:6.2f} "
            f"{row['cpu_s']['total']:6.2f} {row['parts']:5d} {_scores(row['answer']):>30s} "
            f"{_scores(row['without_shape']):>30s}  {', '.join(row['findings'])}"
        )
    stages = ", ".join(f"{name} {value:.3f}" for name, value in result["stages"].items())
    lines += [
        "",
        f"{result['within']} of {result['of']} volumes within {WITHIN[0]} to {WITHIN[1]}.",
        f"Means: {_scores(result['mean']['answer'])}, without the shape {_scores(result['mean']['without_shape'])}.",
        f"CPU s: {stages}.",
    ]
    return "\n".join(lines)


def _scores(row: dict[str, Any]) -> str:
    """Return mass, centre of mass, inertia and distance in one cell."""
    return " / ".join("-" if row[name] is None else f"{row[name]:.2g}" for name in SCORES)
