"""Points spread through the inside of closed surfaces, each with the volume that it stands for."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.shape.mesh import TriangleMesh


def inside(mesh: TriangleMesh, count: int) -> tuple[Array, Array]:
    """Return about `count` points (K, 3) inside the closed surfaces of a mesh, in its frame [m], and volumes (K,).

    Lines on a lattice run along the thinnest side of the box; each stretch inside is filled at the lattice's pitch.
    """
    low, high = mesh.bounds
    axis = int(np.argmin(high - low))
    across = [k for k in range(3) if k != axis]
    corners = mesh.corners
    volume = float(np.linalg.det(corners - low).sum() / 6)
    pitch = (volume / count) ** (1 / 3)
    # Offsets off every round number, so that no line meets a vertex or an edge.
    rows, columns = (np.arange(low[k] + pitch * (0.5 + 1e-3 * np.sqrt(k + 2)), high[k], pitch) for k in across)
    nearest, farthest = corners[:, :, across[0]].min(1), corners[:, :, across[0]].max(1)
    points, volumes = [], []
    for row in rows:
        met = corners[(nearest < row) & (row < farthest)]
        lines = np.stack([np.full(len(columns), row), columns], 1)
        for line, start, end in _stretches(met, lines, across, axis):
            steps = max(1, round((end - start) / pitch))
            filled = np.empty((steps, 3))
            filled[:, across] = line
            filled[:, axis] = start + (np.arange(steps) + 0.5) / steps * (end - start)
            points.append(filled)
            volumes.append(np.full(steps, (end - start) / steps * pitch**2))
    if not points:
        return np.zeros((0, 3)), np.zeros(0)
    return np.concatenate(points), np.concatenate(volumes)


def _stretches(corners: Array, lines: Array, across: list[int], axis: int) -> list[tuple[Array, float, float]]:
    """Return every stretch of the lines (N, 2) along `axis` that is inside at least one surface."""
    flat = corners[:, :, across]
    a, b, c = (flat[None, :, k] - lines[:, None] for k in range(3))

    def turn(p: Array, q: Array) -> Array:
        return np.asarray(p[..., 0] * q[..., 1] - p[..., 1] * q[..., 0])

    weight = np.stack([turn(b, c), turn(c, a), turn(a, b)], -1)
    hit = np.all(weight > 0, axis=-1) | np.all(weight < 0, axis=-1)
    out = []
    for n in np.flatnonzero(hit.any(1)):
        w = weight[n, hit[n]]
        place = (w * corners[hit[n], :, axis]).sum(1) / w.sum(1)
        order = np.argsort(place)
        # Going along the line a surface is entered where it turns away from it.
        sign = -np.sign(w.sum(1)) if axis != 1 else np.sign(w.sum(1))
        depth = np.cumsum(sign[order])
        place = place[order]
        out += [(lines[n], float(place[k]), float(place[k + 1])) for k in np.flatnonzero(depth[:-1] > 0.5)]
    return out
