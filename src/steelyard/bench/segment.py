"""Segmentation of unlabelled clouds against the truth, beside the paper's Tables I and II and its own method here."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.bench.jobs import Progress, chosen_folders, told
from steelyard.bench.shapes.paper_parts import paper_parts, scores_of
from steelyard.check import Array, Integers
from steelyard.datasets.known_object import KnownObject
from steelyard.evaluate.segments import hausdorff_mm, score_segments
from steelyard.evaluate.solids import score, true_solid, winding_of
from steelyard.io.object_folders import read_object
from steelyard.parts.segment import coloured_pieces, parts_of_pieces
from steelyard.parts.segmentation import Segmentation
from steelyard.shape.cloud import Cloud
from steelyard.shape.orient import oriented
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.shape.volume import enclose
from steelyard.spatial import Pose, Rotation, area_vectors

REPEATS = 3
SURFACE_POINTS = 20_000
OUTSIDE_POINTS = 300_000  # dense enough to give points of a cloud the normal where they lie
TURNED_SEED = 11
# Table II of "The Sum of Its Parts": USE, GCE (its own formula), Hausdorff [mm], true parts.
TABLE_II: dict[str, tuple[float, float, float, int]] = {
    "adjustable-wrench": (0.117, 0.098, 14.2, 4),
    "allen-key": (0.0, 0.0, 8.2, 1),
    "bent-jaw-pliers": (0.176, 0.01, 16.5, 3),
    "box-wrench": (0.0, 0.0, 10.9, 1),
    "c-clamp": (0.103, 0.077, 9.6, 5),
    "clamp": (0.259, 0.181, 17.6, 7),
    "electronic-caliper": (0.42, 0.316, 9.1, 14),
    "file": (0.057, 0.102, 17.9, 3),
    "hacksaw": (0.129, 0.128, 11.1, 7),
    "hammer": (0.08, 0.098, 14.7, 3),
    "machinist-hammer": (0.018, 0.012, 13.6, 2),
    "measuring-tape": (0.0, 0.0, 11.4, 1),
    "nut-screwdriver": (0.002, 0.002, 16.0, 2),
    "pliers": (0.123, 0.041, 10.7, 3),
    "rubber-mallet": (0.011, 0.009, 15.8, 2),
    "ruler": (0.0, 0.0, 14.8, 1),
    "screwdriver": (0.013, 0.001, 12.1, 2),
    "socket-wrench": (0.141, 0.123, 7.4, 5),
    "vise-clamp": (0.296, 0.373, 15.1, 9),
    "vise-grip": (0.158, 0.287, 17.2, 8),
}
# Table I: means over its twenty objects, USE, GCE, seconds.
TABLE_I = {"htc_cold": (0.10, 0.05, 9.73), "htc_warm": (0.10, 0.07, 3.48)}
RULES = (
    "Labels unseen. A point has the part of the nearest tet of its colour, by centroids. impurity is the paper's USE, "
    "gce the textbook one (Martin 2001); n_true counts parts with points. volume_ratio over the true solids; "
    "volume_ratio_true_sides were it known which side of each of our normals is out, volume_ratio_true_normals were "
    "the true normals given; volume_iou on 150 000 points in the padded box; Hausdorff on points of what is seen of "
    "both surfaces, the true diagonal scaled to 1000 mm. htc_cold and htc_warm: the paper's clustering (eq. 8, cut at "
    "depth 2 of the tree), from single tets and from its supervoxels (eq. 9), on our solid. turned: the same cloud "
    "turned and its points in another order. CPU: thread time, warm, median of "
    f"{REPEATS}; supervoxels = colours and pieces, "
    "clustering = the tree, its cut, and cells cut at borders."
)


def run(
    data: Path | str,
    progress: Progress | None = None,
    *,
    objects: Sequence[str] = (),
    noise_mm: float = 0.0,
    colour_noise: float = 0.0,
) -> dict[str, Any]:
    """Return the scores of every object folder in `data`. Empty `objects` means all.

    noise_mm      standard deviation added to every coordinate [mm]
    colour_noise  the same of every colour channel, 0..255
    """
    folders = chosen_folders(data, objects)
    result: dict[str, Any] = {name: {} for name in ("objects", "htc_cold", "htc_warm")}
    for folder in told(folders, len(folders), progress):
        known = read_object(folder)
        cloud = _noisy(known.cloud, noise_mm, colour_noise)
        row, solid = _ours(known, cloud, warm=not result["objects"])
        result["objects"][folder.name] = row
        for name in ("htc_cold", "htc_warm"):
            result[name][folder.name] = _published(known, solid, warm=name == "htc_warm")
    return {
        **result,
        "mean": {name: _mean(result[name]) for name in ("objects", "htc_cold", "htc_warm")},
        "counts": _counts(result["objects"]),
        "table_i": {name: dict(zip(("impurity", "gce", "time_s"), row, strict=True)) for name, row in TABLE_I.items()},
        "table_ii": {
            name: dict(zip(("impurity", "gce_own_formula", "hausdorff_mm", "n_true"), TABLE_II[name], strict=True))
            for name in result["objects"]
            if name in TABLE_II
        },
        "noise_mm": noise_mm,
        "colour_noise": colour_noise,
        "rules": RULES,
    }


def _noisy(cloud: Cloud, noise_mm: float, colour_noise: float) -> Cloud:
    """Return the cloud as the method gets it: noisy, without labels."""
    rng = np.random.default_rng(0)
    xyz = cloud.xyz + rng.normal(size=cloud.xyz.shape) * noise_mm * 1e-3 if noise_mm else cloud.xyz
    rgb = cloud.rgb
    if rgb is not None and colour_noise:
        rgb = np.clip(np.round(rgb + rng.normal(size=rgb.shape) * colour_noise), 0, 255).astype(np.uint8)
    return Cloud(xyz, rgb)


def _ours(known: KnownObject, cloud: Cloud, warm: bool) -> tuple[dict[str, Any], TetMesh]:
    """Return the row of one object by the default route, and its solid before cells are cut at borders."""
    if warm:
        _timed(cloud)
    runs = [_timed(cloud) for _ in range(REPEATS)]
    found, uncut, _ = runs[0]
    cpu = {stage: float(np.median([times[stage] for *_, times in runs])) for stage in runs[0][2]}
    true = known.cloud.labels
    turned = _turned(known.cloud.labels, cloud)
    truth = true_solid(known)
    scores, solid = score_segments(true, found.point_part), score(found.mesh, truth)
    surface = _spread(found.mesh.vertices[found.mesh.surface], SURFACE_POINTS)[0]
    gap = hausdorff_mm(surface, _outside(known.mesh.corners, SURFACE_POINTS)[0])
    row = {
        "impurity": scores.impurity,
        "gce": scores.gce,
        "ari": scores.ari,
        "undersegmentation": scores.undersegmentation,
        "hausdorff_mm": gap,
        "n_parts": len(found),
        "n_true": scores.n_true,
        "volume_ratio": solid.volume_ratio,
        "volume_iou": solid.iou,
        **_told(known, cloud, truth.volume),
        "cpu_s": cpu,
        "sure": float(found.sureness[len(found) - 1]),
        "repeats": all(_same(found, other) for other, *_ in runs[1:]),
        "turned": turned,
        "findings": sorted({finding.code for finding in found.findings}),
    }
    return row, uncut


def _same(found: Segmentation, other: Segmentation) -> bool:
    """Return whether two segmentations are the same to the last bit."""
    vertices = np.array_equal(found.mesh.vertices, other.mesh.vertices)
    return vertices and np.array_equal(found.labels, other.labels)


def _timed(cloud: Cloud) -> tuple[Segmentation, TetMesh, dict[str, float]]:
    """Return the segmentation of a cloud, the solid it was made from, and the CPU time [s] of its stages."""
    given = Cloud(cloud.xyz, cloud.rgb)  # nothing found yet, so that neighbours are timed in both
    marks = [time.thread_time()]
    oriented(given)
    marks.append(time.thread_time())
    solid = enclose(cloud := Cloud(cloud.xyz, cloud.rgb))
    marks.append(time.thread_time())
    pieces = coloured_pieces(cloud, solid)
    marks.append(time.thread_time())
    found = parts_of_pieces(pieces)
    marks.append(time.thread_time())
    found = replace(found, findings=(*solid.findings, *found.findings))
    orient, enclosed, supervoxel, clustering = np.diff(marks).tolist()
    volume = enclosed - orient  # enclose orients, too
    return (
        found,
        pieces.mesh,
        {
            "orient": orient,
            "volume": volume,
            "supervoxels": supervoxel,
            "clustering": clustering,
            "total": orient + volume + supervoxel + clustering,
        },
    )


def _turned(true: Integers, cloud: Cloud) -> dict[str, float]:
    """Return impurity and volume of the same cloud, turned and in another order."""
    rng = np.random.default_rng(TURNED_SEED)
    order = rng.permutation(len(cloud))
    pose = Pose(Rotation.exp(rng.normal(size=3)), rng.normal(size=3) * 0.1)
    moved = Cloud(pose.apply(cloud.xyz), cloud.rgb).chosen(order)
    found, *_ = _timed(moved)
    scores = score_segments(true[order], found.point_part)
    return {"impurity": scores.impurity, "n_parts": len(found), "volume_m3": found.mesh.volume}


def _published(known: KnownObject, mesh: TetMesh, warm: bool) -> dict[str, Any]:
    """Return the row of the paper's clustering on our solid: four parts, from supervoxels or from single tets."""
    for _ in range(2):  # the first time compiles
        start = time.thread_time()
        labels = paper_parts(mesh, Cloud(known.cloud.xyz, known.cloud.rgb) if warm else None)
        spent = time.thread_time() - start
    scores = scores_of(known, mesh, labels)
    return {
        "impurity": scores.impurity,
        "gce": scores.gce,
        "ari": scores.ari,
        "n_parts": int(labels.max()) + 1,
        "n_true": scores.n_true,
        "cpu_s": spent,
    }


def _told(known: KnownObject, cloud: Cloud, volume: float) -> dict[str, float]:
    """Return what the ratio to the true volume would be, were the normals given, or which side of ours is out."""
    used = enclose(Cloud(cloud.xyz)).cloud
    shown, facing = _outside(known.mesh.corners, OUTSIDE_POINTS)
    row = nearest(cloud.xyz, used.xyz)  # without those that were left out
    normals, own = facing[nearest(shown, known.cloud.xyz[row])], np.asarray(used.normals)
    sides = np.where((own * normals).sum(1) < 0, -1.0, 1.0)[:, None]
    told = {"volume_ratio_true_sides": sides * own, "volume_ratio_true_normals": normals}
    return {name: enclose(Cloud(used.xyz, normals=given)).mesh.volume / volume for name, given in told.items()}


def _outside(corners: Array, count: int) -> tuple[Array, Array]:
    """Return points (M, 3) of `count` spread over closed surfaces (F, 3, 3) that are seen, and normals (M, 3) there.

    Voids are not seen, nor where parts touch.
    """
    points, normals = _spread(corners, count)
    lifted = points + 1e-5 * float(np.linalg.norm(np.ptp(corners.reshape(-1, 3), axis=0))) * normals
    seen = winding_of(corners, lifted) <= 0
    return points[seen], normals[seen]


def _spread(corners: Array, count: int) -> tuple[Array, Array]:
    """Return points (M, 3) spread evenly over triangles (F, 3, 3), and the normals (M, 3) there."""
    rng = np.random.default_rng(0)
    a, b, c = np.moveaxis(corners, 1, 0)
    normal = area_vectors(corners)
    area = np.linalg.norm(normal, axis=1)
    chosen = rng.choice(len(corners), count, p=area / area.sum())
    u, v = rng.uniform(size=(2, count, 1))
    root = np.sqrt(u)
    points = (1 - root) * a[chosen] + root * (1 - v) * b[chosen] + root * v * c[chosen]
    return np.asarray(points), np.asarray(normal[chosen] / area[chosen, None])


def _mean(rows: dict[str, dict[str, Any]]) -> dict[str, float]:
    """Return the means over objects of the plain numbers, and of the total CPU time."""
    keys = [key for key, value in next(iter(rows.values())).items() if isinstance(value, int | float)]
    mean = {key: float(np.mean([row[key] for row in rows.values()])) for key in keys if key != "repeats"}
    stages = next(iter(rows.values()))["cpu_s"]
    if isinstance(stages, dict):
        for stage in stages:
            mean[f"cpu_{stage}_s"] = float(np.mean([row["cpu_s"][stage] for row in rows.values()]))
    return mean


def _counts(rows: dict[str, dict[str, Any]]) -> dict[str, Any]:
    """Return how many objects keep within twice the true number of parts, and the like."""
    single = [row for row in rows.values() if row["n_true"] == 1]
    return {
        "objects": len(rows),
        "within_twice_true_parts": sum(row["n_parts"] <= 2 * row["n_true"] for row in rows.values()),
        "single_part_tools": len(single),
        "single_part_tools_in_one_part": sum(row["n_parts"] == 1 for row in single),
        **{
            f"volume{told}_within_10_pct": sum(0.9 <= row[f"volume_ratio{told}"] <= 1.1 for row in rows.values())
            for told in ("", "_true_sides", "_true_normals")
        },
        "bit_identical": sum(row["repeats"] for row in rows.values()),
        "impurity_turned_within_0.01": sum(
            abs(row["turned"]["impurity"] - row["impurity"]) <= 0.01 for row in rows.values()
        ),
    }
