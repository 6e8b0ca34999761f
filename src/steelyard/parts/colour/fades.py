"""Colours that fade into one another lie on one material: wear, dirt, a printed gradient.

Where two materials meet, the colour leaps from one point to the next. Across the border of a worn patch it passes all
colours between: a third material has one of them only, and a camera's blur is narrower than the distance of points.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers
from steelyard.parts.colour.modes import NEIGHBOURS, ColourModes
from steelyard.parts.colour.prints import patches
from steelyard.parts.skin import Skin
from steelyard.shape.points.spacing import nearest

FADES = 0.2  # share of the points within two steps of a border that lie on the way, neither here nor there
SPREAD = 0.1  # of those on the way that lie in each third of it
END, NEAREST_END, BESIDE = 0.15, 0.3, 0.2  # of the way: an end at least, at most for this to tell; off the way
_NOISES = 1.5  # an end is as wide as so many median steps between neighbours, three deviations along the way
_FEW = 16  # points that tell nothing


def without_fades(colours: ColourModes, skin: Skin) -> Integers:
    """Return the colours (V,) of the vertices where patches have the colour of the larger one that they fade into.

    A patch that fades into several larger ones is shared out among them, each point to the nearest. Those that fade
    into others themselves take no part, since two materials may wear to one grey.
    """
    patch = patches(colours.label, skin)
    size = np.bincount(patch)
    label, kept = colours.label.copy(), np.ones(len(size), dtype=bool)
    into: dict[int, list[int]] = {}
    for large, small in _fading(colours, patch, size, skin):
        into.setdefault(small, []).append(large)
    for small in sorted(into, key=lambda k: (-size[k], k)):
        goals = [large for large in into[small] if kept[large]]
        kept[small] = not goals
        if goals:
            mine, among = patch == small, np.isin(patch, goals)
            label[mine] = colours.label[among][nearest(skin.vertices[among], skin.vertices[mine])]
    return label


def _fading(colours: ColourModes, patch: Integers, size: Integers, skin: Skin) -> list[tuple[int, int]]:
    """Return pairs of patches, the larger first, across whose border the colour fades."""
    near = skin.near[:, :NEIGHBOURS]
    ends = np.stack([np.repeat(np.arange(len(patch)), near.shape[1]), near.ravel()], axis=1)
    ends = ends[(patch[ends[:, 0]] != patch[ends[:, 1]]) & (size[patch[ends]].min(1) >= _FEW // 2)]
    pairs, pair = np.unique(np.sort(patch[ends], axis=1), axis=0, return_inverse=True)
    order = np.argsort(pair, kind="stable")
    borders = np.split(ends[order], np.cumsum(np.bincount(pair, minlength=len(pairs)))[:-1]) if len(pairs) else []
    found = []
    for (a, b), border in zip(pairs.tolist(), borders, strict=True):
        large, small = (a, b) if size[a] >= size[b] else (b, a)
        zone = np.unique(np.concatenate([border.ravel(), near[border].ravel()]))
        if _fades(colours, patch, large, small, zone[np.isin(patch[zone], (a, b))]):
            found.append((large, small))
    return found


def _fades(colours: ColourModes, patch: Integers, a: int, b: int, zone: Integers) -> bool:
    """Return whether colours everywhere on the way from a to b are met in the zone, two steps wide to either side."""
    start, goal = (colours.rgb[colours.label[zone[patch[zone] == k][0]]] / 255 for k in (a, b))
    way = goal - start
    length = float(np.linalg.norm(way))
    end = max(END, _NOISES * colours.noise / length) if length else 1.0
    if len(zone) < _FEW or end > NEAREST_END:
        return False
    from_start = colours.plain[zone] - start
    along = from_start @ way / length**2
    off = np.linalg.norm(from_start - along[:, None] * way, axis=1)
    thirds = np.histogram(along[off < BESIDE * length], np.linspace(end, 1 - end, 4))[0]
    return bool(thirds.sum() >= FADES * len(zone) and thirds.min() >= SPREAD * thirds.sum())
