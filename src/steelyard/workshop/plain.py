"""Tools of one part: allen key, box wrench, measuring tape, ruler."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import ALLOY_STEEL, ALUMINIUM, BLACK_OXIDE_STEEL, CARBON_STEEL, STAINLESS_STEEL, ZINC
from steelyard.workshop.solids import block, elbow, hexagon, limb, prism, ring, rod, rounded, star, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool


def allen_key(draw: Draw) -> Tool:
    """Return an L of hexagonal bar; the long arm lies along y."""
    across, long, short = draw.sizes(9.4, 152, 32)
    bend = 1.8 * across
    arm = hexagon(across, -long, 0).rotate([0, 90, 0]).rotate([0, 0, 90])  # along -y, flats across x
    foot = hexagon(across, -short, 0).rotate([0, 90, 0])
    solid = union([
        elbow(across, bend), arm.translate([bend, 0, 0]), foot.translate([0, bend, 0]),
    ])  # fmt: skip
    piece = Piece("key", solid, draw.pick(ALLOY_STEEL, BLACK_OXIDE_STEEL), (58, 59, 64))
    return make_tool("allen-key", [piece], Grasp((bend, -0.75 * long, 0), "y", "z"), draw)


def box_wrench(draw: Draw) -> Tool:
    """Return a double box wrench: two offset rings with twelve points on an oval shank along x."""
    length, large, small, thick = draw.sizes(205, 17.5, 15.5, 12)
    shank = limb([(0, 0, 6.5, -3.4, 3.4), (length / 2, 0, 5.6, -3.0, 3.0), (length, 0, 6.0, -3.2, 3.2)])
    heads = [
        rod(large, -thick / 2, thick / 2).translate([0, 0, 1.5]),
        rod(small, -thick / 2, thick / 2 - 1).translate([length, 0, 1.5]),
    ]
    openings = [
        star(0.6 * large, 0.9 * (0.6 * large), 12, -20, 20),
        star(0.6 * small, 0.9 * (0.6 * small), 12, -20, 20).translate([length, 0, 0]),
    ]
    solid = union([shank, *heads]) - union(openings)
    piece = Piece("wrench", solid, draw.pick(ALLOY_STEEL, CARBON_STEEL))
    return make_tool("box-wrench", [piece], Grasp((0.4 * length, 0, 0), "x", "z"), draw, finish="shaded")


def measuring_tape(draw: Draw) -> Tool:
    """Return a tape measure: a hollow case with a hub inside, a thumb lock and the hooked end of the blade."""
    width, height, depth, wall = draw.sizes(61, 54, 24, 1.3, spread=0.08)
    outer = union([
        rounded((0, width), (0, height), (0, depth), 16),
        block((width - 22, width), (0, 18), (0, depth)),
    ])  # fmt: skip
    inner = rounded((wall, width - wall), (wall, height - wall), (wall, depth - wall), 15) - rod(9, -1, 50).translate(
        [width / 2, height / 2, 0]
    )
    mouth = rod(3.5, 0, depth).translate([width - 4, height + 0.5, 0])
    lock = rounded((0.55 * width, 0.85 * width), (height - 3, height + 2.5), (0.3 * depth, 0.7 * depth), 2)
    blade = block((width - 0.2, width + 7), (1, 2.0), (0.2 * depth, 0.8 * depth))
    hook = block((width + 6, width + 7.2), (-6, 2.0), (0.2 * depth, 0.8 * depth))
    rim = ring(0.34 * height, 0.30 * height, depth - 0.1, depth + 0.8).translate([width / 2 - 4, height / 2, 0])
    solid = union([outer - inner, lock, blade, hook, rim]) - mouth
    piece = Piece("case", solid, ZINC, (240, 190, 24))
    return make_tool("measuring-tape", [piece], Grasp((width / 2, height / 2, depth / 2), "x", "y"), draw)


def ruler(draw: Draw) -> Tool:
    """Return a thin ruler with one bevelled edge, a hole, and shallow marks."""
    length, width, thick = draw.sizes(164, 21, 1.05)
    bevelled = [(0, 0), (width, 0), (width, thick), (0.25 * width, thick), (0, 0.45 * thick)]
    blade = prism(bevelled, 0, length).rotate([90, 0, 0]).rotate([0, 0, 90])
    hole = rod(0.14 * width, -5, 5).translate([length - 0.4 * width, 0.5 * width, 0])
    marks = [
        block((10 * k + 2, 10 * k + 2.5), (width * (0.6 if k % 5 else 0.45), width + 1), (thick - 0.12, thick + 1))
        for k in range(1, int(length / 10) - 1)
    ]
    piece = Piece("ruler", blade - hole - union(marks), draw.pick(ALUMINIUM, STAINLESS_STEEL))
    return make_tool("ruler", [piece], Grasp((0.15 * length, width / 2, thick / 2), "x", "z"), draw)
