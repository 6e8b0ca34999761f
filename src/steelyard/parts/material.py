"""Material: a density with how far real pieces of it scatter."""

from __future__ import annotations

import re
from dataclasses import dataclass

from steelyard import check
from steelyard.errors import BadValue

_ONE = re.compile(r"(?P<name>[^=]+)=(?P<density>[^+±]+)(?:(?:\+-|±)(?P<percent>[^%]+)%)?")


@dataclass(frozen=True)
class Material:
    """Name, density [kg/m^3] and relative tolerance (one standard deviation) of a material."""

    name: str
    density: float
    tolerance: float = 0.02

    def __post_init__(self) -> None:
        check.positive(f"density of {self.name}", self.density)
        check.positive(f"tolerance of {self.name}", self.tolerance)


def materials_of(text: str) -> tuple[Material, ...]:
    """Return the materials of a list such as "steel=7850, rubber=1150+-5%" [kg/m^3]; raises BadValue."""
    materials = tuple(_material(part.strip()) for part in text.split(","))
    names = [material.name for material in materials]
    for name in names:
        if names.count(name) > 1:
            raise BadValue(f'"{name}" is listed twice; give two materials two names.')
    return materials


def _material(text: str) -> Material:
    said = _ONE.fullmatch(text)
    try:
        numbers = [] if said is None else [float(said[k]) for k in ("density", "percent") if said[k] is not None]
    except ValueError:
        numbers = []
    if said is None or not numbers:
        raise BadValue(
            "a material must be NAME=DENSITY or NAME=DENSITY+-PERCENT%, in kg/m^3, as in "
            f'"steel=7850, rubber=1150+-5%"; got {text!r}.'
        )
    return Material(said["name"].strip(), numbers[0], *(percent / 100 for percent in numbers[1:]))
