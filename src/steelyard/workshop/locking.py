"""Locking pliers (vise grip): sheet-metal channels with forged jaws; the jaws toward +x, the plane x, y."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import ALLOY_STEEL, CARBON_STEEL, NYLON, PVC, STAINLESS_STEEL, ZINC
from steelyard.workshop.solids import Solid, block, knurled, limb, rod, threaded, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool, scaled

Path = list[tuple[float, float, float]]  # x, y, radius in the plane


def channel(path: Path, width: float, wall: float, opening: float) -> Solid:
    """Return a folded sheet along a path in x, y: two cheeks and a web, open toward the sign of `opening` in y."""
    outer = limb([(x, y, r, -width / 2, width / 2) for x, y, r in path])
    inner = limb([(x, y, r - wall, wall - width / 2, width / 2 - wall) for x, y, r in path])
    mouth = limb([(x, y + opening, r - wall, wall - width / 2, width / 2 - wall) for x, y, r in path])
    return outer - (inner + mouth)


def vise_grip(draw: Draw) -> Tool:
    """Return locking pliers: two channels, two jaws, toggle link, adjusting screw, release lever and spring."""
    k, length, width, wall = draw.scale(0.07), draw.size(140, 0.08), draw.size(14, 0.06), draw.size(1.5, 0.1)
    upper: Path = [(-length, 12, 9.5), (-length + 25, 12, 9.5), (-30, 14, 11), (8, 15, 13)]
    lower: Path = [(-0.86 * length, -34, 8), (-0.5 * length, -28, 9), (-14, -12, 10), (6, -7, 9)]
    inside = width / 2 - wall
    fixed = union([
        limb([(-4, 15, 9, -inside, inside), (22, 16, 10, -inside, inside), (42, 14, 8, -inside, inside),
              (56, 7, 5, -inside + 0.8, inside - 0.8)]), rod(2.8, -width / 2 - 1, width / 2 + 1).translate([2, 18, 0]),
    ]) - block((-99, 99), (-99, 3.2), (-99, 99))  # fmt: skip
    moving = union([
        limb([(4, -4, 7.5, -inside + 0.1, inside - 0.1), (24, -6, 8, -4.6, 4.6), (40, -5, 7, -4.4, 4.4),
              (55, -0.5, 4.2, -4, 4)]) - block((8, 99), (1.6, 99), (-99, 99)),
        rod(3.0, -width / 2 - 1.2, width / 2 + 1.2).translate([5, -6, 0]),
    ])  # fmt: skip
    teeth = union([block((x, x + 1.2), (0.9, 4.0), (-20, 20)) for x in range(28, 58, 3)])
    link = union([
        limb([(-40, -22, 4.4, -2.4, 2.4), (-70, -11, 3.2, -2.2, 2.2), (20 - length, 9, 4, -2.4, 2.4)]),
        rod(2.8, -width / 2 - 1, width / 2 + 1).translate([-40, -22, 0]),
    ])  # fmt: skip
    screw = union([
        threaded(4.2, -length - 16, 16 - length, 2.0, 0.6), knurled(8.2, -length - 24, -length - 12, 20, 0.8),
    ]).rotate([0, 90, 0]).translate([0, 11, 0])  # fmt: skip
    lever = limb([(-0.46 * length, -27, 4.5, -4, 4), (-0.62 * length, -28, 3.2, -3.5, 3.5),
                  (-0.8 * length, -23, 3.0, -6, 6)])  # fmt: skip
    coil = rod(3.4, -62, -8, facets=20) - rod(2.5, -63, -7, facets=20)
    spring = coil.rotate([0, 90, 0]).translate([0, 14, 0])
    steel = draw.pick(CARBON_STEEL, ALLOY_STEEL)
    pieces = [
        Piece("fixed jaw", fixed - teeth, draw.pick(ALLOY_STEEL, CARBON_STEEL)),
        Piece("moving jaw", moving - teeth, draw.pick(ALLOY_STEEL, CARBON_STEEL)),
        Piece("link", link, steel),
        Piece("adjusting screw", screw, draw.pick(CARBON_STEEL, ZINC)),
        Piece("spring", spring, STAINLESS_STEEL),
        Piece("release lever", lever, draw.pick(PVC, NYLON, CARBON_STEEL)),
        Piece("upper handle", channel(upper, width, wall, -14), steel),
        Piece("lower handle", channel(lower, width - 0.6, wall, 12), steel),
    ]
    pieces = scaled(k, pieces)
    grasp, paint = Grasp((-0.6 * length * k, -8 * k, 0), "x", "z"), draw.colour(steel)
    return make_tool("vise-grip", pieces, grasp, draw, finish="scuffed", one_colour=paint)
