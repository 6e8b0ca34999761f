"""Joint fit of delays, accelerometer mount, lever arm, bias and body to the wrench: robust least squares."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.inertia.regressor import motion_map, newton_euler
from steelyard.logs.autocorrelation import correlation_time
from steelyard.logs.delays import Clocks, Question, features, free_residual, turning
from steelyard.logs.imu import Imu, Mounting, first_mount
from steelyard.logs.kinematics import Motion
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import regressors
from steelyard.logs.noise import block_covariance, huber, robust_std
from steelyard.spatial import Rotation, cross_matrix, lever_acceleration, lever_matrix
from steelyard.spatial.screws import exp_pose

_BLOCKS = 20
_ROUNDS = 4
_STEPS = 12
# One scale serves all axes of an accelerometer, whose gains differ by about this much whatever the log shows.
_GAIN = 0.003
_PRIOR: dict[str, float | list[float]] = {
    "delay": 0.1, "rotation": 0.5, "position": 0.3, "bias": 1.0, "scale": 0.01, "centre": 0.5,
    "body": [30.0, 3, 3, 3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3], "wrench_bias": 1e3,
}  # fmt: skip
_STEP = 1e-4
_LONGEST_STEP = 0.01  # [s] a delay may move at once
_FINEST = 1e-4  # of a channel's spread: no residual is trusted below
_HELD = 1e-9
_LONGEST_MEMORY = 0.1  # of the rows: how far the correlation of residuals is followed


@dataclass(frozen=True, eq=False)
class _Layout:
    """Where each unknown of a question sits in the vector theta (U,), with its starting value and prior width."""

    question: Question
    slices: dict[str, slice]
    start: Array
    width: Array
    mount: Rotation | None

    @classmethod
    def of(cls, question: Question, delays: Mapping[str, float], mount: Rotation | None, centre: bool) -> _Layout:
        imu, blocks = question.imu, {"delay": np.array([delays[s] for s in question.unknown])}
        if imu is not None:
            blocks |= {"rotation": np.zeros(3)} if imu.rotation is None else {}
            blocks |= {"position": np.zeros(3)} if imu.position is None else {}
            blocks |= {"bias": np.zeros(3), "scale": np.ones(1)}
            blocks |= {"centre": np.zeros(3)} if centre else {}
        blocks |= {"body": np.zeros(10), "wrench_bias": question.seen(delays)[1].mean(0)}
        ends = np.cumsum([len(block) for block in blocks.values()])
        slices = {name: slice(int(e) - len(blocks[name]), int(e)) for name, e in zip(blocks, ends, strict=True)}
        width = np.concatenate([np.broadcast_to(_PRIOR[name], len(block)) for name, block in blocks.items()])
        return cls(question, slices, np.concatenate(list(blocks.values())), width, mount)

    def held(self, name: str) -> _Layout:
        """Return the layout with a block held where it starts."""
        width = self.width.copy()
        width[self.slices[name]] = _HELD
        return replace(self, width=width)

    def get(self, theta: Array, name: str, default: Array) -> Array:
        """Return one block (k,) of theta (U,), `default` where the layout has none."""
        return theta[self.slices[name]] if name in self.slices else default

    def mounting(self, theta: Array, imu: Imu) -> Mounting:
        """Return the accelerometer's mounting in theta (U,)."""
        rotation = imu.rotation if imu.rotation is not None else self.mount
        if rotation is None:
            rotation = Rotation.identity()
        if "rotation" in self.slices:
            rotation = Rotation.exp(theta[self.slices["rotation"]]) @ rotation
        position = self.get(theta, "position", imu.position if imu.position is not None else np.zeros(3))
        scale = float(self.get(theta, "scale", np.ones(1))[0])
        return Mounting(rotation, position, self.get(theta, "bias", np.zeros(3)), scale)

    def delays(self, theta: Array) -> dict[str, float]:
        """Return all delays [s], given and those in theta (U,)."""
        question = self.question
        sought = dict(zip(question.unknown, (float(v) for v in theta[self.slices["delay"]]), strict=True))
        return {**question.known, **sought}

    @cached_property
    def scales(self) -> Array:
        """Starting scales (k,): what free linear fits of the channels leave over, infinite for dead channels."""
        motion, wrench, force = self.seen(self.start)
        scales, sizes = robust_std(free_residual(wrench, features(motion, force))), wrench.std(0)
        if force is not None and motion.gravity is not None:
            steady = [np.ones((len(force), 1)), motion.gravity, *turning(motion)]
            scales = np.append(scales, np.full(3, robust_std(free_residual(force, steady)).mean()))
            sizes = np.append(sizes, np.full(3, force.std()))
        scales = np.maximum(scales, _FINEST * sizes + 1e-12)
        scales[:6][list(self.question.felt.dead)] = np.inf
        return np.asarray(scales)

    def seen(self, theta: Array) -> tuple[Motion, Array, Array | None]:
        """Return motion, wrench (N, 6) in S and raw specific force (N, 3) by the delays in theta (U,)."""
        return self.question.seen(self.delays(theta))


def refine(question: Question, delays: Mapping[str, float]) -> Clocks:
    """Return the joint robust least-squares answer, started from `delays` [s].

    Residuals: the wrench of a free body with a free bias, and, where an accelerometer and gravity are there, what the
    accelerometer shows against gravity and the measured acceleration (or a free centre of turning where none is
    measured). Scales come from the residuals; rows far off count less; standard deviations from time blocks.
    """
    motion, wrench, force = question.seen(delays)
    mount = None
    if question.imu is not None and force is not None:
        mount = question.imu.rotation or first_mount(force, motion.gravity, wrench[:, 3:])
    free_centre = motion.gravity is not None and not motion.measured
    layout = _mount_by_gravity(_Layout.of(question, delays, mount, centre=free_centre))
    theta, weights = _rounds(layout)
    std = _block_std(layout, theta, weights)
    residual = _residual(layout, theta)[:, :6]
    found = layout.delays(theta)
    spread = dict.fromkeys(found, 0.0)
    spread.update(zip(question.unknown, (float(v) for v in std[layout.slices["delay"]]), strict=True))
    mounting = None
    if question.imu is not None:
        mounting = replace(
            layout.mounting(theta, question.imu),
            rotation_std=layout.get(std, "rotation", np.zeros(3)),
            position_std=layout.get(std, "position", np.zeros(3)),
            scale_std=max(float(layout.get(std, "scale", np.zeros(1))[0]), _GAIN) if "scale" in layout.slices else 0.0,
        )
    return Clocks(found, spread, mounting, theta[layout.slices["body"]], residual)


def _residual(layout: _Layout, theta: Array) -> Array:
    """Return residuals (N, 6) of the wrench, or (N, 9) with those of the accelerometer."""
    return _beside(layout, theta, *_felt(layout, theta))


def _beside(layout: _Layout, theta: Array, felt: Array, extra: list[Array]) -> Array:
    """Return the residuals for what `_felt` returns."""
    motion, wrench, _ = layout.seen(theta)
    body, bias = theta[layout.slices["body"]], theta[layout.slices["wrench_bias"]]
    return np.concatenate([wrench - bias - newton_euler(body, felt, motion.omega, motion.alpha), *extra], 1)


def _felt(layout: _Layout, theta: Array) -> tuple[Array, list[Array]]:
    """Return a - g (N, 3) of S by the clocks and the mount in theta, and what the accelerometer shows against it."""
    motion, _, raw = layout.seen(theta)
    imu, gravity = layout.question.imu, motion.gravity
    free = motion.acceleration - (gravity if gravity is not None else 0.0)
    if imu is None or raw is None:
        return free, []
    mounting = layout.mounting(theta, imu)
    own = mounting.at_sensor(raw, motion.omega, motion.alpha)
    if gravity is None:
        return own, []
    # What a centre of turning away from S adds; absorbs the S acceleration that nothing measures.
    shift = lever_acceleration(motion.omega, motion.alpha, layout.get(theta, "centre", np.zeros(3)))
    # Over the scale, which so multiplies gravity and not the vibration (that would draw it below one).
    return own, [(own - shift - free) / mounting.scale]


def _jacobian(layout: _Layout, theta: Array) -> tuple[Array, Array]:
    """Return residuals (N, k) and their derivative (N, k, P): forward differences over delays, closed forms else."""
    motion, wrench, _ = layout.seen(theta)
    felt, extra = _felt(layout, theta)
    log = MotionLog(wrench, -felt, np.zeros_like(motion.omega), motion.omega, motion.alpha)
    base, body = _beside(layout, theta, felt, extra), theta[layout.slices["body"]]
    out = np.zeros((*base.shape, len(theta)))
    out[:, :6, layout.slices["body"]] = -regressors(log)
    out[:, :6, layout.slices["wrench_bias"]] = -np.eye(6)
    for i in range(*layout.slices["delay"].indices(len(theta))):
        moved = theta.copy()
        moved[i] += _STEP
        out[..., i] = (_residual(layout, moved) - base) / _STEP
    for name, (own, beside) in _by_mount(layout, theta, base[:, 6:]).items():
        out[:, :6, layout.slices[name]] = -motion_map(body)[:, 3:6] @ own
        out[:, 6:, layout.slices[name]] = beside
    return base, out


def _by_mount(layout: _Layout, theta: Array, extra: Array) -> dict[str, tuple[Array, Array]]:
    """Return the derivatives of what `_felt` returns by each block of the mount, (N, 3, k) each.

    extra  (N, 3) what the accelerometer shows, (N, 0) where there is no gravity to show it against
    """
    motion, _, raw = layout.seen(theta)
    if layout.question.imu is None or raw is None:
        return {}
    mount = layout.mounting(theta, layout.question.imu)
    lever, turned = lever_matrix(motion.omega, motion.alpha), mount.rotation.apply(raw - mount.bias)
    own = {"position": -lever, "scale": turned[..., None]}
    own["bias"] = np.broadcast_to(-mount.scale * mount.rotation.matrix, lever.shape)
    if "rotation" in layout.slices:
        # Which way R turns as the rotation vector grows along each axis: where screws of one turn and unit shifts lead.
        vector = theta[layout.slices["rotation"]]
        turns = exp_pose(np.column_stack([np.tile(vector, (3, 1)), np.eye(3)])).position.T
        own["rotation"] = -mount.scale * cross_matrix(turned) @ turns
    shown = slice(0, extra.shape[1])
    out = {name: (by, by[:, shown] / mount.scale) for name, by in own.items() if name in layout.slices}
    out["scale"] = own["scale"], (own["scale"][:, shown] - extra[..., None]) / mount.scale
    if "centre" in layout.slices:
        out["centre"] = np.zeros_like(lever), -lever[:, shown] / mount.scale
    return out


def _rounds(layout: _Layout) -> tuple[Array, Array]:
    """Return the fit and its row weights: scales from the residuals, far rows first counted less, then let go."""
    theta, sigma = layout.start.copy(), layout.scales
    weights = np.zeros((0, 0))
    for k in range(_ROUNDS):
        theta, weights, sigma = _descend(layout, theta, sigma, power=1 if k < _ROUNDS // 2 else 2)
    return theta, weights


def _mount_by_gravity(layout: _Layout) -> _Layout:
    """Return the layout started, and softly held, at the mount that gravity alone tells.

    A hand on the object spoils the wrench for seconds; it cannot spoil this. Held at three standard deviations,
    so that a clean wrench, which says it ten times better, has the last word.
    """
    if "rotation" not in layout.slices or layout.seen(layout.start)[0].gravity is None:
        return layout
    alone = layout.held("delay")
    sigma = np.concatenate([np.full(6, np.inf), layout.scales[6:]])
    theta, weights, _ = _descend(alone, layout.start, sigma)
    std = _block_std(alone, theta, weights)
    start, width = layout.start.copy(), layout.width.copy()
    for name, least in (("rotation", 0.01), ("bias", 0.02)):
        part = layout.slices[name]
        start[part], width[part] = theta[part], np.clip(3 * std[part], least, width[part])
    return replace(layout, start=start, width=width)


def _descend(layout: _Layout, theta: Array, sigma: Array, power: int = 1) -> tuple[Array, Array, Array]:
    """Take Gauss-Newton steps at fixed scales; return theta, row weights (N, k) and new scales (k,)."""
    pull = 1 / layout.width**2
    for _ in range(_STEPS):
        r, J = _jacobian(layout, theta)
        weights = _weights(r, sigma, power)
        H = _normal(J, weights, pull)
        scores = (weights * r).ravel() @ J.reshape(-1, J.shape[-1])
        step = -np.linalg.solve(H, scores + pull * (theta - layout.start))
        biggest = float(np.abs(step[layout.slices["delay"]]).max(initial=0.0))
        step = step * min(1.0, _LONGEST_STEP / max(biggest, 1e-12))
        theta = theta + step
        if np.abs(step * np.sqrt(np.diag(H))).max() < 0.01:
            break
    r = _residual(layout, theta)
    seen = np.clip(robust_std(r), 0.3 * layout.scales, 3 * layout.scales)
    seen[6:] *= np.sqrt(correlation_time(r[:, 6:], _LONGEST_MEMORY * len(r)))
    seen[:6] = np.where(np.isfinite(sigma[:6]), seen[:6], np.inf)
    return theta, _weights(r, seen, power), seen


def _normal(J: Array, weights: Array, pull: Array) -> Array:
    """Return the normal matrix (P, P) with its prior."""
    scaled = (J * np.sqrt(weights)[..., None]).reshape(-1, J.shape[-1])
    return np.asarray(scaled.T @ scaled + np.diag(pull))


def _weights(residual: Array, sigma: Array, power: int) -> Array:
    """Return weights (N, k): 1/sigma^2, less for rows beyond two sigma.

    Judged by the rms of the row's wrench and of its accelerometer; power 1 = Huber, 2 lets far rows go.
    """
    scaled = residual / sigma
    out = np.empty_like(residual)
    for part in (slice(0, 6), slice(6, None)):
        if out[:, part].size:
            out[:, part] = (huber(scaled[:, part]) ** power)[:, None] / sigma[part] ** 2
    return out


def _block_std(layout: _Layout, theta: Array, weights: Array) -> Array:
    """Return standard deviations (P,) by the sandwich over time blocks, which sees correlated residuals."""
    r, J = _jacobian(layout, theta)
    prior = 1 / layout.width**2
    scores = np.einsum("nk,nkp->np", weights * r, J)
    return np.sqrt(np.maximum(np.diag(block_covariance(_normal(J, weights, prior), scores, prior, _BLOCKS)), 0))
