"""A zero-phase Butterworth low-pass of even order: second-order sections, run forwards and backwards.

It answers as `butter` and `sosfiltfilt` of `scipy.signal` do, whose import takes longer than most logs take to answer.

Source: Oppenheim & Schafer, "Discrete-time signal processing" (bilinear transform, cascades of sections);
Gustafsson 1996, "Determining the initial states in forward-backward filtering" (odd reflection at the ends).
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array


def there_and_back(values: Array, cutoff: float, order: int, pad: int) -> Array:
    """Return `values` (N, D) low-passed at `cutoff`, a share of the rate below a half, with no phase.

    order  of the filter, even: so much that each run takes away
    pad    rows, fewer than N, by which the ends are continued: reflected through the first and the last row
    """
    sections = _sections(order, cutoff)
    before, after = 2 * values[:1] - values[pad:0:-1], 2 * values[-1:] - values[-2 : -pad - 2 : -1]
    there = _through(sections, np.concatenate([before, values, after], dtype=float))
    return _through(sections, there[::-1].copy())[::-1][pad : pad + len(values)]


def _sections(order: int, cutoff: float) -> Array:
    """Return of every section (order / 2, 3) the gain of the newest row, and what it remembers of its last two.

    Its transfer function is b (1 + z^-1)^2 / (1 + a1 z^-1 + a2 z^-2), one at rest; a pair of poles for each.
    """
    warped = np.tan(np.pi * cutoff)
    damping = 2 * np.cos(np.pi * (np.arange(order // 2) + 0.5) / order) * warped
    whole = 1 + damping + warped**2
    return np.stack([warped**2 / whole, 2 * (warped**2 - 1) / whole, (1 - damping + warped**2) / whole], 1)


@numba.njit(cache=True)
def _through(sections: Array, rows: Array) -> Array:
    """Return `rows` (N, D), overwritten, after all sections, as if the first row had lasted for ever before."""
    newer, older = np.empty(rows.shape[1]), np.empty(rows.shape[1])
    for s in range(len(sections)):
        b, a1, a2 = sections[s, 0], sections[s, 1], sections[s, 2]
        for d in range(rows.shape[1]):
            newer[d], older[d] = (1 - b) * rows[0, d], (b - a2) * rows[0, d]
        for n in range(len(rows)):
            for d in range(rows.shape[1]):
                x = rows[n, d]
                y = b * x + newer[d]
                newer[d] = 2 * b * x - a1 * y + older[d]
                older[d] = b * x - a2 * y
                rows[n, d] = y
    return rows
