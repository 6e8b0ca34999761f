"""Answers of several models as one: a mixture of Gaussians, whose covariance holds the spread between their means."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array


def mixture(weight: Array, means: Sequence[Array], covariances: Sequence[Array]) -> tuple[Array, Array]:
    """Return mean (n,) and covariance (n, n) of a mixture with weights (K,), the spread between its means included."""
    mean = weight @ np.stack(means)
    return mean, spread_of(weight, np.stack(means) - mean, np.stack(covariances))


def spread_of(weight: Array, off: Array, covariance: Array) -> Array:
    """Return the covariance (n, n) of models (K,) by weight, each `off` (K, n) the mean and (K, n, n) about itself."""
    return np.asarray(np.tensordot(weight, covariance, 1) + (weight * off.T) @ off)
