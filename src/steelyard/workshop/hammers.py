"""Struck tools: rubber mallet, machinist hammer, claw hammer; the handle along y, the head at the top."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import (
    ALLOY_STEEL,
    ALUMINIUM,
    ASH,
    BEECH,
    CARBON_STEEL,
    FIBREGLASS,
    FOAM_RUBBER,
    HICKORY,
    PVC,
    RUBBER,
)  # fmt: skip
from steelyard.workshop.solids import ROUND, Solid, ball, block, chain, hull, lathe, prism, rod, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool


def oval_handle(stations: list[tuple[float, float, float]]) -> Solid:
    """Return a bar along y through ovals (y, half width in x, half width in z), rounded at the low end."""
    discs = [
        rod(1, -0.02, 0.02, facets=ROUND).rotate([90, 0, 0]).scale([a, 1, b]).translate([0, y, 0])
        for y, a, b in stations
    ]
    return chain(discs)


def rubber_mallet(draw: Draw) -> Tool:
    """Return a mallet: a rubber barrel on a turned wooden handle that shows at the top."""
    radius, length, reach, grip = draw.sizes(25.5, 78, 232, 12.6)
    barrel = lathe([
        (0.88 * radius, -length / 2), (radius, -length / 2 + 4), (radius, length / 2 - 4), (0.88 * radius, length / 2),
    ], 48)  # fmt: skip
    head = barrel.rotate([0, 90, 0]).translate([0, reach, 0])
    handle = oval_handle([
        (0, 0.75 * grip, 0.7 * grip), (6, grip, 0.95 * grip), (60, 1.06 * grip, grip), (110, 0.92 * grip, 0.86 * grip),
        (reach - radius - 12, 0.95 * grip, 0.9 * grip), (reach, 0.8 * grip, 0.8 * grip),
        (reach + radius + 1.5, 0.84 * grip, 0.84 * grip),
    ])  # fmt: skip
    pieces = [Piece("handle", handle, draw.pick(ASH, BEECH, HICKORY)), Piece("head", head, draw.pick(RUBBER, PVC))]
    return make_tool("rubber-mallet", pieces, Grasp((0, 50, 0), "y", "-x"), draw)


def machinist_hammer(draw: Draw) -> Tool:
    """Return a small ball-peen hammer: a steel head on an oval hickory handle."""
    face, length, reach = draw.sizes(10.0, 64, 212)
    along = lathe([
        (0.86 * face, -0.5 * length), (face, -0.5 * length + 2), (face, -0.27 * length), (0.7 * face, -0.2 * length),
        (0.86 * face, -0.1 * length), (0.86 * face, 0.1 * length), (0.55 * face, 0.2 * length),
        (0.6 * face, 0.3 * length),
    ])  # fmt: skip
    peen = ball((0, 0, 0.36 * length), 0.8 * face)
    head = union([along, peen]).rotate([0, 90, 0]).translate([0, reach, 0])
    handle = oval_handle([
        (0, 7.4, 6.0), (5, 9.4, 7.4), (45, 9.8, 7.6), (80, 8.4, 6.6), (140, 6.4, 5.2), (reach - face - 4, 7.0, 5.4),
        (reach - face, 5.6, 4.8), (reach + face + 1, 5.8, 5.0),
    ])  # fmt: skip
    pieces = [
        Piece("handle", handle, draw.pick(HICKORY, ASH)),
        Piece("head", head, draw.pick(CARBON_STEEL, ALLOY_STEEL)),
    ]
    return make_tool("machinist-hammer", pieces, Grasp((0, 55, 0), "y", "-x"), draw, finish="scuffed")


def hammer(draw: Draw) -> Tool:
    """Return a claw hammer: a steel head, a shaft, and a grip around the end of the shaft."""
    face, claw, reach, grip = draw.sizes(15, 70, 290, 122)
    shaft = oval_handle([(12, 9.8, 7.2), (150, 9.6, 7.2), (reach - 30, 10.4, 7.6), (reach + 14, 9.6, 7.0)])
    sleeve = oval_handle([
        (0, 17, 13), (8, 19.5, 14.6), (30, 17.5, 13.6), (60, 18.6, 14.2), (grip - 12, 16, 12.5), (grip, 13, 10),
    ])  # fmt: skip
    rings = [block((-25, 25), (y, y + 2.2), (-20, -12.2)) + block((-25, 25), (y, y + 2.2), (12.2, 20))
             for y in (24.0, 36.0, 48.0, 60.0, 72.0, 84.0)]  # fmt: skip
    pieces = [
        Piece("shaft", shaft, draw.pick(ALUMINIUM, FIBREGLASS)),
        Piece("head", _claw_head(face, claw, reach), draw.pick(CARBON_STEEL, ALLOY_STEEL)),
        Piece("grip", sleeve - union(rings), draw.pick(RUBBER, FOAM_RUBBER)),
    ]
    return make_tool("hammer", pieces, Grasp((0, 62, 0), "y", "-x"), draw)


def _claw_head(face: float, claw: float, reach: float) -> Solid:
    """Return the head: striking face toward -x, a neck, the eye, and two curved claws toward +x."""
    pole = lathe(
        [(0.86 * face, -53), (face, -50), (face, -36), (0.72 * face, -26), (0.78 * face, -10), (0.78 * face, 0)]
    )
    eye = hull(block((-15, 15), (-13, 13), (-11.5, 11.5)), block((-18, 18), (-9, 9), (-10, 10)))
    outline = [
        (8, 11), (30, 10), (0.72 * claw, 3), (claw, -13), (0.96 * claw, -14), (0.66 * claw, -4.5), (28, -1), (8, -10),
    ]  # fmt: skip
    blade = prism(outline, -13.5, 13.5)
    slot = hull(block((30, 31), (-40, 40), (-0.8, 0.8)), block((claw + 6, claw + 7), (-40, 40), (-4.2, 4.2)))
    return union([pole.rotate([0, 90, 0]), eye, blade - slot]).translate([0, reach, 0])
