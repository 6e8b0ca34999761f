"""A shape whose homogeneous parts cannot give the wrench, trusted less, step by step, until they can."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from steelyard.check import Array
from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.findings import misfit_limit
from steelyard.identify.masses.models import Masses
from steelyard.identify.masses.placement import consistent, refused, with_mass
from steelyard.identify.masses.recentred import followed, strayed
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.inertia import InertialParameters
from steelyard.parts.parts import Parts

# A shape that is wrong by more than this many doublings of its error says nothing.
DOUBLINGS = 12
LEAST_MASS = 0.1  # of what the log weighs; a shape that allows less has nothing to do with it


@dataclass(frozen=True, eq=False)
class Loosened:
    """The body with the smallest shape error, in steps of two, that homogeneous parts are within.

    masses      of the parts with that error
    body        moved off the parts as far as the log says, known up to `covariance` (10, 10)
    follows     (10, 10) how it follows the log: without a block it would lie elsewhere by this times the block's score
    times       how many times larger the error is than was said
    fits        whether the wrench fits then
    """

    masses: Masses
    body: InertialParameters
    covariance: Array
    follows: Array
    times: int
    fits: bool

    @property
    def note(self) -> str:
        """What was done, in words."""
        so = "so that the wrench fits" if self.fits else "and the wrench does not fit even so"
        return f"the shape was trusted {self.times} times less than given, {so}"


def loosened(
    data: Effective, parts: Parts, shape_error: ShapeError, model: Callable[[Effective, Parts], Masses]
) -> Loosened:
    """Return the body where parts and log together see it, with masses by the `model`.

    Raises NoMasses where even the largest error keeps mass and centre of mass from where the log sees them.
    """
    body = InertialParameters(data.best)
    limit = misfit_limit(data, len(parts))
    for doubling in range(1, DOUBLINGS):
        error = shape_error.scaled(2.0**doubling).with_grasp(consistent(parts, body))
        seen = data.blurred(error)
        masses = model(seen, parts)
        body = with_mass(parts, masses.mean, data)
        if seen.misfit(body.vector) < limit:
            break
    with_mass(parts, masses.mean, data, LEAST_MASS)
    placed, fits = followed(data, body, error), seen.misfit(body.vector) < limit
    if not fits and strayed(data, placed.body) > limit:
        raise refused(parts, data)
    spread = parts.per_mass @ masses.covariance @ parts.per_mass.T
    return Loosened(masses, *placed.known(data, spread, error), 2**doubling, fits)
