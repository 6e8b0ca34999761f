"""Accelerometer: how it sits on S, and the acceleration of S that it tells."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array
from steelyard.logs.conditioning import noise_left, noise_std, signal
from steelyard.logs.curve import Curve
from steelyard.logs.recording import Stream
from steelyard.spatial import Rotation, lever_acceleration


@dataclass(frozen=True, eq=False)
class Imu:
    """An accelerometer stream, low-passed.

    signal     specific force (a - g) in its own axes, on its own clock
    noise_std  [m/s^2] per axis after the low-pass
    rotation, position  the mount as given, None where it is to be found
    """

    name: str
    signal: Curve
    noise_std: float
    rotation: Rotation | None
    position: Array | None


@dataclass(frozen=True, eq=False)
class Mounting:
    """How an accelerometer sits on S: f_S = scale R_SI (f_I - bias) - alpha x p - omega x (omega x p).

    rotation      R_SI
    position      p (3,) [m] of the accelerometer in S
    bias          (3,) [m/s^2] in its own axes
    scale         what its numbers must be multiplied with to agree with gravity
    rotation_std, position_std   (3,) [rad, m]; zero where given
    scale_std     of the scale; zero where it was not sought
    """

    rotation: Rotation
    position: Array
    bias: Array
    scale: float = 1.0
    rotation_std: Array = field(default_factory=lambda: np.zeros(3))
    position_std: Array = field(default_factory=lambda: np.zeros(3))
    scale_std: float = 0.0

    def at_sensor(self, specific_force: Array, omega: Array, alpha: Array) -> Array:
        """Return a - g of the S origin in S (N, 3) from what the accelerometer shows (N, 3) and the turning of S."""
        turned = self.scale * self.rotation.apply(specific_force - self.bias)
        return np.asarray(turned - lever_acceleration(omega, alpha, self.position))


def imu(stream: Stream, cutoff_hz: float | None) -> Imu:
    """Return the accelerometer of a timed stream."""
    values = stream.channels["specific_force"]
    curve = signal(stream.stamps, values, cutoff_hz)
    noise = float(np.sqrt((noise_std(values) ** 2).mean() * noise_left(cutoff_hz, curve.rate)))
    position = None if stream.arm is None else np.asarray(stream.arm, dtype=float)
    return Imu(stream.name, curve, noise, stream.turn, position)


def first_mount(specific_force: Array, gravity: Array | None, force: Array) -> Rotation:
    """Return R_SI from directions: specific force (N, 3) in the accelerometer's axes, gravity and force (N, 3) in S.

    Gravity alone decides while it visits two directions of S; else the force joins in (it is along a - g for a load at
    rest). A constant bias of the accelerometer cancels, save for a small share that only breaks ties. One-axis turning
    leaves rank two, which handedness completes.
    """
    f = specific_force - specific_force.mean(0)
    if gravity is None:
        return Rotation.aligning((force - force.mean(0)).T @ f)
    down = -(gravity - gravity.mean(0))
    match = down.T @ f + 0.01 * len(f) * np.outer(-gravity.mean(0), specific_force.mean(0))
    values = np.linalg.svd(match, compute_uv=False)
    if values[1] < 0.02 * values[0]:
        forces = force - force.mean(0)
        spread = np.sqrt((forces**2).sum() / max((f**2).sum(), 1e-30)) or 1.0
        match = match + 0.1 * forces.T @ f / spread
    return Rotation.aligning(match)
