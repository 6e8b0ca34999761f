"""Moments by stratified Monte Carlo: one random column per cell of a grid, integrated along it. An oracle."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.inertia import InertialParameters
from steelyard.shape.mesh import TriangleMesh


def column_moments(mesh: TriangleMesh, seed: int = 0, cells: int = 60_000) -> Array:
    """Ten parameters at 1 kg/m^3 of everything that the surfaces enclose, by columns along the thinnest axis."""
    axis = int(np.argmin(np.ptp(mesh.bounds, axis=0)))
    order = [(axis + 1) % 3, (axis + 2) % 3, axis]
    corners = mesh.corners[:, :, order]
    low, high = mesh.bounds[:, order]
    side = float(np.sqrt(np.prod((high - low)[:2]) / cells))
    count = np.maximum(((high - low)[:2] / side).astype(int), 20)
    step = (high - low)[:2] / count
    grid = np.stack(np.meshgrid(*(np.arange(n) for n in count), indexing="ij"), axis=-1)
    place = low[:2] + (grid + np.random.default_rng(seed).random(grid.shape)) * step
    sums = np.zeros((3, *count))  # of 1, z, z^2 along each column
    for a, b, c in corners:
        cross = (b - a)[0] * (c - a)[1] - (b - a)[1] * (c - a)[0]
        if cross == 0:
            continue
        first = np.maximum(((np.min([a, b, c], axis=0)[:2] - low[:2]) / step).astype(int), 0)
        last = ((np.max([a, b, c], axis=0)[:2] - low[:2]) / step).astype(int) + 1
        window = np.s_[first[0] : last[0], first[1] : last[1]]
        d = place[window] - a[:2]
        u = (d[..., 0] * (c - a)[1] - d[..., 1] * (c - a)[0]) / cross
        v = ((b - a)[0] * d[..., 1] - (b - a)[1] * d[..., 0]) / cross
        hit = np.sign(cross) * ((u >= 0) & (v >= 0) & (u + v < 1))
        z = a[2] + u * (b - a)[2] + v * (c - a)[2]
        for k in range(3):
            sums[k][window] += hit * z ** (k + 1) / (k + 1)
    return _assembled(sums, place, float(np.prod(step)), order)


def _assembled(sums: Array, place: Array, cell: float, order: list[int]) -> Array:
    x, y = place[..., 0], place[..., 1]
    one, z, zz = sums
    pseudo = np.array([
        [x * x * one, x * y * one, x * z, x * one], [x * y * one, y * y * one, y * z, y * one],
        [x * z, y * z, zz, z], [x * one, y * one, z, one],
    ]).sum((2, 3)) * cell  # fmt: skip
    back = [order.index(k) for k in range(3)] + [3]
    return InertialParameters.from_pseudo_inertia(pseudo[np.ix_(back, back)]).vector
