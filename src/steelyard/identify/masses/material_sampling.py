"""Choices of one material per part drawn by their evidence, where there are too many to try all.

With the data as |R m - t|^2 and masses d (1 + tolerance e), d volume times density and e ~ N(0, 1), the evidence of a
choice is that of a residual t - R d with covariance S = 1 + R diag(d tolerance)^2 R^T, at most ten numbers wide. All
materials of two parts at once, the others kept, then cost one small factorization: two parts are redrawn at a time, so
that what one loses another may gain. Chains at higher temperatures hand their choices down to colder ones, so that none
stays with the first choice that fits.
Source: Gibbs sampling; exchanges between tempered chains as in Geyer (1991).
"""

from __future__ import annotations

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.cost.dense import cholesky
from steelyard.identify.masses.density_priors import TRUST

# Chain c draws by evidence to the power TRUST^c. Neighbours may exchange their choices after every draw: with ten draws
# between, shares of materials were off by up to 0.21, now by 0.07.
CHAINS, DRAWS = 7, 2000
# Once settled every other choice is kept: what differs in one pair at most says little new.
KEPT = slice(200, None, 2)
# Combinations of masses that the log sees less than this share of the best seen one are left out.
UNSEEN = 1e-12
# No part takes what is less likely than the likeliest by this, in logarithms.
NEVER = 40.0
SEED = 0


def draw(
    A: Array, b: Array, volume: Array, density: Array, tolerance: Array, start: Integers
) -> tuple[Integers, Integers, Integers]:
    """Return choices drawn by evidence (N, P), by it to the power TRUST (N, P), and the best fits (P K, P).

    A, b       the data as m^T A m / 2 - b^T m
    density    (K,) of the materials [kg/m^3], with their relative `tolerance` (K,)
    start      (P,) where all chains begin

    The best fits are those of least chi-square met on the way with each material for each part, whatever their prior.
    """
    values, vectors = np.linalg.eigh(A)
    seen = values > UNSEEN * values[-1]
    root = np.sqrt(values[seen])
    R = np.ascontiguousarray((vectors[:, seen] * root).T)
    mass = volume[:, None] * density
    chance = np.random.default_rng(SEED).random((DRAWS, CHAINS, 4))
    t = vectors[:, seen].T @ b / root
    drawn, fits = _chains(R, t, mass, (mass * tolerance) ** 2, start, chance)
    return drawn[0, KEPT], drawn[1, KEPT], fits.reshape(-1, len(volume))


@numba.njit(cache=True)
def material_prior(count: Integers) -> float:
    """Return the log probability, up to a constant, of a choice that takes each material `count` (K,) times.

    Few materials are likelier than many: a Chinese restaurant, whose tables take one material each.
    """
    total, taken = 0.0, 0
    for parts in count:
        if parts:
            total -= np.log(float(len(count) - taken))
            taken += 1
            for i in range(2, parts):
                total += np.log(float(i))
    return total


@numba.njit(cache=True)
def _chains(
    R: Array, t: Array, mass: Array, variance: Array, start: Integers, chance: Array
) -> tuple[Integers, Integers]:
    """Return the choices (2, draws, P) of the two coldest chains, and the best fits (P, K, P).

    chance  (draws, chains, 4) even random numbers: which two parts, what they take, whether choices are exchanged
    """
    draws, chains, _ = chance.shape
    P, K = mass.shape
    now, cost = np.empty((chains, P), np.int64), np.zeros(chains)
    now[:] = start
    drawn = np.empty((2, draws, P), np.int64)
    least, fits = np.full((P, K), np.inf), np.empty((P, K, P), np.int64)
    fits[:] = start
    for n in range(draws):
        for c in range(chains):
            k = int(chance[n, c, 0] * P)
            other = (k + 1 + int(chance[n, c, 1] * (P - 1))) % P
            costs, squares = _costs(R, t, mass, variance, now[c], k, other)
            _note(squares, least, fits, now[c], k, other)
            cost[c] = _redraw(costs, TRUST**c, chance[n, c, 2], now[c], k, other)
        for c in range(chains - 2, -1, -1):
            if np.log(chance[n, c, 3]) < (TRUST**c - TRUST ** (c + 1)) * (cost[c] - cost[c + 1]):
                handed = now[c].copy()
                now[c], now[c + 1] = now[c + 1], handed
                cost[c], cost[c + 1] = cost[c + 1], cost[c]
        drawn[:, n] = now[:2]
    return drawn, fits


@numba.njit(cache=True)
def _redraw(costs: Array, power: float, chance: float, chosen: Integers, k: int, other: int) -> float:
    """Write materials of two parts drawn by evidence to a power, and return the cost of the choice."""
    K = len(costs)
    weight, least, total = np.zeros(K * K), costs.min(), 0.0
    for place, cost in enumerate(costs.ravel()):
        if power * (cost - least) < NEVER:
            weight[place] = np.exp(-power * (cost - least))
            total += weight[place]
    left, place = chance * total, 0
    while place < K * K - 1 and left >= weight[place]:
        left -= weight[place]
        place += 1
    chosen[k], chosen[other] = place // K, place % K
    return float(costs[chosen[k], chosen[other]])


@numba.njit(cache=True)
def _costs(
    R: Array, t: Array, mass: Array, variance: Array, chosen: Integers, k: int, other: int
) -> tuple[Array, Array]:
    """Return minus the log evidence (K, K) and the chi-square (K, K) for all materials of two parts."""
    K = mass.shape[1]
    count = np.zeros(K, np.int64)
    for p in range(len(chosen)):
        count[chosen[p]] += p not in (k, other)
    before, once, twice = material_prior(count), np.empty(K), np.empty(K)
    for x in range(K):
        count[x] += 1
        once[x] = material_prior(count) - before
        count[x] += 1
        twice[x] = material_prior(count) - before
        count[x] -= 2
    taken = (count > 0).sum()
    # A second material that is new, too, is one of one fewer.
    both_new = np.log(float(max(K - taken, 1))) - np.log(float(max(K - taken - 1, 1)))
    g, log_det = _seen_pair(R, t, mass, variance, chosen, k, other)
    out, squares = np.empty((K, K)), np.empty((K, K))
    for x in range(K):
        d, v = mass[k, x], variance[k, x]
        for y in range(K):
            e, w = mass[other, y], variance[other, y]
            # The residual's square, and its products with the two columns, before their tolerances widen S.
            square = g[2, 2] - 2 * (d * g[0, 2] + e * g[1, 2]) + d * d * g[0, 0] + 2 * d * e * g[0, 1] + e * e * g[1, 1]
            one, two = g[0, 2] - d * g[0, 0] - e * g[0, 1], g[1, 2] - d * g[0, 1] - e * g[1, 1]
            first, second, cross = 1 + v * g[0, 0], 1 + w * g[1, 1], v * w * g[0, 1]
            det = first * second - cross * g[0, 1]
            square -= (v * second * one * one - 2 * cross * one * two + w * first * two * two) / det
            prior = before + (twice[x] if x == y else once[x] + once[y])
            if x != y and count[x] == 0 and count[y] == 0:
                prior += both_new
            out[x, y] = 0.5 * (square + log_det + np.log(det)) - prior
            squares[x, y] = square
    return out, squares


@numba.njit(cache=True)
def _note(squares: Array, least: Array, fits: Integers, chosen: Integers, k: int, other: int) -> None:
    """Keep the choices that fit better than all before with their material for one of the two parts."""
    for x in range(len(squares)):
        for y in range(len(squares)):
            for part, material in ((k, x), (other, y)):
                if squares[x, y] < least[part, material]:
                    least[part, material] = squares[x, y]
                    fits[part, material] = chosen
                    fits[part, material, k], fits[part, material, other] = x, y


@numba.njit(cache=True)
def _seen_pair(
    R: Array, t: Array, mass: Array, variance: Array, chosen: Integers, k: int, other: int
) -> tuple[Array, float]:
    """Return products (3, 3) of both columns and of the residual by S^-1, and log det S, without the two parts."""
    S, columns = np.eye(len(t)), np.empty((3, len(t)))
    columns[0], columns[1], columns[2] = R[:, k], R[:, other], t
    for p in range(len(chosen)):
        if p in (k, other):
            continue
        for i in range(len(t)):
            columns[2, i] -= R[i, p] * mass[p, chosen[p]]
            for j in range(i + 1):
                S[i, j] += R[i, p] * variance[p, chosen[p]] * R[j, p]
    low, _ = cholesky(S, 0.5)
    log_det, g = 0.0, np.zeros((3, 3))
    for i in range(len(t)):
        log_det += 2 * np.log(low[i, i])
        for a in range(3):
            for j in range(i):
                columns[a, i] -= low[i, j] * columns[a, j]
            columns[a, i] /= low[i, i]
            for b in range(a + 1):
                g[b, a] += columns[a, i] * columns[b, i]
    return g, log_det
