"""A bias that grows in time, as a sensor that warms up has: how much, and how surely."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.log import MotionLog
from steelyard.sanity.fitted.full_fit import Rows

# A drift counts beyond 2 % of the weight (at 0.1 m for torques), where it takes 20 % of the squared residual away.
DRIFT_WEIGHT, DRIFT_ARM, DRIFT_SHARE = 0.02, 0.1, 0.8
# A drift is beyond doubt from so many standard deviations on, by leaving out stretches: then the fit allows for it.
# Rounding alone drifts by a share of the weight below the last.
DRIFT_SURE, DRIFT_LEAST = 5.0, 1e-4
_FEWEST_ROWS = 8


@dataclass(frozen=True, eq=False)
class Drift:
    """A bias that grows in time: how much over the log [tau N m, f N] (6,), by how much it may be off, what it leaves.

    left    squared residual beside that of a steady bias
    weight  [N] of what is held
    span    [s] of the log
    """

    growth: Array
    std: Array
    left: float
    weight: float
    span: float

    @property
    def sure(self) -> bool:
        """Whether any channel drifts beyond doubt: left out, even a small drift moves mass and centre by bars."""
        least = DRIFT_LEAST * self.weight * np.repeat([DRIFT_ARM, 1.0], 3)
        return bool((np.abs(self.growth) > np.maximum(DRIFT_SURE * self.std, least)).any())

    @property
    def large(self) -> bool:
        """Whether it is worth a finding."""
        sizes, errors = self._sizes
        large = sizes > np.maximum(DRIFT_SURE * errors, DRIFT_WEIGHT * self.weight * np.array([DRIFT_ARM, 1.0]))
        return bool(large.any()) and self.left <= DRIFT_SHARE

    @property
    def findings(self) -> tuple[Finding, ...]:
        """`bias-drift` where the drift is large and explains much of the residual."""
        if not self.large:
            return ()
        sizes, errors = self._sizes
        message = (
            f"The bias drifts by {sizes[1]:.2g} ± {errors[1]:.1g} N and {sizes[0]:.2g} ± {errors[0]:.1g} N m over "
            f"{self.span:.0f} s; a line in time takes {100 * (1 - self.left):.0f} % of the squared residual away."
        )
        return (Finding.of("bias-drift", message),)

    @property
    def surest_words(self) -> str:
        """How much the channel drifts that is surest to."""
        i = int(np.argmax(np.abs(self.growth) / np.maximum(self.std, 1e-300)))
        kind, unit = ("torque", "N m") if i < 3 else ("force", "N")
        return f"{kind} along {'xyz'[i % 3]} by {self.growth[i]:.2g} ± {self.std[i]:.1g} {unit} over {self.span:.0f} s"

    @property
    def _sizes(self) -> tuple[Array, Array]:
        parts = (self.growth, self.std)
        sizes, errors = (np.array([np.linalg.norm(v[:3]), np.linalg.norm(v[3:])]) for v in parts)
        return sizes, errors


def drift_of(log: MotionLog) -> Drift | None:
    """Return how the bias grows over the log; None without a clock, or for too short a log."""
    if log.time is None or len(log) < _FEWEST_ROWS:
        return None
    rows, _ = Rows.of(log)
    if not rows.split:
        return None
    steady, moving = rows.solve(), rows.solve(rows.drifting(), jackknife=True)
    weight = abs(float(steady.phi[0])) * float(np.linalg.norm(log.gravity, axis=1).mean())
    span = float(log.time[-1] - log.time[0])
    return Drift(moving.extra, moving.extra_std, moving.beside(steady), weight, span)
