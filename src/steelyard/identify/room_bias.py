"""A bias of the wrench that keeps its direction in the room, as one that a controller makes in the axes of the base.

In S it turns against the sensor: R^T b_tau in the torque about the origin of S and R^T b_f in the force, with R from S
to W. What of b_f points up is weight without inertia, which only acceleration tells from mass; all else shows in poses
as well. Both are taken to be drawn alike along all axes, N(0, s^2), with s averaged over a ladder by evidence: what
shows tells how large the part may be that does not.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from steelyard.check import Array
from steelyard.identify.bars.correlated import score_in_time
from steelyard.identify.cost import noise_cost
from steelyard.identify.cost.linear import inverse_scaled, nonnegative
from steelyard.identify.fit import Bias, prepared
from steelyard.identify.mixture import mixture
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.logs.log import MotionLog

# [N] the sizes that are tried, alike beforehand; for torques at this arm [m].
SIZES, ARM = (0.01, 0.03, 0.1, 0.3, 1.0, 3.0), 0.1
# Torques of so many times the size of the forces across gravity are those of a weight.
UNLIKE = 5.0
# What acceleration says of a mass may be off by this share: of filters, delays, and arms that bend.
OF_ACCELERATION = 0.02
# Noise, and with it what is told, is judged anew without the bias found: so often, or until that is nearer to the one
# before than this share of what it may be off by.
ROUNDS, STANDS = 16, 0.1


@dataclass(frozen=True, eq=False)
class RoomBias:
    """A bias of the wrench in the axes of W: mean (6,) [tau N m, f N] and covariance (6, 6)."""

    mean: Array
    covariance: Array

    def stands_beside(self, before: RoomBias) -> bool:
        """Whether it is the same as the one that was found before, for what either may be off by."""
        return bool((np.abs(self.mean - before.mean) < STANDS * np.sqrt(np.diag(self.covariance))).all())

    def errors(self) -> Array:
        """Return what it may be off by (k, 6): one standard deviation along each of its axes that may be off at all."""
        scale = np.repeat([ARM, 1.0], 3)
        values, axes = np.linalg.eigh(self.covariance / np.outer(scale, scale))
        return np.asarray((np.sqrt(np.maximum(values, 0.0)) * axes).T * scale)


def without(bias: Array, log: MotionLog, rotation: Array) -> MotionLog:
    """Return the log without a bias (6,) of the wrench in W; rotation (N, 3, 3) turns S into W."""
    in_sensor = np.einsum("nji,kj->nki", rotation, bias.reshape(2, 3))
    return replace(log, wrench=log.wrench - in_sensor.reshape(-1, 6))


def room_bias(log: MotionLog, rotation: Array, gravity: Array, bias: Bias) -> RoomBias:
    """Return the bias in W that a log shows.

    rotation  (N, 3, 3) S to W at the rows     gravity  (3,) [m/s^2] in W     bias  that of the sensor
    """
    weight = np.concatenate([np.zeros(3), OF_ACCELERATION * gravity])
    found = before = RoomBias(np.zeros(6), np.zeros((6, 6)))
    for _ in range(ROUNDS):
        left, problem = prepared(without(found.mean, log, rotation), bias)
        solution = NoiseAware(bias=bias).solution(problem)
        before = found
        found = _drawn(*_told(left, problem.with_room(left, rotation), solution, before.mean, weight), gravity)
        if found.stands_beside(before):
            return found
    step = found.mean - before.mean
    return replace(found, covariance=found.covariance + np.outer(step, step))


def _told(log: MotionLog, problem: Problem, solution: Solution, taken: Array, weight: Array) -> tuple[Array, Array]:
    """Return the information (6, 6) that the rows hold of the bias, and the right side (6,) that goes with it.

    taken   (6,) what of it was taken out of the log before
    weight  (6,) what a kilogram weighs too much or too little where acceleration tells it
    """
    own = len(solution.linear)
    wide = replace(solution, linear=np.concatenate([solution.linear, np.zeros(6)]))
    H, extra, plain = problem.information(wide.linear)
    H = problem.plus_bias_prior(nonnegative(H, plain))
    _, gradient, _ = noise_cost.derivatives(problem.residual_map(wide.linear), *problem.rows)
    variance = score_in_time(log, problem, wide).variance
    V = nonnegative(H + extra, plain) if variance is None else variance
    # How the body follows the bias: the search has set its own part of the gradient to zero.
    follow = solution.chain @ inverse_scaled(solution.with_prior(H[:own, :own])) @ solution.chain.T @ H[:own, own:]
    across = np.concatenate([-follow.T, np.eye(6)], 1)
    F = H[own:, own:] - H[own:, :own] @ follow
    off = F @ weight * solution.linear[0]
    heard = F @ inverse_scaled(across @ V @ across.T + np.outer(off, off))
    return heard @ F, heard @ (F @ taken - gradient[own:] / 2)


def _drawn(F: Array, g: Array, gravity: Array) -> RoomBias:
    """Return the bias that information F (6, 6) and right side g (6,) tell, averaged over the sizes it may be drawn.

    gravity  (3,) in W: a force along it is drawn as large as torques are where these are far larger than other forces,
             since a wrench that was zeroed with the load in hand has no others
    """
    turn = np.zeros((6, 6))
    turn[:3, :3] = turn[3:, 3:] = np.linalg.svd(gravity[None])[2]  # gravity's direction is its first row
    F, g = turn @ F @ turn.T, turn @ g
    torque, force = (axis.ravel() for axis in np.meshgrid(SIZES, SIZES, indexing="ij"))
    S = np.stack([*[ARM * torque] * 3, np.where(torque > UNLIKE * force, torque, force), force, force], 1)
    A = np.eye(6) + S[:, :, None] * F * S[:, None, :]
    covariance = S[:, :, None] * np.linalg.inv(A) * S[:, None, :]
    means = covariance @ g
    chance = (means @ g - np.linalg.slogdet(A)[1]) / 2
    mean, spread = mixture(softmax(chance), means, covariance)
    return RoomBias(turn.T @ mean, turn.T @ spread @ turn)
