"""From what a log says about phi to the masses of parts: free, averaged over models, or from a list of materials."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.evidence import PartMass
from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses import density_priors
from steelyard.identify.masses.material_choice import Choices, choose
from steelyard.identify.masses.nonnegative import nonnegative_masses, spread_about
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts


@dataclass(frozen=True, eq=False)
class Masses:
    """Masses (P,) [kg] with covariance (P, P), and the material choices looked at where there was a list."""

    mean: Array
    covariance: Array
    choices: Choices | None = None


def weighed(
    parts: Parts, mean: Array, covariance: Array, materials: Sequence[str | None] | None = None
) -> tuple[PartMass, ...]:
    """Return parts with masses (P,) [kg] of a covariance (P, P), and the names of their materials where known."""
    std, names = np.sqrt(np.maximum(np.diag(covariance), 0)), materials or [None] * len(parts)
    rows = zip(parts.label, mean, std, parts.volume, parts.centroid, names, strict=True)
    return tuple(PartMass(int(k), float(m), float(s), float(v), c, name) for k, m, s, v, c, name in rows)


def free_masses(data: Effective, parts: Parts) -> Masses:
    """Return masses that are only kept from falling below zero."""
    A, b = _in_masses(data, parts)
    mean = nonnegative_masses(A, b)
    return Masses(mean, spread_about(A, b, mean))


def averaged_masses(data: Effective, parts: Parts) -> Masses:
    """Return masses averaged by evidence over one common density and groups of equal density."""
    A, b = _in_masses(data, parts)
    if len(parts) == 1:
        return free_masses(data, parts)
    return Masses(*density_priors.averaged(*_models(A, b, parts.volume)))


def log_evidence(data: Effective, parts: Parts) -> float:
    """Return the log evidence of the parts, summed over all models of their densities.

    Up to a constant of the data alone, so that different cuts of one object compare.
    """
    _, evidence, _ = _models(*_in_masses(data, parts), parts.volume)
    return float(np.logaddexp.reduce(evidence))


def material_masses(data: Effective, parts: Parts, materials: Sequence[Material]) -> Masses:
    """Return masses averaged by evidence over the choices of one material per part."""
    A, b = _in_masses(data, parts)
    guess = averaged_masses(data, parts).mean
    choices = choose(A, b, parts.volume, materials, guess)
    mean, covariance = choices.mixture()
    return Masses(mean, covariance, choices)


def _in_masses(data: Effective, parts: Parts) -> tuple[Array, Array]:
    """Return A (P, P) and b (P,): the data as m^T A m / 2 - b^T m."""
    B = parts.per_mass
    return B.T @ data.information @ B, B.T @ data.pull


def _models(A: Array, b: Array, volume: Array) -> tuple[Array, Array, Array]:
    """Return masses (N, P), log evidence (N,) and covariances (N, P, P) of the models of both families."""
    start = np.full(len(volume), np.log(max(float(nonnegative_masses(A, b).sum()), 1e-6) / volume.sum()))
    common = density_priors.common_density(A, b, volume, start)
    widest = np.log(common[0][-1] / volume)
    starts = density_priors.first_partitions(widest)
    *groups, looked = density_priors.equal_groups(A, b, volume, widest, starts)
    masses, evidence, spread = (
        np.concatenate([one, other[:looked]]) for one, other in zip(common, groups, strict=True)
    )
    return masses, evidence, spread
