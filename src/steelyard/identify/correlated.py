"""Error bars that survive noise correlated in time: the variance of the score from lagged residuals.

With whitened rows e_t = L^T r_t and G_t = L^T T z_t (W = L L^T) the score is sum_t G_t^T e_t, and its variance
sum_k sum_t G_t^T diag(rho_k) G_{t+k} needs only the autocorrelation rho_k of the six whitened residual channels, which
the whole log shares: in a short stop-and-go log far steadier than blocks. Noise in the regressor adds
(sum_k rho_k^2) times what it adds when white.
Source: Newey and West 1987 for the form; lag choice and flat-top taper Politis 2003.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.identify import noise_cost
from steelyard.identify.linear import nonnegative
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.logs.log import Integers, MotionLog

# Longer logs are judged by the scatter of scores summed over blocks of time; shorter ones have too few.
FEWEST, LONGEST, BLOCKS = 50, 20_000, 200
# A clock with more gaps than rows times this is not even.
MOST_GAPS = 4
# A lag is insignificant below this many standard errors; this many in a row end the search.
SIGNIFICANT, QUIET_LAGS = 2.0, 5
# Anticorrelated noise can make errors smaller than white noise would; no more than this is believed.
LEAST_SHARE = 0.25


def score_variance(log: MotionLog, problem: Problem, solution: Solution) -> Array | None:
    """Return the variance (p, p) of the score, or None where the rows have no order in time."""
    if log.time is None or len(log) < FEWEST:
        return None
    K = problem.residual_map(solution.linear)
    log = log.rows(np.argsort(log.time, kind="stable"))
    if len(log) > LONGEST:
        return _by_blocks(log, K, problem, solution.weights)
    H, extra, plain = noise_cost.information(K, problem.T, problem.scatter, problem.acceleration, problem.wrench)
    residual, slope = _whitened(log, K, problem, solution.weights)
    slot = _slots(np.asarray(log.time))
    variance, squares, memory = np.zeros_like(H), 0.0, 0.0
    for channel in range(6):
        kernel = _autocovariance(_placed(residual[:, channel], slot), len(log))
        if not kernel[0] > 0:  # a channel without any residual has none to be correlated
            continue
        placed = _placed(slope[:, channel], slot)
        variance += placed.T @ _convolved(placed, kernel)
        squares += (2 * float((kernel[1:] ** 2).sum()) / kernel[0] ** 2 + 1) / 6
        memory += (2 * float(kernel[1:].sum()) / kernel[0] + 1) / 6
    # The fit has taken its share of the slow part of the noise out of the residual.
    lost = len(H) * max(memory, 1.0) / (6 * len(log))
    variance = variance / (1 - min(lost, 0.5))
    if solution.weights is None:
        variance += squares * (extra - (plain - H))
        floor = LEAST_SHARE * nonnegative(H + extra, plain)
    else:
        floor = LEAST_SHARE * problem.fixed_weight_score(solution.linear, solution.weights)
        plain = floor
    return np.asarray(floor + nonnegative(variance - floor, plain))


def _by_blocks(log: MotionLog, K: Array, problem: Problem, weights: Array | None) -> Array:
    """Return the score variance from the scatter of scores summed over equal stretches of time."""
    total = np.zeros((BLOCKS, len(problem.T)))
    for block, rows in enumerate(np.array_split(np.arange(len(log)), BLOCKS)):
        residual, slope = _whitened(log.rows(slice(int(rows[0]), int(rows[-1]) + 1)), K, problem, weights)
        total[block] = np.einsum("nip,ni->p", slope, residual)
    total -= total.mean(0)
    return np.asarray(total.T @ total * (BLOCKS / (BLOCKS - 1)))


def _whitened(log: MotionLog, K: Array, problem: Problem, weights: Array | None) -> tuple[Array, Array]:
    """Return whitened residuals (N, 6) and what each adds to the score (N, 6, p): L^-1 W_0 T z for fixed weights."""
    z = problem.features(log)
    residual = z @ K.T
    slope = np.tensordot(z, problem.T, axes=(1, 2)).swapaxes(1, 2)
    for index, number in enumerate(problem.classes):
        rows = log.noise_class == number
        if rows.any():
            L = np.linalg.cholesky(noise_cost.weight(K, problem.acceleration[index], problem.wrench[index]))
            residual[rows] = residual[rows] @ L
            slope[rows] = (L.T if weights is None else np.linalg.solve(L, weights[index])) @ slope[rows]
    return residual, slope


def _slots(time: Array) -> Integers:
    """Return the place of each row on an even clock, so that left-out rows leave gaps; row numbers if it is uneven."""
    step = float(np.median(np.diff(time)))
    if step > 0:
        slot: Integers = np.rint((time - time[0]) / step).astype(np.int64)
        if (np.diff(slot) > 0).all() and slot[-1] < MOST_GAPS * len(time):
            return slot
    return np.arange(len(time))


def _placed(values: Array, slot: Integers) -> Array:
    """Return the values on the even clock, zero in the gaps."""
    out = np.zeros((int(slot[-1]) + 1, *values.shape[1:]))
    out[slot] = values
    return out


def _autocovariance(series: Array, rows: int) -> Array:
    """Return the tapered autocovariance at lags 0, 1, ... per row, up to where it is lost in its own noise."""
    size = 2 ** int(np.ceil(np.log2(2 * len(series))))
    power = np.abs(np.fft.rfft(series, size)) ** 2
    raw = np.fft.irfft(power, size)[: len(series) // 4] / rows
    if not raw[0] > 0:
        return np.zeros(1)
    correlation = raw / raw[0]
    quiet = np.abs(correlation[1:]) < SIGNIFICANT * np.sqrt(np.log10(rows) / rows)
    run = np.convolve(quiet, np.ones(QUIET_LAGS), "valid") >= QUIET_LAGS
    last = int(np.argmax(run)) if run.any() else len(quiet) - 1
    lags = np.arange(min(2 * last + 1, len(raw)))
    taper = np.clip(2 - lags / max(last, 1), 0, 1)
    return np.asarray(raw[: len(lags)] * taper)


def _convolved(values: Array, kernel: Array) -> Array:
    """Return sum_k kernel_|k| values_{t+k} along time."""
    if len(kernel) == 1:
        return np.asarray(kernel[0] * values)
    size = 2 ** int(np.ceil(np.log2(len(values) + 2 * len(kernel))))
    both = np.zeros(size)
    both[: len(kernel)] = kernel
    both[-len(kernel) + 1 :] = kernel[:0:-1]
    spectrum = np.fft.rfft(both).real[:, None] * np.fft.rfft(values, size, axis=0)
    return np.asarray(np.fft.irfft(spectrum, size, axis=0)[: len(values)])
