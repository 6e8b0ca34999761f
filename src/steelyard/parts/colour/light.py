"""The light on a surface, found from how brightness follows the normals, without knowing any colour.

However an object is lit from afar, brightness is nearly a quadratic function of the normal, the nine harmonics of up to
second order. One lamp that leaves the sides that face away alike dark has a kink, which they round off, so that it is
taken by itself: brightness is 1 + sky . f(n) + max(0, lamp . n), with the eight harmonics f of first and second order.
Most pairs of places have one albedo, which drops out of their difference of log brightness; the rest are outliers.
Source: Basri and Jacobs 2003, "Lambertian reflectance and linear subspaces", sec. 3: nine harmonics hold 99 %.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from steelyard.check import Array, Integers

_TURNED = 0.15  # between the normals of a pair, for it to tell of the light
_LIGHT_SEEN = 0.1  # weaker shading is below the difference of two colours
_DARKEST = 0.1  # light from all about turns no side of an object black
_PLACES, _APART = 600, (16, 80)  # places whose pairs tell of the light, and how many flat places lie between the two
_SETTLED = 1e-4  # relative fall of the cost below which a step is the last
_OF_SKY = np.arange(11) < 8
_STEPS, _LENGTHS = 20, (1.0, 0.3, 0.1)  # Gauss-Newton steps, and what of one is tried until the cost falls
_EVEN = 0.05  # cost of a pair below which nothing is lit
_ROUGH = 0.02  # relative brightness: scale beyond which a pair of neighbours is no longer trusted to have one albedo
_RIDGE = 1e-3  # of the mean information of a weight: boxes show fewer normals than there are weights


@dataclass(frozen=True, eq=False)
class Light:
    """How bright a surface is for its normal.

    weights  (11,) of the eight harmonics of first and second order, then the lamp (3,); 0 where no light is seen
    """

    weights: Array

    @property
    def seen(self) -> bool:
        """Whether brightness follows the normals."""
        return bool(self.weights.any())

    def on(self, normals: Array) -> Array:
        """Return the brightness (...) of places with these normals (..., 3); 1 where no light is seen.

        Toward sides of which no pair told, harmonics may fall below zero: nothing is darker than the darkest.
        """
        return np.maximum(_brightness(self.weights, _harmonics(normals)), _DARKEST)


UNLIT = Light(np.zeros(11))


def light_on(colour: Array, normals: Array, flatness: Array, xyz: Array) -> Light:
    """Return the light; UNLIT where the brightness does not follow the normals.

    The fit is over pairs of flat places a few spacings apart whose normals differ: next neighbours share their errors,
    and at an edge a colour is a mixture. It must take away a quarter of the pairs' robust cost to be believed.

    colour    (V, 3) 0..1
    normals   (V, 3) outward
    flatness  (V,) 1 where the surroundings are one plane
    """
    from scipy.spatial import cKDTree

    flat = np.flatnonzero(flatness > np.clip(np.median(flatness), 0.9, 0.98))
    if len(flat) < 2:
        return UNLIT
    tree, some = cKDTree(xyz[flat]), flat[:: 1 + len(flat) // _PLACES]
    apart = flat[tree.query(xyz[some], min(_APART[-1] + 1, len(flat)))[1].reshape(len(some), -1)[:, _APART[0] :: 4]]
    i, j = np.repeat(some, apart.shape[1]), apart.ravel()
    used = ((normals[i] - normals[j]) ** 2).sum(1) > _TURNED**2
    i, j = i[used], j[used]
    bright = np.log(np.maximum(colour.mean(1), 4 / 255))
    side = bright[i] - bright[j]
    before = _cost(side)
    if before < _EVEN:
        return UNLIT
    places, end = np.unique(np.concatenate([i, j]), return_inverse=True)
    weights, after = _fitted(_Pairs(_harmonics(normals[places]), end[: len(i)], end[len(i) :], side))
    return Light(weights) if after < 0.75 * before and np.linalg.norm(weights) >= _LIGHT_SEEN else UNLIT


def _harmonics(normals: Array) -> Array:
    """Return the harmonics (..., 8) of first and second order of unit vectors (..., 3), which are the first three."""
    x, y, z = np.moveaxis(normals, -1, 0)
    return np.stack([x, y, z, x * y, x * z, y * z, (x * x - y * y) / 2, (3 * z * z - 1) / 2], axis=-1)


def _cost(off: Array) -> float:
    """Return the mean robust cost (Cauchy's) of differences of log brightness; 0 where there are none."""
    return float(np.log1p((off / _ROUGH) ** 2).mean()) if len(off) else 0.0


def _brightness(weights: Array, wave: Array) -> Array:
    """Return the brightness (...) under the light of weights (11,) where the harmonics are `wave` (..., 8)."""
    return np.asarray(1 + wave @ weights[:8] + np.maximum(0, wave[..., :3] @ weights[8:]))


class _Pairs(NamedTuple):
    """Harmonics (P, 8) at places; the places `one` and `two` (E,) of each pair, and their log brightness apart (E,)."""

    wave: Array
    one: Integers
    two: Integers
    side: Array

    def apart(self, of_place: Array) -> Array:
        """Return how far what places (P, ...) have is apart in each pair (E, ...)."""
        return np.asarray(of_place[self.one] - of_place[self.two])

    def left(self, weights: Array) -> Array:
        """Return what the light leaves (E,) of the differences of log brightness."""
        return np.asarray(self.side - self.apart(np.log(_brightness(weights, self.wave))))


def _fitted(pairs: _Pairs) -> tuple[Array, float]:
    """Return the weights that explain differences of log brightness best, and their cost: a sky, then with a lamp."""
    sky, _ = _improved(np.zeros(11), 8, pairs)
    return _improved(np.append(sky[:8], sky[:3]), 11, pairs)


def _improved(weights: Array, count: int, pairs: _Pairs) -> tuple[Array, float]:
    """Return weights and their cost after robust Gauss-Newton steps of the first `count`.

    Pairs of two albedos are outliers (Cauchy's weights). A step is shortened until the cost falls: a lamp has a kink.
    """
    cost = _cost(pairs.left(weights))
    for _ in range(_STEPS):
        step = _step(weights, count, pairs)
        tried = (_not_black(weights + length * step, pairs.wave) for length in _LENGTHS)
        better = ((moved, less) for moved in tried if (less := _cost(pairs.left(moved))) < cost)
        moved, less = next(better, (weights, cost))
        fall, weights, cost = cost - less, moved, less
        if fall <= _SETTLED * cost:
            break
    return weights, cost


def _step(weights: Array, count: int, pairs: _Pairs) -> Array:
    """Return a Gauss-Newton step (11,) of the first `count` weights, those of the harmonics held by a small ridge."""
    off = pairs.left(weights)
    rows = pairs.apart(_slopes(weights, pairs.wave)[:, :count])
    weighted = rows.T / (_ROUGH**2 + off**2)
    normal = weighted @ rows
    ridge, held = _RIDGE * np.trace(normal) / count, np.where(_OF_SKY, weights, 0.0)[:count]
    step = np.linalg.solve(normal + ridge * np.eye(count), weighted @ off - ridge * held)
    return np.append(step, np.zeros(len(weights) - count))


def _slopes(weights: Array, wave: Array) -> Array:
    """Return how log brightness (P, 11) changes with every weight."""
    lit = (wave[:, :3] @ weights[8:] > 0)[:, None]
    return np.hstack([wave, wave[:, :3] * lit]) / _brightness(weights, wave)[:, None]


def _not_black(weights: Array, wave: Array) -> Array:
    """Return weights with harmonics so weak that no place is black without the lamp."""
    dip = -float((wave @ weights[:8]).min())
    return np.where(_OF_SKY, weights * min(1.0, (1 - _DARKEST) / max(dip, 1e-12)), weights)
