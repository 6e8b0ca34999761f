"""Tilt: the direction of gravity in W taken from the wrench itself; and axes of the force that are turned.

Source: f = m a - R^T u + bias is linear in u = m g, so that the force alone gives the direction without a start value.

Where S turns about one axis only, a tilt along that axis adds a constant to the force, which a free bias takes up. It
also makes gravity sweep less than its full size; an accelerometer of known gain shows that, and a few per cent of gain
error look the same.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.identify.cost.left_out import jackknife
from steelyard.sanity.readings.glance import Glance, Seen
from steelyard.sanity.readings.static_fit import beside, better_fit, leave_out, solve
from steelyard.sanity.words import axis_words
from steelyard.spatial import Rotation, cross_matrix

# Directions of W that the rotations show this much less (in variance) than the best one are left as given.
_BLIND = 0.02
# A turn is refined so many times.
_ROUNDS = 3

# Gains of accelerometers are good to 3 %; a sweep further off, beyond five standard deviations, is a tilt (16 degrees).
GAIN, SURE, LEFT = 0.04, 5.0, 0.01


@dataclass(frozen=True, eq=False)
class GlanceTilt:
    """Gravity (3,) in W [m/s^2] that fits best, its angle to the given one and std [rad], and what it leaves.

    blind   (3,) a direction of W along which gravity cannot be seen, None where all are
    """

    gravity: Array
    angle: float
    angle_std: float
    force_share: float
    torque_share: float
    blind: Array | None = None

    @property
    def length_std(self) -> float:
        """How much a tilt along `blind`, as large as the one found, changes what is seen of gravity, as a share."""
        if self.blind is None:
            return 0.0
        along = abs(float(self.blind @ self.gravity)) / float(np.linalg.norm(self.gravity))
        return self.angle * along / float(np.sqrt(max(1 - along**2, 1e-12)))


@dataclass(frozen=True, eq=False)
class Turn:
    """A constant turn of the wrench against the frame whose rotation is given, and what it leaves of the force."""

    rotation: Rotation
    force_share: float


def tilt_at_a_glance(view: Glance, gravity: Array, rotation: Array | None, mass: float) -> GlanceTilt | None:
    """Return the gravity that fits best; None without rotations (N, 3, 3) or where nothing is seen of it.

    gravity  (3,) [m/s^2] in W, as given

    `mass` [kg] turns the measured acceleration into a force; its sign is taken from the fit as given.
    """
    if rotation is None:
        return None
    seen = view.still.seen(gravity, rotation)
    force = seen.wrench[:, 3:]
    if view.acceleration is not None:
        force = force + mass * view.seen(np.zeros(3), rotation).pull
    turned = np.swapaxes(rotation, 1, 2).reshape(len(rotation), 9)
    columns = -view.smooth(turned).reshape(-1, 3, 3) * seen.heard(1)
    force = force * seen.heard(1)[:, 0]
    lever = None if seen.lever is None else seen.lever * seen.heard(1)
    sign = np.sign(mass) or 1.0
    weight, spread, shown = free_direction(columns, lever, force, view.block, sign * gravity)
    if weight is None:
        return None
    found = sign * weight * np.linalg.norm(gravity) / np.linalg.norm(weight)
    angle = float(angle_between(found, gravity))
    best = better_fit(view, found, rotation)
    unseen = None if np.trace(shown) > 2.5 else np.asarray(np.linalg.eigh(shown)[1][:, 0])
    return GlanceTilt(found, angle, spread, best.force_share, best.torque_share, unseen)


def free_direction(
    columns: Array, lever: Array | None, force: Array, block: Integers, gravity: Array
) -> tuple[Array | None, float, Array]:
    """Return u (3,) of f = columns u + lever h + bias, the jackknife std of its angle [rad], the part of W seen (3, 3).

    columns, lever (N, 3, 3), force (N, 3), block (N,); `gravity` (3,) is kept in directions that no column shows.
    """
    values, axes = _shown(columns)
    shown = axes[:, values > _BLIND * max(float(values[-1]), 1e-12)]
    seen = shown @ shown.T
    if values[-1] < 1e-4 * len(force):
        return None, 0.0, seen

    k = shown.shape[1]
    _, all_rows, left_out = leave_out(beside(columns @ shown, lever), force, block)

    def weights(found: Array) -> Array:
        # The unseen part of gravity keeps its share: the seen part gives the weight.
        u = found[:, :k] @ shown.T
        scale = np.linalg.norm(u, axis=1) / max(float(np.linalg.norm(seen @ gravity)), 1e-9)
        return np.asarray(u + scale[:, None] * (gravity - seen @ gravity))

    everything = weights(all_rows[None])[0]
    angles = angle_between(weights(left_out), everything)
    return everything, float(np.sqrt(jackknife(angles[:, None])[0, 0])), seen


def _shown(columns: Array) -> tuple[Array, Array]:
    """Return how columns (N, 3, 3) vary along directions (3, 3) of W, least first; a bias hides what is constant."""
    centred = columns - columns.mean(0)
    values, axes = np.linalg.eigh(np.einsum("nik,nil->kl", centred, centred))
    return values, axes


def angle_between(a: Array, b: Array) -> Array:
    """Return the angle (..) [rad] between vectors (.., 3) and a vector (3,)."""
    return np.asarray(np.arctan2(np.linalg.norm(np.cross(a, b), axis=-1), a @ b))


def force_and_weight(seen: Seen, sign: float) -> tuple[Array, Array]:
    """Return, about their means, the force (N, 3) and what it should follow by the sign of the mass.

    One that is not known (0) is taken to be right: turned by more than 120 degrees, forces look like a negative mass.
    """
    force, pull = seen.wrench[:, 3:] - seen.wrench[:, 3:].mean(0), seen.pull - seen.pull.mean(0)
    return force, -pull * (np.sign(sign) or 1.0)


def turn_at_a_glance(view: Glance, gravity: Array, sign: float) -> Turn | None:
    """Return the constant turn of S that explains the force best; None without rotations or all forces.

    Where the sensor turns tells it (Wahba); then what the acceleration adds to the force puts it right.
    """
    if view.rotation is None or any(view.dead[3:]):
        return None
    force, down = force_and_weight(view.still.seen(gravity, view.rotation), sign)
    turn = Rotation.aligning(force.T @ down)
    force = view.seen(gravity, view.rotation).wrench[:, 3:]
    turns = (_refined(v.seen(gravity, v.rotation), force, turn, view.block) for v in (view, view.still))
    return min(turns, key=lambda turn: turn.force_share)


def _refined(seen: Seen, force: Array, turn: Rotation, block: Integers) -> Turn:
    """Return the turn of forces (N, 3) near the one given with which a body felt as `seen` explains most of them."""
    body = beside(-seen.pull[:, :, None], seen.lever)
    share = 1.0
    for _ in range(_ROUNDS):
        right = turn.inverse().apply(force)
        held, _, share = solve(body, right, block)
        felt, size = body @ held, len(held)
        more, _, _ = solve(beside(body, -cross_matrix(felt - felt.mean(0))), right, block)
        turn = turn @ Rotation.exp(more[size:])
    return Turn(turn, share)


def blind_axis(view: Glance, rotation: Array) -> Array | None:
    """Return the direction (3,) of W along which gravity cannot be seen beside a bias, None where there is none."""
    turned = view.smooth(np.swapaxes(rotation, 1, 2).reshape(len(rotation), 9)).reshape(-1, 3, 3)
    values, axes = _shown(turned)
    bar = _BLIND * float(values[2])
    return np.asarray(axes[:, 0]) if values[0] < bar < values[1] else None


def blind_tilt(view: Glance, gravity: Array, blind: Array) -> tuple[Finding, ...]:
    """Return `base-tilted` where an accelerometer sees gravity sweep more or less than its direction (3,) in W says.

    blind  (3,) unit vector of W along which a tilt does not show in the force
    """
    if view.accelerometer is None or view.rotation is None:
        return ()
    seen = view.seen(gravity, view.rotation)
    felt, up = view.smooth(view.accelerometer), -(seen.pull - seen.pull.mean(0))
    turn = Rotation.aligning(up.T @ (felt - felt.mean(0)))
    gain, spread, left = solve(beside(up[:, :, None], seen.lever), felt @ turn.matrix.T, view.block)
    if abs(gain[0] - 1) < max(GAIN, SURE * spread[0]) or abs(gain[0] - 1) > 0.5 or left > LEFT:
        return ()
    size = float(np.linalg.norm(gravity))
    across = float(np.linalg.norm(gravity - blind * (blind @ gravity))) / size
    tilt = abs(np.arccos(min(across, 1.0)) - np.arccos(min(across * float(gain[0]), 1.0)))
    message = (
        f"Gravity sweeps {abs(gain[0] - 1) * 100:.1f} ± {spread[0] * 100:.1g} % {'more' if gain[0] > 1 else 'less'} in "
        f"the accelerometer than its direction in W says: a tilt of about {np.degrees(tilt):.0f} degrees toward or "
        f"from ({axis_words(blind)}) of W, unless the accelerometer's gain is off; the answer does not assume this."
    )
    return (Finding.of("base-tilted", message),)
