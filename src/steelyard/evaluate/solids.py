"""How well a reconstructed solid fills the true one: volume ratio, and inside/outside agreement."""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.datasets.known_object import KnownObject
from steelyard.shape.mesh import TriangleMesh, part_moments
from steelyard.shape.tets import TetMesh

SAMPLES = 150_000
_PAD = 0.02  # of the diagonal of the box, on every side


@dataclass(frozen=True, eq=False)
class TrueSolid:
    """What an object truly fills.

    volume   of its solids, voids taken away [m^3]
    points   (M, 3) spread evenly over the padded box around the object along its principal axes [m]
    inside   (M,) which of them lie in a solid
    """

    volume: float
    points: Array
    inside: Mask


@dataclass(frozen=True)
class SolidScore:
    """Volume over the true volume, and intersection over union of what both fill."""

    volume_ratio: float
    iou: float


def true_solid(known: KnownObject | TriangleMesh, samples: int = SAMPLES) -> TrueSolid:
    """Return the truth to score solids of an object against; a surface turned inside out bounds a void."""
    mesh = known.mesh if isinstance(known, KnownObject) else known
    middle = mesh.vertices.mean(0)
    axes = np.linalg.svd(mesh.corners.reshape(-1, 3) - middle, full_matrices=False)[2]
    along = (mesh.vertices[np.unique(mesh.triangles)] - middle) @ axes.T
    low, high = along.min(0), along.max(0)
    pad = _PAD * float(np.linalg.norm(high - low))
    drawn = np.random.default_rng(0).uniform(low - pad, high + pad, (samples, 3))
    points = drawn @ axes + middle
    return TrueSolid(float(part_moments(mesh)[:, 0].sum()), points, winding_of(mesh.corners, points) > 0)


def score(solid: TetMesh, truth: TrueSolid) -> SolidScore:
    """Return how well the cells of `solid` fill the true solid, in the same frame."""
    found = winding_of(solid.vertices[solid.surface], truth.points) > 0
    union = int((found | truth.inside).sum())
    return SolidScore(solid.volume / truth.volume, int((found & truth.inside).sum()) / max(union, 1))


def winding_of(corners: Array, points: Array) -> Integers:
    """Return how often closed surfaces of triangles (F, 3, 3) wind around each of `points` (M, 3).

    A ray leaves each point along x; crossings count with the side they leave by. Shared edges are judged by the same
    numbers on both sides, so that no ray slips between two triangles.
    """
    corners = np.ascontiguousarray(corners, float)
    low, high = corners[:, :, 1:].min((0, 1)), corners[:, :, 1:].max((0, 1))
    cells = np.maximum(np.int64(np.sqrt(len(corners))) * np.ones(2, np.int64), 1)
    step = np.maximum((high - low) / cells, 1e-300)
    first = np.clip(np.floor((corners[:, :, 1:].min(1) - low) / step), 0, cells - 1).astype(np.int64)
    last = np.clip(np.floor((corners[:, :, 1:].max(1) - low) / step), 0, cells - 1).astype(np.int64)
    start, member = _binned(first, last, cells)
    return np.asarray(_crossings(corners, np.ascontiguousarray(points, float), low, step, cells, start, member))


@numba.njit(cache=True)
def _binned(first: Integers, last: Integers, cells: Integers) -> tuple[Integers, Integers]:
    """Return the triangles that may cover each cell of a grid over (y, z), as starts and members."""
    start = np.zeros(cells[0] * cells[1] + 1, np.int64)
    for f in range(len(first)):
        for i in range(first[f, 0], last[f, 0] + 1):
            for j in range(first[f, 1], last[f, 1] + 1):
                start[i * cells[1] + j + 1] += 1
    start = np.cumsum(start)
    fill = start[:-1].copy()
    member = np.empty(start[-1], np.int64)
    for f in range(len(first)):
        for i in range(first[f, 0], last[f, 0] + 1):
            for j in range(first[f, 1], last[f, 1] + 1):
                cell = i * cells[1] + j
                member[fill[cell]] = f
                fill[cell] += 1
    return start, member


@numba.njit(cache=True)
def _left(ay: float, az: float, by: float, bz: float, y: float, z: float) -> bool:
    """Whether (y, z) lies left of the line from a to b; the same numbers decide for the line from b to a."""
    if ay < by or (ay == by and az < bz):
        return (by - ay) * (z - az) - (bz - az) * (y - ay) > 0
    return not (ay - by) * (z - bz) - (az - bz) * (y - by) > 0


@numba.njit(cache=True)
def _crossings(
    corners: Array, points: Array, low: Array, step: Array, cells: Integers, start: Integers, member: Integers
) -> Integers:
    out = np.zeros(len(points), np.int64)
    for k in range(len(points)):
        x, y, z = points[k]
        i, j = int(np.floor((y - low[0]) / step[0])), int(np.floor((z - low[1]) / step[1]))
        if i < 0 or j < 0 or i >= cells[0] or j >= cells[1]:
            continue
        for m in range(start[i * cells[1] + j], start[i * cells[1] + j + 1]):
            a, b, c = corners[member[m]]
            s = _left(a[1], a[2], b[1], b[2], y, z)
            if s != _left(b[1], b[2], c[1], c[2], y, z) or s != _left(c[1], c[2], a[1], a[2], y, z):
                continue
            uy, uz, vy, vz = b[1] - a[1], b[2] - a[2], c[1] - a[1], c[2] - a[2]
            across = uy * vz - uz * vy
            if across == 0:
                continue
            p, q = ((y - a[1]) * vz - (z - a[2]) * vy) / across, (uy * (z - a[2]) - uz * (y - a[1])) / across
            if a[0] + p * (b[0] - a[0]) + q * (c[0] - a[0]) > x:
                out[k] += 1 if s else -1
    return out
