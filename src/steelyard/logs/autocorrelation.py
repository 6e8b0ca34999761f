"""How long a residual remembers itself: rows that follow one another closely are not independent.

Source: Sokal 1997, "Monte Carlo methods in statistical mechanics" (integrated autocorrelation time).
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import takewhile

import numpy as np

from steelyard.check import Array

# Below this correlation a residual has forgotten itself.
LOST = 0.05

# So many lags cost less one by one than all of them by Fourier transform.
FEW = 64


def lagged_products(series: Array, lags: int) -> Array:
    """Return the sums (lags,) over rows and columns of a series (N, ..) of x_t x_{t + lag}, from lag 0 on."""
    from scipy.fft import irfft, next_fast_len, rfft

    flat = series.reshape(len(series), -1)
    # So many zeros that the end does not meet the beginning.
    size = next_fast_len(len(flat) + lags, real=True)
    waves = rfft(flat, size, axis=0)
    return np.asarray(irfft((waves * waves.conj()).real.sum(1), size)[:lags])


def correlation_time(residual: Array, longest: float, power: int = 1) -> float:
    """Return how many rows of a residual (N, ..) are worth one independent row; 1 where it is white.

    It has mean zero, its columns count alike, and zeros stand for rows that are missing.
    longest  lags to which the correlation is followed at most
    power    2 for the rows' squares, whose correlation is that of Gaussian rows squared
    """
    flat = residual.reshape(len(residual), -1)
    flat = flat / np.maximum(np.sqrt(np.einsum("tk,tk->k", flat, flat) / len(flat)), 1e-300)
    remembered = takewhile(lambda alike: alike >= LOST, _correlations(flat, max(int(longest), 2)))
    return 1 + 2 * sum(alike**power for alike in remembered)


def _correlations(flat: Array, longest: int) -> Iterator[float]:
    """Yield how alike rows (N, k) are at lags 1, 2, .. below `longest`, the first each as it is asked for."""
    whole = max(float(np.vdot(flat, flat)), 1e-300)
    for lag in range(1, min(FEW, longest)):
        yield float(np.vdot(flat[lag:], flat[:-lag])) / whole
    if longest > FEW:
        yield from (lagged_products(flat, longest)[FEW:] / whole).tolist()
