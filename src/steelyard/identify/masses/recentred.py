"""A body where shape, grasp and log together see it: of a measured shape mass and centre of mass, of a scan all of it.

Shape and grasp put them at x up to an error with covariance G, the log alone sees them at x_log up to P, whatever the
inertia, as long as it is of the size of the shape's: they belong at x + G (G + P)^-1 (x_log - x), never beyond either.
Letting a log move the inertia of a measured mesh loses more in thin axes than it wins in the others. A scan errs by a
share of each second moment, so that its thin axes hold, and a log that knows the inertia better takes it over.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.linalg import eigh

from steelyard.check import Array
from steelyard.identify.bars.effective import Effective
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import half_trace_com, parameter_jacobian, people_jacobian

# An entry of the inertia may be off by so many half traces. Were it free, noise in the accelerations of rows at rest
# would pass for inertia, and hide where the centre of mass is.
ANY_INERTIA = 1.0
# The log tells where the centre is along an axis that it sees better than the shape does.
SEEN = 1.0
# Of the shape's second moment in every direction at least this much stays.
LEAST_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class Recentred:
    """A body that was moved, the covariance (10, 10) of what is left of its error, and how the move follows the log.

    gain  (10, 10) d phi / d (F phi_hat) of the move
    """

    body: InertialParameters
    error: Array
    gain: Array

    def known(self, data: Effective, spread: Array, error: Array) -> tuple[InertialParameters, Array, Array]:
        """Return the body, its covariance (10, 10) with that of its masses, and how it follows F phi_hat (10, 10).

        spread  (10, 10) of the body by its masses, which the log gave blurred by the `error` (10, 10) of the shape
        As for Gaussian phi = B m + e: the move is e given m and the log, and makes up for a wrong m.
        """
        rest = np.eye(10) - self.gain @ data.information
        before = spread @ data.left_by(error)
        follows = before + self.gain @ (np.eye(10) - data.information @ before)
        return self.body, np.asarray(rest @ spread @ rest.T + self.error), np.asarray(follows)


def recentred(data: Effective, body: InertialParameters, error: Array) -> Recentred:
    """Return the body (up to `error` (10, 10) by shape and grasp) with mass and centre where the log sees them, too."""
    phi = body.vector.copy()
    slope, people = parameter_jacobian(phi)[:, :4], people_jacobian(phi)[:4]
    said, known = _of_log(data, body)
    shared = people @ error
    own = shared @ people.T
    weight = np.linalg.solve(np.eye(4) + known @ own, np.hstack([known, said]))
    move, step = slope @ own @ weight[:, :4], own @ weight[:, 4:]
    change = step @ (data.pull - data.information @ body.vector)
    left = error - move @ shared - shared.T @ move.T + move @ own @ slope.T
    found = InertialParameters.from_com(float(body.mass + change[0]), body.com + change[1:], body.inertia_com)
    return Recentred(found, 0.5 * (left + left.T), slope @ step)


def followed(data: Effective, body: InertialParameters, error: Array) -> Recentred:
    """Return the body (up to `error` (10, 10) by its shape) with all ten parameters where the log sees them, too."""
    gain = np.asarray(np.linalg.solve(np.eye(10) + error @ data.information, error))
    left = error - gain @ data.information @ error
    moved = body.vector + gain @ (data.pull - data.information @ body.vector)
    return Recentred(nearest_body(body.vector, moved), 0.5 * (left + left.T), gain)


def apart(data: Effective, body: InertialParameters, error: Array) -> float:
    """Return how far apart shape and log see the centre, in standard deviations of both, rms over what the log sees.

    error  (10, 10) of the body by its shape
    """
    people = people_jacobian(body.vector.copy())[1:4]
    said, known = _of_log(data, body)
    score = said @ (data.pull - data.information @ body.vector)
    # Whatever the mass, which the shape does not know.
    aside = known[1:, 0] / known[0, 0]
    root = np.linalg.cholesky(people @ error @ people.T)
    seen, axes = np.linalg.eigh(root.T @ (known[1:, 1:] - np.outer(aside, known[0, 1:])) @ root)
    along = axes.T @ root.T @ (score[1:] - aside * score[0])
    told = seen > SEEN
    return float(np.sqrt(np.mean(along[told] ** 2 / (seen * (1 + seen))[told]))) if told.any() else 0.0


def strayed(data: Effective, body: InertialParameters) -> float:
    """Return the chi-square (four numbers) that mass and centre of a body leave, whatever the inertia."""
    said, known = _of_log(data, body)
    score = said @ (data.pull - data.information @ body.vector)
    return float(score @ inverse_scaled(known) @ score)


def _of_log(data: Effective, body: InertialParameters) -> tuple[Array, Array]:
    """Return what the log says of mass and centre, whatever the inertia: rows (4, 10) for F phi, information (4, 4)."""
    phi = body.vector.copy()
    slopes = parameter_jacobian(phi)
    seen = slopes.T @ data.information @ slopes
    inner = seen[4:, 4:] + np.eye(6) / (ANY_INERTIA * half_trace_com(phi)) ** 2
    said = np.hstack([np.eye(4), -np.linalg.solve(inner, seen[4:, :4]).T]) @ slopes.T
    known = said @ data.information @ slopes[:, :4]
    return said, 0.5 * (known + known.T)


def nearest_body(inside: Array, target: Array) -> InertialParameters:
    """Return the mass and centre of `target` (10,) with as much of its inertia as stays well inside the bodies.

    Between the inertia of `inside` (10,), scaled to the mass, and that of `target` the farthest point counts where no
    second moment, in any direction, falls below a share of the former's.
    """
    shape, aim = InertialParameters(inside), InertialParameters(target)
    if not aim.mass > 0:
        return shape
    central = shape.inertia_com * (aim.mass / shape.mass)
    least = InertialParameters.from_com(aim.mass, aim.com, central)
    for step in np.linspace(1.0, 0.0, 21):
        body = InertialParameters.from_com(aim.mass, aim.com, central + step * (aim.inertia_com - central))
        if eigh(body.pseudo_inertia, least.pseudo_inertia, eigvals_only=True)[0] > LEAST_SHARE:
            return body
    return least
