"""One robot whose torques have another sign, or another size, than its forces: moments of all balance without."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.inertia.regressor import basis
from steelyard.logs.log import Integers
from steelyard.team.payload.leftover import scatter, unexplained
from steelyard.team.payload.model import Group

# What is left of the moments must fall by this factor.
FALLS = 16.0


def with_torque_sign(groups: Sequence[Group], D: Array) -> tuple[int | None, Array]:
    """Return the one robot whose torques must have the other sign for moments to balance, and D with it turned.

    D  (6, 6 N) sums the pushes at B
    """
    S = scatter(groups)
    left = {i: _moments_left(S, D, i, -1.0) for i in _with_torque_sensor(S)}
    if not left:
        return None, D
    robot = min(left, key=left.__getitem__)
    if left[robot] * FALLS > _moments_left(S, D, robot, 1.0):
        return None, D
    return robot, _torque_taken(D, robot, -1.0)


def torque_factor(groups: Sequence[Group], D: Array) -> tuple[int, float] | None:
    """Return the one robot whose torques balance moments times a factor, and that factor; None where none does."""
    S, best = scatter(groups), []
    for i in _with_torque_sensor(S):
        none, given, turned = (_moments_left(S, D, i, times) for times in (0.0, 1.0, -1.0))
        bend = (given + turned) / 2 - none
        if bend > 0:
            times = (turned - given) / (4 * bend)
            best.append((_moments_left(S, D, i, times) / given, i, times))
    if not best or min(best)[0] * FALLS > 1:
        return None
    return min(best)[1:]


def _with_torque_sensor(S: Array) -> Integers:
    """Return the robots that measure torques."""
    own = np.diag(S)[12:-1].reshape(-1, 6)[:, :3]
    return np.flatnonzero(own.any(1)).astype(np.int64)


def _moments_left(S: Array, D: Array, robot: int, times: float) -> float:
    """Return what a body leaves of the moments about B with one robot's torques taken so many times."""
    return unexplained(_torque_taken(D, robot, times)[:3], basis()[1:, :3], S)


def _torque_taken(D: Array, robot: int, times: float) -> Array:
    out = D.copy()
    out[:3, 6 * robot : 6 * robot + 3] *= times
    return out
