"""Noise of dense points: how much there is, and the points brought to the surface that their neighbours share.

Noise of a quarter of the spacing leaves no surface that a solid could be told from; a dense cloud has neighbours
enough to average it away before it is thinned. Their plain mean will not do: they may lie on both sheets of a wall, so
of two layers only the point's own one counts; and the mean of a bent surface lies on its hollow side, so what a whole
neighbourhood moves by is taken back (twicing: Tukey 1977, "Exploratory Data Analysis").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from steelyard.check import Array, Integers
from steelyard.shape.points.spacing import evenly

_REACHES = (1.0, 1.4, 2.0, 2.8)  # of neighbourhoods, in spacings of the points that will be kept
_NOISY = 0.08  # noise over reach below which it does no harm
_THIN = 0.17  # noise over reach at which a neighbourhood is seen to be a surface
_FEW, _ENOUGH, _MOST = 8, 20, 64  # neighbours that show noise; that average it well; more are not looked at
_WIDER = 1.5  # reach over which a move is shared, of that over which it was found
_LEAST = 6  # neighbours below which a point stays
_LAYERS = 0.2  # of the variance is left within two layers; one keeps 0.36 by noise, 0.25 where it is evenly thick
_SHARE = 0.08  # of the weight: less is no layer
_LOOKED_AT = 500  # points that tell how noisy all are
_TINY = 1e-30


class Settled(NamedTuple):
    """Points (N, 3) brought to the surface that they share [m], and their noise across it before [m]."""

    xyz: Array
    noise: float


def settled(xyz: Array, normals: Array | None, rows: Integers, spacing: float) -> Settled | None:
    """Return the points `rows` of a cloud (M, 3) [m] moved across its surface onto it; None where it is not noisy.

    normals  (M, 3), None where not known: neighbours that look the other way do not count
    spacing  of the points that will be kept of them [m]
    """
    among, reach, noise = _reach(xyz, normals, spacing)
    if noise < _NOISY * reach:
        return None
    sides = None if normals is None else normals[rows]
    sheet = _Around.of(xyz[rows], sides, among, reach).sheet()
    moved = _Around.of(xyz[rows], sides, _Among.of(xyz[rows], sides), _WIDER * reach)
    offset = sheet.offset - moved.shared(sheet.offset, sheet.across)
    return Settled(xyz[rows] + offset[:, None] * sheet.across, noise)


class _Among(NamedTuple):
    """Points among which neighbours are looked for: a kd tree of them, their normals (M, 3) where they are known."""

    tree: Any
    normals: Array | None

    @classmethod
    def of(cls, xyz: Array, normals: Array | None, step: int = 1) -> _Among:
        """Return one point in `step` of points (N, 3)."""
        from scipy.spatial import cKDTree

        return cls(cKDTree(xyz[::step]), None if normals is None else normals[::step])


def _reach(xyz: Array, normals: Array | None, spacing: float) -> tuple[_Among, float, float]:
    """Return neighbours enough, the least reach at which they look like a surface [m], and the noise across it [m]."""
    rows = evenly(len(xyz), _LOOKED_AT)
    sides, step, among = None if normals is None else normals[rows], 1, _Among.of(xyz, normals)
    for factor in _REACHES:
        reach = factor * spacing
        while True:
            around = _Around.of(xyz[rows], sides, among, reach)
            if np.median(around.count) < _MOST:
                break
            step += 1
            among = _Among.of(xyz, normals, step)
        count = np.median(around.count)
        if count < _FEW and factor < _REACHES[-1]:
            continue
        noise = float(np.median(around.sheet().noise))
        if noise < _NOISY * reach or (noise < _THIN * reach and count >= _ENOUGH):
            break
    return among, reach, noise


class _Sheet(NamedTuple):
    """The sheet at each of N points: how far above the point (N,) along an axis (N, 3), and the noise (N,) about it."""

    offset: Array
    across: Array
    noise: Array


@dataclass(frozen=True, eq=False)
class _Around:
    """The neighbours of N points within a reach: where from a point (N, K, 3), their numbers and weights (N, K)."""

    away: Array
    index: Integers
    weight: Array

    @classmethod
    def of(cls, points: Array, sides: Array | None, among: _Among, reach: float) -> _Around:
        xyz, normals = among.tree.data, among.normals
        far, index = among.tree.query(points, min(_MOST, len(xyz)), distance_upper_bound=reach)
        found = np.isfinite(far)
        index = np.where(found, index, 0)
        weight = np.where(found, (1 - np.where(found, far / reach, 1) ** 2) ** 2, 0)
        if sides is not None and normals is not None:
            weight *= np.einsum("nd,nkd->nk", sides, normals[index]) > 0
        return cls(xyz[index] - points[:, None], index, weight)

    @property
    def count(self) -> Integers:
        return np.asarray((self.weight > 0).sum(1))

    def sheet(self) -> _Sheet:
        """Return the sheet that each point lies on; a point with few neighbours stays."""
        axes, rows = _axes(self.away, self.weight), np.arange(len(self.away))
        spreads = [self._layers(axes[..., k]).within for k in range(3)]
        across = axes[rows, :, np.argmin(spreads, axis=0)]
        for _ in range(2):
            across = _axes(self.away, self._layers(across).own * self.weight)[..., 0]
        layers = self._layers(across)
        few, count = self.count < _LEAST, np.maximum(self.count, _LEAST)
        noise = np.sqrt(np.maximum(layers.within, 0) * count / (count - 3))
        return _Sheet(np.where(few, 0, layers.mean), across, noise)

    def shared(self, offset: Array, across: Array) -> Array:
        """Return the mean (N,) of what the others around each of all points move by along its axis."""
        alike = np.einsum("nd,nkd->nk", across, across[self.index])
        weight = self.weight * alike**2 * (self.index != np.arange(len(alike))[:, None])
        return np.asarray((weight * np.sign(alike) * offset[self.index]).sum(1) / np.maximum(weight.sum(1), _TINY))

    def _layers(self, axis: Array) -> _Layers:
        return _Layers.of(np.einsum("nkd,nd->nk", self.away, axis), self.weight)


class _Layers(NamedTuple):
    """Neighbours about a point as one layer or two: mean (N,) of the point's own, variance within, which are in it."""

    mean: Array
    within: Array
    own: Array

    @classmethod
    def of(cls, height: Array, weight: Array) -> _Layers:
        """Return the layers of neighbours at heights (N, K) over points at height zero.

        Two where the split between them that leaves the least variance leaves very little (Otsu 1979).
        """
        rows, weight = np.arange(len(height)), weight / np.maximum(weight.sum(1), _TINY)[:, None]
        mean = (weight * height).sum(1)
        gap = height - mean[:, None]
        variance = (weight * gap**2).sum(1)
        order = np.argsort(np.where(weight > 0, gap, np.inf), axis=1)
        ranked, share = np.take_along_axis(gap, order, 1), np.take_along_axis(weight, order, 1)
        below, moment = np.cumsum(share, 1), np.cumsum(share * ranked, 1)
        fit = (below > _SHARE) & (below < 1 - _SHARE)
        between = np.where(fit, moment**2 / np.where(fit, below * (1 - below), 1), 0)
        cut = between.argmax(1)
        within = variance - between[rows, cut]
        two = within < _LAYERS * variance
        bound = 0.5 * (ranked[rows, cut] + ranked[rows, np.minimum(cut + 1, ranked.shape[1] - 1)])
        low = -mean < bound
        own = ~two[:, None] | ((gap < bound[:, None]) == low[:, None])
        below, moment = below[rows, cut], moment[rows, cut]
        side = np.where(low, moment / np.maximum(below, _TINY), -moment / np.maximum(1 - below, _SHARE))
        return cls(mean + np.where(two, side, 0), np.where(two, within, variance), own)


def _axes(away: Array, weight: Array) -> Array:
    """Return the principal axes (N, 3, 3), as columns, of weighted neighbours (N, K, 3), that of least spread first."""
    total = np.maximum(weight.sum(1), _TINY)
    gap = away - np.einsum("nk,nkd->nd", weight, away)[:, None] / total[:, None, None]
    return np.asarray(np.linalg.eigh(np.einsum("nk,nki,nkj->nij", weight, gap, gap))[1])
