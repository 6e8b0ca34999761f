"""Hacksaw; the blade along x at y = 0, the frame above it."""

from __future__ import annotations

import numpy as np

from steelyard.spatial import unit_vectors
from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import ALUMINIUM, BRASS, CARBON_STEEL, FOAM_RUBBER, MAGNESIUM, RUBBER, STAINLESS_STEEL
from steelyard.workshop.solids import Solid, block, chain, limb, rod, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool


def hacksaw(draw: Draw) -> Tool:
    """Return a hacksaw: tubular frame, D handle with a grip, blade, its two holders and a wing nut."""
    span, depth, width, wall = draw.sizes(300, 88, 13, 1.5, spread=0.08)
    back = span + 30
    path = [(-10, -9), (-10, depth - 22), (4, depth), (back - 14, depth), (back + 2, depth - 8)]
    filled = _bar(path, 18, width)
    tube = filled - _bar(path, 18 - 2 * wall, width - 2 * wall, ends=1.5 * wall)
    blade = block((-9, span + 5), (-6, 6.5), (-0.33, 0.33)) - union([
        rod(2, -9, 9, facets=16).translate([x, 0, 0]) for x in (-4, span)
    ])  # fmt: skip
    teeth = union(
        [
            block((-1.2, 1.2), (-1.2, 1.2), (-2, 2)).rotate([0, 0, 45]).translate([x, -6.6, 0])
            for x in np.arange(6, span - 6, 3.4)
        ]
    )
    front = union([block((-16, 2), (-5, 5), (0.33, 5)), rod(1.9, -4, 3, facets=16).translate([-4, 0, 0]),
                   rod(4, 0, 9).rotate([0, -90, 0]).translate([-13, 0, 0])])  # fmt: skip
    rear = union([block((span - 6, span + 12), (-5, 5), (0.33, 5)), rod(1.9, -4, 3, facets=16).translate([span, 0, 0]),
                  rod(4.2, 10, 66, facets=24).rotate([0, 90, 0]).translate([span, 0, 0])])  # fmt: skip
    neck = limb(
        [
            (back + 6, depth, 11, -9, 9),
            (back + 8, 0.45 * depth, 8, -8, 8),
            (back + 6, 0, 9.5, -9, 9),
            (back + 8, -20, 8, -8, 8),
        ]
    )
    bottom = limb([(back + 8, -20, 8, -8, 8), (back + 70, -34, 8, -8, 8)])
    spine = limb([(back + 6, depth, 11, -9, 9), (back + 46, 0.62 * depth, 11, -9, 9), (back + 70, -34, 9, -9, 9)])
    grip = limb([(back + 30, 0.78 * depth, 14, -13, 13), (back + 47, 0.58 * depth, 15, -13.5, 13.5),
                 (back + 65, -14, 13.5, -13, 13)])  # fmt: skip
    wings = union([
        rod(7.5, 46, 56, top=6).rotate([0, 90, 0]), block((48, 57), (-2, 2), (-16, 16)),
    ]).translate([span, 0, 0])  # fmt: skip
    bore = rod(4.2, 0, 90).rotate([0, 90, 0]).translate([span + 2, 0, 0])
    pieces = [
        Piece("blade", blade - teeth, draw.pick(CARBON_STEEL, STAINLESS_STEEL), (44, 70, 130)),
        Piece("front holder", front, CARBON_STEEL),
        Piece("rear holder", rear, CARBON_STEEL),
        Piece("wing nut", wings - bore, draw.pick(BRASS, CARBON_STEEL)),
        Piece("frame", tube, draw.pick(CARBON_STEEL, STAINLESS_STEEL), (196, 34, 34)),
        Piece("handle", union([neck, bottom, spine]) - filled, draw.pick(ALUMINIUM, MAGNESIUM)),
        Piece("grip", grip, draw.pick(RUBBER, FOAM_RUBBER)),
    ]
    return make_tool("hacksaw", pieces, Grasp((back + 50, 0.5 * depth, 0), "x", "z"), draw)


def _bar(path: list[tuple[float, float]], high: float, wide: float, ends: float = 0.0) -> Solid:
    """Return a bar of rectangular section along a path in x, y, its ends drawn in by `ends`."""
    points = np.array(path, float)
    points[0] += ends * unit_vectors(points[1] - points[0])
    points[-1] += ends * unit_vectors(points[-2] - points[-1])
    a, b = high / 2, wide / 2
    return chain([rod(a, -b, b, facets=20).translate([x, y, 0]) for x, y in points])
