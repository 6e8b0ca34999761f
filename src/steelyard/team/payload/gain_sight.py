"""What the changes of forces say of their gains.

A gain that errs makes forces wrong as they change: D s - L(phi) x = b + sum_k gamma_k u_k s_k + noise, u_k (6,) the
unit wrench at B of force axis k. Beside a bias and a body of the recording's own, these columns show most of the gamma;
what all share (a heavier body) they do not. Only bands and combinations of axes that change far more than they are
noisy are asked: elsewhere noise would explain itself.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.team.definite import shown_axes
from steelyard.team.payload.spectra import Spectra, regressors

# What changes by so many times the power of its noise counts: of a band, with all the sum's noise on each axis, and of
# a combination of axes.
LOUD = 10.0
# Information below this share of the largest is rounding.
RANK = 1e-9


@dataclass(frozen=True, eq=False)
class GainSight:
    """Information about the gains (F,) of all force axes, and its right side (F,), with body and bias left out."""

    information: Array
    right: Array

    @classmethod
    def none(cls, axes: int) -> GainSight:
        """Return that of a recording which says nothing of `axes` gains."""
        return cls(np.zeros((axes, axes)), np.zeros(axes))

    def evidence(self, sizes: Array) -> Array:
        """Return the logarithm (L,) of how likely gains ~ N(0, s^2) are against none, for `sizes` (L,)."""
        values, _, along = self._axes
        kept = np.square(sizes)[:, None] / (1 + np.square(sizes)[:, None] * values)
        return np.asarray(0.5 * (kept @ along**2 - np.log1p(np.square(sizes)[:, None] * values).sum(1)))

    def squares(self, size: float) -> Array:
        """Return the mean products (F, F) of the gains' errors given what is seen, where they are ~ N(0, size^2)."""
        values, axes, along = self._axes
        kept = size**2 / (1 + size**2 * values)
        mean = axes @ (kept * along)
        return np.asarray((axes * kept) @ axes.T + np.outer(mean, mean))

    @cached_property
    def _axes(self) -> tuple[Array, Array, Array]:
        """Return eigenvalues (F,) and vectors (F, F) of the information, and its right side (F,) along these."""
        values, axes = np.linalg.eigh(self.information)
        told = values > RANK * max(float(values[-1]), 1e-300)
        return np.where(told, values, 0.0), axes, np.where(told, axes.T @ self.right, 0.0)


def gain_sight(part: Spectra, D: Array, W: Array, noise: Array, levers: Array) -> GainSight:
    """Return what one recording says of its gains.

    D  (6, 6 N) sums the pushes at B     W  (K, 6, 6) weights     noise  (K, 6) of the summed wrench
    levers  (U, 6, Q) of biases that stand still in the room, which are left out as well
    """
    axes, unit = gain_columns(D)
    axes = 12 + axes
    each = noise[:, 3:].mean(1)
    bands = _changes(part.scatter, axes) > LOUD * each * part.rows
    if not bands.any():
        return GainSight.none(len(axes))
    S, W, rows, each = part.scatter[bands], W[bands], part.rows[bands], each[bands]
    inside, last = S.shape[1], S.shape[1] - 1
    if len(levers):
        room = part.room[bands]
        S = np.concatenate([np.concatenate([S, room[..., :inside].swapaxes(1, 2)], axis=2), room], axis=1)
    known = regressors(levers)
    beside = len(known)
    T = np.zeros((beside + len(axes), 6, S.shape[1]))
    T[:beside, :, :12], T[:beside, :, last:] = known[..., :12], known[..., 12:]
    T[np.arange(beside, len(T)), :, axes] = unit.T
    K = np.zeros((6, S.shape[1]))
    K[:, 12:last] = D
    seen = ((W[:, None] @ T).reshape(len(S), -1, S.shape[1]) @ S).sum(0).reshape(len(T), -1)
    H, g = seen @ T.reshape(len(T), -1).T, seen @ K.ravel()
    # A sensor's own noise is in the sum and in its column: the robots are taken as noisy alike.
    own = 3 * each * rows / len(axes)
    noisy = (unit * (np.tensordot(own, W, 1) @ unit)).sum(0)
    g[beside:] -= noisy
    axes_beside, values = shown_axes(H[:beside, :beside], RANK)
    held = axes_beside / np.sqrt(values)
    blind = H[beside:, :beside] @ held
    return _loud(H[beside:, beside:] - blind @ blind.T, g[beside:] - blind @ (held.T @ g[:beside]), noisy)


def _loud(information: Array, right: Array, noisy: Array) -> GainSight:
    """Return what is left without combinations of axes that are mostly noise: `noisy` (F,) of the information."""
    unit = np.sqrt(np.maximum(noisy, 1e-300))
    values, axes = np.linalg.eigh(information / np.outer(unit, unit))
    told = values > LOUD
    back = unit[:, None] * axes[:, told]
    return GainSight((back * values[told]) @ back.T, back @ (axes[:, told].T @ (right / unit)))


def gain_columns(D: Array) -> tuple[Integers, Array]:
    """Return which of the 6 N pushes are forces (3 N,), and the unit wrench at B of each (6, 3 N)."""
    force: Integers = np.flatnonzero(of_force(D.shape[1])).astype(np.int64)
    return force, D[:, force]


def of_force(axes: int) -> Mask:
    """Return which of so many axes (6 N,) of pushes, the moment of each before its force, are those of forces."""
    return np.asarray(np.arange(axes) % 6 >= 3)


def _changes(S: Array, axes: Integers) -> Array:
    """Return the mean power (K,) of force axes in every band without their constant."""
    constant = S[:, -1, -1, None]
    power = S[:, axes, axes] - np.where(constant > 0, S[:, axes, -1] ** 2 / np.maximum(constant, 1e-300), 0.0)
    return np.asarray(power.mean(1))
