"""From a solution to an Estimate: covariance, evidence, and an error where the data do not fix mass and centre."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.evidence import Evidence
from steelyard.findings import Finding, counted
from steelyard.identify.bars.correlated import NOTHING, Score
from steelyard.identify.bars.holdout import leave_one_out
from steelyard.identify.bars.widened import widened
from steelyard.identify.cost import noise_cost
from steelyard.identify.cost.linear import fitted, inverse_scaled, nonnegative, normal_equations, without_bias
from steelyard.identify.estimate import Estimate
from steelyard.identify.problem import ADD_POSES, Problem
from steelyard.identify.sight import INERTIA_SHARE, Sight
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import ENTRIES

# There is no answer at all where mass or centre of mass are looser than these shares of their natural sizes.
LOST_MASS, LOST_COM = 1 / 3, 2.5


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
    sight = Sight.of(F, G, solution.linear[:10])
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
    least = f"one standard deviation is at least {share:.0f} % of half its trace ({100 * INERTIA_SHARE:.0f} % would do)"
    least = least if share < 1e3 else "the rows that were fitted show next to nothing of it"
    text = f"The data do not fix the inertia entries {', '.join(ENTRIES[lost])}: {least}."
    return (Finding.of("inertia-not-identified", text),)
