"""Smoother: values and two derivatives of a sampled signal, with the variances they deserve.

The signal is taken as the n-fold integral of white noise seen through white noise (a smoothing spline); one
number, the ratio of the two, is chosen by the likelihood of the innovations.
Source: Wahba 1978 (spline as a posterior mean).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numba import njit

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.clock import median_step
from steelyard.logs.conditioning import lowpass, lowpass_gain
from steelyard.logs.spline_filter import WARM_UP, backward, forward

_SEARCH_ROWS = 6000
_NOISE_FLOOR = 1e-9
_ORDERS = (3, 4, 5)
_FINER = 17  # ratios tried within a decade of the best
_LONG = 20.0  # periods of a low-pass, from which on there is one
SMEARED = 2.0  # periods of a low-pass over which an end is felt
_FINE = 10.0  # times the cut-off
_NOISY_END = 2.0  # times the median variance of a second derivative


@dataclass(frozen=True, eq=False)
class Smooth:
    """A smoothed signal of D channels that share one noise level.

    time       (N,) [s]
    states     (N, 3, D) value, first and second derivative
    variance   (N, 3) of each of them, per channel, before a low-pass
    noise_std  of one measurement of one channel
    passed     (3,) share of the variance that is noise which came through; the rest is what was taken off the signal
    """

    time: Array
    states: Array
    variance: Array
    noise_std: float
    passed: Array

    @property
    def start(self) -> float:
        """The first time [s] that it tells."""
        return float(self.time[0])

    @property
    def end(self) -> float:
        """The last time [s] that it tells."""
        return float(self.time[-1])

    def at(self, time: Array) -> tuple[Array, Array]:
        """Return states (M, 3, D) and variances (M, 3) at other times [s] (quintic Hermite; ends are held)."""
        times = np.clip(time, self.start, self.end)
        left = np.clip(np.searchsorted(self.time, times, "right") - 1, 0, len(self.time) - 2)
        return _quintic(self.time, self.states, self.variance, times, left)  # type: ignore[no-any-return]


def smooth(time: Array, values: Array, noise_dof: int | None = None, cutoff_hz: float | None = None) -> Smooth:
    """Smooth `values` (N, D), sampled at rising `time` (N,) [s], by an n-fold integral of white noise.

    The order n (3 = white jerk of a position, 4, 5) and the bandwidth are the most likely ones.
    noise_dof  how many of the D channels carry noise (3 for unit quaternions); None = all
    cutoff_hz  low-pass [Hz] of what is smoothed, that of the wrench it is compared with; None = none

    Raises BadValue with fewer than 12 samples.
    """
    t, y = check.finite("time", time), check.finite("values", values)
    if len(t) < 2 * WARM_UP:
        raise BadValue(f"smoothing needs at least {2 * WARM_UP} samples in time; got {len(t)}.")
    step = median_step(t)
    origin = y.mean(0)
    clock, centred = (t - t[0]) / step, np.ascontiguousarray(y - origin)
    share = (noise_dof or y.shape[1]) / y.shape[1]
    _, order, ratio = min(_best_ratio(clock, centred, n) for n in _ORDERS)
    scale = ratio ** (1 / (2 * order))
    floor = (_NOISE_FLOOR * (np.ptp(y, axis=0).max() + 1e-12)) ** 2
    states, cov, weights, quad, _, count = forward(clock, centred, order, np.array([scale]), True)
    backward(clock * scale, centred, states, cov, weights)
    noise = max(float(quad[0]) / max(count * y.shape[1] * share, 1.0), floor)
    back = (scale / step) ** np.arange(order)
    bandwidth = scale / (2 * np.pi * step)
    rate = 1 / step
    if cutoff_hz is not None and not (cutoff_hz < 0.4 * rate and t[-1] - t[0] > _LONG / cutoff_hz):
        cutoff_hz = None
    states, variance = states * back[:, None], np.einsum("nii->ni", cov) * back**2 * noise
    states[:, 0] += origin
    whole = Smooth(
        t, check.frozen(states[:, :3]), check.frozen(np.maximum(variance[:, :3], 0)), float(np.sqrt(noise)),
        passed(order, bandwidth, cutoff_hz)[:3],
    )  # fmt: skip
    return whole if cutoff_hz is None else _below(whole, cutoff_hz)


def passed(order: int, bandwidth: float, cutoff_hz: float | None = None) -> Array:
    """Return the share (order,) of the variance of each derivative that is noise which comes through.

    bandwidth  [Hz] of the smoother, which passes H = 1 / (1 + (f / bandwidth)^(2 order)) of a frequency f
    cutoff_hz  [Hz] of a low-pass after it

    The rest is what the smoother takes away of the signal: it scatters about the smoothed value. Only the noise within
    that value makes a fit to it too small. Shares are the integrals of f^(2 d) H^2 over those of f^(2 d) H, without a
    low-pass 1 - (2 d + 1) / (2 order).
    """
    f = np.geomspace(1e-3, 1e3, 4000) * bandwidth
    H = 1 / (1 + (f / bandwidth) ** (2 * order))
    low = 1.0 if cutoff_hz is None else lowpass_gain(f, cutoff_hz)
    powers = f ** (2 * np.arange(order)[:, None] + 1)  # of f, times df / d log f
    return np.asarray((powers * (H * low) ** 2).sum(1) / (powers * H).sum(1))


def _below(whole: Smooth, cutoff_hz: float) -> Smooth:
    """Return a smoothed signal through the low-pass of the wrench [Hz], on an even clock.

    The ends are left out: derivatives have far more noise there, which the low-pass smears.
    """
    sound = whole.time[whole.variance[:, 2] <= _NOISY_END * np.median(whole.variance[:, 2])]
    # A digital low-pass bends near half the rate: the wrench, mostly quicker, has none of that.
    rate = max(1 / median_step(whole.time), _FINE * cutoff_hz)
    even = np.linspace(sound[0], sound[-1], round(float(sound[-1] - sound[0]) * rate) + 1)
    states, variance = whole.at(even)
    states = lowpass(states.reshape(len(even), -1), cutoff_hz, rate).reshape(states.shape)
    end = round(SMEARED * rate / cutoff_hz)
    inner = slice(end, len(even) - end)
    if len(even[inner]) < 2 * WARM_UP:
        return whole
    even, states, variance = (check.frozen(v[inner]) for v in (even, states, variance))
    return replace(whole, time=even, states=states, variance=variance)


@njit(cache=True, error_model="numpy")
def _quintic(knots: Any, states: Any, variance: Any, times: Any, left: Any) -> Any:
    """Return states (M, 3, D) and variances (M, 3) at times (M,), each right of its knot `left`.

    The states (N, 3, D) at the knots are met by quintics, the variances (N, 3) by straight lines.
    """
    out, between = np.empty((len(times), 3, states.shape[2])), np.empty((len(times), 3))
    for k in range(len(times)):
        a, b, h = states[left[k]], states[left[k] + 1], knots[left[k] + 1] - knots[left[k]]
        s = (times[k] - knots[left[k]]) / h
        for d in range(3):
            between[k, d] = variance[left[k], d] + s * (variance[left[k] + 1, d] - variance[left[k], d])
        for c in range(states.shape[2]):
            value, rate, rise = a[0, c], a[1, c], a[2, c]
            gap = b[0, c] - value - rate * h - rise * h**2 / 2
            slope = (b[1, c] - rate - rise * h) * h
            bend = (b[2, c] - rise) * h**2
            c3, c4 = 10 * gap - 4 * slope + bend / 2, -15 * gap + 7 * slope - bend
            c5 = 6 * gap - 3 * slope + bend / 2
            out[k, 0, c] = value + rate * h * s + rise * (h * s) ** 2 / 2 + s**3 * (c3 + s * (c4 + s * c5))
            out[k, 1, c] = rate + rise * h * s + s**2 * (3 * c3 + s * (4 * c4 + s * 5 * c5)) / h
            out[k, 2, c] = rise + s * (6 * c3 + s * (12 * c4 + s * 20 * c5)) / h**2
    return out, between


def _best_ratio(clock: Array, values: Array, order: int) -> tuple[float, int, float]:
    """Return the least cost, the order, and the most likely ratio of process to measurement noise per step."""
    pieces = _pieces(len(clock))
    size = float(np.abs(values).max()) + 1e-300

    def costs(log_ratios: Array) -> Array:
        scales = np.exp(log_ratios / (2 * order))
        quad, log_det, count = 0.0, 0.0, 0
        for p in pieces:
            *_, squares, logs, rows = forward(clock[p], values[p], order, scales, False)
            quad, log_det, count = quad + squares / values.shape[1], log_det + logs, count + rows
        return np.asarray(count * np.log(quad / count + (_NOISE_FLOOR * size) ** 2) + log_det)

    decades = np.log(10.0) * np.arange(-4.0 * order, 4.1)
    near = decades[np.argmin(costs(decades))] + np.log(10.0) * np.linspace(-1.0, 1.0, _FINER)
    least, log_ratio = _lowest(near, costs(near))
    return least, order, float(np.exp(log_ratio))


def _lowest(at: Array, costs: Array) -> tuple[float, float]:
    """Return the least of costs (K,) at even steps (K,), and where it is: that of the parabola through the three."""
    k = int(np.argmin(costs))
    if not 0 < k < len(at) - 1:
        return float(costs[k]), float(at[k])
    slope, bend = (costs[k + 1] - costs[k - 1]) / 2, costs[k + 1] - 2 * costs[k] + costs[k - 1]
    if bend <= 0.0:
        return float(costs[k]), float(at[k])
    return float(costs[k] - slope**2 / (2 * bend)), float(at[k] - slope / bend * (at[1] - at[0]))


def _pieces(rows: int) -> list[slice]:
    """Return up to three stretches of a long log to choose the smoothing from."""
    if rows <= _SEARCH_ROWS:
        return [slice(0, rows)]
    each = _SEARCH_ROWS // 3
    return [slice(int(s), int(s) + each) for s in np.linspace(0, rows - each, 3)]
