"""The ten parameters of the payload from all recordings at once, the force bias of each under one prior.

Sensors are tared when they like: every recording r has its own bias b_r of the summed wrench, b_r ~ N(0, s^2 C), C what a
unit bias of every force axis of every grasp adds up to. Still and moving rows are fitted together: the force equation in
motion and the spread of tilts share the centre of mass. s is averaged over a ladder by its evidence: with no bias, no
accuracy is lost to it, with one, none is pretended.
Source: the linear form of Atkeson, An, Hollerbach 1986; the paper fits mass, centre and inertia one after the other.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.identify.correlated import score_variance
from steelyard.identify.effective import Effective
from steelyard.identify.linear import inverse_scaled
from steelyard.identify.problem import BiasPrior, Problem
from steelyard.identify.regressor import residual_map
from steelyard.identify.solution import Solution
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments, features
from steelyard.team.fused_motion import Fused

# [N] bias of a force axis: from none to as much as a light payload weighs.
LADDER = np.geomspace(0.01, 10.0, 13)
ROUNDS = 4
# [N m, N] noise is not taken below it.
LEAST_NOISE = np.repeat([1e-6, 1e-5], 3)


@dataclass(frozen=True, eq=False)
class PayloadFit:
    """Ten parameters (10,) in B with covariance (10, 10), what the log alone says of them, and how it came about.

    information  (10, 10) F, so that a change of the rows that moves F phi by d moves phi by F^-1 d
    bias_N       spread of force bias per axis that the recordings show
    logs         rows with their noise     chi2 per degree of freedom
    """

    parameters: Array
    covariance: Array
    information: Array
    weights: tuple[Array, ...]
    bias_N: float
    logs: tuple[MotionLog, ...]
    chi2: float


def fit_payload(recordings: tuple[Fused, ...], unit_bias: Array) -> PayloadFit:
    """Return the fit; `unit_bias` (6, 6) is C, per (N on every force axis) squared, in B's axes.

    Raises CannotAnswer where all rows together leave one of the ten open.
    """
    logs = tuple(r.log for r in recordings)
    phi = _ordinary(logs)
    noise = [np.ones(6)] * len(logs)
    scales = LADDER
    for _ in range(ROUNDS):
        noise = _wrench_noise(logs, phi, noise)
        noisy = tuple(_with_wrench(log, n) for log, n in zip(logs, noise, strict=True))
        problems = [Problem.of(Moments.of_log(log, by_block=False), True) for log in noisy]
        models = [_model(noisy, problems, phi, s**2 * unit_bias) for s in scales]
        evidence = np.array([m.evidence for m in models])
        weight = np.exp(evidence - evidence.max())
        weight /= weight.sum()
        phi = sum((w * m.phi for w, m in zip(weight, models, strict=True)), np.zeros(10))
    covariance = sum(
        (w * (m.covariance + np.outer(m.phi - phi, m.phi - phi)) for w, m in zip(weight, models, strict=True)),
        np.zeros((10, 10)),
    )
    best = models[int(np.argmax(weight))]
    return PayloadFit(
        phi, covariance, best.information, best.weights, float(np.exp(weight @ np.log(scales))), noisy, best.chi2
    )


@dataclass(frozen=True, eq=False)
class _Model:
    """The answer at one spread of the bias."""

    phi: Array
    covariance: Array
    information: Array
    weights: tuple[Array, ...]
    evidence: float
    chi2: float


def _model(logs: tuple[MotionLog, ...], problems: list[Problem], phi: Array, bias: Array) -> _Model:
    precision = np.linalg.inv(bias)
    said, pull, evidence = np.zeros((10, 10)), np.zeros(10), 0.0
    plain, right, constant, rows, weights = np.zeros((10, 10)), np.zeros(10), 0.0, 0.0, []
    for log, problem in zip(logs, problems, strict=True):
        known = replace(problem, bias_prior=BiasPrior(np.zeros(6), precision))
        linear = np.concatenate([phi, np.zeros(6)])
        W = known.noise_weights(known.residual_map(linear))
        H, g = known.normal_equations(W)
        inner = np.linalg.inv(H[10:, 10:])
        linear[10:] = inner @ (g[10:] - H[10:, :10] @ phi)
        score = score_variance(log, known, Solution.unconstrained(linear))
        data = Effective.of(known, linear, score)
        said, pull = said + data.information, pull + data.pull
        plain += H[:10, :10] - H[:10, 10:] @ inner @ H[10:, :10]
        right += g[:10] - H[:10, 10:] @ inner @ g[10:]
        wrench = known.scatter[:, 12:18, 12:18]
        constant += float(np.einsum("cij,cji->", W, wrench)) - float(g[10:] @ inner @ g[10:])
        evidence += 0.5 * float(np.linalg.slogdet(precision)[1] - np.linalg.slogdet(H[10:, 10:])[1])
        rows += problem.samples
        weights.append(W)
    covariance = inverse_scaled(said)
    found = covariance @ pull
    seen = inverse_scaled(plain) @ right
    chi2 = constant - float(right @ seen)
    evidence -= 0.5 * chi2 + 0.5 * float(np.linalg.slogdet(plain)[1])
    return _Model(found, covariance, said, tuple(weights), evidence, chi2 / max(6 * rows - 10, 1.0))


def _ordinary(logs: tuple[MotionLog, ...]) -> Array:
    """Return phi (10,) by least squares with force and moment in units of their own, each recording with its bias."""
    H, g = np.zeros((10, 10)), np.zeros(10)
    for log in logs:
        problem = Problem.of(Moments.of_log(_with_wrench(log, np.ones(6)), by_block=False), True)
        W = np.eye(6)[None]
        prior = replace(problem, bias_prior=BiasPrior(np.zeros(6), np.eye(6)))
        full, right = prior.normal_equations(W)
        inner = np.linalg.inv(full[10:, 10:])
        H += full[:10, :10] - full[:10, 10:] @ inner @ full[10:, :10]
        g += right[:10] - full[:10, 10:] @ inner @ right[10:]
    values = np.linalg.eigvalsh(H / np.sqrt(np.outer(np.diag(H), np.diag(H))))
    if not values[0] > 1e-10:
        raise CannotAnswer(
            "all rows together leave some of the ten parameters open; turn the payload about three axes."
        )
    return np.asarray(inverse_scaled(H) @ g)


def _wrench_noise(logs: tuple[MotionLog, ...], phi: Array, before: list[Array]) -> list[Array]:
    """Return standard deviations (6,) per recording, pooled over those alike: what is left of the rows, less a mean."""
    squares, counts = [], []
    for log in logs:
        left = features(log) @ residual_map(phi, np.zeros(6)).T
        left = left - left.mean(0)
        squares.append((left**2).sum(0))
        counts.append(max(len(log) - 1, 1))
    resting = [not log.angular_velocity.any() for log in logs]
    out = []
    for rest in resting:
        same = [k for k, other in enumerate(resting) if other == rest]
        pooled = sum(squares[k] for k in same) / sum(counts[k] for k in same)
        out.append(np.maximum(np.sqrt(pooled), LEAST_NOISE))
    return out


def _with_wrench(log: MotionLog, std: Array) -> MotionLog:
    """Return the log with its wrench noise (6,) [N m, N] declared beside that of its motion."""
    motion = np.zeros(6) if log.noise is None else log.noise[0].acceleration
    return replace(log, noise=(Noise(motion, std**2),))
