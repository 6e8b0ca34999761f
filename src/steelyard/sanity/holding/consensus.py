"""The largest set of time slices that one body explains: structured candidates, then refitting until nothing changes.

A slice is the mean of z over 0.1 s or so; the residual of its six channels is linear in p parameters. Touch is
contiguous in time, so every stretch of time, and every log less one stretch, is a candidate; each costs one p x p
solution from running sums. The best are refined on all slices: scale learned from what is kept, kept slices by the
cheapest path through touched and untouched, refit.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.identify.cost.dense import solved
from steelyard.logs.two_states import cheapest_path

# Nodes of the candidates' time grid, and the smallest share of time a kept set may cover.
NODES, LEAST_KEPT = 36, 0.25
# Candidates made of several windows, beside the stretches: their number, windows each, and seed.
MIXED, WINDOWS, SEED = 200, 3, 7
REFINED, PASSES, APART = 16, 8, 4
# A slice is touched where its squared residual (6 channels, in standard deviations) is above 2 OUT for a while.
OUT, SWITCH = 6.0, 10.0
# Leaving everything out would have to shrink the tolerance by e^FINE.
FINE = 0.7
# Model errors that no estimator can see: share of the wrench, delay [s], lever of torque errors [m].
SHARE, DELAY, LEVER = 0.01, 0.004, 0.05
LATEST = 0.03  # [s] a longer delay is for others to find
UNSEEN = 1e-12  # added to the unit diagonal of scaled normal equations
SMALLEST, SCALE = np.repeat([1e-4, 1e-3], 3), np.repeat([LEVER, 1.0], 3)


@dataclass(frozen=True, eq=False)
class Slices:
    """F means over short times.

    A       (F, 6, p) derivative of the predicted wrench by the p parameters [phi (10), bias (0 or 6)]
    y       (F, 6) [tau N m, f N] measured wrench
    time    (F,) [s] middle of the slice
    weight  (F,) 1 for a full slice, less where rows are missing
    ridge   (p,) weak pull of each parameter to zero, one over its largest thinkable size squared
    """

    A: Array
    y: Array
    time: Array
    weight: Array
    ridge: Array

    def part(self, index: slice) -> Slices:
        """Return some of them."""
        return Slices(self.A[index], self.y[index], self.time[index], self.weight[index], self.ridge)


@dataclass(frozen=True, eq=False)
class Consensus:
    """A body and bias x (p,), the slices it explains (F,), its cost (less is better).

    tolerance, residual  (F, 6); late (F, 6) the wrench that a delay between wrench and motion adds
    """

    x: Array
    kept: Mask
    tolerance: Array
    residual: Array
    late: Array
    cost: float


@numba.njit(cache=True)
def solve(H: Array, g: Array) -> Array:
    """Return x (n,) of H x = g for a small positive definite H (n, n), held finite where directions are not seen."""
    n = len(g)
    low, scale, x = np.zeros((n, n)), np.empty(n), np.empty(n)
    for i in range(n):
        scale[i] = 1 / np.sqrt(H[i, i])
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j] * scale[i] * scale[j]
            for k in range(j):
                total -= low[i, k] * low[j, k]
            low[i, j] = np.sqrt(max(total + UNSEEN, UNSEEN)) if i == j else total / low[j, j]
        x[i] = g[i] * scale[i]
    x = solved(low, x)
    for i in range(n):
        x[i] *= scale[i]
    return x


@numba.njit(cache=True)
def _scan(H: Array, g: Array, c: Array, ridge: Array, masks: Mask, least: int, lost: float) -> tuple[Array, Array]:
    """Return cost (M,) and solution (M, p) of the node sets `masks` (M, C); H (C, p, p), g (C, p), c (C,)."""
    count, nodes = masks.shape
    p = g.shape[1]
    cost, found = np.empty(count), np.empty((count, p))
    error = np.empty(nodes)
    for k in range(count):
        total, right = np.zeros((p, p)), np.zeros(p)
        for i in range(p):
            total[i, i] = ridge[i]
        for n in range(nodes):
            if masks[k, n]:
                for i in range(p):
                    right[i] += g[n, i]
                    for j in range(p):
                        total[i, j] += H[n, i, j]
        x = solve(total, right)
        for i in range(p):
            found[k, i] = x[i]
        for n in range(nodes):
            value = c[n]
            for i in range(p):
                row = -2 * g[n, i]
                for j in range(p):
                    row += H[n, i, j] * x[j]
                value += x[i] * row
            # Sorted as they come: to compile NumPy's sort takes longer than all else here.
            place, value = n, max(value, 0.0)
            while place > 0 and error[place - 1] > value:
                error[place] = error[place - 1]
                place -= 1
            error[place] = value
        cost[k] = _split(error, least, lost)[0]
    return cost, found


@numba.njit(cache=True)
def _split(error: Array, least: int, lost: float) -> tuple[float, int]:
    """Return the least cost of keeping the first k of sorted node errors, and k."""
    nodes = len(error)
    below, best, chosen = 0.0, np.inf, nodes
    for k in range(1, nodes + 1):
        below += error[k - 1]
        value = nodes * np.log(1.0 + below / max(k - lost, 0.3 * k)) / 2 + FINE * (nodes - k)
        if k >= least and value < best:
            best, chosen = value, k
    return best, chosen


def _untouched(square: Array) -> Mask:
    """Return which slices are untouched on the cheapest path; square (F,) costs half of itself, touch costs OUT."""
    step = np.tile(SWITCH * (1 - np.eye(2)), (len(square) - 1, 1, 1))
    return np.asarray(cheapest_path(step, np.stack([square / 2, np.full(len(square), OUT)], axis=1)) == 0)


def fit(slices: Slices, kept: Mask, tolerance: Array, late: Array | float = 0.0) -> Array:
    """Return x (p,) of the weighted solution over the kept slices, `late` taken off the wrench."""
    scale = np.sqrt(slices.weight[kept])[:, None] / tolerance[kept]
    A = (slices.A[kept] * scale[:, :, None]).reshape(-1, len(slices.ridge))
    return np.asarray(solve(A.T @ A + np.diag(slices.ridge), A.T @ ((slices.y - late)[kept] * scale).ravel()))


def sums(slices: Slices, tolerance: Array) -> tuple[Array, Array, Array]:
    """Return H (F, p, p), g (F, p), c (F,) of each slice's squared residual in units of `tolerance` (F, 6)."""
    A = slices.A * (np.sqrt(slices.weight)[:, None] / tolerance)[:, :, None]
    y = slices.y * (np.sqrt(slices.weight)[:, None] / tolerance)
    return A.swapaxes(1, 2) @ A, np.einsum("fcp,fc->fp", A, y), (y**2).sum(1)


def _misfit(slices: Slices, x: Array, kept: Mask) -> tuple[Array, Array, Array]:
    """Return residual, tolerance and late wrench (F, 6): noise as in what is kept, and errors of the model itself.

    The model may be off by a share of the wrench, and by a delay; the delay that the kept slices show is taken out.
    """
    predicted = slices.A[:, :, :10] @ x[:10]
    place = np.arange(len(slices.time))
    before, after = np.maximum(place - 1, 0), np.minimum(place + 1, len(place) - 1)
    rate = (predicted[after] - predicted[before]) / (slices.time[after] - slices.time[before])[:, None]
    residual = slices.y - slices.A @ x
    seen, by = rate[kept] / SCALE, residual[kept] / SCALE
    late = rate * np.clip((seen * by).sum() / ((seen**2).sum() + 1e-12), -LATEST, LATEST)
    residual = residual - late
    return residual, _tolerance(slices, predicted, rate, residual, kept), late


def _tolerance(slices: Slices, predicted: Array, rate: Array, residual: Array, kept: Mask) -> Array:
    """Return the tolerance (F, 6), equal for the axes of force and of torque.

    Its parts: the spread of the kept residuals, a share of the wrench, and what grows with the rate of the wrench, as
    an unsteady delay does, learned from the kept residuals too.
    """
    speed, miss = ((v.reshape(-1, 2, 3) ** 2).sum(2) for v in (rate, residual))
    weight, fast, miss = slices.weight[kept, None], speed[kept], miss[kept] / 3
    slow = fast <= np.median(fast, axis=0)
    steady = (weight * slow * miss).sum(0) / (weight * slow).sum(0)
    growth = (weight * fast * (miss - steady)).sum(0) / ((weight * fast**2).sum(0) + 1e-12)
    growth = np.clip(growth, DELAY**2, LATEST**2)
    spread = (weight * (miss - growth * fast)).sum(0) / weight.sum()
    count = kept.sum()
    spread = np.maximum(spread, steady) * count / max(count - slices.A.shape[2] / 6, 0.3 * count)
    beside = np.repeat(np.sqrt(spread + growth * speed), 3, axis=1)
    return np.asarray(np.hypot(beside, share_of(predicted)) + SMALLEST)


def share_of(predicted: Array) -> Array:
    """Return the errors (F, 6) that the model itself may have of a predicted wrench (F, 6), equal for all axes."""
    size = (predicted.reshape(-1, 2, 3) ** 2).sum(2)
    size[:, 0] = np.maximum(size[:, 0], LEVER**2 * size[:, 1])
    return np.asarray(np.repeat(SHARE * np.sqrt(size), 3, axis=1))


def _grid(slices: Slices) -> tuple[Integers, Mask]:
    """Return the node of every slice and all candidate sets of nodes (M, C)."""
    count = len(slices.y)
    nodes = min(NODES, count)
    node = (np.arange(count) * nodes) // count
    i, j = np.triu_indices(nodes + 1, 1)
    inside = (np.arange(nodes) >= i[:, None]) & (np.arange(nodes) < j[:, None])
    share = inside.mean(1)
    rng = np.random.default_rng(SEED)
    width = max(nodes // 9, 1)
    start = rng.integers(0, nodes - width + 1, (MIXED, WINDOWS))
    mixed = ((np.arange(nodes) >= start[..., None]) & (np.arange(nodes) < start[..., None] + width)).any(1)
    return node, np.concatenate([inside[share >= 0.15], ~inside[share <= 1 - 0.15], mixed])


def refine(slices: Slices, x: Array, kept: Mask) -> Consensus | None:
    """Return the self-consistent set that grows from a candidate, x and its slices kept (M,), None where it withers."""
    for _ in range(PASSES):
        residual, tolerance, late = _misfit(slices, x, kept)
        square = ((residual / tolerance) ** 2).sum(1)
        before, kept = kept, _untouched(square)
        if kept.mean() < LEAST_KEPT:
            return None
        x = fit(slices, kept, tolerance, late)
        if (kept == before).all():
            break
    return _consensus(slices, x, kept)


def _consensus(slices: Slices, x: Array, kept: Mask) -> Consensus:
    residual, tolerance, late = _misfit(slices, x, kept)
    # The mean log tolerance of all slices, and a fine per slice that is not kept.
    cost = float(np.log(tolerance).mean() + FINE * (~kept).mean())
    return Consensus(x, kept, tolerance, residual, late, cost)


def largest(slices: Slices) -> Consensus:
    """Return the best self-consistent set of slices; all of them where no set is."""
    everything = np.ones(len(slices.y), np.bool_)
    whole = fit(slices, everything, _first_tolerance(slices))
    starts = [(whole, everything), *_starts(slices)]
    refined = [r for r in (refine(slices, *s) for s in starts) if r is not None and np.isfinite(r.cost)]
    return min(refined, key=lambda r: r.cost) if refined else _consensus(slices, whole, everything)


def _first_tolerance(slices: Slices) -> Array:
    """Return a tolerance (F, 6) of small shares of how far force and torque vary."""
    spread = np.maximum(np.std(slices.y, axis=0).reshape(2, 3).max(1), [1e-3, 1e-2])
    spread[0] = max(spread[0], LEVER * spread[1])
    return np.tile(np.repeat(0.02 * spread, 3), (len(slices.y), 1))


def _starts(slices: Slices) -> list[tuple[Array, Mask]]:
    """Return parameters and kept slices of the best candidates that are not alike."""
    node, masks = _grid(slices)
    begin = np.searchsorted(node, np.arange(node[-1] + 1))
    size = 6 * np.add.reduceat(slices.weight, begin)
    H, g, c = (np.add.reduceat(v, begin) for v in sums(slices, _first_tolerance(slices)))
    H, g, c = H / size[:, None, None], g / size[:, None], c / size
    least = int(np.ceil(LEAST_KEPT * len(c)))
    lost = slices.A.shape[2] / 6 * len(c) / len(slices.y)
    cost, found = _scan(H, g, c, slices.ridge / size.mean(), masks, least, lost)
    chosen: list[int] = []
    for k in np.argsort(cost):
        if len(chosen) == REFINED:
            break
        if all((masks[k] != masks[m]).sum() > APART for m in chosen):
            chosen.append(int(k))
    return [(found[k], _best_nodes(H, g, c, found[k], least, lost)[node]) for k in chosen]


def _best_nodes(H: Array, g: Array, c: Array, x: Array, least: int, lost: float) -> Mask:
    """Return the nodes (C,) that the best split of x's errors keeps."""
    error = np.maximum(c - 2 * g @ x + np.einsum("i,cij,j->c", x, H, x), 0)
    order = np.argsort(error)
    kept = np.zeros(len(c), np.bool_)
    kept[order[: _split(error[order], least, lost)[1]]] = True
    return kept
