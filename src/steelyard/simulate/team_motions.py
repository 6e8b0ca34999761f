"""Motions of a payload carried by a team: each of six axes a sum of sines, with exact derivatives.

The rotation is given as a rotation vector r(t), R_WC = exp(r), so that a motion may be held to an axis, to a plane or
to a pivot. W is the payload frame C at rest.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.simulate.motions import Kinematics
from steelyard.spatial import Rotation, cross, lever_acceleration
from steelyard.spatial.screws import second_coefficients

_SMALL = 0.05  # [rad] below it three terms of a series are exact to the last digits
SINES = 5


@dataclass(frozen=True, eq=False)
class Freedom:
    """What a motion may do: columns (3, k) that span its rotation vectors and its translations, in C at rest.

    pivot  (3,) [m] a point of the payload that stays where it is, instead of any translation
    """

    rotation: Array
    translation: Array
    pivot: Array | None = None

    @classmethod
    def general(cls) -> Freedom:
        """Return six free axes."""
        return cls(np.eye(3), np.eye(3))


@dataclass(frozen=True, eq=False)
class SineMotion:
    """Sines about and along the axes of a Freedom.

    rotation, translation  (k, 3, SINES): amplitude [rad or m], angular frequency [rad/s], phase [rad] of every axis
    """

    freedom: Freedom
    rotation: Array
    translation: Array

    def scaled(self, factor: float) -> SineMotion:
        """Return the same motion with all amplitudes times `factor`."""
        size = np.array([factor, 1.0, 1.0])[:, None]
        return replace(self, rotation=self.rotation * size, translation=self.translation * size)

    def at(self, time: Array) -> Kinematics:
        """Return the payload's kinematics at `time` (T,) [s]."""
        turn = tuple(x @ self.freedom.rotation.T for x in sines(self.rotation, time))
        rotation = Rotation.exp(turn[0])
        omega, alpha = rotation_vector_rates(*turn)
        if self.freedom.pivot is not None:
            lever = -self.freedom.pivot
            position = self.freedom.pivot + rotation.apply(lever)
            velocity = cross(omega, lever)
            acceleration = lever_acceleration(omega, alpha, lever)
        else:
            moved = [x @ self.freedom.translation.T for x in sines(self.translation, time)]
            position = moved[0]
            velocity, acceleration = (rotation.inverse().apply(x) for x in moved[1:])
        return Kinematics(time, rotation, position, velocity, acceleration, omega, alpha, np.zeros(len(time), np.int64))


def draw_motion(
    rng: np.random.Generator,
    time: Array,
    band_hz: tuple[float, float],
    rotation_max: float,
    translation_max: float,
    freedom: Freedom,
) -> SineMotion:
    """Return a motion whose every axis reaches its maximum [rad, m] once over `time` (T,) [s].

    Frequencies are uniform in `band_hz`, amplitudes uniform(0.5, 1) / sqrt(frequency), phases uniform. Six axes are
    drawn whatever the freedom, so that motions of one seed are alike.
    """
    drawn = np.empty((6, 3, SINES))
    frequency = rng.uniform(*band_hz, (6, SINES))
    drawn[:, 0] = rng.uniform(0.5, 1.0, (6, SINES)) / np.sqrt(frequency)
    drawn[:, 1] = 2 * np.pi * frequency
    drawn[:, 2] = rng.uniform(0, 2 * np.pi, (6, SINES))
    largest = np.abs(sines(drawn, time)[0]).max(0)
    drawn[:, 0] *= (np.repeat([rotation_max, translation_max], 3) / largest)[:, None]
    turns, moves = freedom.rotation.shape[1], freedom.translation.shape[1]
    return SineMotion(freedom, drawn[:turns], drawn[3 : 3 + moves])


def sines(drawn: Array, time: Array) -> tuple[Array, Array, Array]:
    """Return sums of sines (T, k) at `time` (T,) and their first two derivatives, from (k, 3, SINES)."""
    amplitude, rate, phase = drawn[:, 0], drawn[:, 1], drawn[:, 2]
    angle = time[:, None, None] * rate + phase
    sine, cosine = np.sin(angle), np.cos(angle)
    return (
        (amplitude * sine).sum(-1),
        (amplitude * rate * cosine).sum(-1),
        -(amplitude * rate**2 * sine).sum(-1),
    )


def rotation_vector_rates(r: Array, dr: Array, ddr: Array) -> tuple[Array, Array]:
    """Return angular velocity and acceleration (T, 3) in body axes of R = exp(r), from r and its derivatives (T, 3).

    With t = |r|: omega = dr - b r x dr + c r x (r x dr), b = (1 - cos t) / t^2, c = (t - sin t) / t^3, and alpha is
    its derivative.
    """
    square = (r * r).sum(-1)
    t = np.sqrt(square)
    small = t < _SMALL
    s = np.where(small, 1.0, t)
    b, c = second_coefficients(t, _SMALL)
    slope_b = np.where(small, -1 / 12 + square / 180 - square**2 / 6720, (s * np.sin(s) - 2 * (1 - np.cos(s))) / s**4)
    slope_c = np.where(small, -1 / 60 + square / 1260 - square**2 / 60480, (3 * np.sin(s) - s * (2 + np.cos(s))) / s**5)
    growth = (r * dr).sum(-1)
    b, c, db, dc = (x[:, None] for x in (b, c, slope_b * growth, slope_c * growth))
    once, again = cross(r, dr), cross(r, ddr)
    twice = cross(r, once)
    omega = dr - b * once + c * twice
    alpha = ddr - b * again + c * cross(r, again) - db * once + dc * twice + c * cross(dr, once)
    return omega, alpha
