"""Points spread through the inside of closed surfaces, each with the volume that it stands for."""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import cross


def inside(mesh: TriangleMesh, count: int) -> tuple[Array, Array]:
    """Return about `count` points (K, 3) inside the closed surfaces of a mesh, in its frame [m], and volumes (K,).

    Lines on a lattice run along the thinnest side of the box; each stretch inside is filled at the lattice's pitch.
    """
    low, high = mesh.bounds
    a, b, c = np.moveaxis(mesh.corners - low, 1, 0)
    volume = float((a * cross(b, c)).sum()) / 6
    axis = int(np.argmin(high - low))
    across = [k for k in range(3) if k != axis]
    pitch = (volume / count) ** (1 / 3)
    # Offsets off every round number, so that no line meets a vertex or an edge.
    first = low + pitch * (0.5 + 1e-3 * np.sqrt(np.arange(3) + 2.0))
    rows, columns = (np.arange(first[k], high[k], pitch) for k in across)
    line, depth, sign = _hits(mesh.vertices, mesh.triangles, rows, columns, pitch, (across[0], across[1], axis))
    order = np.lexsort((depth, line))
    line, start, end = _stretches(line[order], depth[order], sign[order])
    steps = np.maximum(1, np.round((end - start) / pitch)).astype(np.int64)
    # Which of the points of its stretch each one is.
    which = np.arange(steps.sum()) - np.repeat(np.cumsum(steps) - steps, steps)
    points = np.empty((len(which), 3))
    row, column = np.divmod(np.repeat(line, steps), len(columns)) if len(which) else (which, which)
    points[:, across[0]], points[:, across[1]] = rows[row], columns[column]
    pieces = np.repeat((end - start) / steps, steps)
    points[:, axis] = np.repeat(start, steps) + (which + 0.5) * pieces
    return points, pieces * pitch**2


@numba.njit(cache=True, nogil=True)
def _hits(
    vertices: Array, triangles: Integers, rows: Array, columns: Array, pitch: float, axes: tuple[int, int, int]
) -> tuple[Integers, Array, Integers]:
    """Return where lines meet triangles: line (H,) = row * columns + column, depth (H,), and sign (H,): one where the
    line enters, minus one where it leaves. `axes`: across which rows lie, across which columns, and along the lines.
    """
    first, second, axis = axes
    room, count = 64, 0
    line, depth, sign = np.empty(room, np.int64), np.empty(room), np.empty(room, np.int64)
    # A surface is entered where it turns away from the line.
    turned = 1 if axis == 1 else -1
    x, y, z = np.empty(3), np.empty(3), np.empty(3)
    for f in range(len(triangles)):
        for k in range(3):
            v = triangles[f, k]
            x[k], y[k], z[k] = vertices[v, first], vertices[v, second], vertices[v, axis]
        low = max(int(np.ceil((min(x[0], x[1], x[2]) - rows[0]) / pitch - 1e-6)), 0)
        high = min(int(np.floor((max(x[0], x[1], x[2]) - rows[0]) / pitch + 1e-6)), len(rows) - 1)
        if low > high:
            continue
        left = max(int(np.ceil((min(y[0], y[1], y[2]) - columns[0]) / pitch - 1e-6)), 0)
        right = min(int(np.floor((max(y[0], y[1], y[2]) - columns[0]) / pitch + 1e-6)), len(columns) - 1)
        for i in range(low, high + 1):
            for j in range(left, right + 1):
                u0, u1, u2 = x[0] - rows[i], x[1] - rows[i], x[2] - rows[i]
                v0, v1, v2 = y[0] - columns[j], y[1] - columns[j], y[2] - columns[j]
                a, b, c = u1 * v2 - v1 * u2, u2 * v0 - v2 * u0, u0 * v1 - v0 * u1
                if not ((a > 0 and b > 0 and c > 0) or (a < 0 and b < 0 and c < 0)):
                    continue
                if count == room:
                    room *= 2
                    line = np.concatenate((line, np.empty_like(line)))
                    depth = np.concatenate((depth, np.empty_like(depth)))
                    sign = np.concatenate((sign, np.empty_like(sign)))
                line[count] = i * len(columns) + j
                depth[count] = (a * z[0] + b * z[1] + c * z[2]) / (a + b + c)
                sign[count] = turned if a > 0 else -turned
                count += 1
    return line[:count], depth[:count], sign[:count]


@numba.njit(cache=True, nogil=True)
def _stretches(line: Integers, depth: Array, sign: Integers) -> tuple[Integers, Array, Array]:
    """Return line, start and end (S,) of every stretch inside at least one surface; hits sorted by line and depth."""
    kept = np.zeros(max(len(line) - 1, 0), np.bool_)
    level = 0
    for k in range(len(kept)):
        level = (level if k and line[k] == line[k - 1] else 0) + sign[k]
        kept[k] = level > 0 and line[k + 1] == line[k]
    found = np.flatnonzero(kept)
    return line[found], depth[found], depth[found + 1]
