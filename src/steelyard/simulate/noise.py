"""Noise of known strength and colour."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np
from scipy import signal

from steelyard.check import Array
from steelyard.errors import BadValue

Spectrum = Literal["white", "2hz"]
# Standard deviations of angular acceleration, acceleration, force, torque [rad/s^2, m/s^2, N, N m].
Std = tuple[float, float, float, float]
SPECTRA: tuple[Spectrum, ...] = ("white", "2hz")
CUTOFF_HZ = 2.0
_SETTLE_S = 5.0


def unit_noise(rng: np.random.Generator, rows: int, columns: int, spectrum: Spectrum, rate: float) -> Array:
    """Return noise (rows, columns) of standard deviation 1, columns independent, sampled at `rate` [Hz].

    "white": independent rows. "2hz": white noise through a digital second-order Butterworth low-pass
    (bilinear) with its -3 dB point at 2 Hz, divided by the filter's own gain for white noise, after 5 s of
    settling from rest (the transient is then below 1e-19): stationary from the first row. Raises BadValue for any
    other spectrum.
    """
    if spectrum == "white":
        return rng.standard_normal((rows, columns))
    if spectrum != "2hz":
        raise BadValue(f"spectrum must be 'white' or '2hz'; got {spectrum!r}.")
    sections = signal.butter(2, CUTOFF_HZ, fs=rate, output="sos")
    settle = math.ceil(_SETTLE_S * rate)
    impulse = np.zeros(settle)
    impulse[0] = 1
    gain = np.linalg.norm(signal.sosfilt(sections, impulse))
    driven = signal.sosfilt(sections, rng.standard_normal((rows + settle, columns)), axis=0)
    return np.ascontiguousarray(driven[settle:] / gain)
