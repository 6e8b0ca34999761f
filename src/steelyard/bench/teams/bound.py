"""The Cramer-Rao bound of a team whose poses and forces err by white noise, and how near the joint estimate comes.

The bound of the grasps is that of the joint likelihood of poses at the truth. That of the ten parameters takes grasps
as known, which only lowers it: the wrench equation at every frequency of the true motion, its noise that of the forces
and of accelerations from the best path that the poses allow.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from scipy.fft import dct

from steelyard.bench.teams.intervals import errors
from steelyard.check import Array
from steelyard.inertia.parameters import frame_change
from steelyard.inertia.people import people_jacobian
from steelyard.inertia.regressor import basis, motion_map
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import EXACT, TeamNoise, TeamScene
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.joint import JointTeam
from steelyard.team.payload.body_rows import balance_frame, summing
from steelyard.team.payload.gain_sight import of_force
from steelyard.team.poses.fit import information
from steelyard.team.poses.measured import TeamMotion
from steelyard.team.poses.solver import OWN, Solver
from steelyard.team.poses.team import PoseTeam

FIRST_SEED = 9000
HIGHEST_HZ = 4.0
WHITE = TeamNoise(pose_rad=1e-3, pose_m=5e-4, force_white_N=1.0)
SCENE = TeamScene(WHITE, 3, "poses", kinds=("motion",), motion_samples=2000)


def bound(noise: TeamNoise, exact: TeamTrial) -> dict[str, Array]:
    """Return the least standard deviations by kind for noise that is white, from the noise-free trial."""
    standing = PoseTeam.of(exact.log, False)
    data = TeamMotion.of(standing.parts)
    team, count = standing.fit.team, len(exact.log.names)
    size = np.tile([noise.pose_rad, noise.pose_m], (count, 1))
    unknown = np.concatenate([OWN * i + np.arange(OWN - 1) for i in range(1, count)])
    H = information(data, team.grasps, size)[np.ix_(unknown, unknown)]
    grasps = np.sqrt(np.diag(Solver.of(H, unknown, size, len(data.valid)).all_shown().inverse))
    each = grasps.reshape(count - 1, OWN - 1)
    std = _payload(noise, exact, standing)
    return {
        "rotation": each[:, :3].ravel(), "position": each[:, 3:6].ravel(), "mass": std[:1], "com": std[1:4],
        "inertia": std[4:],
    }  # fmt: skip


def _payload(noise: TeamNoise, exact: TeamTrial, standing: PoseTeam) -> Array:
    grasps = standing.fit.grasps
    frame = balance_frame(grasps)
    D = summing(frame.inverse() @ grasps)
    forces = D[:, of_force(D.shape[1])]
    weights = np.repeat([noise.pose_rad**-2, noise.pose_m**-2], 3)
    path = np.linalg.inv(np.einsum("nia,i,nib->ab", *[adjoint_inverse(grasps), weights, adjoint_inverse(grasps)]))
    path = adjoint_inverse(frame) @ path @ adjoint_inverse(frame).T
    body = exact.truth.body.in_frame(frame.inverse()).vector
    M, F = motion_map(body)[:, :6], np.zeros((10, 10))
    for rows, _ in standing.rows(exact.log, HIGHEST_HZ)[0]:
        for run in rows.runs:
            x = dct(run.motion, axis=0, norm="ortho")
            hz = np.arange(len(x)) * (run.rate / (2 * len(x)))
            kept = hz <= HIGHEST_HZ
            shaken = M @ path @ M.T * ((2 * np.pi * hz[kept]) ** 4)[:, None, None]
            V = shaken + noise.force_white_N**2 * forces @ forces.T
            slope = np.einsum("pix,tx->tip", basis(), x[kept])
            F += np.einsum("tip,tij,tjq->pq", slope, np.linalg.inv(V), slope, optimize=True)
    change = frame_change(frame)
    jacobian = people_jacobian(exact.truth.body.vector) @ change
    return np.sqrt(np.diag(jacobian @ np.linalg.inv(F) @ jacobian.T))


def run(trials: int) -> dict[str, Any]:
    """Return rms error over rms bound by kind, over trials with white noise and no bias."""
    kinds = ("rotation", "position", "mass", "com", "inertia")
    squares = {kind: np.zeros(2) for kind in kinds}
    for seed in range(FIRST_SEED, FIRST_SEED + trials):
        made = simulate_team(SCENE, seed)
        exact = simulate_team(replace(SCENE, noise=EXACT), seed)
        found, least = errors(made, JointTeam(clocks=False).identify(made.log)), bound(WHITE, exact)
        for kind in kinds:
            squares[kind] += [float((found[kind][0] ** 2).sum()), float((least[kind] ** 2).sum())]
    return {
        "trials": trials,
        **{
            kind: {"ratio": float(np.sqrt(s[0] / s[1])), "bound_rms": float(np.sqrt(s[1] / trials))}
            for kind, s in squares.items()
        },
    }
