"""Error bars at least as wide as leaving blocks of the log out shows, where there are enough of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.identify.sight import natural_sizes
from steelyard.inertia.people import parameter_jacobian, people_jacobian

# Fewer blocks left out in turn say too little about error bars; below this factor they agree.
ENOUGH_BLOCKS, WORTH_WIDENING = 10, 1.5
# Share of its size that no number is known better than.
SMALLEST_STD = 1e-9


def widened(estimate: Estimate) -> Estimate:
    """Return the estimate with error bars at least as wide as leaving blocks out shows, where there are enough blocks.

    What the model leaves out (a soft wrist, cross-talk) is no noise, and only differs from one stretch to the next.
    With a shape, too: what the log says of mass and centre is wrong by as much.
    """
    return _each_widened(_all_widened(estimate))


def _all_widened(estimate: Estimate) -> Estimate:
    """Return the estimate with all bars wider alike, where leaving blocks out moves half of the numbers by more."""
    moved, known = _moved(estimate), estimate.identified
    if moved is None or not known.any() or (factor := float(np.median(moved[known]))) < WORTH_WIDENING:
        return estimate
    note = f"error bars are {factor:.1f} times those of noise alone: leaving blocks out moves the answer that much"
    return replace(
        estimate,
        covariance=factor**2 * estimate.covariance,
        bias_covariance=factor**2 * estimate.bias_covariance,
        cross_covariance=factor**2 * estimate.cross_covariance,
        part_covariance=None if estimate.part_covariance is None else factor**2 * estimate.part_covariance,
        parts=tuple(replace(part, std=factor * part.std) for part in estimate.parts),
        notes=(*estimate.notes, note),
    )


def _each_widened(estimate: Estimate) -> Estimate:
    """Return the estimate with no number's bar narrower than leaving blocks out shows; correlations are kept.

    What the model leaves out (an arm that swings after a stop) moves some numbers more than others.
    """
    moved = _moved(estimate)
    if moved is None:
        return estimate
    factor = np.where(estimate.identified, np.maximum(moved, 1.0), 1.0)
    phi = estimate.parameters.vector.copy()
    stretch = parameter_jacobian(phi) @ (factor[:, None] * people_jacobian(phi))
    return replace(
        estimate,
        covariance=stretch @ estimate.covariance @ stretch.T,
        cross_covariance=stretch @ estimate.cross_covariance,
    )


def _moved(estimate: Estimate) -> Array | None:
    """Return by how many of its bars leaving blocks out moves each number (10,), None where blocks are few."""
    jackknife = estimate.evidence.jackknife_people
    if jackknife is None or estimate.evidence.blocks < ENOUGH_BLOCKS:
        return None
    # A channel that holds exact zeros has no noise at all, and nothing to be a multiple of.
    least = SMALLEST_STD * natural_sizes(estimate.parameters.vector.copy())
    return np.asarray(jackknife / np.maximum(estimate.std, least))
