"""Moments: the sufficient statistic of a log, one 19 x 19 scatter matrix per group of rows.

With z = [alpha (3), a - g (3), omega omega^T (xx xy xz yy yz zz), tau (3), f (3), 1] a group keeps sum z z^T. Ordinary,
weighted and noise-aware least squares, part masses and a constant bias need nothing else, whatever the length of the
log. A group is one noise class within one time block or still pose. Groups of logs of one body add; a stream forgets
by scaling.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from functools import cached_property

import numba
import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue
from steelyard.inertia.regressor import basis
from steelyard.logs.log import MotionLog, Noise

SIZE = 19
MOTION, ONE = slice(0, 12), 18

_CHUNK = 128
# Runs of rows of one group shorter than this, on average, are sorted before the pass.
SHORTEST_RUN = 16


@numba.njit(cache=True, fastmath=True, nogil=True)
def _features(
    alpha: Array, accel: Array, gravity: Array, omega: Array, wrench: Array, start: int, rows: int, out: Array
) -> None:
    """Write z of rows start..start+rows into out (19, chunk), features first so that products run along memory."""
    for k in range(rows):
        i = start + k
        for j in range(3):
            out[j, k] = alpha[i, j]
            out[3 + j, k] = accel[i, j] - gravity[i, j]
        x, y, z = omega[i, 0], omega[i, 1], omega[i, 2]
        out[6, k], out[7, k], out[8, k] = x * x, x * y, x * z
        out[9, k], out[10, k], out[11, k] = y * y, y * z, z * z
        for j in range(6):
            out[12 + j, k] = wrench[i, j]
        out[18, k] = 1.0


@numba.njit(cache=True, fastmath=True, nogil=True)
def _scatter_pass(
    alpha: Array,
    accel: Array,
    gravity: Array,
    omega: Array,
    wrench: Array,
    starts: Integers,
    group: Integers,
    out: Array,
) -> None:
    """Add z z^T of the rows starts[k]..starts[k+1] to out[group[k]] for every run k, in one pass over memory."""
    buffer = np.empty((SIZE, _CHUNK))
    for run in range(len(group)):
        for start in range(starts[run], starts[run + 1], _CHUNK):
            rows = min(_CHUNK, starts[run + 1] - start)
            _features(alpha, accel, gravity, omega, wrench, start, rows, buffer)
            for i in range(SIZE):
                for j in range(i, SIZE):
                    total = 0.0
                    for k in range(rows):
                        total += buffer[i, k] * buffer[j, k]
                    out[group[run], i, j] += total
    for g in range(out.shape[0]):
        for i in range(SIZE):
            for j in range(i):
                out[g, i, j] = out[g, j, i]


@dataclass(frozen=True, eq=False)
class Moments:
    """Scatter matrices (G, 19, 19) of G groups of rows.

    noise_class  (G,) index into `noise`
    block        (G,) still pose or time block, -1 where there is none
    still        (G,) whether the rows are at rest
    noise        one Noise per class, or None where it is not known
    """

    scatter: Array
    noise_class: Integers
    block: Integers
    still: Mask
    noise: tuple[Noise, ...] | None = None

    @classmethod
    def of_log(cls, log: MotionLog, by_block: bool = True) -> Moments:
        """Return the statistic of a log, grouped by noise class, stillness and (by default) block."""
        groups, label = _groups(log, by_block)
        columns = _columns(log)
        starts = np.concatenate([[0], np.flatnonzero(label[1:] != label[:-1]) + 1, [len(log)]])
        if len(starts) > len(log) / SHORTEST_RUN + 2:
            # Rows of many groups mixed: gather them first, so that products run over long stretches.
            # Sixteen bits are sorted by counting.
            order = np.argsort(label.astype(np.uint16) if len(groups) < 1 << 16 else label, kind="stable")
            columns = tuple(_taken(v, order) for v in columns)  # type: ignore[assignment]
            label = label[order]
            starts = np.searchsorted(label, np.arange(len(groups) + 1))
        out = np.zeros((len(groups), SIZE, SIZE))
        if len(log):
            _scatter_pass(*columns, starts.astype(np.int64), label[starts[:-1]], out)
        return cls(out, groups[:, 0], groups[:, 1], groups[:, 2].astype(np.bool_), log.noise)

    @classmethod
    def total(cls, logs: Iterable[Moments]) -> Moments:
        """Return the statistic of several logs of one body: groups of one class, stillness and block are added.

        Raises BadValue for none, and where the noise of the classes differs.
        """
        parts = list(logs)
        if not parts:
            raise BadValue("There must be at least one statistic to add; got none.")
        noise = parts[0].noise
        if any(_differ(noise, p.noise) for p in parts[1:]):
            raise BadValue("Statistics can be added only where their noise classes are the same; these differ.")
        keys = np.concatenate([np.stack([p.noise_class, p.still, p.block], 1).astype(np.int64) for p in parts])
        groups, label = np.unique(keys, axis=0, return_inverse=True)
        out = np.zeros((len(groups), SIZE, SIZE))
        np.add.at(out, label, np.concatenate([p.scatter for p in parts]))
        return cls(out, groups[:, 0], groups[:, 2], groups[:, 1].astype(np.bool_), noise)

    def __add__(self, other: Moments) -> Moments:
        return Moments.total([self, other])

    def scaled(self, factor: float) -> Moments:
        """Return the statistic with every row weighted by `factor` (forgetting)."""
        return replace(self, scatter=self.scatter * factor)

    def where(self, keep: Mask) -> Moments:
        """Return the statistic of the groups where `keep` (G,) is true."""
        return Moments(self.scatter[keep], self.noise_class[keep], self.block[keep], self.still[keep], self.noise)

    @cached_property
    def sum(self) -> Array:
        """The scatter matrix (19, 19) of all rows."""
        return np.asarray(self.scatter.sum(0))

    @property
    def counts(self) -> Array:
        """Rows per group (G,)."""
        return self.scatter[:, ONE, ONE]

    @property
    def samples(self) -> float:
        """Rows in all."""
        return float(self.counts.sum())


def _taken(values: Array, rows: Integers) -> Array:
    """Return the rows, read-only like those of a log: the pass is compiled for one kind of array."""
    out = values.take(rows, 0)
    out.flags.writeable = False
    return out


def features(log: MotionLog) -> Array:
    """Return z (N, 19) of every row: for second passes; the statistic itself never stores them."""
    out = np.empty((SIZE, len(log)))
    _features(*_columns(log), 0, len(log), out)
    return out.T


def _columns(log: MotionLog) -> tuple[Array, Array, Array, Array, Array]:
    """Return what the features of a row are made of."""
    return log.angular_acceleration, log.acceleration, log.gravity, log.angular_velocity, log.wrench


def regressors(log: MotionLog) -> Array:
    """Return A (N, 6, 10), so that the wrench of row n without bias is A[n] phi."""
    by_feature = basis().transpose(2, 1, 0).reshape(-1, 60)
    return np.asarray(features(log)[:, MOTION] @ by_feature).reshape(-1, 6, 10)


def _groups(log: MotionLog, by_block: bool) -> tuple[Integers, Integers]:
    """Return the groups present (G, 3: class, block, still) and the group of every row, by counting (no sort)."""
    if not len(log):
        return np.zeros((0, 3), np.int64), np.zeros(0, np.int64)
    block = log.pose if by_block else np.full(1, -1)
    blocks = int(block.max()) + 2
    key = (2 * log.noise_class + log.still) * blocks + (block + 1)
    present = np.flatnonzero(np.bincount(key))
    rank = np.zeros(int(present[-1]) + 1, np.int64)
    rank[present] = np.arange(len(present))
    kind, position = np.divmod(present, blocks)
    return np.stack([kind // 2, position - 1, kind % 2], 1), rank[key]


def _differ(one: tuple[Noise, ...] | None, other: tuple[Noise, ...] | None) -> bool:
    if one is None or other is None:
        return one is not other
    return len(one) != len(other) or any(
        not (np.array_equal(a.acceleration, b.acceleration) and np.array_equal(a.wrench, b.wrench))
        for a, b in zip(one, other, strict=True)
    )
