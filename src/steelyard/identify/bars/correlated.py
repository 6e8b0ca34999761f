"""Error bars that survive noise correlated in time, or with the pose: the variance of the score from residuals.

With whitened rows e_t = L^T r_t and G_t = L^T T z_t (W = L L^T) the score is sum_t G_t^T e_t, and its variance
sum_k sum_t G_t^T diag(rho_k) G_{t+k} needs only the autocorrelation rho_k of the six whitened residual channels, which
the whole log shares: in a short stop-and-go log far steadier than blocks. Noise in the regressor adds
(sum_k rho_k^2) times what it adds when white.
Source: Newey and West 1987 for the form; lag choice and flat-top taper Politis 2003.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.bars.pose_errors import directions, pose_errors
from steelyard.identify.cost import noise_cost
from steelyard.identify.cost.linear import nonnegative
from steelyard.identify.problem import Problem
from steelyard.identify.solution import Solution
from steelyard.logs.autocorrelation import lagged_products
from steelyard.logs.clock import median_step
from steelyard.logs.log import MotionLog

# Shorter logs tell nothing; of longer ones so many rows in turn are joined that no more than these are left.
FEWEST, LONGEST = 50, 20_000
# A clock with more gaps than rows times this is not even.
MOST_GAPS = 4
# A lag is insignificant below this many standard errors; this many in a row end the search.
SIGNIFICANT, QUIET_LAGS = 2.0, 5
# Anticorrelated noise can make errors smaller than white noise would; no more than this is believed.
LEAST_SHARE = 0.25


@dataclass(frozen=True, eq=False)
class Score:
    """What the order of the rows tells of the score, and notes.

    by_noise  (p, p) its variance by noise that rows remember; None where the rows have no order
    by_pose   (p, p) what errors that come back with the pose add to it
    """

    by_noise: Array | None = None
    by_pose: Array | float = 0.0
    notes: tuple[str, ...] = ()

    @property
    def variance(self) -> Array | None:
        """The variance (p, p) of the score, None where the rows have no order."""
        return None if self.by_noise is None else self.by_noise + self.by_pose


NOTHING = Score()


def score_in_time(log: MotionLog, problem: Problem, solution: Solution) -> Score:
    """Return the variance of the score under noise that rows remember, and errors that come back with the pose."""
    if log.time is None or len(log) < FEWEST:
        return NOTHING
    K, D = problem.residual_map(solution.linear), directions(problem)
    rows = _read(log.rows(np.argsort(log.time, kind="stable")), K, D, problem, solution.weights)
    variance = _by_noise(rows, problem, solution)
    recurring = pose_errors(problem, solution, D, _along(rows))
    return Score(variance) if recurring is None else Score(variance, recurring.variance, (recurring.note,))


def _by_noise(rows: _Rows, problem: Problem, solution: Solution) -> Array:
    """Return the variance (p, p) of the score under noise that rows remember."""
    H, extra, plain = problem.information(solution.linear)
    variance, squares, memory = np.zeros_like(H), 0.0, 0.0
    for channel in range(6):
        kernel = rows.kernel(rows.white[:, channel])
        if not kernel[0] > 0:  # a channel without any residual has none to be correlated
            continue
        variance += _summed(_placed(rows.slope[:, channel], rows.slot), kernel)
        squares += (2 * rows.joined * float((kernel[1:] ** 2).sum()) / kernel[0] ** 2 + 1) / 6
        memory += (2 * float(kernel[1:].sum()) / kernel[0] + 1) / 6
    # The fit has taken its share of the slow part of the noise out of the residual.
    lost = len(H) * max(memory, 1.0) / (6 * len(rows.slot))
    variance = variance / (1 - min(lost, 0.5))
    if solution.weights is None:
        variance += squares * (extra - (plain - H))
        floor = LEAST_SHARE * nonnegative(H + extra, plain)
    else:
        floor = LEAST_SHARE * problem.fixed_weight_score(solution.linear, solution.weights)
        plain = floor
    return np.asarray(floor + nonnegative(variance - floor, plain))


def _along(rows: _Rows) -> Array:
    """Return the variance (6, K, K) by noise of the mean of every channel's residual times a - g along an axis."""
    placed = _placed(rows.along, rows.slot)
    return np.stack([_summed(placed, rows.kernel(r)) for r in rows.residual.T]) / len(rows.slot) ** 2


@dataclass(frozen=True, eq=False)
class _Rows:
    """Rows in order of time, `joined` in turn made one: means of residuals, sums of what they pull.

    slot      (M,) place of each on an even clock
    residual  (M, 6) of the wrench
    white     (M, 6) the same, whitened
    along     (M, K) a - g along the directions of `pose_errors`
    slope     (M, 6, p) what each whitened residual adds to the score: L^-1 W_0 T z for fixed weights W_0
    """

    joined: int
    slot: Integers
    residual: Array
    white: Array
    along: Array
    slope: Array

    def kernel(self, series: Array) -> Array:
        """Return the autocovariance of one number for each row (M,) at lags 0, 1, ..., as far as it is known."""
        return _autocovariance(_placed(series, self.slot), len(self.slot))


def _read(log: MotionLog, K: Array, D: Array, problem: Problem, weights: Array | None) -> _Rows:
    """Return the rows of a log, joined where they are many, at the residual map K (6, Z)."""
    z = problem.features(log)
    joined = -(-len(log) // LONGEST)
    starts = np.arange(0, len(log), joined)
    counts = np.diff(np.append(starts, len(log)))[:, None]
    residual, along, time = (_joined(v, starts) / counts for v in (z @ K.T, z @ D.T, np.c_[log.time]))
    white, slope = np.empty((len(starts), 6)), np.empty((len(starts), 6, len(problem.T)))
    # Slopes are many times as large as the rows: not all of them at once.
    for some in np.array_split(np.arange(len(starts)), joined):
        rows = slice(int(starts[some[0]]), int(starts[some[-1]] + counts[some[-1], 0]))
        parts = _whitened(z[rows], log.noise_class[rows], K, problem, weights)
        white[some], slope[some] = (_joined(v, starts[some] - rows.start) for v in parts)
    return _Rows(joined, _slots(time[:, 0]), residual, white / counts, along, slope)


def _joined(values: Array, starts: Integers) -> Array:
    """Return the sums of values (N, ...) over the rows from each of `starts` to the next."""
    return values if len(values) == len(starts) else np.asarray(np.add.reduceat(values, starts))


def _whitened(
    z: Array, noise_class: Integers, K: Array, problem: Problem, weights: Array | None
) -> tuple[Array, Array]:
    """Return whitened residuals (N, 6) of rows z (N, Z), and what each adds to the score (N, 6, p)."""
    white, slope = np.zeros((len(z), 6)), np.zeros((len(z), 6, len(problem.T)))
    for index, number in enumerate(problem.classes):
        rows = noise_class == number
        L = np.linalg.cholesky(noise_cost.weight(K, problem.acceleration[index], problem.wrench[index]))
        pull = (L.T if weights is None else np.linalg.solve(L, weights[index])) @ problem.T
        white[rows] = z[rows] @ (K.T @ L)
        slope[rows] = np.tensordot(z[rows], pull, axes=(1, 2)).swapaxes(1, 2)
    return white, slope


def _slots(time: Array) -> Integers:
    """Return the place of each row on an even clock, so that left-out rows leave gaps; row numbers if it is uneven."""
    step = median_step(time)
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
    raw = lagged_products(series, len(series) // 4) / rows
    if not raw[0] > 0:
        return np.zeros(1)
    correlation = raw / raw[0]
    quiet = np.abs(correlation[1:]) < SIGNIFICANT * np.sqrt(np.log10(rows) / rows)
    run = np.convolve(quiet, np.ones(QUIET_LAGS), "valid") >= QUIET_LAGS
    last = int(np.argmax(run)) if run.any() else len(quiet) - 1
    lags = np.arange(min(2 * last + 1, len(raw)))
    taper = np.clip(2 - lags / max(last, 1), 0, 1)
    return np.asarray(raw[: len(lags)] * taper)


def _summed(values: Array, kernel: Array) -> Array:
    """Return the sum (p, p) of values_t kernel_|k| values_{t+k}^T over rows t of values (N, p) and lags k."""
    if len(kernel) == 1:
        return np.asarray(kernel[0] * values.T @ values)
    size = 2 ** int(np.ceil(np.log2(len(values) + 2 * len(kernel))))
    both = np.zeros(size)
    both[: len(kernel)] = kernel
    both[-len(kernel) + 1 :] = kernel[:0:-1]
    # Parseval: every frequency but the first and the last stands for two.
    power = np.fft.rfft(both).real / size
    power[1:-1] *= 2
    waves = np.fft.rfft(values, size, axis=0)
    return np.asarray(((waves.conj() * power[:, None]).T @ waves).real)
