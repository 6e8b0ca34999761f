"""The sensor's own matrix: what no body can feel, a wrench turned in S or forces whose axes have unlike gains.

At rest the force is m g whatever is held, so that 8 of the 9 numbers that take gravity to the force are the sensor's: a
turn, which a mount that was not declared gives, and a stretch of its axes, which a calibration gives. The ninth, a gain
that all axes share, looks like mass.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, codes
from steelyard.identify.estimate import Estimate
from steelyard.inertia import forms
from steelyard.inertia.people import parameter_jacobian
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import Rows
from steelyard.sanity.words import axis_words, mount_remedy, mounted
from steelyard.spatial import Rotation, cross_matrix

# A turn [rad] and a gain are worth a word from what careful mounting and good calibration leave, if they are so many
# standard deviations from none and leave so much less of the squared residual.
TURN, UNLIKE, SURE = np.radians(1.0), 0.015, 8.0
TURN_LEFT, UNLIKE_LEFT = 0.95, 0.99
# Turns and stretches that a body and a bias mimic but for this share of their squares are not told: noise of the
# acceleration alone would decide them. A sweep of one joint keeps gravity within some 3 degrees of a plane of S.
TOLD = 3e-3
# The turn is linearised anew until it changes by less [rad].
ROUNDS, SETTLED = 5, 1e-5
_FEWEST_ROWS = 8


@dataclass(frozen=True, eq=False)
class SensorMatrix:
    """How the sensor turns and stretches what is felt, with standard deviations by leaving out stretches of the log.

    turn, turn_std        (3,) [rad] of the wrench about the axes of S
    stretch, stretch_std  (3, 3) of the force, symmetric and without a trace: gains of the axes beside their mean
    left                  squared residual beside that of a sensor without either
    moved                 (4,) what mass [kg] and its first moment [kg m] are less with it
    """

    turn: Array
    turn_std: Array
    stretch: Array
    stretch_std: Array
    left: float
    moved: Array

    @property
    def turned(self) -> bool:
        """Whether the wrench is turned beyond doubt."""
        return self.left < TURN_LEFT and _sure(self.turn, self.turn_std, TURN)

    @property
    def unlike(self) -> bool:
        """Whether gains differ beyond doubt."""
        return self.left < UNLIKE_LEFT and _sure(self.stretch, self.stretch_std, UNLIKE)

    def put_right(self, log: MotionLog) -> MotionLog:
        """Return the log as a sensor would have felt it that neither is turned nor has unlike gains."""
        wrench = _rotated(Rotation.exp(-self.turn), log.wrench)
        force = np.linalg.solve(np.eye(3) + self.stretch, wrench[:, 3:].T).T
        return replace(log, wrench=np.concatenate([wrench[:, :3], force], 1))


# Symmetric matrices (5, 3, 3) without a trace, which add up to any.
_XX, _XY, _XZ, _YY, _YZ, _ZZ = forms.inertia_matrix(np.eye(10)[4:])
_STRETCHES = np.stack([_XX - _ZZ, _YY - _ZZ, _XY, _XZ, _YZ])


def sensor_matrix(log: MotionLog, drift: bool = False, turn: Rotation | None = None) -> SensorMatrix | None:
    """Return what the wrench says of the sensor; None for too short a log or channels that do not measure.

    drift  whether the bias may grow with time
    turn   by how much the wrench seems turned; needed where that is much
    """
    if len(log) < _FEWEST_ROWS or log.dead.any():
        return None
    rows, _ = Rows.of(log, drift)
    if not rows.split:
        return None
    plain, turn = rows.solve(), turn or Rotation.identity()
    values = rows.values
    phi = replace(rows, values=_rotated(turn.inverse(), values)).solve().phi
    for _ in range(ROUNDS):
        felt = rows.columns[:, :, :10] @ phi
        right = replace(rows, values=_rotated(turn.inverse(), values))
        extra = np.concatenate([_turned(felt), _stretched(felt)], 2)
        told = rows.told(extra, TOLD)
        fit = right.solve(extra @ told, jackknife=True)
        value, covariance = told @ fit.extra, told @ fit.extra_covariance @ told.T
        turn, phi = turn @ Rotation.exp(value[:3]), fit.phi
        if np.linalg.norm(value[:3]) < SETTLED:
            break
    stretch = np.tensordot(value[3:], _STRETCHES, 1)
    spread = np.sqrt(np.einsum("kij,kl,lij->ij", _STRETCHES, covariance[3:, 3:], _STRETCHES))
    moved = plain.phi[:4] - fit.phi[:4]
    return SensorMatrix(turn.log(), np.sqrt(np.diag(covariance)[:3]), stretch, spread, fit.beside(plain), moved)


def _rotated(turn: Rotation, wrench: Array) -> Array:
    """Return wrenches (N, 6), forces and torques turned."""
    return turn.apply(wrench.reshape(-1, 3)).reshape(-1, 6)


def _turned(felt: Array) -> Array:
    """Return what a small turn about each axis adds to wrenches (N, 6), (N, 6, 3)."""
    return np.concatenate([-cross_matrix(felt[:, :3]), -cross_matrix(felt[:, 3:])], 1)


def _stretched(felt: Array) -> Array:
    """Return what each stretch adds to wrenches (N, 6), (N, 6, 5)."""
    force = np.einsum("kij,nj->nik", _STRETCHES, felt[:, 3:])
    return np.concatenate([np.zeros_like(force), force], 1)


def examine_sensor(
    log: MotionLog, recording: Recording, estimate: Estimate, known: tuple[Finding, ...], drift: bool = False
) -> tuple[Estimate, tuple[Finding, ...]]:
    """Return `sensor-turned` or `gains-differ` where the wrench shows them, and the estimate with bars that hold them.

    estimate  of what was held, or of what is left of it without the tool
    known     what was found before: a tilted base or a wrench that nothing explains is not looked at again
    drift     whether the bias was taken to grow with time
    """
    stream, found = recording.stream_of("force"), _looked_at(log, known, drift)
    if stream is None or found is None:
        return estimate, ()
    turned = found.turned and not in_world(stream)
    findings = (*_turn(found, stream) * turned, *_gains(found) * found.unlike)
    return (_widened(estimate, found), findings) if findings else (estimate, ())


def turn_of(
    log: MotionLog, recording: Recording, known: tuple[Finding, ...], drift: bool = False
) -> tuple[float, float, float] | None:
    """Return the rotation vector [rad] by which the wrench is turned beyond doubt, None where it is not."""
    stream, found = recording.stream_of("force"), _looked_at(log, known, drift)
    if stream is None or in_world(stream) or found is None or not found.turned:
        return None
    x, y, z = (float(v) for v in found.turn)
    return x, y, z


def _looked_at(log: MotionLog, known: tuple[Finding, ...], drift: bool) -> SensorMatrix | None:
    """Return what the wrench, turned back into S, says of the sensor; None where something else is wrong with it.

    Where a large turn was told, it begins with the turn of the force that follows what accelerates and holds the load
    best (Wahba).
    """
    if stands_aside("sensor", known):
        return None
    if "sensor-turned" not in codes(known):
        return sensor_matrix(log, drift)
    force, own = log.wrench[:, 3:], log.acceleration - log.gravity
    return sensor_matrix(log, drift, Rotation.aligning((force - force.mean(0)).T @ (own - own.mean(0))))


def in_world(stream: Stream) -> bool:
    """Tell whether the wrench of a stream is given in W: whoever turned it there knew the mount of the sensor.

    Its gains are still those of the axes of S, and show once it is turned back. Poses beside it always are in W.
    """
    return stream.in_world("force") or stream.in_world("torque")


def _sure(value: Array, std: Array, least: float) -> bool:
    """Whether a number is large and so many standard deviations from none."""
    return bool(((np.abs(value) > least) & (np.abs(value) > SURE * std)).any())


def _turn(found: SensorMatrix, stream: Stream) -> tuple[Finding, ...]:
    turn = Rotation.exp(found.turn)
    size, spread = np.linalg.norm(found.turn), np.linalg.norm(found.turn_std)
    message = (
        f"The wrench is turned by {np.degrees(size):.2g} ± {np.degrees(spread):.1g} degrees against what a body gives "
        f"in these poses: {mounted(stream, turn)}. The answer takes S as it was given; its bars hold what that changes."
    )
    return (Finding("sensor-turned", message, mount_remedy(stream, turn)),)


def _gains(found: SensorMatrix) -> tuple[Finding, ...]:
    gains, axes = np.linalg.eigh(found.stretch)
    along = [axis_words(axis) for axis in axes.T]
    message = (
        f"Forces along ({along[2]}) of S read {100 * (gains[2] - gains[0]):.2g} % more than along ({along[0]}), "
        "whatever is held: gains of the sensor's axes differ, or one leaks into another. Error bars hold this, and a "
        "common gain as large, which looks like mass."
    )
    return (Finding.of("gains-differ", message),)


def _widened(estimate: Estimate, found: SensorMatrix) -> Estimate:
    """Return the estimate with bars that hold what the sensor's matrix moves mass and centre by, and a common gain."""
    phi = estimate.parameters.vector
    mass, first = found.moved[0], found.moved[1:]
    moved = parameter_jacobian(phi)[:, :4] @ np.append(mass, (first - mass * estimate.com) / estimate.mass)
    # Three gains with this spread have a mean that is known no better; of torques as of forces, which alone show mass.
    gain = np.sqrt(np.square(found.stretch).sum() / 2 / 3)
    of_force, of_torque = gain * np.eye(10)[0] * phi[0], gain * np.append(0.0, phi[1:])
    return estimate.allowing(moved, of_force, of_torque)
