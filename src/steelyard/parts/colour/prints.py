"""Prints and labels: patches of another colour that are flush with what is around them are no parts of their own.

The vector area of a patch depends on its border only. A flat patch has a vector area as large as its area; what sticks
out, goes around or ends a part has much less: a half cylinder 0.64, a hemisphere 0.5, a ring 0.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers
from steelyard.parts.skin import Skin
from steelyard.shape.pairs import joined
from steelyard.spatial import summed

FLUSH = 0.75  # vector area over area; plates, whose rims count, are flush as well
SMALL = 0.05  # of the boundary's area: a larger patch is rather a plate, and a part more does less harm than one less
PART = 0.01  # of the boundary's area: what sticks out and is as large as this is a part
NESTED = 3  # prints upon prints: what is written on a label shows only once the label is none
SPECK = 0.003  # of the boundary's area: three points in a thousand tell nothing


def without_prints(label: Integers, skin: Skin) -> Integers:
    """Return the colours (V,) of the vertices with small, flush patches given the colour around them."""
    total = float(skin.areas.sum())
    for _ in range(NESTED):
        patch = patches(label, skin)
        count = int(patch.max()) + 1
        corners = patch[skin.triangles]
        owner = np.where(corners[:, 1] == corners[:, 2], corners[:, 1], corners[:, 0])
        area = np.bincount(owner, skin.areas, count)
        flush = np.linalg.norm(summed(owner, skin.area_vectors, count), axis=1) > FLUSH * area
        colour = np.zeros(count, dtype=np.int64)
        colour[patch] = label
        speck, print_ = area < SPECK * total, flush & (area < SMALL * total)
        # A colour that some part has is believed where it lies flush as well.
        print_ &= ~np.isin(colour, colour[~print_ & (area > PART * total)])
        print_ |= speck
        print_[area.argmax()] = False
        ends = patch[np.concatenate([skin.edges, skin.edges[:, ::-1]])]
        ends = ends[print_[ends[:, 0]] & ~print_[ends[:, 1]]]
        if not len(ends):
            break
        votes = np.zeros((count, int(label.max()) + 1))
        np.add.at(votes, (ends[:, 0], colour[ends[:, 1]]), 1)
        asked = votes.any(1)
        colour[asked] = votes[asked].argmax(1)
        label = colour[patch]
    return label


def patches(label: Integers, skin: Skin) -> Integers:
    """Return the number (V,) of the connected patch of one colour that each vertex lies in."""
    one, two = label[skin.links].T
    return joined(skin.links[one == two], len(label))
