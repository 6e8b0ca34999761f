"""Normal equations with columns beside the payload: errors of the robots' wrenches that are linear in their forces.

An error u of robot i adds l_i u f_i to the summed wrench, l_i (6, 3) its lever. Beside the ten parameters and the
biases it is one more column. A force's own noise is in the column and in the sum, so that it would explain itself: what
it makes of the equations is taken out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Group, Normal
from steelyard.team.payload.spectra import NO_LEVERS, SEEN, Spectra, regressors

# Bands count in which turns are so many times their noise: elsewhere it hides what all places share.
LOUD = 10.0


def along(wide: Sequence[Normal], ways: Array, at: Array, usual: float) -> list[Normal]:
    """Return equations in [phi, u, bias] of those in [phi, errors (N C), bias], where errors are ways u.

    at  (N, C) what was taken out already
    u, whose ways are at right angles, is held to nought by how large errors usually are, once for all recordings.
    """
    count = ways.shape[1]
    T = np.zeros((len(wide[0].H), 16 + count))
    T[:10, :10], T[10:-6, 10:-6], T[-6:, -6:] = np.eye(10), ways, np.eye(6)
    inner, u = T[:-6, :-6], np.arange(10, 10 + count)
    out = [replace(n, H=T.T @ n.H @ T, g=T.T @ n.g, noise=inner.T @ n.noise @ inner) for n in wide]
    out[0].H[u, u] += usual**-2.0
    out[0].g[u] -= ways.T @ at.ravel() / (ways**2).sum(0) * usual**-2.0
    return out


def equations(fit: PayloadFit, D: Array, levers: Array) -> tuple[list[Normal], list[Normal]]:
    """Return the normal equations of every recording without errors and with those of all robots, in loud bands.

    levers  (N, C, 6, 3) of C errors of every robot
    """
    plain, wide = list[Normal](), list[Normal]()
    for whole, weights in zip(fit.groups, fit.weights, strict=True):
        group, W = _loud(whole, weights)
        each = group.normals(D, W)
        plain += each
        force = 6 / D.shape[1] * group.wrench_noise[:, 3:].mean(1)
        wide += [_with_columns(one, part, D, W, force, levers) for one, part in zip(each, group.parts, strict=True)]
    return plain, wide


def _loud(group: Group, W: Array) -> tuple[Group, Array]:
    """Return the group with its weights (K, 6, 6) in the slowest band and those in which turns are no noise."""
    rows = np.sum([part.rows for part in group.parts], axis=0)
    turned = np.sum([np.einsum("kii->k", part.scatter[:, :3, :3]) for part in group.parts], axis=0)
    loud = turned >= LOUD * rows * np.einsum("kii->k", group.motion_noise[:, :3, :3])
    loud[0] = True
    parts = tuple(replace(p, scatter=p.scatter[loud], room=p.room[loud], rows=p.rows[loud]) for p in group.parts)
    return Group(parts, group.motion_noise[loud], group.wrench_noise[loud], sighted=False), W[loud]


def _with_columns(normal: Normal, part: Spectra, D: Array, W: Array, force: Array, levers: Array) -> Normal:
    """Return the equations of a recording with columns of all errors (N C), before the bias.

    force  (K,) [N^2] noise of a force, which is in the columns and in the sum: it would explain itself
    """
    S, T, forces = part.scatter, regressors(NO_LEVERS), np.arange(D.shape[1]).reshape(-1, 6)[:, 3:]
    robots, each = levers.shape[:2]
    count = robots * each
    columns = np.zeros((robots, each, 6, D.shape[1]))
    for column, lever, own in zip(columns, levers, forces, strict=True):
        column[..., own] = -lever
    flat, weighed = columns.reshape(count, -1), -(W[:, None, None] @ levers).reshape(len(W), robots, 6 * each, 3)
    alone = (force * part.rows)[:, None, None] * np.eye(S.shape[2])
    seen, noisy = ((weighed @ some[:, 12 + forces]).sum(0).reshape(count, 6, -1) for some in (S, alone))
    pushed, noise_pushed = (some[..., 12:-1].reshape(count, -1) for some in (seen, noisy))
    across = seen[..., SEEN].reshape(count, -1) @ T.reshape(16, -1).T
    old, u = np.r_[:10, 10 + count : 16 + count], np.arange(10, 10 + count)
    H, g, noise = np.zeros((16 + count, 16 + count)), np.zeros(16 + count), np.zeros((10 + count, 10 + count))
    H[np.ix_(old, old)], g[old], noise[:10, :10] = normal.H, normal.g, normal.noise
    H[np.ix_(u, u)], H[np.ix_(u, old)], H[np.ix_(old, u)] = pushed @ flat.T, across, across.T
    g[u], noise[10:, 10:] = (pushed - noise_pushed) @ D.ravel(), noise_pushed @ flat.T
    return replace(normal, H=H, g=g, noise=noise)
