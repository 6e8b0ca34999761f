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

from steelyard.check import Array
from steelyard.identify.linear import inverse_scaled
from steelyard.logs.log import Integers

# Log density [kg/m^3] of everyday solids: wood to brass lies within one and a half deviations.
CENTRE, WIDTH = float(np.log(2500.0)), 1.3
# How much densities of "one" material differ: from one part made of one piece to anything at all.
LADDER = np.array([0.003, 0.01, 0.03, 0.1, 0.3, 1.0])
STEPS, FALL = 30, 1e-7
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
    """Return the mode y (G,), its cost with the prior N(centre, precision^-1), and the Hessian (G, G), by Newton."""
    y = start.copy()
    G = len(y)
    cost, gradient, hessian = _cost(A, b, volume, group, precision, centre, y)
    for _ in range(STEPS):
        values, vectors = np.linalg.eigh(hessian)
        step = -(vectors @ ((vectors.T @ gradient) / np.maximum(np.abs(values), 1e-6)))
        fall = -(gradient @ step)
        if fall < FALL:
            break
        longest = np.abs(step).max()
        if longest > 1.0:
            step = step / longest
        for _ in range(20):
            now, g, h = _cost(A, b, volume, group, precision, centre, y + step)
            if now < cost + 1e-12 * abs(cost):
                break
            step = 0.5 * step
        y, cost, gradient, hessian = y + step, now, g, h
    return y, cost, hessian.reshape(G, G)


@numba.njit(cache=True)
def _cost(
    A: Array, b: Array, volume: Array, group: Integers, precision: Array, centre: Array, y: Array
) -> tuple[float, Array, Array]:
    """Return data cost plus prior at log densities y (G,), gradient and Hessian."""
    P, G = len(volume), len(y)
    mass = np.empty(P)
    for k in range(P):
        mass[k] = volume[k] * np.exp(min(y[group[k]], 20.0))
    Am = A @ mass
    cost = float(0.5 * (mass @ Am) - b @ mass)
    off = y - centre
    pull = precision @ off
    cost += float(0.5 * (off @ pull))
    gradient, hessian = pull.copy(), precision.copy()
    for k in range(P):
        slope = mass[k] * (Am[k] - b[k])
        gradient[group[k]] += slope
        hessian[group[k], group[k]] += slope
        for j in range(P):
            hessian[group[k], group[j]] += mass[k] * A[k, j] * mass[j]
    return cost, gradient, hessian.reshape(G, G)


@numba.njit(cache=True)
def log_det(matrix: Array) -> float:
    """Return log det of a symmetric matrix, with eigenvalues kept above zero."""
    total = 0.0
    for value in np.linalg.eigvalsh(matrix):
        total += np.log(max(value, 1e-9))
    return total


@numba.njit(cache=True)
def common_density(A: Array, b: Array, volume: Array, start: Array) -> tuple[Array, Array, Array]:
    """Return masses (S, P), log evidence (S,) and mass covariance (S, P, P) over the ladder of sigma, widest first."""
    P, S = len(volume), len(LADDER)
    masses, evidence, spread = np.zeros((S, P)), np.zeros(S), np.zeros((S, P, P))
    own = np.arange(P)
    y = start.copy()
    for s in range(S - 1, -1, -1):
        near, wide = LADDER[s] ** 2, WIDTH**2
        precision = np.eye(P) / near - wide / (near * (near + P * wide))
        y, cost, hessian = mode(A, b, volume, own, precision, np.full(P, CENTRE), y)
        prior = (P - 1) * np.log(near) + np.log(near + P * wide)
        evidence[s] = -cost - 0.5 * (prior + log_det(hessian))
        masses[s] = volume * np.exp(y)
        spread[s] = np.outer(masses[s], masses[s]) * inverse_scaled(hessian)
    return masses, evidence - np.log(S), spread


@numba.njit(cache=True)
def partition_prior(group: Integers, G: int) -> float:
    """Return the log probability of a partition in a Chinese restaurant with concentration one."""
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
    """Return the partition with groups numbered in the order of their first part, and their number."""
    out, seen = np.full(len(group), -1), np.full(len(group) + 1, -1)
    G = 0
    for k in range(len(group)):
        if seen[group[k]] < 0:
            seen[group[k]] = G
            G += 1
        out[k] = seen[group[k]]
    return out, G


@numba.njit(cache=True)
def equal_groups(
    A: Array, b: Array, volume: Array, start: Array, starts: Integers
) -> tuple[Array, Array, Array, Integers, int]:
    """Return masses (N, P), log evidence (N,), covariance (N, P, P), partitions (N, P) and how many were looked at.

    From each of the partitions `starts` (K, P) every part is tried in every other group and in one of its own, sweep by
    sweep, as long as the evidence rises; everything looked at counts in the average.
    """
    P = len(volume)
    masses, evidence = np.zeros((MOST_MODELS, P)), np.full(MOST_MODELS, -np.inf)
    spread, known = np.zeros((MOST_MODELS, P, P)), np.full((MOST_MODELS, P), -1)
    count = 0
    for k0 in range(len(starts)):
        current, _ = canonical(starts[k0])
        best = -np.inf
        for sweep in range(SWEEPS + 1):
            improved = False
            for k in range(P if sweep else 1):
                base = current.copy()
                G = base.max() + 1
                for g in range(G + 1 if sweep else 1):
                    trial = base.copy()
                    if sweep:
                        trial[k] = g
                    trial, groups = canonical(trial)
                    place = -1
                    for i in range(count):
                        if (known[i] == trial).all():
                            place = i
                            break
                    if place < 0:
                        if count == MOST_MODELS:
                            return masses, evidence, spread, known, count
                        place = count
                        count += 1
                        known[place] = trial
                        masses[place], evidence[place], spread[place] = _grouped(A, b, volume, trial, groups, start)
                    if evidence[place] > best + 1e-9:
                        best, current, improved = evidence[place], trial.copy(), True
            if sweep and not improved:
                break
    return masses, evidence, spread, known, count


@numba.njit(cache=True)
def _grouped(A: Array, b: Array, volume: Array, group: Integers, G: int, start: Array) -> tuple[Array, float, Array]:
    """Return masses (P,), log evidence and covariance (P, P) of one partition."""
    P = len(volume)
    y, weight = np.zeros(G), np.zeros(G)
    for k in range(P):
        y[group[k]] += volume[k] * start[k]
        weight[group[k]] += volume[k]
    y /= weight
    y, cost, hessian = mode(A, b, volume, group, np.eye(G) / WIDTH**2, np.full(G, CENTRE), y)
    evidence = -cost - 0.5 * (2 * G * np.log(WIDTH) + log_det(hessian)) + partition_prior(group, G)
    inverse = inverse_scaled(hessian)
    mass, spread = np.empty(P), np.empty((P, P))
    for k in range(P):
        mass[k] = volume[k] * np.exp(y[group[k]])
    for k in range(P):
        for j in range(P):
            spread[k, j] = mass[k] * mass[j] * inverse[group[k], group[j]]
    return mass, evidence, spread


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


def averaged(families: list[tuple[Array, Array, Array]]) -> tuple[Array, Array, list[Array]]:
    """Return mean masses (P,), covariance (P, P) with the spread between models, and the weights per family.

    Each family brings masses (N, P), log evidence (N,) and covariances (N, P, P). Within a family models count by their
    evidence; families count alike, since Laplace's evidence does not compare across them: with parts cut in pieces the
    better family is often the one it disfavours. The covariance is that about the mean with evidence annealed: a model
    that is simple and slightly wrong wins by more than it should where noise hides what it leaves out.
    """
    weights = _weights(families, 1.0)
    mean = sum((w @ m for w, (m, _, _) in zip(weights, families, strict=True)), np.zeros(families[0][0].shape[1]))
    covariance = np.zeros((len(mean), len(mean)))
    for w, (m, _, c) in zip(_weights(families, TRUST), families, strict=True):
        off = m - mean
        covariance += np.tensordot(w, c, 1) + (w * off.T) @ off
    return mean, covariance, weights


def _weights(families: list[tuple[Array, Array, Array]], trust: float) -> list[Array]:
    """Return the weights of each family's models by evidence to the power `trust`; families count alike."""
    weights = [np.exp(trust * (e - e.max())) for _, e, _ in families]
    return [w / (w.sum() * len(families)) for w in weights]
