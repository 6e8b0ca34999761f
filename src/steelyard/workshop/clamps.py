"""Clamps: C clamp, bar clamp, and a small vise that clamps to a table."""

from __future__ import annotations

import numpy as np

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import (
    ABS,
    ALLOY_STEEL,
    ALUMINIUM,
    BEECH,
    BRASS,
    CARBON_STEEL,
    DUCTILE_IRON,
    MAGNESIUM,
    NYLON,
    PVC,
    RUBBER,
    ZINC,
)  # fmt: skip
from steelyard.workshop.solids import Solid, ball, block, chain, hexagon, lathe, limb, rod, threaded, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool, scaled


def upright(solid: Solid) -> Solid:
    """Return a solid along z turned so that it lies along y."""
    return solid.rotate([-90, 0, 0])


def frame(path: list[tuple[float, float]], thick: float, width: float) -> Solid:
    """Return a bar of square section, `thick` in the plane and `width` across it, along a path in x, y."""
    a, b = thick / 2, width / 2
    return chain([block((-a, a), (-a, a), (-b, b)).translate([x, y, 0]) for x, y in path])


def c_clamp(draw: Draw) -> Tool:
    """Return a C clamp: a ribbed iron frame, a screw in a bushing, a sliding bar and a swivel foot."""
    k, throat, mouth, open_ = draw.scale(0.07), draw.size(58, 0.1), draw.size(100, 0.1), draw.size(46, 0.3)
    low, top = -mouth / 2, mouth / 2
    path = [(4, low - 8), (-0.7 * throat, low - 7), (-throat - 5, low + 14), (-throat - 5, top - 12),
            (-0.7 * throat, top + 8), (4, top + 9)]  # fmt: skip
    rib, flange = frame(path, 15, 8.5), frame([(x - 4.5 * (x < -20), y + np.sign(y) * 4) for x, y in path], 5.5, 21)
    boss = upright(rod(11.5, -9, 9)).translate([0, top + 9, 0])
    anvil = upright(rod(10, -3, 4)).translate([0, low - 1.2, 0])
    foot_y = low + open_
    screw = union([
        upright(threaded(6.4, foot_y + 7, top + 52, 2.4, 0.9)), upright(rod(8.0, top + 50, top + 66)),
        ball((0, foot_y + 5, 0), 4.6),
    ])  # fmt: skip
    bar_y = top + 58
    bar = rod(2.9, -33, 33, facets=20).translate([0, bar_y, 0]) + union(
        [ball((0, bar_y, z), 4.4, 16) for z in (-33, 33)]
    )
    foot = upright(lathe([(10, foot_y), (10.5, foot_y + 3), (7, foot_y + 8)], 28))
    bushing = upright(lathe([(8.4, top - 1), (8.4, top + 18), (10.2, top + 18), (10.2, top + 21)]))
    pieces = scaled(k, [
        Piece("bar", bar, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("screw", screw, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("foot", foot, draw.pick(BRASS, ZINC)),
        Piece("bushing", bushing, BRASS),
        Piece("frame", union([rib, flange, boss, anvil]), draw.pick(DUCTILE_IRON, ZINC)),
    ])  # fmt: skip
    return make_tool("c-clamp", pieces, Grasp((-k * (throat + 5), 0, 0), "x", "y"), draw)


def clamp(draw: Draw) -> Tool:
    """Return a bar clamp: a flat bar with a fixed arm, a sliding arm, a screw with a handle and a padded foot."""
    k, length, reach, gap = draw.scale(0.07), draw.size(206, 0.1), draw.size(66, 0.1), draw.size(62, 0.25)
    bar = block((-7, 7), (0, length), (-2.6, 2.6)) - union([
        block((-9, -6.6), (y, y + 1.2), (-5, 5)) for y in np.arange(20, length - 20, 3.5)
    ])  # fmt: skip
    top = length - 2
    fixed = limb([(0, top - 6, 8.5, -4.6, 4.6), (-0.5 * reach, top - 2, 5.4, -4, 4), (-reach, top - 6, 6.5, -5.4, 5.4)])
    at = top - gap - 24
    sliding = limb([(0, at, 12, -5.2, 5.2), (-0.5 * reach, at, 6.5, -4.2, 4.2), (-reach, at, 7.5, -6, 6)])
    screw = upright(threaded(4.1, at - 62, at + 18, 2.0, 0.6)).translate([-reach, 0, 0])
    foot = upright(lathe([(6, at + 14), (8.5, at + 19), (8.5, at + 21.5)], 28)).translate([-reach, 0, 0])
    pads = [
        upright(lathe([(9.6, at + 17.6), (9.6, at + 24)], 28)).translate([-reach, 0, 0]),
        upright(lathe([(9.6, top - 15.5), (9.6, top - 9)], 28)).translate([-reach, 0, 0]),
    ]
    grip = lathe([
        (7, at - 118), (12, at - 115), (13, at - 104), (11.2, at - 84), (12.4, at - 62), (9.6, at - 44), (7, at - 42),
    ])  # fmt: skip
    pieces = scaled(k, [
        Piece("bar", bar, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("screw", screw, draw.pick(CARBON_STEEL, ALLOY_STEEL), (66, 68, 72)),
        Piece("foot", foot, draw.pick(CARBON_STEEL, BRASS)),
        Piece("fixed arm", fixed, draw.pick(CARBON_STEEL, DUCTILE_IRON), (150, 30, 30)),
        Piece("sliding arm", sliding, draw.pick(CARBON_STEEL, DUCTILE_IRON), (150, 30, 30)),
        Piece("handle", upright(grip).translate([-reach, 0, 0]), draw.pick(PVC, BEECH, NYLON), (222, 140, 40)),
        Piece("pads", union(pads), RUBBER),
    ])  # fmt: skip
    return make_tool("clamp", pieces, Grasp((0, 0.35 * length * k, 0), "y", "-x"), draw)


def vise_clamp(draw: Draw) -> Tool:
    """Return a small table vise: body, moving jaw, spindle in a hidden nut, bar with caps, clamp screw with a pad."""
    k, jaw, gap, tall = draw.scale(0.07), draw.size(21, 0.1), draw.size(15, 0.25), draw.size(36, 0.08)
    front, z = 11 + gap, 22.0
    body = union([
        block((0, 66), (-14, 14), (0, 10)), block((0, 11), (-jaw, jaw), (4, tall)), block((0, 9), (-12, 12), (-40, 2)),
        limb([(4.5, 0, 12, -48, -39), (26, 0, 9, -48, -39)]), block((62, 72), (-13, 13), (0, 32)),
    ]) - block((11, 100), (-8, 8), (3.2, 10))  # fmt: skip
    shell = block((1.5, 9.5), (2 - jaw, jaw - 2), (6, tall - 3)) ^ block((-9, 99), (-99, 99), (8, tall - 12))
    moving = union([
        block((front, front + 11), (-jaw, jaw), (10, tall)), block((front, front + 26), (-7.9, 7.9), (3.2, 10)),
        limb([(front + 8, 0, 9, 10, 30), (front + 18, 0, 7, 10, 28)]),
    ])  # fmt: skip
    spindle = union([threaded(4.2, front + 12, 86, 2.0, 0.6), rod(6.5, 84, 97)]).rotate([0, 90, 0]).translate([0, 0, z])
    nut = hexagon(14, 63.5, 70.5).rotate([0, 90, 0]).translate([0, 0, z])
    bar = rod(2.3, -26, 26, facets=18).rotate([90, 0, 0]).translate([91, 0, z])
    caps = [ball((91, side * 27, z), (5, 6, 5), 16) for side in (-1, 1)]
    screw = union([threaded(3.9, -72, -15, 1.8, 0.5), block((-13, 13), (-2.2, 2.2), (-78, -66))]).translate([24, 0, 0])
    pad = lathe([(9.5, -18), (10, -12.5), (9, -11)], 28).translate([24, 0, 0])
    pieces = scaled(k, [
        Piece("bar", bar, CARBON_STEEL),
        Piece("left cap", caps[0], draw.pick(PVC, NYLON), (30, 30, 32)),
        Piece("right cap", caps[1], draw.pick(PVC, NYLON), (30, 30, 32)),
        Piece("spindle", spindle, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("nut", nut, draw.pick(BRASS, CARBON_STEEL)),
        Piece("pad", pad, draw.pick(RUBBER, ABS)),
        Piece("clamp screw", screw, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("moving jaw", moving, draw.pick(ALUMINIUM, MAGNESIUM, ZINC), (40, 84, 150)),
        Piece("body", body - shell, draw.pick(ALUMINIUM, MAGNESIUM, ZINC), (40, 84, 150)),
    ])  # fmt: skip
    return make_tool("vise-clamp", pieces, Grasp((30 * k, 0, 5 * k), "x", "z"), draw)
