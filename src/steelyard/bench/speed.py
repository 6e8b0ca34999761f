"""How fast clusters and hulls are made: ours beside the same algorithm with SciPy's Qhull, in one run."""

from __future__ import annotations

import time
from collections.abc import Callable
from functools import partial
from typing import Any

import numba
import numpy as np
from scipy.spatial import ConvexHull, Delaunay

from steelyard.bench.jobs import Progress, told
from steelyard.bench.shapes import hull_sets
from steelyard.bench.shapes.plain_clustering import plain_cluster
from steelyard.bench.timing import REPEATS, thread_ms
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.parts.clustering import cluster
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.supervoxels import pieces_of_points, supervoxels
from steelyard.shape.hull import TOLERANCE, HullWork, hull_volume, hull_work, qhull
from steelyard.shape.inside import inside
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.nesting import body_of
from steelyard.shape.pairs import joined
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.workshop.catalogue import build
from steelyard.workshop.sampling import spread_evenly, surface_cloud
from steelyard.workshop.solids import union

TOOL = "hammer"
POINTS = (8, 20, 50, 200)
SETS = 50  # of points per time
TIMING = (
    "CPU time of the calling thread [ms; hulls: us], warm, median of the repeats; the solid is a built hammer. "
    "cold: from single tets, warm: from 50 supervoxels. Rivals: the same algorithm in plain Python, a SciPy Qhull call "
    "per hull, run once; `eager` makes every hull at once as published, `lazy` when no bound by earlier hulls is less; "
    "`Qhull alone` is the time inside Qhull on the latter. The trees are the same where `same_tree` says so."
)


def run(
    tets: int = 5000, many: int = 150_000, repeats: int = REPEATS, progress: Progress | None = None, *, sets: int = 0
) -> dict[str, Any]:
    """Return stage times, in-run ratios, and how `sets` sets of points compare with Qhull; 0 leaves a step out."""
    if tets < 100 or repeats < 1:
        raise BadValue(f"the solid needs at least 100 tets and a time at least one run; got {tets} and {repeats}.")
    steps: list[Callable[[], dict[str, Any]]] = [partial(_clustering, tets, repeats), partial(_hulls, repeats)]
    if many:
        steps.append(partial(_large, many))
    found: dict[str, Any] = {"stages": {}, "ratios": {}, "timing": TIMING}
    for step in told(steps, len(steps), progress):
        for name, part in step().items():
            found[name].update(part)
    if sets:
        found["hull_sets"] = hull_sets.run(sets, progress)
    return found


def speed_table(result: dict[str, Any]) -> str:
    """Return stage times and ratios, a line each."""
    lines = [f"  {name:34s} {value:12.3f}" for name, value in result["stages"].items()]
    ratios = [f"  {name:34s} {value:12.1f} x" for name, value in result["ratios"].items()]
    return "\n".join([result["timing"], "", "stages", *lines, "", "rival / ours", *ratios, *_sets_lines(result)])


def _sets_lines(result: dict[str, Any]) -> list[str]:
    """Return the largest error of a hull's volume per kind of set, where sets were compared."""
    if "hull_sets" not in result:
        return []
    found = result["hull_sets"]
    lines = [
        f"  {kind:34s} {error:12.1e}   {found['faults'][kind]} given back" for kind, error in found["error"].items()
    ]
    return ["", f"volume of {found['sets']} hulls against Qhull, seed {found['seed']}: largest relative error", *lines]


def tool_solid(tets: int) -> TetMesh:
    """Return a built hammer as about `tets` tetrahedra, between points on its skin and points spread inside."""
    tool = build(TOOL)
    body = union([body_of(tool.mesh, [int(label)]) for label in tool.mesh.labels]).to_mesh()
    triangles = np.asarray(body.tri_verts, dtype=np.int64)
    skin = TriangleMesh(np.asarray(body.vert_properties)[:, :3], triangles, np.zeros(len(triangles), np.int64))
    count = tets / 6
    for _ in range(4):
        mesh = _filled(skin, int(count), np.random.default_rng(0))
        if abs(len(mesh) / tets - 1) < 0.02:
            break
        count *= tets / len(mesh)
    return mesh


def _filled(skin: TriangleMesh, count: int, rng: np.random.Generator) -> TetMesh:
    """Return the Delaunay cells inside a skin of `count` points, half of them on it."""
    xyz, normal, _ = spread_evenly(skin, rng, count // 2)
    core = inside(skin, count - count // 2)[0]
    pitch = (skin_volume(skin) / count) ** (1 / 3)
    core = core + rng.uniform(-0.2, 0.2, core.shape) * pitch
    core = core[_depth(core, xyz, normal) < -0.3 * pitch]
    points = np.concatenate([xyz, core])
    cells = TetMesh(points, Delaunay(points).simplices)
    return _largest_body(cells.chosen((_depth(cells.centroids, xyz, normal) < 0) & (cells.volumes > 0)))


def _largest_body(mesh: TetMesh) -> TetMesh:
    body = joined(mesh.dual, len(mesh))
    return mesh.chosen(body == np.bincount(body).argmax())


def skin_volume(skin: TriangleMesh) -> float:
    """Return the volume inside a closed surface [m^3]."""
    return float(np.linalg.det(skin.corners).sum() / 6)


def _depth(points: Array, xyz: Array, normal: Array) -> Array:
    """Return how far points lie above the surface samples nearest to them, below zero inside."""
    row = nearest(xyz, points)
    return np.asarray(((points - xyz[row]) * normal[row]).sum(1))


def _clustering(tets: int, repeats: int) -> dict[str, Any]:
    mesh = tool_solid(tets)
    cloud = surface_cloud(build(TOOL))
    labels = supervoxels(cloud)
    piece = pieces_of_points(mesh, cloud, labels)
    cold = thread_ms(lambda: cluster(_anew(mesh)), repeats)
    warm = thread_ms(lambda: cluster(_anew(mesh), piece), repeats)
    eager, eager_ms, _, tree = _rival(mesh, None, False)
    lazy, lazy_ms, alone_ms, _ = _rival(mesh, None, True)
    _, warm_ms, _, warm_tree = _rival(mesh, piece, False)
    same = _same(tree, cluster(mesh)) and _same(warm_tree, cluster(mesh, piece))
    return {
        "stages": {
            "tets": len(mesh),
            "same_tree": same,
            "supervoxels_ms": thread_ms(lambda: supervoxels(cloud), repeats),
            "supervoxels_to_tets_ms": thread_ms(lambda: pieces_of_points(mesh, cloud, labels), repeats),
            "dual_graph_ms": thread_ms(lambda: _anew(mesh).dual, repeats),
            "htc_cold_ms": cold,
            "htc_warm_ms": warm,
            "hulls_eager": eager,
            "hulls_lazy": lazy,
            "rival_cold_eager_ms": eager_ms,
            "rival_cold_lazy_ms": lazy_ms,
            "rival_cold_qhull_alone_ms": alone_ms,
            "rival_warm_eager_ms": warm_ms,
        },
        "ratios": {
            "htc_cold, eager": eager_ms / cold,
            "htc_cold, lazy": lazy_ms / cold,
            "htc_cold, Qhull alone": alone_ms / cold,
            "htc_warm, eager": warm_ms / warm,
        },
    }


def _anew(mesh: TetMesh) -> TetMesh:
    """Return the solid with nothing found yet, so that the dual graph is timed too."""
    return TetMesh(mesh.vertices, mesh.tets)


def _rival(mesh: TetMesh, piece: Integers | None, lazy: bool) -> tuple[int, float, float, Hierarchy]:
    start = time.thread_time()
    tree, took = plain_cluster(_anew(mesh), piece, lazy=lazy)
    return took.hulls, 1000 * (time.thread_time() - start), 1000 * took.hull_s, tree


def _same(one: Hierarchy, other: Hierarchy) -> bool:
    return bool(np.array_equal(one.merges, other.merges))


def _large(tets: int) -> dict[str, Any]:
    mesh = tool_solid(tets)
    start = time.thread_time()
    cluster(mesh)
    return {"stages": {"tets_large": len(mesh), "htc_cold_large_ms": 1000 * (time.thread_time() - start)}, "ratios": {}}


def _hulls(repeats: int) -> dict[str, Any]:
    stages: dict[str, float] = {}
    ratios: dict[str, float] = {}
    rng = np.random.default_rng(0)
    for count in POINTS:
        sets = rng.normal(size=(SETS, count, 3))
        sets *= rng.random((SETS, count, 1)) ** (1 / 3) / np.linalg.norm(sets, axis=2, keepdims=True)
        ours = 1000 / SETS * thread_ms(partial(_all_hulls, sets, 2 * TOLERANCE, hull_work(count)), repeats)
        theirs = 1000 / SETS * thread_ms(partial(_all_qhulls, sets), repeats)
        stages[f"hull_{count}_points_us"], stages[f"qhull_{count}_points_us"] = ours, theirs
        ratios[f"hull of {count} points"] = theirs / ours
        worst = max(abs(hull_volume(p, np.arange(count), count, 2 * TOLERANCE, hull_work(count))[0] / qhull(p)[0] - 1)
                    for p in sets)  # fmt: skip
        stages[f"hull_{count}_points_error"] = worst
    return {"stages": stages, "ratios": ratios}


@numba.njit(cache=True, nogil=True)
def _all_hulls(sets: Array, tolerance: float, work: HullWork) -> float:
    total, rows = 0.0, np.arange(sets.shape[1])
    for k in range(len(sets)):
        total += hull_volume(sets[k], rows, len(rows), tolerance, work)[0]
    return total


def _all_qhulls(sets: Array) -> float:
    return float(sum(ConvexHull(points).volume for points in sets))
