"""Pliers: two halves that cross at a lap joint, and the rivet through it; the jaws toward +x, the plane x, y."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import ALLOY_STEEL, BLACK_OXIDE_STEEL, BRASS, CARBON_STEEL, STAINLESS_STEEL
from steelyard.workshop.solids import Solid, block, limb, rod, smooth, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool

Station = tuple[float, float, float, float, float]  # x, y, radius, low, high


def halves(jaw: list[Station], handle: list[Station], radius: float, thick: float) -> tuple[Solid, Solid]:
    """Return the two halves of pliers with the joint at the origin.

    The first has its jaw above the x axis and its handle below; the second is its mirror image. In the disc of
    `radius` around the joint each keeps half of the thickness.
    """
    disc = rod(radius, -thick / 2, thick / 2, facets=40)
    upper = limb(jaw) - block((-500, 500), (-500, 0), (-50, 50))
    first = union([upper, limb(handle), disc])
    second = first.mirror([0, 1, 0])
    lap = rod(radius + 0.3, -50, 50, facets=40)
    above, below = block((-500, 500), (-500, 500), (0, 50)), block((-500, 500), (-500, 500), (-50, 0))
    return first - (lap ^ above), second - (lap ^ below)


def scaled(stations: list[Station], factor: float) -> list[Station]:
    """Return stations with all lengths times `factor`."""
    return [tuple(factor * value for value in row) for row in stations]  # type: ignore[misc]


def bent_jaw_pliers(draw: Draw) -> Tool:
    """Return long-nose pliers whose jaws bend out of the plane, in one colour."""
    k, nose, spread = draw.scale(0.08), draw.size(62, 0.12), draw.size(24, 0.12)
    jaw: list[Station] = scaled([
        (0, 3, 8.5, -5.5, 5.5), (0.30 * nose, 4.2, 5.6, -5, 5), (0.62 * nose, 3.0, 4.0, -4, 4.5),
        (0.88 * nose, 2.2, 3.0, 2, 8.5), (1.08 * nose, 1.8, 2.2, 9.5, 14.5),
    ], k)  # fmt: skip
    handle: list[Station] = scaled([
        (0, 0, 9, -5.5, 5.5), (-17, -8, 6.0, -5, 5), (-42, -0.8 * spread, 4.9, -4.4, 4.4),
        (-85, -spread, 4.9, -4.2, 4.2), (-122, -0.86 * spread, 5.2, -4, 4),
    ], k)  # fmt: skip
    first, second = halves(jaw, smooth(handle), 11.5 * k, 11 * k)
    grooves = [block((x, x + 0.8), (-0.6, 0.6), (-20, 30)) for x in range(int(0.5 * nose * k), int(0.9 * nose * k), 3)]
    steel = draw.pick(ALLOY_STEEL, CARBON_STEEL)
    pieces = [
        Piece("rivet", rod(4.2 * k, -6.2 * k, 6.2 * k), draw.pick(BRASS, STAINLESS_STEEL)),
        Piece("lower half", first - union(grooves), steel),
        Piece("upper half", second - union(grooves), steel),
    ]
    grasp, paint = Grasp((-70 * k, 0, 0), "x", "z"), draw.colour(steel)
    return make_tool("bent-jaw-pliers", pieces, grasp, draw, finish="shaded", one_colour=paint)


def pliers(draw: Draw) -> Tool:
    """Return heavy slip-joint pliers in one colour: broad toothed jaws and long curved handles."""
    k, spread = draw.scale(0.08), draw.size(26, 0.12)
    jaw: list[Station] = scaled([
        (0, 5, 11, -8, 8), (20, 7, 8.5, -7.5, 7.5), (38, 6, 7, -7, 7), (53, 3.6, 4.6, -6.2, 6.2),
    ], k)  # fmt: skip
    handle: list[Station] = scaled([
        (0, 0, 13, -8, 8), (-28, -12, 7.6, -7.6, 7.6), (-60, -0.85 * spread, 6.6, -7, 7),
        (-110, -spread, 6.4, -6.8, 6.8), (-150, -0.95 * spread, 6.4, -6.6, 6.6), (-181, -0.72 * spread, 6, -6.4, 6.4),
    ], k)  # fmt: skip
    first, second = halves(jaw, smooth(handle), 15.5 * k, 16 * k)
    mouth = rod(5.2 * k, -50, 50).translate([26 * k, 0, 0])
    teeth = [block((x * k, (x + 1.1) * k), (-0.9, 0.9), (-20, 20)) for x in (36, 39, 42, 45, 48, 51)]
    cut = union([mouth, *teeth])
    steel = draw.pick(BLACK_OXIDE_STEEL, ALLOY_STEEL)
    pieces = [
        Piece("rivet", rod(5.5 * k, -8.9 * k, 8.9 * k), steel),
        Piece("lower half", first - cut, steel),
        Piece("upper half", second - cut, steel),
    ]
    paint = draw.colour(steel)
    return make_tool("pliers", pieces, Grasp((-100 * k, 0, 0), "x", "z"), draw, one_colour=paint)
