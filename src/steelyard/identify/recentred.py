"""Mass and centre of mass where shape, grasp and log together see them; the shape's inertia about the centre stays.

Shape and grasp put them at x up to an error with covariance G, the log alone sees them at x_log up to P, whatever the
inertia: they belong at x + G (G + P)^-1 (x_log - x), never beyond either. Letting a log move the inertia too loses more
in thin axes than it wins in the others.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.identify.effective import Effective
from steelyard.identify.linear import inverse_scaled
from steelyard.identify.people import parameter_jacobian, people_jacobian
from steelyard.inertia import InertialParameters


@dataclass(frozen=True, eq=False)
class Recentred:
    """A body that was moved, the covariance (10, 10) of what is left of its error, and how the move follows the log.

    gain  (10, 10) d phi / d (F phi_hat) of the move
    """

    body: InertialParameters
    error: Array
    gain: Array

    def following(self, data: Effective, before: Array) -> Array:
        """Return how phi follows F phi_hat (10, 10), where it did by `before` (10, 10) until it was moved."""
        return np.asarray(before + self.gain @ (np.eye(10) - data.information @ before))


def recentred(data: Effective, body: InertialParameters, error: Array) -> Recentred:
    """Return the body (up to `error` (10, 10) by shape and grasp) with mass and centre where the log sees them, too."""
    F, phi = data.information, body.vector
    slope, people = parameter_jacobian(phi)[:, :4], people_jacobian(phi)[:4]
    # What the log says of mass and centre, whatever the inertia.
    said = slope[:4].T @ np.hstack([np.eye(4), -F[:4, 4:] @ inverse_scaled(F[4:, 4:].copy())])
    known = said @ F[:, :4] @ slope[:4]
    shared = people @ error
    own = shared @ people.T
    weight = np.linalg.solve(np.eye(4) + known @ own, np.hstack([known, said]))
    move, step = slope @ own @ weight[:, :4], own @ weight[:, 4:]
    change = step @ (data.pull - F @ phi)
    left = error - move @ shared - shared.T @ move.T + move @ own @ slope.T
    found = InertialParameters.from_com(float(body.mass + change[0]), body.com + change[1:], body.inertia_com)
    return Recentred(found, 0.5 * (left + left.T), slope @ step)
