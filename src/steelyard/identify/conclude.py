"""From a solution to an Estimate: covariance, evidence and which numbers the data fix."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numba
import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.evidence import Evidence
from steelyard.findings import Finding, counted
from steelyard.identify.bars.correlated import NOTHING, Score
from steelyard.identify.bars.holdout import leave_one_out
from steelyard.identify.cost import noise_cost
from steelyard.identify.cost.dense import eigen, product, product_transposed
from steelyard.identify.cost.linear import fitted, inverse_scaled, nonnegative, normal_equations, without_bias
from steelyard.identify.estimate import Estimate
from steelyard.identify.problem import ADD_POSES, Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import ENTRIES, parameter_jacobian, people_jacobian
from steelyard.logs.log import Mask

# Identified means: the data alone, without prior, give one standard deviation below these shares of
# the mass, of the radius of gyration, and of half the trace of the inertia about the centre of mass.
MASS_SHARE, COM_SHARE, INERTIA_SHARE = 0.1, 0.2, 0.1
SHARES = np.repeat([MASS_SHARE, COM_SHARE, INERTIA_SHARE], [1, 3, 6])
SMALLEST_RADIUS = 0.02
# There is no answer at all where mass or centre of mass are looser than these shares of the same sizes.
LOST_MASS, LOST_COM = 1 / 3, 2.5
# Fewer blocks left out in turn say too little about error bars; below this factor they agree.
ENOUGH_BLOCKS, WORTH_WIDENING = 10, 1.5
# Share of its size that no number is known better than.
SMALLEST_STD = 1e-9
# A direction counts toward the rank when the data fix it to half its natural size.
RANK_INFORMATION = 4.0
# Below this information (a third of the natural size to the power -2), or below this share of the best seen direction,
# a direction is open.
OPEN, UNSEEN = 0.1, 1e-12


def _sandwich(H: Array, V: Array, solution: Solution) -> Array:
    """Return the covariance (p, p) of the linear parameters, the prior counted as data of its own strength."""
    bread = solution.chain @ inverse_scaled(solution.with_prior(H))
    return np.asarray(bread @ solution.with_prior(V) @ bread.T)


def _taken(H: Array, problem: Problem, solution: Solution) -> float:
    """Return how many degrees of freedom the fit took of the residuals, of the information H (p, p)."""
    J, prior = solution.chain, problem.plus_bias_prior(np.zeros_like(H))
    prior[:10, :10] += solution.prior
    return fitted(J.T @ H @ J, prior)


@dataclass(frozen=True, eq=False)
class Fit:
    """How well a solution fits.

    information                      (p, p) of the linear parameters
    white                            (p, p) variance of the score where noise is white
    chi2                             per degree of freedom
    residual_torque, residual_force  rms per axis [N m], [N]
    """

    information: Array
    white: Array
    chi2: float
    residual_torque: float
    residual_force: float


def _fit_of(problem: Problem, solution: Solution) -> Fit:
    """Return how well a solution fits the rows of its problem."""
    H, extra, plain = problem.information(solution.linear)
    K = problem.residual_map(solution.linear)
    cost, square = noise_cost.value(K, problem.scatter, problem.acceleration, problem.wrench)
    H, rows = nonnegative(H, plain), problem.samples
    left = max(int(problem.heard.sum()) * rows - _taken(H, problem, solution), 1.0)
    chi2 = max(cost / left, 0.0)
    # Noise that few degrees of freedom told is uncertain itself: the variance of Student's t.
    white = max(chi2, 1.0) * max(left, 3.0) / (max(left, 3.0) - 2) * nonnegative(H + extra, plain)
    return Fit(H, white, chi2, *problem.rms(square / rows))


def _information(problem: Problem, solution: Solution, fit: Fit, score: Score) -> tuple[Array, Array]:
    """Return the information (p, p) of the linear parameters and the variance of its score, what is known of the bias
    counted as data.
    """
    bread, meat = fit.information, fit.white
    if (weights := solution.weights) is not None:
        bread, _ = normal_equations(problem.T, problem.scatter, weights)
        meat = max(fit.chi2, 1.0) * problem.fixed_weight_score(solution.linear, weights)
    meat = meat if score.by_noise is None else score.by_noise
    return problem.plus_bias_prior(bread), problem.plus_bias_prior(meat)


def conclude(
    problem: Problem, solution: Solution, method: str, score: Score = NOTHING, response: Array | None = None
) -> Estimate:
    """Return the Estimate of a solution.

    `score` tells the variance of the score where the log's own correlation is known; else noise is taken as white.
    Where a shape makes the answer together with the log, `response` (p, p) is how it follows the score: then the
    covariance, still that of the log alone, and its widening are left to the caller, and nothing must be fixed by the
    log alone. Else raises CannotAnswer where mass or centre of mass are not fixed, and names the inertia that is not.
    """
    if not (np.isfinite(solution.linear).all() and solution.linear[0] != 0):
        raise _lost(np.ones(4, np.bool_), problem)
    fit = _fit_of(problem, solution)
    bread, meat = _information(problem, solution, fit, score)
    covariance = _sandwich(bread, meat + score.by_pose, solution)
    # Whether the data fix a number is judged by noise alone: more poses cure no error that comes back with them.
    seen = meat if solution.weights is None else problem.plus_bias_prior(fit.white)
    F, G, _, _ = without_bias(problem.plus_bias_prior(fit.information), seen)
    sight = Sight(*_sight(F, G, solution.linear[:10]))
    if response is None:
        _require_answer(sight, problem)
    estimate = Estimate(
        InertialParameters(solution.linear[:10]),
        covariance[:10, :10],
        method,
        Evidence(
            sight.rank, sight.condition, int(problem.samples), int(problem.still_samples),
            fit.residual_force, fit.residual_torque, fit.chi2, spread=2 * sight.std,
        ),
        sight.identified,
        solution.bias,
        covariance[10:16, 10:16] if problem.with_bias else np.zeros((6, 6)),
        covariance[:10, 10:16] if problem.with_bias else np.zeros((10, 6)),
    )  # fmt: skip
    left_out = leave_one_out(problem, solution, bread, response)
    if left_out:
        estimate = replace(estimate, evidence=replace(estimate.evidence, **left_out))
    return widened(estimate.with_findings(*_findings(estimate))) if response is None else estimate


def widened(estimate: Estimate) -> Estimate:
    """Return the estimate with error bars at least as wide as leaving blocks out shows, where there are enough blocks.

    What the model leaves out (a soft wrist, cross-talk) is no noise, and only differs from one stretch to the next.
    With a shape, too: what the log says of mass and centre is wrong by as much.
    """
    return _each_widened(_all_widened(estimate))


def _all_widened(estimate: Estimate) -> Estimate:
    """Return the estimate with all bars wider alike, where leaving blocks out moves half of the numbers by more."""
    moved, known = _moved(estimate), estimate.identified
    if moved is None or not known.any() or (factor := float(np.median(moved[known]))) < WORTH_WIDENING:
        return estimate
    note = f"error bars are {factor:.1f} times those of noise alone: leaving blocks out moves the answer that much"
    return replace(
        estimate,
        covariance=factor**2 * estimate.covariance,
        bias_covariance=factor**2 * estimate.bias_covariance,
        cross_covariance=factor**2 * estimate.cross_covariance,
        part_covariance=None if estimate.part_covariance is None else factor**2 * estimate.part_covariance,
        parts=tuple(replace(part, std=factor * part.std) for part in estimate.parts),
        notes=(*estimate.notes, note),
    )


def _each_widened(estimate: Estimate) -> Estimate:
    """Return the estimate with no number's bar narrower than leaving blocks out shows; correlations are kept.

    What the model leaves out (an arm that swings after a stop) moves some numbers more than others.
    """
    moved = _moved(estimate)
    if moved is None:
        return estimate
    factor = np.where(estimate.identified, np.maximum(moved, 1.0), 1.0)
    phi = estimate.parameters.vector.copy()
    stretch = parameter_jacobian(phi) @ (factor[:, None] * people_jacobian(phi))
    return replace(
        estimate,
        covariance=stretch @ estimate.covariance @ stretch.T,
        cross_covariance=stretch @ estimate.cross_covariance,
    )


def _moved(estimate: Estimate) -> Array | None:
    """Return by how many of its bars leaving blocks out moves each number (10,), None where blocks are few."""
    jackknife = estimate.evidence.jackknife_people
    if jackknife is None or estimate.evidence.blocks < ENOUGH_BLOCKS:
        return None
    # A channel that holds exact zeros has no noise at all, and nothing to be a multiple of.
    least = SMALLEST_STD * natural_sizes(estimate.parameters.vector.copy())
    return np.asarray(jackknife / np.maximum(estimate.std, least))


@dataclass(frozen=True, eq=False)
class Sight:
    """What the data alone see: rank, condition, std (10,) of mass, com, inertia about the CoM, and their sizes."""

    rank: int
    condition: float
    std: Array
    sizes: Array

    @property
    def identified(self) -> Mask:
        """Which of the ten the data fix."""
        return identified(self.std, self.sizes)


@numba.njit(cache=True)
def natural_sizes(phi: Array) -> Array:
    """Return (10,) mass [kg], radius of gyration [m] for com x y z, half the trace of the inertia about it."""
    mass = max(abs(phi[0]), 1e-6)
    square = phi[1] * phi[1] + phi[2] * phi[2] + phi[3] * phi[3]
    trace = abs((phi[4] + phi[7] + phi[9]) / 2 - square / mass)
    out = np.empty(10)
    out[0] = mass
    for i in range(1, 4):
        out[i] = max(np.sqrt(trace / mass / 3), SMALLEST_RADIUS)
    for i in range(4, 10):
        out[i] = max(trace, mass * SMALLEST_RADIUS**2)
    return out


def identified(std: Array, sizes: Array) -> Mask:
    """Return which of mass, com and inertia about the CoM (10,) have standard deviations small beside their sizes."""
    return np.asarray(std < SHARES * sizes)


@numba.njit(cache=True)
def _sight(F: Array, G: Array, phi: Array) -> tuple[int, float, Array, Array]:
    """Return the fields of `Sight` from information and score variance (10, 10) of phi, the bias projected out.

    In natural units (mass m, length r, the radius of gyration) an eigenvalue 1 fixes a direction to its own size.
    """
    sizes = natural_sizes(phi)
    natural, scaled = np.empty(10), np.empty((10, 10))
    for i in range(10):
        natural[i] = sizes[i] if i == 0 else sizes[0] * sizes[1] * (1.0 if i < 4 else sizes[1])
    for i in range(10):
        for j in range(10):
            scaled[i, j] = F[i, j] * natural[i] * natural[j]
    values, vectors = eigen(scaled)
    into = np.empty((10, 10))
    for i in range(10):
        for k in range(10):
            into[i, k] = natural[i] * vectors[i, k]
    directions = product(people_jacobian(phi), into)
    # Directions that the data leave open may be off by several times their natural size, not by anything at all.
    least = max(OPEN, UNSEEN * values[-1])
    seen, open_end, rank, weakest = np.zeros((10, 10)), np.zeros(10), 0, np.inf
    for k in range(10):
        if values[k] > RANK_INFORMATION:
            rank += 1
            weakest = min(weakest, values[k])
        for i in range(10):
            if values[k] < least:
                open_end[i] += directions[i, k] ** 2 / OPEN
            else:
                seen[i, k] = directions[i, k] / values[k]
    bread = product_transposed(seen, into)
    half, std = product(bread, G), np.empty(10)
    for i in range(10):
        variance = 0.0
        for j in range(10):
            variance += half[i, j] * bread[i, j]
        std[i] = np.inf if open_end[i] > sizes[i] ** 2 else np.sqrt(max(variance, 0.0) + open_end[i])
    return rank, np.sqrt(values[-1] / weakest) if rank else np.inf, std, sizes


def _require_answer(sight: Sight, problem: Problem) -> None:
    """Raise CannotAnswer where mass or centre of mass are lost, saying what to add."""
    lost = sight.std[:4] > np.repeat([LOST_MASS, LOST_COM], [1, 3]) * sight.sizes[:4]
    if lost.any():
        raise _lost(lost, problem)


def _lost(lost: Mask, problem: Problem) -> CannotAnswer:
    """Return the error that names which of mass, com x y z (4,) are lost, and what to add."""
    names = ("the mass", *(f"the centre of mass along {axis}" for axis in "xyz"))
    poses = len(np.unique(problem.block_number[problem.block_number >= 0]))
    seen = counted(int(problem.samples), "row") + (f" in {poses} still poses or time blocks" if poses else "")
    return CannotAnswer(
        f"The data do not fix {', '.join(n for n, gone in zip(names, lost, strict=True) if gone)} ({seen}). "
        + ADD_POSES
        + ("; or tare the sensor without a load and say --bias none." if problem.with_bias else ".")
    )


def _findings(estimate: Estimate) -> tuple[Finding, ...]:
    """Return what the evidence alone has to say."""
    spread, lost = estimate.evidence.spread, ~estimate.identified[4:]
    if spread is None or not lost.any():
        return ()
    half_trace = float(np.trace(estimate.parameters.inertia_com)) / 2
    share = 50 * float(np.min(spread[4:][lost])) / max(half_trace, 1e-12)
    least = f"one standard deviation is at least {share:.0f} % of half its trace"
    least = least if share < 1e3 else "no measured acceleration shows it"
    text = f"The data do not fix the inertia entries {', '.join(ENTRIES[lost])}: {least}."
    return (Finding.of("inertia-not-identified", text),)
