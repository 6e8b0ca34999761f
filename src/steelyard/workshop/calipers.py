"""Electronic caliper; the beam along x, its face toward +z."""

from __future__ import annotations

from steelyard.workshop.draw import Draw
from steelyard.workshop.materials import (
    ABS,
    ALUMINIUM,
    BOARD,
    BRASS,
    CARBON_STEEL,
    CELL,
    GLASS,
    NYLON,
    RUBBER,
    STAINLESS_STEEL,
)  # fmt: skip
from steelyard.workshop.solids import Solid, block, knurled, prism, rod, rounded, union
from steelyard.workshop.tools import Grasp, Piece, Tool, make_tool, scaled

_BUTTONS = ((200, 60, 50), (60, 120, 200), (225, 225, 225))


def jaws(reach: float, upper: float, thick: float) -> Solid:
    """Return a lower and an upper jaw whose measuring edge lies on x = 0, in z from 0 to `thick`."""
    lower = prism([(0, -6), (0, -reach), (-2.4, -reach), (-8, -0.55 * reach), (-14, -7)], 0, thick)
    above = prism([(0, 6), (-1.2, upper), (-2.6, upper), (-9, 7)], 0, 0.6 * thick)
    return union([lower, above, block((-15, 0), (-8, 8), (0, thick))])


def electronic_caliper(draw: Draw) -> Tool:
    """Return a digital caliper of fourteen parts; the circuit board and the cell inside the housing are hidden."""
    k, length, reach, at = draw.scale(0.06), draw.size(220, 0.08), draw.size(41, 0.1), draw.size(18, 0.6)
    beam = union([block((-1, length), (-8, 8), (0, 3.3)), jaws(reach, 21, 3.3)]) - block(
        (22, length + 1), (-1.8, 1.8), (-1, 1.5)
    )
    channel = block((-99, 999), (-8, 8), (0, 3.3))
    moving = jaws(reach, 21, 3.3).mirror([1, 0, 0])
    slider = (union([block((0, 60), (-11.5, 11.5), (-1.5, 4.7)), moving]) - channel).translate([at, 0, 0])
    low, high = at + 2, at + 74
    inner = rounded((low + 2.0, high - 2.0), (-14, 14), (6.2, 11.6), 2)
    housing = union([rounded((low, high), (-16, 16), (4.7, 13.4), 4), block((at + 60, high - 1), (-13, 13), (3.3, 5))])
    frame_x, frame_y = (low + 9, low + 49), (-5.5, 9.5)
    inside_x, inside_y = (frame_x[0] + 2, frame_x[1] - 2), (frame_y[0] + 2, frame_y[1] - 2)
    bezel = rounded(frame_x, frame_y, (11.6, 14.0), 2) - rounded(inside_x, inside_y, (11, 15), 1)
    window = rounded(inside_x, inside_y, (11.6, 13.6), 1)
    buttons = [rod(3.0, 11.6, 14.4).translate([low + x, -10.5, 0]) for x in (14, 28, 42)]
    board = block((low + 4, low + 52), (-12, 12), (6.2, 7.8))
    cell = rod(5.8, 6.2, 11.4).translate([high - 11, 3, 0])
    cover = rounded((high - 19, high - 4), (-5.5, 11.5), (11.6, 13.9), 2)
    wheel = knurled(5.5, -0.5, 4, 16, 0.5).translate([at + 46, -15.5, 0])
    screw = union([rod(3.4, 11.5, 19), rod(1.6, 8.0, 12)]).rotate([-90, 0, 0]).translate([at + 26, 0, 1.6])
    depth = block((23, length + 0.4 * at), (-1.8, 1.8), (-0.2, 1.5))
    pieces = [
        Piece("depth rod", depth, STAINLESS_STEEL, (150, 152, 156)),
        Piece("beam", beam, draw.pick(STAINLESS_STEEL, CARBON_STEEL)),
        Piece("lock screw", screw, draw.pick(BRASS, CARBON_STEEL)),
        Piece("thumb wheel", wheel, draw.pick(CARBON_STEEL, ALUMINIUM), (110, 112, 118)),
        Piece("slider", slider, draw.pick(STAINLESS_STEEL, CARBON_STEEL)),
        Piece("window", window, GLASS),
        Piece("bezel", bezel, draw.pick(ALUMINIUM, ABS)),
        *[Piece(f"button {n + 1}", solid, RUBBER, _BUTTONS[n]) for n, solid in enumerate(buttons)],
        Piece("cell cover", cover, draw.pick(ABS, NYLON), (90, 92, 98)),
        Piece("board", board, BOARD),
        Piece("cell", cell, CELL),
        Piece("housing", housing - inner, draw.pick(ABS, NYLON)),
    ]
    pieces = scaled(k, pieces)
    return make_tool("electronic-caliper", pieces, Grasp(((at + 38) * k, 0, 4 * k), "x", "z"), draw)
