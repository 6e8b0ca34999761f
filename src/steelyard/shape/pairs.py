"""Pairs of numbered things: each pair once, and what hangs together by them."""

from __future__ import annotations

import numpy as np

from steelyard.check import Integers


def distinct_pairs(first: Integers, second: Integers, count: int) -> Integers:
    """Return the pairs (E, 2) of numbers (N,) and (N,), each once and rising; the second are below `count`.

    Sorted, which is five times as fast as `np.unique` with its table.
    """
    keys = np.sort(first * count + second)
    once = np.ones(len(keys), np.bool_)
    once[1:] = keys[1:] != keys[:-1]
    return np.stack(np.divmod(keys[once], count), axis=1)


def joined(pairs: Integers, count: int) -> Integers:
    """Return the piece (N,), from 0 on, that each of N things lies in when `pairs` (E, 2) of them are joined.

    count  N; pieces are numbered in the order of their first members
    """
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    links = coo_array((np.ones(len(pairs), np.int8), (pairs[:, 0], pairs[:, 1])), shape=(count, count))
    return np.asarray(connected_components(links, directed=False)[1], np.int64)
