"""Adjustable wrench and socket wrench; the handle along x."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import (
    ALLOY_STEEL,
    CARBON_STEEL,
    FOAM_RUBBER,
    NYLON,
    PVC,
    RUBBER,
    STAINLESS_STEEL,
    ZINC,
)
from steelyard.workshop.solids import block, hexagon, knurled, lathe, limb, prism, rod, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool, scaled


def adjustable_wrench(draw: Draw) -> Tool:
    """Return a wrench with a sliding jaw, the worm that moves it, and a dipped grip."""
    k, reach, opening = draw.scale(0.07), draw.size(236, 0.1), draw.size(20, 0.2)
    head = limb([(-6, -12, 15, -8, 8), (14, 10, 17, -8, 8), (34, 22, 8.5, -7.5, 7.5), (46, 25, 6.5, -7, 7)])
    fixed = prism([(8, 8), (52, 19), (50, 31), (30, 33), (6, 27)], -7.5, 7.5)
    shank = limb([(-6, -8, 13, -7, 7), (-40, -9, 10.5, -6, 6), (-reach, -9, 12.5, -6, 6)])
    web = limb([(-45, -9, 6.5, -20, 20), (28 - reach, -9, 8.0, -20, 20)])
    hollow = web ^ (block((-500, 500), (-500, 500), (3.2, 20)) + block((-500, 500), (-500, 500), (-20, -3.2)))
    eye = rod(6, -20, 20).translate([-reach, -9, 0])
    rail = block((-26, 60), (-11, -3), (-4.2, 4.2))
    low = 18 - opening
    jaw = union([
        prism([(20, low - 16), (33, low - 14), (50, low - 3), (52, low), (20, low)], -7, 7),
        block((18, 23), (-11, low - 2), (-3.0, 3.0)), block((-14, 23), (-10.5, -3.6), (-3.8, 3.8)),
    ])  # fmt: skip
    worm = knurled(5.8, -8, 8, 18, 0.6).rotate([0, 90, 0]).translate([0, -15.2, 0])
    pocket = block((-8.0, 8.0), (-21.4, -9), (-20, 20))
    space = block((16, 80), (low - 20, 18), (-20, 20))
    body = union([head, fixed, shank]) - union([hollow, eye, rail, pocket, space])
    sleeve = limb([(-0.42 * reach, -9, 13.2, -8, 8), (-0.75 * reach, -9, 14.2, -8, 8), (11 - reach, -9, 14.4, -8, 8)])
    grip = sleeve - limb([(-0.3 * reach, -9, 6.5, -20, 20), (30 - reach, -9, 7.5, -20, 20)])
    steel = draw.pick(ALLOY_STEEL, CARBON_STEEL)
    pieces = scaled(k, [
        Piece("worm", worm, steel, (120, 122, 128)),
        Piece("jaw", jaw, steel),
        Piece("body", body, steel),
        Piece("grip", grip, draw.pick(PVC, FOAM_RUBBER)),
    ])  # fmt: skip
    return make_tool("adjustable-wrench", pieces, Grasp((-0.6 * reach * k, -9 * k, 0), "x", "z"), draw)


def socket_wrench(draw: Draw) -> Tool:
    """Return a ratchet with a socket on it: a gear hidden in the head, a selector on top and a grip."""
    k, reach, across = draw.scale(0.07), draw.size(152, 0.1), draw.size(15, 0.1)
    head = union([lathe([(15, -8), (16.5, -6), (16.5, 6), (15, 8)]), limb([(0, 0, 13, -6, 6), (26, 0, 6, -5.2, 5.2)])])
    stem = rod(5.4, 0, reach + 24, facets=28).rotate([0, 90, 0]).translate([22, 0, 0])
    chamber = rod(11.5, -5.6, 5.2)
    gear = knurled(11.5, -5.6, 4.6, 24, 0.9)
    drive = block((-4.75, 4.75), (-4.75, 4.75), (-20, -5.6)) + rod(6.4, -9, -5.6)
    socket = lathe([(11.2, -38), (11.5, -36), (11.5, -22), (9.8, -18), (9.8, -9.4)]) - union([
        hexagon(across, -40, -24), rod(0.4 * across, -26, -18), block((-4.75, 4.75), (-4.75, 4.75), (-22, -9)),
    ])  # fmt: skip
    lever = union([rod(5.5, 8, 11.5), limb([(0, 0, 4, 8.6, 11), (-12, 0, 2.6, 8.6, 11)])])
    y = 0.43 * reach
    sleeve = lathe([
        (8.2, y), (10.4, y + 5), (9.4, y + 16), (10.8, 0.7 * reach), (11.2, 0.86 * reach), (12.4, reach + 20),
        (11, reach + 27), (8, reach + 30),
    ]).rotate([0, 90, 0]).translate([22, 0, 0])  # fmt: skip
    mouth = rod(7, -12, -5.6)
    pieces = [
        Piece("gear and drive", gear + drive, draw.pick(ALLOY_STEEL, CARBON_STEEL), (110, 112, 116)),
        Piece("socket", socket, draw.pick(ALLOY_STEEL, CARBON_STEEL)),
        Piece("ratchet", union([head, stem]) - (chamber + mouth), draw.pick(ALLOY_STEEL, STAINLESS_STEEL)),
        Piece("selector", lever, draw.pick(NYLON, ZINC)),
        Piece("grip", sleeve, draw.pick(PVC, RUBBER)),
    ]
    pieces = scaled(k, pieces)
    return make_tool("socket-wrench", pieces, Grasp((0.8 * reach * k, 0, 0), "-x", "z"), draw)
