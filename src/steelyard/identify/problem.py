"""Problem: what every estimator solves, a statistic per class of rows with its noise, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.regressor import design
from steelyard.logs.moments import Integers, Moments

# Row counts below this cannot fix four numbers and a bias whatever they hold.
FEWEST_ROWS = 2


@dataclass(frozen=True, eq=False)
class Problem:
    """Scatter (C, Z, Z), variances of acceleration and wrench (C, 6) each, and whether a constant bias is free.

    classes       (C,) number of each class in the log
    blocks        (B, Z, Z) the same rows by still pose or time block, and their class (B,), for hold-out
    """

    scatter: Array
    acceleration: Array
    wrench: Array
    with_bias: bool
    classes: Integers
    blocks: Array
    block_class: Integers
    block_number: Integers
    still_samples: float = 0.0

    @classmethod
    def of(cls, moments: Moments, with_bias: bool) -> Problem:
        """Return the problem of a statistic whose noise is known."""
        if moments.noise is None:
            raise BadValue("The statistic must carry its noise; got none. Declare it, or use identify(log).")
        if moments.samples < FEWEST_ROWS:
            raise CannotAnswer(
                f"The log has {int(moments.samples)} usable rows; at least {FEWEST_ROWS} are needed. Record more."
            )
        classes, label = np.unique(moments.noise_class, return_inverse=True)
        scatter = np.zeros((len(classes), *moments.scatter.shape[1:]))
        np.add.at(scatter, label, moments.scatter)
        acceleration = np.stack([moments.noise[c].acceleration for c in classes])
        wrench = np.stack([moments.noise[c].wrench for c in classes])
        if (wrench <= 0).any():
            raise BadValue("Wrench noise must be above zero on every axis; a zero variance would weigh infinitely.")
        return cls(
            scatter,
            acceleration,
            wrench,
            with_bias,
            classes,
            moments.scatter,
            label,
            moments.block,
            float(moments.counts[moments.still].sum()),
        )

    @cached_property
    def T(self) -> Array:
        """The design (p, 6, Z): derivative of the residual map by the linear parameters."""
        return design(self.with_bias)

    @property
    def samples(self) -> float:
        """Rows in all."""
        return float(self.scatter[:, 18, 18].sum())
