"""Priors on the densities of parts, averaged by evidence: one common density, and groups of equal density.

The data are a quadratic form in the masses, m^T A m / 2 - b^T m. With m = V exp(y_z), z the group of each part and y
the log densities, every model below is a Gaussian prior on y; its evidence is Laplace's,
    log Z = -cost(mode) - (log det C + log det H) / 2,
C the prior covariance and H the Hessian at the mode. Densities stay positive by construction.
  common    every part has its own y_k ~ N(mu, sigma^2) around one free mu, over a ladder of sigma;
  groups    parts share densities in groups, y_g ~ N(mu_0, s_0^2), partitions weighted as in a Chinese restaurant.
Source: own; the recipe started from a trial with the same two families.
"""

from __future__ import annotations

import numba
import numpy as np
from scipy.special import softmax

from steelyard.check import Array, Integers
from steelyard.identify.cost.dense import cholesky, downhill, eigen, inner, moved, times
from steelyard.identify.cost.linear import RANK_TOLERANCE, pseudo_inverse
from steelyard.identify.mixture import spread_of

# Log density [kg/m^3] of everyday solids: wood to brass lies within one and a half deviations.
CENTRE, WIDTH = float(np.log(2500.0)), 1.3
# How much densities of "one" material differ: from one part made of one piece to anything at all.
LADDER = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0])
STEPS, FALL = 30, 1e-7
DEEPEST = 0.9  # of a density that one step may take
# Curvatures below this count as this: the prior alone gives a free density half of one.
FLATTEST = 1e-6
MOST_MODELS = 600
SWEEPS = 3
# The search from all parts apart is dear, and among many parts never the one that wins.
FEW_PARTS = 8
# How sure evidence is rests on the widths above, which nobody vouches for. Error bars count a difference of it half.
TRUST = 0.5


@numba.njit(cache=True)
def mode(
    A: Array, b: Array, volume: Array, group: Integers, precision: Array, centre: Array, start: Array
) -> tuple[Array, float, Array]:
    """Return the mode y (G,), its cost with the prior N(centre, precision^-1), and the Hessian (G, G), by Newton.

    Steps are straight in the densities, in which the data are quadratic: masses that trade against each other lie in a
    valley that is straight there, and bent in log densities.
    """
    y, step, share = start, np.zeros(len(start)), 0.0
    best, hessian = np.inf, precision
    for _ in range(STEPS + 1):
        # The first look is at the start itself; each further one is a step that is halved until the cost falls.
        for _ in range(20):
            trial = y + np.log1p(share * step)
            now, g, h = _cost(A, b, volume, group, precision, centre, trial)
            if share == 0.0 or now < best + 1e-12 * abs(best):
                break
            share *= 0.5
        y, best, hessian = trial, now, h
        # Of densities as shares of their own: less by the slope than that of their logs.
        straight, deepest = h.copy(), 0.0
        for k in range(len(y)):
            straight[k, k] -= g[k]
        step = downhill(g, straight, FLATTEST)
        if -inner(g, step) < FALL:
            break
        for k in range(len(y)):
            deepest = max(deepest, -step[k])
        share = DEEPEST / max(deepest, DEEPEST)
    return y, best, hessian


@numba.njit(cache=True)
def _cost(
    A: Array, b: Array, volume: Array, group: Integers, precision: Array, centre: Array, y: Array
) -> tuple[float, Array, Array]:
    """Return data cost plus prior at log densities y (G,), gradient and Hessian."""
    P, cost = len(volume), 0.0
    mass = np.empty(P)
    for k in range(P):
        mass[k] = volume[k] * np.exp(min(y[group[k]], 20.0))
    Am, off = times(A, mass), moved(y, centre, -1.0)
    gradient, hessian = times(precision, off), precision.copy()
    for g in range(len(y)):
        cost += 0.5 * off[g] * gradient[g]
    for k in range(P):
        cost += mass[k] * (0.5 * Am[k] - b[k])
        slope = mass[k] * (Am[k] - b[k])
        gradient[group[k]] += slope
        hessian[group[k], group[k]] += slope
        for j in range(P):
            hessian[group[k], group[j]] += mass[k] * A[k, j] * mass[j]
    return cost, gradient, hessian


@numba.njit(cache=True)
def log_det(matrix: Array) -> float:
    """Return log det of a symmetric matrix (n, n), with eigenvalues kept above zero."""
    low, positive = cholesky(matrix, FLATTEST)
    total = 0.0
    if positive:
        for k in range(len(low)):
            total += 2 * np.log(low[k, k])
    else:
        for value in eigen(matrix)[0]:
            total += np.log(max(value, 1e-9))
    return total


def apart(P: int, near: float, wide: float) -> Array:
    """Return the precision (P, P) of log densities with variance `near` about a common one with variance `wide`."""
    return np.eye(P) / near - wide / (near * (near + P * wide))


def common_density(A: Array, b: Array, volume: Array, start: Array) -> tuple[Array, Array, Array]:
    """Return masses (S, P), log evidence (S,) and mass covariance (S, P, P) over the ladder of sigma, widest first."""
    P, S, wide = len(volume), len(LADDER), WIDTH**2
    masses, evidence, spread = np.empty((S, P)), np.empty(S), np.empty((S, P, P))
    own, centre, y = np.arange(P), np.full(P, CENTRE), start
    for s in range(S - 1, -1, -1):
        near = float(LADDER[s] ** 2)
        y, cost, hessian = mode(A, b, volume, own, apart(P, near, wide), centre, y)
        prior = (P - 1) * np.log(near) + np.log(near + P * wide)
        evidence[s] = -cost - 0.5 * (prior + log_det(hessian)) - np.log(S)
        spread_masses(volume, own, y, hessian, masses[s], spread[s])
    return masses, evidence, spread


@numba.njit(cache=True)
def spread_masses(volume: Array, group: Integers, y: Array, hessian: Array, masses: Array, spread: Array) -> None:
    """Write masses (P,) and their covariance (P, P) at a mode."""
    inverse = pseudo_inverse(hessian, RANK_TOLERANCE)
    for k in range(len(volume)):
        masses[k] = volume[k] * np.exp(y[group[k]])
    for k in range(len(volume)):
        for j in range(len(volume)):
            spread[k, j] = masses[k] * masses[j] * inverse[group[k], group[j]]


@numba.njit(cache=True)
def partition_prior(group: Integers, G: int) -> float:
    """Return the log probability of G groups, `group` (P,), in a Chinese restaurant with concentration one."""
    P = len(group)
    total = 0.0
    for k in range(1, P + 1):
        total -= np.log(float(k))
    for g in range(G):
        members = 0
        for k in range(P):
            members += group[k] == g
        for i in range(2, members):
            total += np.log(float(i))
    return total


@numba.njit(cache=True)
def canonical(group: Integers) -> tuple[Integers, int]:
    """Return the partition (P,) with groups numbered in the order of their first part, and their number."""
    out, seen = np.empty(len(group), np.int64), np.zeros(len(group) + 1, np.int64)
    G = 0
    for k in range(len(group)):
        if seen[group[k]] == 0:
            G += 1
            seen[group[k]] = G
        out[k] = seen[group[k]] - 1
    return out, G


@numba.njit(cache=True)
def place_of(row: Integers, known: Integers, count: int) -> int:
    """Return which of the first `count` rows of `known` (N, P) is `row` (P,), else `count`, and write it there."""
    for i in range(count):
        same = True
        for k in range(len(row)):
            same = same and known[i, k] == row[k]
        if same:
            return i
    if count < len(known):
        for k in range(len(row)):
            known[count, k] = row[k]
    return count


@numba.njit(cache=True)
def equal_groups(A: Array, b: Array, volume: Array, start: Array, starts: Integers) -> tuple[Array, Array, Array, int]:
    """Return masses (N, P), log evidence (N,), covariance (N, P, P) of models, and how many were looked at.

    From each of the partitions `starts` (K, P) every part is tried in every other group and in one of its own, sweep by
    sweep, as long as the evidence rises; everything looked at counts in the average.
    """
    P, N = len(volume), MOST_MODELS
    masses, evidence, spread = np.zeros((N, P)), np.zeros(N), np.zeros((N, P, P))
    known = np.zeros((N, P), np.int64)
    count = 0
    for k0 in range(len(starts)):
        current, most = canonical(starts[k0])
        best = -np.inf
        for sweep in range(SWEEPS + 1):
            improved = False
            for k in range(P if sweep else 1):
                base = current
                for g in range(most + 1 if sweep else 1):
                    trial = base.copy()
                    if sweep:
                        trial[k] = g
                    trial, groups = canonical(trial)
                    place = place_of(trial, known, count)
                    if place == count:
                        if count == N:
                            return masses, evidence, spread, count
                        count += 1
                        evidence[place] = _grouped(A, b, volume, trial, groups, start, masses[place], spread[place])
                    if evidence[place] > best + 1e-9:
                        best, current, improved = evidence[place], trial, True
                most = 0
                for i in range(P):
                    most = max(most, current[i] + 1)
            if sweep and not improved:
                break
    return masses, evidence, spread, count


@numba.njit(cache=True)
def _grouped(
    A: Array, b: Array, volume: Array, group: Integers, G: int, start: Array, masses: Array, spread: Array
) -> float:
    """Return the log evidence of one partition; write masses (P,) and their covariance (P, P)."""
    y, weight, centre, precision = np.zeros(G), np.zeros(G), np.empty(G), np.zeros((G, G))
    for k in range(len(volume)):
        y[group[k]] += volume[k] * start[k]
        weight[group[k]] += volume[k]
    for g in range(G):
        y[g] /= weight[g]
        centre[g], precision[g, g] = CENTRE, WIDTH**-2
    y, cost, hessian = mode(A, b, volume, group, precision, centre, y)
    spread_masses(volume, group, y, hessian, masses, spread)
    return float(-cost - 0.5 * (2 * G * np.log(WIDTH) + log_det(hessian)) + partition_prior(group, G))


def first_partitions(start: Array) -> Integers:
    """Return partitions (K, P) to begin with: one group, cuts of the densities at wide gaps, few parts all apart."""
    P = len(start)
    order = np.argsort(start, kind="stable")
    gaps = np.diff(start[order])
    out = [np.zeros(P, np.int64)]
    if P <= FEW_PARTS:
        out.append(np.arange(P))
    for cuts in range(1, min(P - 1, 4) + 1):
        edges = np.sort(np.argsort(-gaps, kind="stable")[:cuts])
        group = np.zeros(P, np.int64)
        group[order] = np.searchsorted(edges, np.arange(P), side="left")
        out.append(group)
    return np.stack(out)


def averaged(masses: Array, evidence: Array, spread: Array) -> tuple[Array, Array]:
    """Return mean masses (P,) and their covariance (P, P) with the spread between models.

    masses (N, P), log evidence (N,), spread (N, P, P)

    Models count by their evidence, whatever their family. The covariance is that about the mean with evidence annealed:
    a model that is simple and slightly wrong wins by more than it should where noise hides what it leaves out.
    """
    mean = softmax(evidence) @ masses
    return mean, spread_of(softmax(TRUST * evidence), masses - mean, spread)
