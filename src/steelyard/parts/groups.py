"""Groups that join one after the other: each member knows one of its group, the first knows itself."""

from __future__ import annotations

from typing import Any

import numba


@numba.njit(cache=True, nogil=True)
def root(parent: Any, k: int) -> int:
    """Return the first of the group of `k`; the way there is halved for the next time."""
    while parent[k] != k:
        parent[k] = parent[parent[k]]
        k = parent[k]
    return int(k)
