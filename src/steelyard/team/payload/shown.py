"""Which directions of the parameters the rows show, once biases and gains are integrated out."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Mask

# What a body of this mass and size could be: a direction whose error is not below this share of it is lost.
SHOWN = 0.3
# Information below this share of the largest is rounding.
RANK = 1e-11


class Shown(NamedTuple):
    """Directions (..., P, P), as columns, in units of what a body can be.

    values  (..., P) information about each, rising     told  (..., P) whether the rows show it
    """

    values: Array
    vectors: Array
    told: Mask

    @classmethod
    def of(cls, information: Array, noise: Array) -> Shown:
        """Return the directions of an information (..., P, P), less what noise in the motion adds to it (P, P).

        What noise in the motion alone would seem to say is known to no better than its own size.
        """
        values, vectors = np.linalg.eigh(information - noise)
        seeming = np.einsum("...pk,pq,...qk->...k", vectors, noise, vectors)
        told = (values > SHOWN**-2.0) & (values > RANK * values[..., -1:]) & (values > seeming)
        return cls(values, vectors, np.asarray(told))

    @property
    def inverse(self) -> Array:
        """The inverse information (..., P, P) in what is shown, zero in what is lost."""
        each = np.where(self.told, 1 / np.where(self.told, self.values, 1.0), 0.0)
        return np.asarray((self.vectors * each[..., None, :]) @ self.vectors.swapaxes(-1, -2))

    @property
    def lost(self) -> Array:
        """The directions (P, L) that are lost, of one information."""
        return self.vectors[:, ~self.told]

    @property
    def condition(self) -> float:
        """The condition number in what is shown, of one information; infinite where nothing is."""
        return float(np.sqrt(self.values[-1] / self.values[self.told][0])) if self.told.any() else np.inf
