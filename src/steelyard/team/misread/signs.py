"""Signs of one robot's wrench: what is said of one that was turned, and torques that do not go with its forces.

Torques of one robot that have another sign, or another size, than its forces show in moments: without, all balance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.inertia.regressor import basis
from steelyard.team.payload.model import Group, left_of_pushes, scatter

# What is left of the moments must fall by this factor.
TORQUES_FALL = 16.0
# What turns the sign of a wrench's moments alone (6, 6).
TORQUES_TURNED = np.diag([-1.0, -1.0, -1.0, 1.0, 1.0, 1.0])


def sign_finding(name: str) -> Finding:
    """Return the finding of a robot whose forces had the other sign."""
    text = f"What '{name}' and the others push against one another cancels only with its sign turned; it was."
    remedy = f'Set wrench = "on-sensor" in the [[robot]] \'{name}\' ("on-object" if that is what it says).'
    return Finding("wrench-sign-flipped", text, remedy)


def torque_sign_finding(name: str, turned: bool) -> Finding:
    """Return the finding of a robot whose torques have another sign than its forces, which were `turned` or not."""
    which, other = ("force", "torques") if turned else ("torque", "forces")
    text = (
        f"The torques of '{name}' fit one body only with the sign opposite to that of its forces: the sign of its "
        f"{which}s was turned, that of its {other} was not."
    )
    return Finding("wrench-sign-flipped", text, f"Turn the signs of the {which} columns of '{name}', and of no others.")


def torques_of_other_sign(groups: Sequence[Group], D: Array) -> int | None:
    """Return the one robot whose torques must have the other sign for moments to balance, None where none must.

    D  (6, 6 N) sums the pushes at B
    """
    S = scatter(groups)
    left = {i: _moments_left(S, D, i, -1.0) for i in with_torque_sensor(S)}
    fall = [i for i in left if left[i] * TORQUES_FALL < _moments_left(S, D, i, 1.0)]
    return min(fall, key=left.__getitem__, default=None)


def torque_factor(groups: Sequence[Group], D: Array) -> tuple[int, float] | None:
    """Return the one robot whose torques balance moments times a factor, and that factor; None where none does."""
    S, best = scatter(groups), []
    for i in with_torque_sensor(S):
        none, given, turned = (_moments_left(S, D, i, times) for times in (0.0, 1.0, -1.0))
        bend = (given + turned) / 2 - none
        if bend > 0:
            times = (turned - given) / (4 * bend)
            best.append((_moments_left(S, D, i, times) / given, i, times))
    if not best or min(best)[0] * TORQUES_FALL > 1:
        return None
    return min(best)[1:]


def with_torque_sensor(S: Array) -> Integers:
    """Return the robots that measure torques."""
    own = np.diag(S)[12:-1].reshape(-1, 6)[:, :3]
    return np.flatnonzero(own.any(1)).astype(np.int64)


def _moments_left(S: Array, D: Array, robot: int, times: float) -> float:
    """Return what a body leaves of the moments about B with one robot's torques taken so many times."""
    D = D[:3].copy()
    D[:, 6 * robot : 6 * robot + 3] *= times
    return left_of_pushes(D, basis()[1:, :3], S)
