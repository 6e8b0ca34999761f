"""Delays between streams, and the accelerometer's mount, by asking which of them lets the wrench be
explained best.

The wrench decides, not a comparison of an accelerometer with orientations: the unknown acceleration of S
would pass for a delay there (by 15 ms in the recordings this was measured on). First every clock is scanned
by linear fits that know nothing of mounts or bodies; then delays, mount, lever arm, bias and body are
refined together.
Source: Atkeson, An, Hollerbach 1986 (the wrench is linear in ten parameters); design section 4.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.imu import Imu, Mounting, first_mount, lever
from steelyard.logs.kinematics import Kinematics, Motion
from steelyard.logs.log import MotionLog
from steelyard.spatial import Rotation

_BLOCKS = 20
_ROUNDS = 4
_STEPS = 12
_PRIOR = {"delay": 0.1, "rotation": 0.5, "position": 0.3, "bias": 1.0, "scale": 0.02, "centre": 0.5}
_PRIOR_BODY = np.array([30.0, 3, 3, 3, 0.3, 0.3, 0.3, 0.3, 0.3, 0.3])


@dataclass(frozen=True, eq=False)
class Clocks:
    """What the joint fit found.

    delays_s, delays_std_s   of every stream but the wrench's; std 0 where given
    mounting                 of the accelerometer, None without one
    body                     (10,) parameters of the fit, not the answer
    residual                 (N, 6) of the wrench at the rows given
    """

    delays_s: dict[str, float]
    delays_std_s: dict[str, float]
    mounting: Mounting | None
    body: Array
    residual: Array


@dataclass(frozen=True, eq=False)
class Question:
    """Everything the fit needs: rows on the wrench clock and the other streams as functions of their own
    time.

    time (N,), wrench (N, 6) on-object in S; unknown = streams whose delay is sought; known = the other
    delays [s]
    """

    time: Array
    wrench: Array
    kinematics: Kinematics
    imu: Imu | None
    unknown: tuple[str, ...]
    known: Mapping[str, float]
    max_delay_s: float = 0.25
    _cache: dict[tuple[float, ...], tuple[Motion, Array | None]] = field(default_factory=dict, repr=False)

    def seen(self, delays: Mapping[str, float]) -> tuple[Motion, Array | None]:
        """Return the motion and the raw specific force (N, 3) at the rows, for these delays."""
        key = tuple(delays[n] for n in self.unknown)
        if key not in self._cache:
            if len(self._cache) > 64:
                self._cache.clear()
            force = None
            if self.imu is not None:
                force = self.imu.signal.at(self.time + delays.get(self.imu.name, 0.0))
            self._cache[key] = (self.kinematics.at(self.time, delays), force)
        return self._cache[key]


def find_clocks(question: Question) -> Clocks:
    """Return delays with standard deviations, the accelerometer's mounting, and the wrench residual."""
    delays = {**question.known, **scan(question)}
    return refine(question, delays)


def scan(question: Question, rows: int = 3000) -> dict[str, float]:
    """Return a first delay [s] for every unknown stream: the lag at which linear fits explain the wrench
    best."""
    thin = _thinned(question, rows)
    delays = {**question.known, **dict.fromkeys(question.unknown, 0.0)}
    names = sorted(question.unknown, key=lambda n: question.imu is not None and n == question.imu.name)
    grid = np.arange(-question.max_delay_s, question.max_delay_s + 1e-9, 0.004)
    grid = grid[np.argsort(np.abs(grid), kind="stable")]  # ties go to no delay
    for name in names:
        cost = np.array([_scan_cost(thin, {**delays, name: float(d)}, name) for d in grid])
        delays[name] = float(grid[int(np.argmin(cost))])
    return {n: delays[n] for n in question.unknown}


def _scan_cost(question: Question, delays: Mapping[str, float], name: str) -> float:
    """Return the profile likelihood cost of free linear fits of the six channels."""
    motion, force = question.seen(delays)
    own = force is not None and question.imu is not None and name == question.imu.name
    features = [np.ones((len(force), 1)), force] if own and force is not None else _features(motion, None)
    left = (_free_residual(question.wrench, features) ** 2).mean(0) / (question.wrench.var(0) + 1e-30)
    return float(np.log(left + 1e-9).sum())


def _features(motion: Motion, force: Array | None) -> list[Array]:
    """Return what a body's wrench is linear in, with a constant: a - g (by the accelerometer if given) and
    turning."""
    columns = [np.ones((len(motion.omega), 1)), *_turning(motion)]
    if force is not None:
        return [*columns, force]
    columns += [motion.gravity] if motion.gravity is not None else []
    return columns + ([motion.acceleration] if motion.measured else [])


def _turning(motion: Motion) -> list[Array]:
    w = motion.omega
    return [motion.alpha, w[:, [0, 0, 0, 1, 1, 2]] * w[:, [0, 1, 2, 1, 2, 2]]]


def _free_residual(values: Array, features: list[Array]) -> Array:
    """Return what a free linear fit of `values` (N, k) leaves over."""
    X = np.concatenate(features, 1)
    X = X / np.maximum(np.abs(X).max(0), 1e-12)
    normal = X.T @ X + 1e-9 * len(X) * np.eye(X.shape[1])
    return np.asarray(values - X @ np.linalg.solve(normal, X.T @ values))


@dataclass(frozen=True, eq=False)
class _Layout:
    """Where each unknown sits in the vector of the joint fit, with its starting value and prior width."""

    slices: dict[str, slice]
    start: Array
    width: Array
    mount: Rotation | None

    @classmethod
    def of(
        cls, question: Question, delays: Mapping[str, float], mount: Rotation | None, centre: bool
    ) -> _Layout:
        names, start, width = [], [], []

        def add(name: str, value: Array, spread: Array) -> None:
            names.append((name, len(value)))
            start.append(value)
            width.append(spread)

        n = len(question.unknown)
        add("delay", np.array([delays[s] for s in question.unknown]), np.full(n, _PRIOR["delay"]))
        imu = question.imu
        if imu is not None:
            if imu.rotation is None:
                add("rotation", np.zeros(3), np.full(3, _PRIOR["rotation"]))
            if imu.position is None:
                add("position", np.zeros(3), np.full(3, _PRIOR["position"]))
            add("bias", np.zeros(3), np.full(3, _PRIOR["bias"]))
            add("scale", np.ones(1), np.full(1, _PRIOR["scale"]))
            if centre:
                add("centre", np.zeros(3), np.full(3, _PRIOR["centre"]))
        add("body", np.zeros(10), _PRIOR_BODY)
        add("wrench_bias", question.wrench.mean(0), np.full(6, 1e3))
        ends = np.cumsum([k for _, k in names])
        slices = {name: slice(int(e) - k, int(e)) for (name, k), e in zip(names, ends, strict=True)}
        return cls(slices, np.concatenate(start), np.concatenate(width), mount)

    def get(self, theta: Array, name: str, default: Array) -> Array:
        """Return one block of theta."""
        return theta[self.slices[name]] if name in self.slices else default

    def mounting(self, theta: Array, imu: Imu) -> Mounting:
        """Return the accelerometer's mounting in theta."""
        rotation = imu.rotation if imu.rotation is not None else self.mount
        if rotation is None:
            rotation = Rotation.identity()
        if "rotation" in self.slices:
            rotation = Rotation.exp(theta[self.slices["rotation"]]) @ rotation
        position = self.get(theta, "position", imu.position if imu.position is not None else np.zeros(3))
        scale = float(self.get(theta, "scale", np.ones(1))[0])
        return Mounting(rotation, position, self.get(theta, "bias", np.zeros(3)), scale)

    def delays(self, theta: Array, question: Question) -> dict[str, float]:
        """Return all delays, given and sought."""
        sought = dict(zip(question.unknown, (float(v) for v in theta[self.slices["delay"]]), strict=True))
        return {**question.known, **sought}


def refine(question: Question, delays: Mapping[str, float]) -> Clocks:
    """Return the joint robust least-squares answer, started from `delays` [s].

    Residuals: the wrench of a free body with a free bias, and, where an accelerometer and gravity are there,
    what the accelerometer shows against gravity and the measured acceleration (or a free centre of turning
    where none is measured). Scales come from the residuals; rows far off count less; standard deviations
    from time blocks.
    """
    motion, force = question.seen(delays)
    mount = None
    if question.imu is not None and force is not None:
        mount = question.imu.rotation or first_mount(force, motion.gravity, question.wrench[:, 3:])
    layout = _Layout.of(question, delays, mount, centre=motion.gravity is not None and not motion.measured)
    theta, sigma = layout.start.copy(), None
    for _ in range(_ROUNDS):
        theta, weights, sigma = _descend(question, layout, theta, sigma)
    std = _block_std(question, layout, theta, weights)
    residual = _residual(question, layout, theta)[:, :6]
    found = layout.delays(theta, question)
    spread = dict.fromkeys(found, 0.0)
    spread.update(zip(question.unknown, (float(v) for v in std[layout.slices["delay"]]), strict=True))
    mounting = None
    if question.imu is not None:
        mounting = replace(
            layout.mounting(theta, question.imu),
            rotation_std=layout.get(std, "rotation", np.zeros(3)),
            position_std=layout.get(std, "position", np.zeros(3)),
            bias_std=layout.get(std, "bias", np.zeros(3)),
        )
    return Clocks(found, spread, mounting, theta[layout.slices["body"]], residual)


def _residual(question: Question, layout: _Layout, theta: Array) -> Array:
    """Return residuals (N, 6) of the wrench, or (N, 9) with those of the accelerometer."""
    motion, raw = question.seen(layout.delays(theta, question))
    zero = np.zeros_like(motion.omega)
    gravity = motion.gravity
    pull = (gravity if gravity is not None else zero) - motion.acceleration
    extra: list[Array] = []
    if question.imu is not None and raw is not None:
        mounting = layout.mounting(theta, question.imu)
        own = mounting.at_sensor(raw, motion.omega, motion.alpha)
        if gravity is not None:
            # What a centre of turning away from S adds; absorbs the S acceleration that nothing measures.
            shift = lever(motion.omega, motion.alpha, layout.get(theta, "centre", np.zeros(3)))
            # Over the scale, so that it multiplies gravity and not the vibration (which would draw it below
            # one).
            extra = [(own - shift + pull) / mounting.scale]
        pull = -own
    log = MotionLog(question.wrench, pull, zero, motion.omega, motion.alpha)
    body, bias = theta[layout.slices["body"]], theta[layout.slices["wrench_bias"]]
    return np.concatenate([question.wrench - bias - log.predicted(body), *extra], 1)


def _jacobian(question: Question, layout: _Layout, theta: Array) -> tuple[Array, Array]:
    """Return residuals (N, k) and their derivative (N, k, P) by central differences."""
    steps = np.full(len(theta), 1e-4)
    steps[layout.slices["delay"]] = 1e-4
    columns = []
    for i, h in enumerate(steps):
        d = np.zeros_like(theta)
        d[i] = h
        plus, minus = _residual(question, layout, theta + d), _residual(question, layout, theta - d)
        columns.append((plus - minus) / (2 * h))
    return _residual(question, layout, theta), np.stack(columns, -1)


def _descend(
    question: Question, layout: _Layout, theta: Array, sigma: Array | None
) -> tuple[Array, Array, Array]:
    """Take Gauss-Newton steps at fixed scales; return theta, row weights (N, k) and new scales (k,)."""
    least = _first_scales(question, layout, theta)
    sigma = least if sigma is None else np.clip(sigma, 0.3 * least, 3 * least)
    pull = 1 / layout.width**2
    for _ in range(_STEPS):
        r, J = _jacobian(question, layout, theta)
        weights = _weights(r, sigma)
        H = np.einsum("nkp,nk,nkq->pq", J, weights, J, optimize=True) + np.diag(pull)
        g = np.einsum("nkp,nk,nk->p", J, weights, r, optimize=True) + pull * (theta - layout.start)
        step = -np.linalg.solve(H, g)
        limit = layout.slices["delay"]
        biggest = float(np.abs(step[limit]).max(initial=0.0))
        if biggest > 0.01:
            step = step * (0.01 / biggest)
        theta = theta + step
        if np.abs(step / np.sqrt(1 / np.diag(H))).max() < 0.01:
            break
    r = _residual(question, layout, theta)
    sigma = np.maximum(1.4826 * np.median(np.abs(r), axis=0), 1e-9)
    return theta, _weights(r, sigma), sigma


def _first_scales(question: Question, layout: _Layout, theta: Array) -> Array:
    """Return starting scales (k,): what free linear fits of the channels leave over."""
    motion, force = question.seen(layout.delays(layout.start, question))
    residual = _free_residual(question.wrench, _features(motion, force))
    scales = 1.4826 * np.median(np.abs(residual), axis=0)
    if force is not None and motion.gravity is not None:
        features = [np.ones((len(force), 1)), motion.gravity, *_turning(motion)]
        scales = np.append(
            scales, 1.4826 * np.median(np.abs(_free_residual(force, features)), axis=0).mean() * np.ones(3)
        )
    return np.asarray(np.maximum(scales, 1e-9 + 1e-6 * np.abs(_residual(question, layout, theta)).max()))


def _weights(residual: Array, sigma: Array) -> Array:
    """Return weights (N, k): 1/sigma^2, less for rows beyond three sigma (Huber on the row's norm)."""
    scaled = residual / sigma
    out = np.empty_like(residual)
    for part in (slice(0, 6), slice(6, None)):
        size = np.sqrt((scaled[:, part] ** 2).mean(1)) if scaled[:, part].size else np.zeros(len(scaled))
        out[:, part] = np.minimum(1.0, 2.0 / np.maximum(size, 1e-12))[:, None] / sigma[part] ** 2
    return out


def _block_std(question: Question, layout: _Layout, theta: Array, weights: Array) -> Array:
    """Return standard deviations (P,) by the sandwich over time blocks, which sees correlated residuals."""
    r, J = _jacobian(question, layout, theta)
    H = np.einsum("nkp,nk,nkq->pq", J, weights, J, optimize=True) + np.diag(1 / layout.width**2)
    scores = np.einsum("nkp,nk,nk->np", J, weights, r, optimize=True)
    block = np.minimum((np.arange(len(r)) * _BLOCKS) // max(len(r), 1), _BLOCKS - 1)
    sums = np.stack([np.bincount(block, s, _BLOCKS) for s in scores.T], 1)
    back = np.linalg.inv(H)
    cov = back @ (sums.T @ sums) @ back * _BLOCKS / (_BLOCKS - 1) + back @ np.diag(1 / layout.width**2) @ back
    return np.sqrt(np.maximum(np.diag(cov), 0))


def _thinned(question: Question, rows: int) -> Question:
    """Return the question with at most `rows` rows, evenly taken."""
    pick = np.unique(np.linspace(0, len(question.time) - 1, min(rows, len(question.time))).astype(int))
    return replace(question, time=question.time[pick], wrench=question.wrench[pick], _cache={})
