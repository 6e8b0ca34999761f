"""How long a residual remembers itself: rows that follow one another closely are not independent.

Source: Sokal 1997, "Monte Carlo methods in statistical mechanics" (integrated autocorrelation time).
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array

# Below this correlation a residual has forgotten itself.
LOST = 0.05


def lagged_products(series: Array, lags: int) -> Array:
    """Return the sums (lags,) over rows and columns of a series (N, ..) of x_t x_{t + lag}, from lag 0 on."""
    flat = series.reshape(len(series), -1)
    size = 2 ** int(np.ceil(np.log2(2 * len(flat))))
    power = (np.abs(np.fft.rfft(flat, size, axis=0)) ** 2).sum(1)
    return np.asarray(np.fft.irfft(power, size)[:lags])


def correlation_time(residual: Array, longest: float, power: int = 1) -> float:
    """Return how many rows of a residual (N, ..) are worth one independent row; 1 where it is white.

    It has mean zero, its columns count alike, and zeros stand for rows that are missing.
    longest  lags to which the correlation is followed at most
    power    2 for the rows' squares, whose correlation is that of Gaussian rows squared
    """
    flat = residual.reshape(len(residual), -1)
    products = lagged_products(flat / np.maximum(np.sqrt((flat**2).mean(0)), 1e-300), max(int(longest), 2))
    alike = products[1:] / max(float(products[0]), 1e-300)
    lost = np.flatnonzero(alike < LOST)
    return 1 + 2 * float((alike[: lost[0] if len(lost) else None] ** power).sum())
