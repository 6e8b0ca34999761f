"""Draws of sizes and materials: the nominal ones, or those of a random variant."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.workshop.materials import Colour, Material


@dataclass(frozen=True)
class Draw:
    """Where a tool's sizes and materials come from: nominal without a generator, random with one."""

    rng: np.random.Generator | None = None

    def size(self, nominal: float, spread: float = 0.1) -> float:
        """Return a size within `spread` (a part) of the nominal one, same unit."""
        return nominal if self.rng is None else nominal * (1 + self.rng.uniform(-spread, spread))

    def sizes(self, *nominal: float, spread: float = 0.1) -> tuple[float, ...]:
        """Return sizes, each drawn on its own."""
        return tuple(self.size(value, spread) for value in nominal)

    def scale(self, spread: float = 0.1) -> float:
        """Return a factor for all sizes of a tool."""
        return self.size(1.0, spread)

    def pick(self, *choices: Material) -> Material:
        """Return one of the materials, the first without a generator."""
        return choices[0] if self.rng is None else choices[int(self.rng.integers(len(choices)))]

    def colour(self, material: Material) -> Colour:
        """Return one of the material's usual colours."""
        return material.colours[0 if self.rng is None else int(self.rng.integers(len(material.colours)))]

    def density(self, material: Material) -> float:
        """Return a density within the material's tolerance [kg/m^3]."""
        return self.size(material.density, material.tolerance)

    def sign(self) -> float:
        """Return 1, or with a generator 1 or -1."""
        return 1.0 if self.rng is None or self.rng.random() < 0.5 else -1.0
