"""Leave-one-out: what the fit without a still pose or time block predicts there, and how far the answer moves.

Each refit is one Newton step from the full solution, exact for linear estimators up to the renewed weights, so that
hundreds of blocks cost no more than hundreds of small solves. Source: Efron and Tibshirani 1993, chapter 11.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.identify.cost import noise_cost
from steelyard.identify.cost.left_out import jackknife
from steelyard.identify.cost.linear import inverse_scaled, normal_equations
from steelyard.identify.cost.newton import Rows
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.inertia import forms

FEWEST_BLOCKS = 4


def leave_one_out(problem: Problem, solution: Solution, H: Array, response: Array | None) -> dict[str, Any]:
    """Return the hold-out errors and jackknife deviations of `Evidence` by name, or nothing where blocks are few.

    H         (p, p) information of the whole log
    response  (p, p) how the answer follows the score, where more than the log and a Gaussian prior make it: each block
              then counts as a small change (the infinitesimal jackknife, chapter 21 of the same)
    """
    if len(problem.block_number) < FEWEST_BLOCKS:
        return {}
    numbers = np.unique(problem.block_number[problem.block_number >= 0])
    if len(numbers) < FEWEST_BLOCKS:
        return {}
    J, full = solution.chain, solution.with_prior(H)

    def left(plain: Array) -> Array:
        return response if response is not None else J @ inverse_scaled(full - J.T @ plain @ J) @ J.T

    refits, misses, rows = [], [], 0.0
    for number in numbers:
        chosen = problem.block_number == number
        moved, miss = _without(problem, chosen, solution, left)
        refits.append(moved)
        misses.append(miss)
        rows += float(problem.blocks[chosen, 18, 18].sum())
    torque, force = problem.rms(np.sum(misses, axis=0) / rows)
    phi = np.array(refits)[:, :10] - solution.known
    return {
        "holdout_force_N": force,
        "holdout_torque_Nm": torque,
        "blocks": len(numbers),
        "jackknife": _spread(phi),
        "jackknife_people": _spread(forms.people(phi)),
    }


def _without(
    problem: Problem, chosen: np.ndarray[Any, np.dtype[np.bool_]], solution: Solution, left: Callable[[Array], Array]
) -> tuple[Array, Array]:
    """Return the refit without the chosen groups, and the squared residual (6,) it leaves in them.

    left  what remains of the covariance (p, p) without this information (p, p)
    """
    classes = problem.block_class[chosen]
    scatter = problem.blocks[chosen]
    if solution.weights is None:
        K = problem.residual_map(solution.linear)
        rows = Rows(problem.T, scatter, problem.acceleration[classes], problem.wrench[classes])
        _, gradient, _ = noise_cost.derivatives(K, *rows)
        _, _, plain = noise_cost.information(K, *rows)
    else:
        plain, g = normal_equations(problem.T, scatter, solution.weights[classes])
        gradient = 2 * (plain @ solution.linear - g)
    moved = solution.linear + left(plain) @ gradient / 2
    K = problem.residual_map(moved)
    return moved, np.einsum("ij,jk,ik->i", K, scatter.sum(0), K)


def _spread(refits: Array) -> Array:
    """Return the jackknife standard deviation (10,) of leave-one-out refits (B, 10)."""
    return np.sqrt(np.diag(jackknife(refits - refits.mean(0))))
