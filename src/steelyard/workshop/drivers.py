"""Tools with a shaft in a handle: screwdriver, nut screwdriver, file; the handle along z, the tip at the top."""

from __future__ import annotations

import numpy as np

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import (
    ACETATE,
    ALLOY_STEEL,
    ALUMINIUM,
    ASH,
    BEECH,
    BRASS,
    CARBON_STEEL,
    NYLON,
    PVC,
    STAINLESS_STEEL,
)  # fmt: skip
from steelyard.workshop.solids import Solid, block, hexagon, hull, lathe, rod, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool


def fluted(radius: float, length: float, flutes: int = 6) -> Solid:
    """Return a driver handle from z = 0 to `length`: a turned body with a round end, a neck and flutes."""
    r = radius
    ends = [(r * np.sin(a), r * (1 - np.cos(a))) for a in np.radians([20, 45, 70, 90])]
    body = [*ends, (r, 0.6 * length), (0.72 * r, 0.74 * length), (0.70 * r, 0.82 * length), (0.88 * r, 0.92 * length)]
    handle = lathe([*body, (0.62 * r, length)])
    cutter = rod(0.3 * r, 0.5 * r, 0.62 * length, facets=16).translate([1.18 * r, 0, 0])
    return handle - union([cutter.rotate([0, 0, 360 * k / flutes]) for k in range(flutes)])


def screwdriver(draw: Draw) -> Tool:
    """Return a slotted screwdriver; its tang reaches deep into the handle."""
    radius, handle, shaft, blade = draw.sizes(8.2, 82, 108, 2.05)
    tip = handle + shaft
    stem = union([
        rod(blade, 0.35 * handle, tip - 8, facets=24),
        block((-2.2 * blade, 2.2 * blade), (-0.8, 0.8), (0.4 * handle, 0.5 * handle)),
        hull(
            rod(blade, tip - 9, tip - 8, facets=24),
            block((-1.35 * blade, 1.35 * blade), (-0.5, 0.5), (tip - 4, tip - 3)),
            block((-1.15 * blade, 1.15 * blade), (-0.3, 0.3), (tip - 1, tip)),
        ),
    ])  # fmt: skip
    pieces = [
        Piece("shaft", stem, draw.pick(ALLOY_STEEL, STAINLESS_STEEL)),
        Piece("handle", fluted(radius, handle), draw.pick(PVC, ACETATE, NYLON)),
    ]
    return make_tool("screwdriver", pieces, Grasp((0, 0, 0.4 * handle), "z", "-y"), draw)


def nut_screwdriver(draw: Draw) -> Tool:
    """Return a nut driver: a hollow shaft with a hexagonal mouth, its end hidden in the handle."""
    radius, handle, shaft, mouth = draw.sizes(11.6, 94, 92, 7.0)
    tip, wall = handle + shaft, 0.72 * mouth + 0.4
    outside = lathe([
        (0.56 * mouth, 0.45 * handle), (0.56 * mouth, tip - 22), (wall, tip - 18), (wall, tip),
    ], 32)  # fmt: skip
    bore = union([hexagon(mouth, tip - 10, tip + 1), rod(0.3 * mouth, 0.6 * handle, tip - 5, facets=20)])
    cross = block((-0.75 * mouth, 0.75 * mouth), (-1.2, 1.2), (0.5 * handle, 0.58 * handle))
    pieces = [
        Piece("shaft", union([outside, cross]) - bore, draw.pick(ALLOY_STEEL, CARBON_STEEL)),
        Piece("handle", fluted(radius, handle, 8) - rod(0.3 * mouth, 0.6 * handle, tip, facets=20),
              draw.pick(ACETATE, NYLON, PVC)),
    ]  # fmt: skip
    return make_tool("nut-screwdriver", pieces, Grasp((0, 0, 0.4 * handle), "z", "-y"), draw)


def file(draw: Draw) -> Tool:
    """Return a small half-round file: a toothed blade whose tang ends inside a wooden handle, with a ferrule."""
    handle, blade, width, thick = draw.sizes(66, 104, 7.4, 2.2)
    end = handle + blade
    half_round = hull(
        block((-0.5 * width, 0.5 * width), (0, 0.6 * thick), (handle + 2, handle + 3)),
        block((-0.28 * width, 0.28 * width), (0, thick), (handle + 2, handle + 3)),
        block((-0.45 * width, 0.45 * width), (0, 0.6 * thick), (end - 30, end - 29)),
        block((-0.2 * width, 0.2 * width), (0, 0.7 * thick), (end - 2, end)),
    )
    teeth = [block((-width, width), (-1, 0.14), (z, z + 0.7)) for z in np.arange(handle + 12, end - 4, 1.8)]
    tang = hull(
        block((-0.25 * width, 0.25 * width), (0.2, thick), (handle + 2, handle + 4)),
        block((-1, 1), (0.5, thick - 0.5), (0.45 * handle, 0.45 * handle + 1)),
    )
    grip = lathe([
        (3.0, 0), (5.2, 3), (6.0, 10), (5.9, 20), (5.0, 34), (4.4, handle - 14), (4.6, handle - 8), (4.0, handle),
    ])  # fmt: skip
    ferrule = lathe([(4.95, handle - 11), (4.95, handle - 1), (3.6, handle + 2)]) - rod(4.0, 0, handle - 0.6)
    pieces = [
        Piece("blade", union([half_round, tang]) - union(teeth), draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("ferrule", ferrule, draw.pick(BRASS, ALUMINIUM)),
        Piece("handle", grip, draw.pick(BEECH, ASH)),
    ]
    return make_tool("file", pieces, Grasp((0, 0, 0.4 * handle), "z", "-y"), draw, finish="scuffed")
