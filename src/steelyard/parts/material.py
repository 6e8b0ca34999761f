"""Material: a density with how far real pieces of it scatter."""

from __future__ import annotations

from dataclasses import dataclass

from steelyard import check


@dataclass(frozen=True)
class Material:
    """Name, density [kg/m^3] and relative tolerance (one standard deviation) of a material."""

    name: str
    density: float
    tolerance: float = 0.02

    def __post_init__(self) -> None:
        check.positive(f"density of {self.name}", self.density)
        check.positive(f"tolerance of {self.name}", self.tolerance)
