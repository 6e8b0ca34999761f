"""Materials of real tools: density, how far it varies from batch to batch, and usual colours."""

from __future__ import annotations

from dataclasses import dataclass

Colour = tuple[int, int, int]


@dataclass(frozen=True)
class Material:
    """A material.

    name       words of the field
    density    typical [kg/m^3]
    tolerance  how far batches differ from it, as a part of it
    colours    usual finishes, red green blue 0..255; the first is the usual one
    """

    name: str
    density: float
    tolerance: float
    colours: tuple[Colour, ...]


_BARE, _DARK, _CHROME = (168, 170, 174), (74, 76, 80), (206, 209, 214)
_RED, _BLUE, _YELLOW, _BLACK, _ORANGE = (186, 32, 34), (32, 74, 160), (240, 190, 24), (36, 36, 38), (232, 110, 26)

CARBON_STEEL = Material("carbon steel", 7850, 0.005, (_BARE, _DARK, (120, 124, 130)))
ALLOY_STEEL = Material("chrome-vanadium steel", 7800, 0.005, (_CHROME, _BARE, _DARK))
STAINLESS_STEEL = Material("stainless steel", 7750, 0.01, ((196, 198, 200), _CHROME))
BLACK_OXIDE_STEEL = Material("black-oxide steel", 7850, 0.005, ((52, 53, 58), (64, 60, 58)))
DUCTILE_IRON = Material("ductile iron", 7100, 0.02, ((40, 84, 150), _RED, (60, 66, 70), _ORANGE))
BRASS = Material("brass", 8500, 0.01, ((200, 164, 78), (184, 150, 70)))
ZINC = Material("zinc alloy", 6600, 0.01, ((228, 186, 30), _BARE, _RED))
ALUMINIUM = Material("aluminium", 2700, 0.01, ((188, 192, 198), _RED, _BLUE, _BLACK))
MAGNESIUM = Material("magnesium alloy", 1800, 0.02, ((150, 152, 156), _ORANGE))
FIBREGLASS = Material("fibreglass", 1900, 0.05, (_YELLOW, _BLUE, _ORANGE))
PVC = Material("PVC", 1380, 0.03, (_RED, _BLUE, _ORANGE, _BLACK))
ABS = Material("ABS", 1050, 0.02, (_BLACK, (70, 72, 78), _YELLOW))
NYLON = Material("glass-filled nylon", 1350, 0.03, (_BLACK, _RED, _BLUE))
ACETATE = Material("cellulose acetate", 1280, 0.02, ((236, 150, 20), _RED, _BLUE, (44, 132, 66)))
RUBBER = Material("rubber", 1150, 0.05, ((42, 42, 44), (60, 58, 56), (120, 118, 112)))
FOAM_RUBBER = Material("soft elastomer", 950, 0.05, (_BLUE, _BLACK, _RED))
HICKORY = Material("hickory", 800, 0.08, ((196, 150, 96), (178, 128, 78)))
ASH = Material("ash", 680, 0.08, ((214, 178, 126), (196, 156, 100)))
BEECH = Material("beech", 710, 0.08, ((206, 160, 112), (170, 60, 40)))
GLASS = Material("glass", 2500, 0.01, ((150, 172, 150), (140, 150, 160)))
BOARD = Material("circuit board", 1850, 0.05, ((30, 110, 60), (30, 70, 120)))
CELL = Material("button cell", 3500, 0.05, (_BARE, _CHROME))
