"""Colours of a surface: the light taken out, noise averaged, and the few colours that the object is made of."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.colour.light import Light, light_on
from steelyard.parts.skin import OPPOSITE, Skin
from steelyard.shape.eight_bits import Colours
from steelyard.shape.points.spacing import nearest
from steelyard.spatial import summed, unit_vectors

NEIGHBOURS = 8
# Distances between colours 0..1 (black to white is 1.7). Steps of eight bits and of a compressed texture are below the
# finest, and a tint apart from another of the same object is above the coarsest.
FINEST, COARSEST = 0.03, 0.2
_STEPS = 3.0  # one colour reaches this many median steps between neighbours
_LEFT = 0.75  # of the noise: what averaging leaves of it is alike in neighbours, and so not seen between them
_RARE = 0.01  # a colour has at least this share of the points
_ONE_SIDE = 0.9  # product of the normals of neighbours on one side of a thin body, which are lit alike
_SHADE = 0.08  # of the brightness: what is left of the light once it is taken out


@dataclass(frozen=True, eq=False)
class ColourModes:
    """The M colours of an object.

    label  (V,) the colour 0..M-1 of every point
    rgb    (M, 3) the colours, 0..255, as they are without the light
    light  what lights the object
    noise  median distance of neighbouring colours, 0..1, before averaging
    plain  (V, 3) the colour of every point, 0..1, without the light and before averaging
    """

    label: Integers
    rgb: Array
    light: Light
    noise: float
    plain: Array


def colour_modes(rgb: Colours | Array, skin: Skin, normals: Array | None = None, seen: Any = None) -> ColourModes:
    """Return the colours of the surface whose vertices have `rgb` (V, 3), 0..255.

    normals  (V, 3) outward at the vertices, where they are known better than the triangles tell
    seen     (V,) whose colour was measured; the rest take the colour that the nearest of those has without the light
    """
    seen = np.ones(len(rgb), dtype=bool) if seen is None or not seen.any() else seen
    colour, near = np.asarray(rgb, dtype=np.float64) / 255, skin.near[:, :NEIGHBOURS]
    facing = _calm_sides(skin.normals if normals is None else normals, near)
    alike = np.einsum("id,ikd->ik", facing, facing[near])
    flatness = skin.flatness if normals is None else _flatness(alike)
    calm = _without_noise(colour, near, _step(colour, near, seen), alike > _ONE_SIDE)
    light = light_on(calm, facing, np.where(seen, flatness, 0.0), skin.vertices)
    sure = seen.copy()
    if light.seen:
        colour = colour / light.on(facing)[:, None]
        # Colours at edges are mixtures. An edge is less flat than what is around it; a thin rod is flat nowhere.
        around = np.minimum(np.median(flatness[skin.near], axis=1), np.median(flatness[seen]))
        sure &= flatness > np.minimum(0.95, around)
    colour = _lent(colour, skin.vertices, seen)
    raw, noise = colour, _step(colour, near, sure)
    colour = _without_noise(colour, near, noise)
    shade = _SHADE * float(np.median(np.linalg.norm(colour, axis=1))) if light.seen else 0.0
    reach = float(np.clip(max(_STEPS * _step(colour, near, sure), _LEFT * noise, shade), FINEST, COARSEST))
    modes = _modes(colour, near, sure, reach)
    label = _assigned(colour, near, sure, modes, reach)
    label, modes = _without_blends(label, modes, near, raw, max(FINEST, 2 * noise))
    return ColourModes(label, np.clip(255 * modes, 0, 255), light, noise, raw)


def _calm_sides(normals: Array, near: Integers) -> Array:
    """Return normals (V, 3) averaged over those neighbours (V, K) that look nearly the same way, twice.

    How nearly is told by how far neighbours differ: noise of points and of normals goes, edges stay.
    """
    for _ in range(2):
        gap = np.linalg.norm(normals[near] - normals[:, None], axis=2)
        width = _STEPS * float(np.median(gap[:, :4]))
        weight = (gap < np.sqrt(2)) * np.exp(-0.5 * (gap / max(width, 1e-9)) ** 2)
        normals = unit_vectors(normals + (weight[:, :, None] * normals[near]).sum(1))
    return normals


def _flatness(alike: Array) -> Array:
    """Return how much neighbours look the same way (V,), of their products (V, K) with the normal of each point.

    Those that look the opposite way are on the other side of a thin wall, which may be as flat as any.
    """
    beside = alike > OPPOSITE
    return np.asarray((alike * beside).sum(1) / np.maximum(beside.sum(1), 1))


def _lent(colour: Array, xyz: Array, seen: Any) -> Array:
    """Return colours (V, 3) where points that nobody saw have that of the nearest that was seen."""
    if seen.all():
        return colour
    lent = colour.copy()
    lent[~seen] = colour[seen][nearest(xyz[seen], xyz[~seen])]
    return lent


def _step(colour: Array, near: Integers, sure: Any) -> float:
    """Return the median distance between the colours of near neighbours."""
    gaps = np.linalg.norm(colour[near[:, :4]] - colour[:, None], axis=2)
    return float(np.median(gaps[sure])) if sure.any() else 0.0


def _without_noise(colour: Array, near: Integers, noise: float, which: Any = True) -> Array:
    """Return colours averaged over those neighbours (V, K) of like colour, twice: noise goes, borders stay."""
    if noise <= FINEST / _STEPS:
        return colour
    width = float(np.clip(_STEPS * noise, FINEST, COARSEST))
    for _ in range(2):
        gap = np.linalg.norm(colour[near] - colour[:, None], axis=2)
        weight = which * np.exp(-0.5 * (gap / width) ** 2)
        colour = (colour + (weight[:, :, None] * colour[near]).sum(1)) / (1 + weight.sum(1))[:, None]
    return colour


def _modes(colour: Array, near: Integers, sure: Any, reach: float) -> Array:
    """Return colours (M, 3) that many points are near to, the most frequent first; at least one."""
    alike = (np.linalg.norm(colour[near] - colour[:, None], axis=2) < reach).mean(1)
    grid = np.floor(colour[sure] / (reach / 4)).astype(np.int64)
    grid -= grid.min(0)
    key = np.ravel_multi_index(tuple(grid.T), tuple(grid.max(0) + 1))
    cell, member, count = np.unique(key, return_inverse=True, return_counts=True)
    centre = summed(member, colour[sure], len(cell)) / count[:, None]
    company = np.bincount(member, alike[sure], len(cell))
    close = np.linalg.norm(centre[:, None] - centre, axis=2) < reach
    left = np.ones(len(cell), dtype=bool)
    found: list[Array] = []
    while left.any():
        crowd = np.where(left, close @ (count * left), -1)
        best = int(crowd.argmax())
        if crowd[best] < _RARE * len(colour) and found:
            break
        mine = left & close[best]
        middle = np.average(centre[mine], axis=0, weights=count[mine])
        mine |= left & (np.linalg.norm(centre - middle, axis=1) < reach)
        # Colours whose points have no neighbours of their own colour are noise or borders.
        if company[mine].sum() >= 0.5 * count[mine].sum() or not found:
            found.append(np.average(centre[mine], axis=0, weights=count[mine]))
        left &= ~mine
    return np.array(found)


def _assigned(colour: Array, near: Integers, sure: Any, modes: Array, reach: float) -> Integers:
    """Return the mode (V,) of every point: the nearest within reach, else by colour and neighbours together."""
    gap = np.linalg.norm(colour[:, None] - modes, axis=2)
    label = np.where((gap.min(1) < reach) & sure, gap.argmin(1), -1)
    open_points = label < 0
    for _ in range(4):
        # An unsure colour (light at an edge) is worth half a neighbour less per black-to-white step.
        score = _votes(label, near, len(modes)) / near.shape[1] - np.where(sure, 2.0, 0.5)[:, None] * gap
        label = np.where(open_points, score.argmax(1), label)
    votes = _votes(label, near, len(modes))
    lone = np.take_along_axis(votes, label[:, None], 1)[:, 0] <= 1
    return np.asarray(np.where(lone, votes.argmax(1), label))


def _votes(label: Integers, near: Integers, count: int) -> Array:
    """Return how many neighbours (V, count) of each point have each label; -1 has no vote."""
    votes = label[near]
    voter, _ = np.nonzero(votes >= 0)
    counted = np.bincount(voter * count + votes[votes >= 0], minlength=len(near) * count)
    return counted.reshape(-1, count).astype(np.float64)


def _without_blends(
    label: Integers, modes: Array, near: Integers, colour: Array, plain: float
) -> tuple[Integers, Array]:
    """Give the points of colours that are but the mixture of two others beside them to the nearer of the two.

    A mixture is one point wide (a pixel on a border), or runs from the one to the other: a part of its own between the
    two has colours that scatter less than `plain` along that way.
    """
    count = len(modes)
    for m in np.argsort(np.bincount(label, minlength=count), kind="stable") if count > 2 else ():
        mine = label == m
        if not mine.any():  # its points have all been given to others
            continue
        votes = _votes(label, near, count)[mine]
        beside = np.where(np.arange(count) == m, 0, votes.sum(0))
        two = np.argsort(-beside, kind="stable")[:2]
        if beside[two].min() < 0.1 * beside.sum():
            continue
        a, way = modes[two[0]], modes[two[1]] - modes[two[0]]
        length = max(float(np.linalg.norm(way)), 1e-12)
        along = (colour[mine] - a) @ way / length**2
        off = np.linalg.norm(colour[mine] - a - along[:, None] * way, axis=1)
        thin = (votes[:, two].sum(1) > 0).mean() > 0.6
        runs = np.std(along) * length > plain
        between = 0.1 < np.median(along) < 0.9 and np.median(off) < 0.1 * length
        if between and (thin or runs):
            label = label.copy()
            label[mine] = two[(along > 0.5).astype(np.int64)]
    used, label = np.unique(label, return_inverse=True)
    return label, modes[used]
