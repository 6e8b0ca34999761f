"""Is it the same object? A chi-square test of two results."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import gammaincc

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.identify.cost.linear import unit_diagonal
from steelyard.identify.sight import natural_sizes
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.people import NAMES, people_jacobian

# A result is exact to this share of mass, radius of gyration and inertia: what is typed from a data sheet is rounded.
EXACT = 1e-6
# No direction is known better than this beside the best known quantities in it, as a variance.
SHARPEST = 1e-8


@dataclass(frozen=True)
class Comparison:
    """How two results differ.

    p_value  probability of a difference this large between two results of one body
    compared  what was compared, with the difference (second minus first) and its standard deviation
    """

    p_value: float
    chi2: float
    dof: int
    compared: tuple[tuple[str, float, float], ...]

    @property
    def same(self) -> bool:
        """Whether one body explains both results at the 1 % level."""
        return self.p_value > 0.01


def compare(
    one: InertialParameters, one_covariance: Array, other: InertialParameters, other_covariance: Array,
    known: Array, any_grasp: bool = False,
) -> Comparison:  # fmt: skip
    """Compare two bodies given with their covariances (10, 10) of m, h, I about the origin.

    `known` (10,) says which of mass, com, inertia about the CoM both results identify. `any_grasp` compares only what
    does not depend on how the object is held: mass and principal moments. Raises CannotAnswer where nothing is left to
    compare, BadValue for a body of mass zero, which has no centre, and for covariances with a negative variance.
    """
    first, first_cov, names = _quantities(one, one_covariance, any_grasp)
    second, second_cov, _ = _quantities(other, other_covariance, any_grasp)
    chosen = np.asarray(known, bool)
    if any_grasp:
        chosen = np.concatenate([chosen[:1], np.repeat(chosen[4:].all(), 3)])
    if not chosen.any():
        raise CannotAnswer("Neither mass nor inertia is identified in both results; there is nothing to compare.")
    gap = (second - first)[chosen]
    covariance = (first_cov + second_cov)[np.ix_(chosen, chosen)]
    if not (np.diag(covariance) > 0).all():
        raise BadValue("the covariances of two results must have no negative variance; these have.")
    scaled, scale = unit_diagonal(covariance)
    values, axes = np.linalg.eigh(scaled)
    chi2 = float(((axes.T @ (scale * gap)) ** 2 / np.maximum(values, SHARPEST)).sum())
    shown = tuple((n, float(g), float(s)) for n, g, s in zip(np.array(names)[chosen], gap, 1 / scale, strict=True))
    return Comparison(float(gammaincc(len(gap) / 2, chi2 / 2)), chi2, len(gap), shown)


def _quantities(body: InertialParameters, covariance: Array, any_grasp: bool) -> tuple[Array, Array, tuple[str, ...]]:
    """Return what is compared, its covariance and its names."""
    if body.mass == 0:
        raise BadValue("a body of mass zero has no centre of mass; there is nothing to compare.")
    J = people_jacobian(body.vector.copy())
    people = J @ covariance @ J.T + np.diag(np.square(EXACT * natural_sizes(body.vector.copy())))
    if not any_grasp:
        return body.people, people, NAMES
    moments, axes = np.linalg.eigh(body.inertia_com)
    slopes = np.zeros((4, 10))
    slopes[0, 0], slopes[1:, 4:] = 1, forms.principal_slopes(axes)
    names = ("mass", "principal moment 1", "principal moment 2", "principal moment 3")
    return np.concatenate([[body.mass], moments]), slopes @ people @ slopes.T, names
