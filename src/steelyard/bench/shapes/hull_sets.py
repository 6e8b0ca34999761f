"""Many sets of points of every kind through our hull and through Qhull: the same volumes?"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from steelyard.bench.jobs import Progress
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.shape.hull import TOLERANCE, hull_volume, hull_work, qhull
from steelyard.spatial import Rotation

FEWEST, MOST = 4, 60  # points of a set
SEED = 0


def _grid(rng: np.random.Generator, count: int) -> Array:
    return np.floor(rng.uniform(0, rng.integers(2, 7), (count, 3)))


def _turned(rng: np.random.Generator, points: Array) -> Array:
    return np.asarray(Rotation.exp(rng.normal(size=3)).apply(points))


# Kind of set -> how it is made of `count` points.
KINDS: dict[str, Callable[[np.random.Generator, int], Array]] = {
    "cloud": lambda rng, n: rng.normal(size=(n, 3)),
    "cube": lambda rng, n: rng.uniform(size=(n, 3)),
    "sphere": lambda rng, n: (x := rng.normal(size=(n, 3))) / np.linalg.norm(x, axis=1, keepdims=True),
    "grid": _grid,
    "turned grid": lambda rng, n: _turned(rng, _grid(rng, n) * rng.uniform(0.1, 1, 3)),
    "noisy grid": lambda rng, n: _grid(rng, n) + 10.0 ** rng.uniform(-16, -6) * rng.normal(size=(n, 3)),
    "flat": lambda rng, n: _turned(rng, rng.normal(size=(n, 3)) * [1, 1, 0]),
    "thin": lambda rng, n: _turned(rng, rng.normal(size=(n, 3)) * [1, 1, 10.0 ** rng.uniform(-8, -2)]),
    "needle": lambda rng, n: rng.normal(size=(n, 3)) * [1, 1e-4, 1e-4],
    "line": lambda rng, n: rng.normal(size=(n, 1)) * rng.normal(size=3),
    "repeated": lambda rng, n: rng.normal(size=(n, 3))[rng.integers(0, max(n // 3, 1), n)],
    "far and small": lambda rng, n: 1e-3 * rng.normal(size=(n, 3)) + rng.normal(size=3),
}


def run(sets: int, progress: Progress | None = None) -> dict[str, Any]:
    """Return per kind the largest error of our volumes and how many sets were given back.

    error   |ours - Qhull's|, over Qhull's volume or a thousandth of the cube of the set's size, whichever is larger
    faults  sets that the kernel gives back
    """
    if sets < 1:
        raise BadValue(f"at least one set is needed; got {sets}.")
    rng, work, kinds = np.random.default_rng(SEED), hull_work(MOST), list(KINDS)
    worst, faults, count = dict.fromkeys(kinds, 0.0), dict.fromkeys(kinds, 0), dict.fromkeys(kinds, 0)
    rows = np.arange(MOST)
    for k in range(sets):
        kind = kinds[k % len(kinds)]
        points = np.ascontiguousarray(KINDS[kind](rng, int(rng.integers(FEWEST, MOST + 1))))
        size = float(np.ptp(points, axis=0).max())
        volume, vertices = hull_volume(points, rows[: len(points)], len(points), TOLERANCE * size, work)
        true = qhull(points)[0]
        if vertices < 0:
            volume = true
        count[kind] += 1
        faults[kind] += vertices < 0
        worst[kind] = max(worst[kind], abs(volume - true) / max(true, 1e-3 * size**3, 1e-300))
        if progress is not None and (k + 1) % 1000 == 0:
            progress(k + 1, sets)
    return {
        "sets": sets, "points": [FEWEST, MOST], "seed": SEED, "error": worst, "faults": faults, "count": count,
        "largest_error": max(worst.values()), "faults_in_all": sum(faults.values()),
    }  # fmt: skip
