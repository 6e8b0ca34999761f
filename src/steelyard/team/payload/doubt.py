"""What errors of grasps and gains do to the ten parameters: seen from elsewhere, a force has another moment."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.spatial import Pose, cross_matrix
from steelyard.team.payload.body_rows import summing
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.gain_sight import gain_columns
from steelyard.team.payload.model import Group, scatter
from steelyard.team.payload.spectra import regressors


def moved_by_pushes(fit: PayloadFit, D: Array) -> Array:
    """Return d phi (10, N) for changes of what every robot pushes that `fit` has in place of the pushes.

    D  (6, 6 N) sums the pushes at B
    """
    return moved_by(fit, np.moveaxis(D.reshape(6, -1, 6), 1, 0)[:, None])


def lost_turns(fit: PayloadFit, X_BG: Pose, lost: Array) -> Array:
    """Return the covariance (10, 10) that steps which the motion does not show add beyond their slope.

    lost  (6 N, L) as in `Spread`, of the length that each may have
    An angle that nobody knows may be any: along a circle D' s + D'' (1 - c) the slope may vanish where everything else
    is off, and a slope of one radian has D'^2 in place of D'^2 / 2 + 3 D''^2 / 2. The fit may have called bias what
    forces that are turned do not lift; so the mass is as unsure as it is from what they lift on average.
    """
    bends = _bends(X_BG, lost)
    out = _squares(moved_by(fit, bends[:, None]))
    S = scatter(fit.groups)
    up, pushed = S[-1, 3:6] / S[-1, -1], S[-1, 12:-1].reshape(-1, 6, 1) / S[-1, -1]
    lift = up / (up @ up)
    slope = (turned_by_step(X_BG) @ pushed[:, None])[..., 3:, 0] @ lift
    bent = (bends @ pushed)[None, :, 3:, 0] @ lift
    out[0, 0] += ((slope.ravel() @ lost) ** 2).sum() + _squares(bent)[0, 0]
    return out


def _bends(X_BG: Pose, lost: Array) -> Array:
    """Return by how much the summing block (N, 6, 6) of each grasp bends, on average over steps along `lost`."""
    screws = np.einsum("nkl,kab->nlab", lost.reshape(len(X_BG.position), 6, -1), turned_by_step(Pose.identity(1))[0])
    return np.asarray(summing(X_BG).reshape(6, -1, 6).swapaxes(0, 1) @ (screws @ screws).sum(1))


def _squares(each: Array) -> Array:
    """Return the covariance (P, P) of bends (P, N), whose mean is not zero."""
    return np.asarray(np.outer(each.sum(1), each.sum(1)) + 0.5 * each @ each.T)


def moved_by(fit: PayloadFit, changes: Array) -> Array:
    """Return d phi (10, N C) of each of C changes of the block (6, 6) that sums what a grasp pushes, (N, C, 6, 6)."""
    count, kinds = changes.shape[:2]
    flat = changes.reshape(count, 6 * kinds, 6)
    right = np.zeros((kinds * count, 10 + len(fit.levers)))
    for group, weights, blinds in zip(fit.groups, fit.weights, fit.blind, strict=True):
        for part, blind in zip(group.parts, blinds, strict=True):
            for W, S in zip(weights, part.seen(len(fit.levers) > 0), strict=True):
                pushes = S[:, 12 : 12 + 6 * count].reshape(-1, count, 6).transpose(1, 2, 0)
                change = flat @ pushes
                seen = (W @ _levers(fit, blind)).reshape(right.shape[1], -1)
                right += change.reshape(kinds * count, -1) @ seen.T
    return np.asarray(_kept(fit) @ right.T)


def moved_by_gains(fit: PayloadFit, D: Array) -> Array:
    """Return the covariance (10, 10) that `fit.gain_squares` add beyond the gains' mean pull, which acts as a bias."""
    force, unit = gain_columns(D)
    back, each = _kept(fit), list[Array]()
    for group, weights, blinds in zip(fit.groups, fit.weights, fit.blind, strict=True):
        for part, blind in zip(group.parts, blinds, strict=True):
            S = part.scatter
            mean = S[:, :, -1].sum(0) / max(float(S[:, -1, -1].sum()), 1e-300)
            seen = part.seen(len(fit.levers) > 0)
            varying = seen[:, :, 12 + force] - seen[:, :, S.shape[2] - 1, None] * mean[12 + force]
            turned = np.einsum("kau,kxu->axu", weights @ unit, varying)
            each.append(back @ _levers(fit, blind).reshape(back.shape[1], -1) @ turned.reshape(-1, len(force)))
    moved, (anew, lasting) = np.array(each), fit.gain_squares
    every = moved.sum(0)
    return np.asarray((moved @ anew @ moved.swapaxes(1, 2)).sum(0) + every @ lasting @ every.T)


def weight_by_gains(groups: Sequence[Group], D: Array) -> float:
    """Return the share of the weight that gains which err by one, each for itself, on every force axis would make.

    Gains that last make forces larger or smaller alike in every attitude, as another mass does: no motion tells.
    """
    force, unit = gain_columns(D)
    total = sum((part.scatter.sum(0)[:, -1] for group in groups for part in group.parts), np.zeros(1))
    pushed = unit[3:] * total[12 + force]
    whole = pushed.sum(1)
    return float(np.linalg.norm(whole @ pushed) / max(float(whole @ whole), 1e-300))


def _levers(fit: PayloadFit, blind: Array) -> Array:
    """Return what the wrench of a row with `Spectra.seen` says of the parameters (P, 6, 13 + Q) beside its bias."""
    out = regressors(fit.levers)[: len(blind)]
    out[:, :, 12] = -blind
    return out


def _kept(fit: PayloadFit) -> Array:
    """Return F^-1 (10, P) in the directions that the rows show."""
    scale = np.concatenate([fit.scale, np.ones(len(fit.levers))])
    unit = np.outer(scale, scale)
    inverse = np.linalg.pinv(fit.information * unit, hermitian=True, rcond=1e-10) * unit
    keep = np.eye(10) - (fit.scale[:, None] * (fit.lost @ fit.lost.T)) / fit.scale
    return np.asarray(keep @ inverse[:10])


def turned_by_step(X_BG: Pose) -> Array:
    """Return how the summing block (6, 6) of each grasp changes per step k of its own (N, 6, 6, 6)."""
    R, P = X_BG.rotation.matrix, cross_matrix(X_BG.position)
    out = np.zeros((len(R), 6, 6, 6))
    for k in range(3):
        axis = cross_matrix(np.eye(3)[k])
        out[:, k, :3, :3] = out[:, k, 3:, 3:] = R @ axis
        out[:, k, :3, 3:] = P @ R @ axis
        out[:, 3 + k, :3, 3:] = cross_matrix(R[:, :, k]) @ R
    return out
