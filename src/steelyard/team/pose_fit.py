"""Joint maximum likelihood over all grasps from poses, for bases that stand still.

Every robot i reports the pose T_i(t) of its grasp in its own home. With the homes Z_i and the payload X(t) in the home
of the reference robot and the grasps G_i in the reference grasp,
    T_i(t) = Z_i^-1 X(t) G_i exp(e_i),   e_i ~ N(0, W_i^-1),
so that every loop closes by construction. A Gauss-Newton step has six unknowns per row of time, which are eliminated
row by row (Schur complement), and thirteen per robot: grasp, home and how late its clock is.
Source: own; the paper fits twists of pairs (eq. 1-8) and refines them (section III-B2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.log import Integers
from steelyard.team import pose_rows
from steelyard.team.adjoint import adjoint_inverse, exp
from steelyard.team.pose_noise import pose_noise
from steelyard.team.pose_rows import OWN, SIGN, WHICH
from steelyard.team.poses import Team, TeamMotion

STEPS = 12
# A step that lowers chi^2 by less than this is smaller than a hundredth of a standard deviation.
SETTLED = 1e-4
# Rows that are enough to come near the optimum; all rows then finish.
FEW_ROWS = 1500
# A direction of a grasp is shown where the motion along it is so many times the noise of a single row.
SHOWN = 5.0
# Noise to begin with [rad, m].
GUESS = 1e-3
# Noise is renewed until it changes by less than this share.
NOISE_SETTLED = 0.03


@dataclass(frozen=True, eq=False)
class Linear:
    """One linearisation of the fit with the motion eliminated: chi^2 = const - 2 pull.d + d.information.d.

    residual  (T, N, 6) from predicted to measured, in the axes of each grasp
    free      (T, 6) how the motion moves at d = 0
    scores    (T, 13 N) what each row adds to `pull`
    """

    information: Array
    pull: Array
    residual: Array
    free: Array
    scores: Array
    J: Array
    W: Array
    inverse: Array


def linearise(data: TeamMotion, team: Team, noise: Array) -> Linear:
    """Return the normal equations of one Gauss-Newton step; noise (N, 2) [rad, m]."""
    W, J = np.repeat(noise**-2.0, 3, axis=1), adjoint_inverse(team.grasps)
    found, place = data.patterns
    info = np.einsum("nia,ni,nib->nab", J, W, J)
    held = np.einsum("cn,nab->cab", found.astype(float), info)
    # Rows that nobody saw say nothing: any motion will do.
    held[~found.any(1)] = np.eye(6)
    inverse = np.linalg.inv(held)
    G, Z, X = team.grasps, team.homes, team.motion
    residual = pose_rows.residuals(
        data.poses.rotation.matrix, data.poses.position, data.valid, G.rotation.matrix, G.position, Z.rotation.matrix,
        Z.position, X.rotation.matrix, X.position,
    )  # fmt: skip
    if data.twist is not None:
        residual = residual - data.twist * team.delays[:, None] * data.valid[..., None]
    free, rest = pose_rows.followed(residual, data.valid, J, W, inverse, place)
    scores = pose_rows.scores(rest, data.features, WHICH, SIGN)
    information = sum(
        (
            pose_rows.information(S, J, W, seen, WHICH, SIGN)
            for S, seen in zip(data.scatter, found, strict=True)
            if seen.any()
        ),
        np.zeros((OWN * data.count, OWN * data.count)),
    )
    return Linear(information, scores.sum(0), residual, free, scores, J, W, inverse)


@dataclass(frozen=True, eq=False)
class Solved:
    """A step in the directions that the motion shows.

    step     (K,) of the unknown parameters
    inverse  (K, K) their covariance for white noise
    lost     (K, L) directions of theirs that the motion does not show, unit length in units of the noise
    """

    step: Array
    inverse: Array
    lost: Array


def solved(linear: Linear, unknown: Integers, noise: Array, rows: int) -> Solved:
    """Return the step in the parameters `unknown`; the others, and directions not shown, stay.

    Homes and delays always follow; of what is then left for the grasps, a direction counts as lost where the motion
    along it is less than SHOWN times the noise of a row: from noise alone, poses look as if they moved that much.
    """
    H, g = linear.information[np.ix_(unknown, unknown)], linear.pull[unknown]
    grasp = unknown % OWN < 6
    homes = np.linalg.pinv(H[np.ix_(~grasp, ~grasp)], hermitian=True)
    carried = H[np.ix_(grasp, ~grasp)] @ homes
    left = H[np.ix_(grasp, grasp)] - carried @ H[np.ix_(~grasp, grasp)]
    turn, place = noise[unknown[grasp] // OWN].T
    floor = np.where(unknown[grasp] % OWN < 3, 2.0, (turn / place) ** 2) * rows
    scale = 1 / np.sqrt(floor)
    values, vectors = np.linalg.eigh(left * np.outer(scale, scale))
    shown = values > SHOWN**2
    root = scale[:, None] * vectors[:, shown]
    inverse = np.zeros_like(H)
    inner = (root / values[shown]) @ root.T
    back = -carried.T @ inner
    inverse[np.ix_(grasp, grasp)] = inner
    inverse[np.ix_(~grasp, grasp)] = back
    inverse[np.ix_(grasp, ~grasp)] = back.T
    inverse[np.ix_(~grasp, ~grasp)] = homes - back @ carried
    lost = np.zeros((len(unknown), int((~shown).sum())))
    lost[grasp] = scale[:, None] * vectors[:, ~shown]
    return Solved(inverse @ g, inverse, lost)


def moved(data: TeamMotion, team: Team, linear: Linear, unknown: Integers, step: Array) -> Team:
    """Return the team after a step in the unknown parameters, with the motion that follows from it."""
    full = np.zeros(OWN * data.count)
    full[unknown] = step
    own = full.reshape(-1, OWN)
    follow = linear.free - pose_rows.moved_by(
        full, data.features, linear.J, linear.W, linear.inverse, data.patterns[1], data.valid, WHICH, SIGN
    )
    return Team(
        team.grasps @ exp(own[:, :6]),
        team.homes @ exp(own[:, 6:12]),
        team.motion @ exp(follow),
        team.delays + own[:, 12],
    )


@dataclass(frozen=True, eq=False)
class PoseFit:
    """The optimum: the team, its last normal equations, noise (N, 2) [rad, m] and which parameters were unknown."""

    team: Team
    linear: Linear
    noise: Array
    unknown: Integers
    solved: Solved


def fit_poses(data: TeamMotion, start: Team, reference: int, noise: Array | None = None) -> PoseFit:
    """Return the optimum near `start`; the noise of every robot is estimated along the way.

    Delays are estimated where the data have twists. Evenly spread rows come first, all rows finish.
    """
    rows, count = data.valid.shape
    own = np.arange(OWN if data.twist is not None else OWN - 1)
    unknown = np.concatenate([OWN * i + own for i in range(count) if i != reference])
    team, noise = start, np.full((count, 2), GUESS) if noise is None else noise
    every = rows // FEW_ROWS
    if every > 1:
        thin = slice(None, None, every)
        few = fit_poses(data.rows(thin), replace(start, motion=start.motion[thin]), reference, noise)
        noise, team = few.noise, replace(few.team, motion=data.motion_seen(few.team.grasps, few.team.homes))
    for _ in range(STEPS):
        linear = linearise(data, team, noise)
        new = pose_noise(linear.residual, data.valid, linear.J, noise)
        quiet = np.abs(np.log(new / noise)).max() < NOISE_SETTLED
        last = solved(linear, unknown, noise, rows)
        if quiet and float(last.step @ linear.pull[unknown]) < SETTLED:
            break
        team = moved(data, team, linear, unknown, last.step)
        noise = new
    return PoseFit(team, linear, noise, unknown, last)
