"""Parts whose density changes within: freed part by part where homogeneous parts cannot give the wrench.

phi = sum_k m_k b_k(u_k), the profile of part k tilted by u_k ~ N(0, T), masses with one common density. About a tilt
the model is linear, phi = B m + J (u' - u): the tilts are then an error of the shape with covariance J T J^T, and the
masses, the tilts and the evidence follow in closed form. Steps are kept where they make masses and tilts likelier.
Which parts are free, and how much, is averaged by evidence.
Source: own; Gauss-Newton on the tilts with the masses projected out, evidence by Laplace.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.identify import density_priors
from steelyard.identify.effective import Effective
from steelyard.identify.linear import inverse_scaled
from steelyard.identify.part_models import Masses
from steelyard.identify.part_profiles import Profile
from steelyard.parts.parts import Parts

# Standard deviations of the linear tilt; products of positions count half.
LADDER = (0.1, 0.3, 1.0)
MIDDLE, CONTENDER = 0.3, 7.0
QUADRATIC = 0.5
# How many parts of real tools are not homogeneous.
COMMON = 0.1
ROUNDS, HALVINGS, SETTLED, LONGEST = 40, 12, 1e-3, 0.7
# Models this much less likely than the best do not count.
UNLIKELY = float(np.log(1e-2))


@dataclass(frozen=True, eq=False)
class Model:
    """One choice of which parts are free: the rows of the parts, and the variance (F,) of their tilts."""

    free: tuple[int, ...]
    variance: Array
    log_chance: float


@dataclass(frozen=True, eq=False)
class Freed:
    """An answer with freed parts.

    vector, covariance   the ten parameters (10,) and (10, 10)
    masses               of the parts
    evidence             log evidence, the chance of the model counted
    free, variance       as in the model
    tilts                (P, F), zero where a part is homogeneous
    """

    vector: Array
    covariance: Array
    masses: Masses
    evidence: float
    free: tuple[int, ...]
    variance: Array
    tilts: Array


def freed(data: Effective, parts: Parts, profiles: list[Profile], enough: float) -> list[Freed]:
    """Return the likely models of which parts are not homogeneous, most likely first.

    Parts are freed one by one, the best first, as long as the evidence rises and the misfit is above `enough`. Sets are
    compared at the middle of the ladder, and only those that could win are tried on all of it.
    """
    tried: list[Freed] = []
    best = -np.inf
    base: tuple[int, ...] = ()
    while len(base) < len(parts):
        sets = [tuple(sorted((*base, k))) for k in range(len(parts)) if k not in base]
        now = [_fit(data, parts, profiles, _model(free, MIDDLE, parts, profiles)) for free in sets]
        limit = max(found.evidence for found in now) - CONTENDER
        likely = [found.free for found in now if found.evidence > limit]
        others = [width for width in LADDER if width != MIDDLE]
        now += [_fit(data, parts, profiles, _model(free, w, parts, profiles)) for free in likely for w in others]
        tried += now
        top = max(now, key=lambda found: found.evidence)
        if top.evidence < best or data.misfit(top.vector) < enough:
            break
        best, base = top.evidence, top.free
    tried.sort(key=lambda found: -found.evidence)
    return [found for found in tried if found.evidence > tried[0].evidence + UNLIKELY]


def even(data: Effective, parts: Parts) -> float:
    """Return the log evidence of homogeneous parts, to compare with that of freed ones."""
    _, evidence, _ = _common(data, parts, np.full(len(parts), density_priors.CENTRE))
    best = inverse_scaled(data.information) @ data.pull
    return evidence - 0.5 * float(best @ data.pull) + len(parts) * float(np.log(1 - COMMON))


def _model(free: tuple[int, ...], width: float, parts: Parts, profiles: list[Profile]) -> Model:
    """Return the model with the parts `free` and linear tilts of that standard deviation."""
    size = profiles[0].features.shape[1]
    linear = np.repeat([1.0, QUADRATIC**2], [3, size - 3])
    chance = len(free) * np.log(COMMON) + (len(parts) - len(free)) * np.log(1 - COMMON) - np.log(len(LADDER))
    return Model(free, np.tile(width**2 * linear, len(free)), float(chance))


def _fit(data: Effective, parts: Parts, profiles: list[Profile], model: Model) -> Freed:
    """Return the answer of one model."""
    rows, variance = list(model.free), model.variance
    tilts = np.zeros((len(parts), profiles[0].features.shape[1]))
    now, slope = _tilted(parts, profiles, tilts, rows)
    masses, likely, _ = _common(data, now, np.full(len(parts), density_priors.CENTRE))
    for _ in range(ROUNDS):
        step = _linear(data, now, slope(masses), tilts[rows].ravel(), variance, masses)[0]
        step *= min(1.0, LONGEST / max(float(np.abs(step).max()), 1e-9))
        gained = 0.0
        for _ in range(HALVINGS):
            if np.abs(step).max() < SETTLED:
                break
            trial = tilts.copy()
            trial[rows] += step.reshape(len(rows), -1)
            there, turned = _tilted(parts, profiles, trial, rows)
            found, value, _ = _common(data, there, _logs(masses, parts))
            value -= 0.5 * float((trial[rows].ravel() ** 2 / variance).sum())
            if value > likely:
                gained = value - likely
                tilts, now, slope, masses, likely = trial, there, turned, found, value
                break
            step = 0.5 * step
        if gained < SETTLED:
            break
    _, evidence, spread, covariance = _linear(data, now, slope(masses), tilts[rows].ravel(), variance, masses)
    return Freed(
        now.whole(masses).vector, covariance, Masses(masses, spread), evidence + model.log_chance, model.free, variance,
        tilts,
    )  # fmt: skip


def _linear(
    data: Effective, now: Parts, slope: Array, tilts: Array, variance: Array, masses: Array
) -> tuple[Array, float, Array, Array]:
    """Return what the model linear about tilts (F,) says: the step (F,) from there, the log evidence, and the
    covariances of the masses (P, P) and of the ten parameters (10, 10). `slope` (10, F) is d phi / d tilts.
    """
    shifted = replace(data, pull=data.pull + data.information @ (slope @ tilts))
    error = (slope * variance) @ slope.T
    seen = shifted.blurred(error)
    found, evidence, spread = _common(seen, now, _logs(masses, now))
    _, logdet = np.linalg.slogdet(np.eye(10) + data.information @ error)
    best = inverse_scaled(seen.information) @ seen.pull
    evidence -= 0.5 * float(logdet + best @ seen.pull)
    B = now.per_mass
    step = variance * (slope.T @ (seen.pull - seen.information @ (B @ found))) - tilts
    gain = error @ seen.information
    rest = (np.eye(10) - gain) @ B
    covariance = rest @ spread @ rest.T + error - gain @ error
    return step, evidence, spread, 0.5 * (covariance + covariance.T)


def _logs(masses: Array, parts: Parts) -> Array:
    """Return the log densities (P,) of masses."""
    return np.asarray(np.log(np.maximum(masses / parts.volume, 1e-3)))


def _common(data: Effective, parts: Parts, start: Array) -> tuple[Array, float, Array]:
    """Return masses (P,) averaged over the spreads of one common density, log evidence and covariance (P, P)."""
    B = parts.per_mass
    A, b = B.T @ data.information @ B, B.T @ data.pull
    masses, evidence, spread = density_priors.common_density(A, b, parts.volume, start)
    weight = np.exp(evidence - evidence.max())
    total = float(evidence.max() + np.log(weight.sum()))
    weight /= weight.sum()
    mean = weight @ masses
    off = masses - mean
    return mean, total, np.einsum("n,nij->ij", weight, spread) + np.einsum("n,ni,nj->ij", weight, off, off)


def _tilted(
    parts: Parts, profiles: list[Profile], tilts: Array, rows: list[int]
) -> tuple[Parts, Callable[[Array], Array]]:
    """Return the parts with the moments of their tilted densities, volumes kept, and masses (P,) -> d phi / d tilts."""
    moments, slopes = parts.moments.copy(), []
    for k in rows:
        b, slope = profiles[k].tilted(tilts[k])
        moments[k] = parts.volume[k] * b
        slopes.append(slope)

    def slope_at(masses: Array) -> Array:
        return np.concatenate([masses[k] * slope for k, slope in zip(rows, slopes, strict=True)], 1)

    return Parts(parts.label, moments, parts.rgb), slope_at
