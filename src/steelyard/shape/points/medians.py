"""Medians, quartiles and trimmed means; inside compiled passes sorted no further than needed, nothing allocated."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array

MIDDLE_HALF = 1.35  # standard deviations that the middle half of a normal distribution spans


def middle_half_std(values: Array) -> float:
    """Return the standard deviation of values (N,) as their middle half has it: what lies far out does not count."""
    return float(np.subtract(*np.percentile(values, (75, 25)))) / MIDDLE_HALF


@numba.njit(cache=True, nogil=True)
def part(values: Any, a: int, b: int, k: int) -> None:
    """Exchange values[a..b] (b included) until none before place k is larger than the one there, none after smaller.

    No step depends on a comparison but by a sum: what a processor cannot foresee costs it more than the work.
    Source: Hoare 1961, algorithm 65, FIND; partition by N. Lomuto.
    """
    while a < b:
        pivot, first = values[(a + b) >> 1], a
        for i in range(a, b + 1):
            value = values[i]
            values[i] = values[first]
            values[first] = value
            first += value < pivot
        if k < first:
            b = first - 1
            continue
        alike = first
        for i in range(first, b + 1):
            value = values[i]
            values[i] = values[alike]
            values[alike] = value
            alike += value <= pivot
        if k < alike:
            return
        a = alike


@numba.njit(cache=True, nogil=True)
def middle_mean(values: Any, count: int) -> float:
    """Return the mean of the middle half of the first `count` values; their order is lost.

    Near the median's robustness, most of the mean's precision.
    """
    low, high = count // 4, count - count // 4
    part(values, 0, count - 1, low)
    part(values, low, count - 1, high - 1)
    total = 0.0
    for i in range(low, high):
        total += values[i]
    return float(total / (high - low))


@numba.njit(cache=True, nogil=True)
def quantile(values: Any, count: int, share: float) -> float:
    """Return the value below which `share` of the first `count` lie, between two by proportion; their order is lost."""
    place = share * (count - 1)
    low = int(place)
    part(values, 0, count - 1, low)
    if low + 1 >= count:
        return float(values[low])
    above = values[low + 1]
    for i in range(low + 2, count):
        above = min(above, values[i])
    return float(values[low] + (place - low) * (above - values[low]))
