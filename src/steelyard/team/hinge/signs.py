"""Whether forces have the sign that they should where the payload is two bodies with a hinge: see `misread.signs`.

What robots push against one another through the hinge cancels in the sum of forces too. Beside the first body's motion,
that of the second, turned by the hinge's angle, is taken out of every force, and so is a bias that turns.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.team.hinge.poses import Hinged
from steelyard.team.hinge.rows import Sums, about_z
from steelyard.team.misread.signs import odd_one_out
from steelyard.team.payload.body_rows import BodyRows
from steelyard.team.payload.spectra import as_frequencies

# Columns before the robots' forces: motion of the first body, of the second, that turned, means and means turned.
MOTION = 12
INNER = 4 * MOTION + 3


def robot_of_other_sign(
    made: Sequence[tuple[Hinged, BodyRows, BodyRows]], sums: Sums, names: Sequence[str], highest_hz: float
) -> tuple[int | None, tuple[Finding, ...]]:
    """Return the robot whose sign must be turned, None where all are right, and the finding that says so.

    made  of every recording, where everything is and the rows of either body
    """
    count = len(names)
    each, lifted = np.zeros((count, count)), np.zeros(count)
    for still in (True, False):
        some = [_scatter(team, one, two, sums, highest_hz) for team, one, two in made if one.still == still]
        if some:
            S = np.sum(some, axis=0)
            inner, pushes = S[:INNER, :INNER], S[INNER:, :INNER]
            left = S[INNER:, INNER:] - pushes @ np.linalg.pinv(inner, 1e-9, hermitian=True) @ pushes.T
            each += np.einsum("aiaj->ij", left.reshape(3, count, 3, count))
            lifted += np.einsum("aia->i", pushes[:, 3:6].reshape(3, count, 3))
    return odd_one_out(each, lifted, names)


def _scatter(team: Hinged, one: BodyRows, two: BodyRows, sums: Sums, highest_hz: float) -> Array:
    """Return the scatter of motion and forces of one recording, as far as frequencies are used."""
    count = len(team.second)
    out = np.zeros((INNER + 3 * count, INNER + 3 * count))
    # (N, 3, 6): the force that each robot's push adds, with the hinge at zero.
    forces = np.split((sums.first + sums.second)[3:], count, axis=1)
    for run, other in zip(one.runs, two.runs, strict=True):
        turn = about_z(team.angle[run.rows])[:, 3:, 3:]
        pushed = np.split(run.pushed, count, axis=1)
        force = np.stack([own @ F.T for own, F in zip(pushed, forces, strict=True)], axis=2)
        force[..., team.second] = turn @ force[..., team.second]
        cos, sin = turn[:, :1, 0], turn[:, 1:2, 0]
        seen = [run.motion, other.motion, cos * other.motion, sin * other.motion, np.ones_like(cos), cos, sin]
        z = as_frequencies([*seen, force.reshape(len(force), -1)], run, highest_hz, not one.still)
        out += z.T @ z
    return out
