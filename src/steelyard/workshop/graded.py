"""The graded families: tools with parts that are not homogeneous, where Assumption 1 of the paper breaks.

Source: "The Sum of Its Parts", section III, Assumption 1; what is uneven is what real tools have: castings with
porosity, pressed and sintered heads, wood of uneven growth, shot and ballast within a closed shell.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType

from steelyard.workshop.draw import Draw
from steelyard.workshop.grading import Fall, Grading, Layer, layers
from steelyard.workshop.materials import ALUMINIUM, ASH, BRASS, CARBON_STEEL, RUBBER, ZINC

# Loose steel shot fills six tenths of its space.
SHOT = 0.6 * CARBON_STEEL.density


def _falls(part: str, draw: Draw, axis: tuple[float, float, float], share: float, what: str) -> Grading:
    """Return a linear fall of about `share`, the heavier end drawn."""
    size, sign = draw.size(share, 0.3), draw.sign()
    along = (sign * axis[0], sign * axis[1], sign * axis[2])
    direction = ("-" if sign < 0 else "") + "xyz"[axis.index(1)]
    return Grading(
        part, Fall(along, size), f"{what}: density falls linearly along {direction} by {size:.3g} of its mean"
    )


def machinist_hammer(draw: Draw) -> tuple[Grading, ...]:
    """Wood that is denser toward one end of the handle."""
    return (_falls("handle", draw, (0, 1, 0), 0.6, "uneven growth"),)


def hammer(draw: Draw) -> tuple[Grading, ...]:
    """A pressed and sintered head, densest at the striking face."""
    return (_falls("head", draw, (1, 0, 0), 0.3, "sintered"),)


def c_clamp(draw: Draw) -> tuple[Grading, ...]:
    """A cast frame whose porosity grows from one end to the other."""
    return (_falls("frame", draw, (0, 1, 0), 0.35, "cast"),)


def box_wrench(draw: Draw) -> tuple[Grading, ...]:
    """A sintered wrench of one part."""
    return (_falls("wrench", draw, (1, 0, 0), 0.4, "sintered"),)


def rubber_mallet(draw: Draw) -> tuple[Grading, ...]:
    """A dead-blow head: steel shot behind one of its faces."""
    share = draw.size(0.3, 0.3)
    start, end = (0.0, share) if draw.sign() > 0 else (1 - share, 1.0)
    return (Grading("head", (Layer(0, start, end, SHOT),), f"steel shot in {share:.2g} of its length along x"),)


def screwdriver(draw: Draw) -> tuple[Grading, ...]:
    """A slug of ballast in the end of the handle."""
    share = draw.size(0.2, 0.3)
    slug = Layer(2, 0.0, share, draw.pick(ZINC, BRASS).density)
    return (Grading("handle", (slug,), f"ballast in {share:.2g} of its length along z"),)


def vise_clamp(draw: Draw) -> tuple[Grading, ...]:
    """Two castings with porosity: the body and the jaw that moves."""
    return (
        _falls("body", draw, (1, 0, 0), 0.4, "cast"),
        _falls("moving jaw", draw, (0, 0, 1), 0.4, "cast"),
    )


def adjustable_wrench(draw: Draw) -> tuple[Grading, ...]:
    """A body laminated of steel and light metal along its length."""
    share = draw.size(0.5, 0.3)
    stack = layers(0, [(share, CARBON_STEEL), (1 - share, draw.pick(ZINC, BRASS))])
    return (Grading("body", stack, f"laminated: changes material at {share:.2g} of its length along x"),)


def file(draw: Draw) -> tuple[Grading, ...]:
    """A handle pressed of layers of ash, rubber and aluminium."""
    ends = draw.size(0.3, 0.3)
    stack = layers(2, [(ends, ALUMINIUM), (0.6 - ends, RUBBER), (0.4, ASH)])
    return (Grading("handle", stack, "laminated along z: aluminium, rubber, ash"),)


GRADED: Mapping[str, Callable[[Draw], tuple[Grading, ...]]] = MappingProxyType({
    "box-wrench": box_wrench,
    "screwdriver": screwdriver,
    "rubber-mallet": rubber_mallet,
    "machinist-hammer": machinist_hammer,
    "c-clamp": c_clamp,
    "adjustable-wrench": adjustable_wrench,
    "hammer": hammer,
    "file": file,
    "vise-clamp": vise_clamp,
})  # fmt: skip
