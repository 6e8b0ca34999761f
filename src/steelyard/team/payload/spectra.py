"""Rows of a recording as frequencies, gathered into bands: one scatter matrix per band.

The wrench is linear in features of the motion at every instant, so it is at every frequency. Noise is not white: that
of accelerations grows with the fourth power of the frequency, sensors and structures err slowly. In bands narrow enough
each is white, so that information is counted once and every frequency weighs what it is worth. Rows are tapered at
their ends, or the ends would spill high frequencies into low ones.
Noise of the fused path enters accelerations and the direction of gravity band by band: its size comes from the joint
fit, its colour from the residuals of the same fit.
Source: own; Whittle 1953 for the likelihood.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.fft import dct

from steelyard.check import Array, Integers
from steelyard.inertia.regressor import basis
from steelyard.logs.middles import mean
from steelyard.spatial import cross_matrix
from steelyard.team.payload.body_rows import BodyRows, Run, slope

# A band holds at least so many rows, and its upper end is at least so many times its lower one.
ROWS, RATIO = 30, 1.35
# Share of a run, and seconds, over which it is faded in and out: the shorter.
FADE_SHARE, FADE_S = 0.1, 1.0
# Motion and constant among all that is scattered: by these, and what stands still in the room, a wrench tells a body.
SEEN = np.array([*range(12), -1])
# Levers (U, 6, Q) of no biases that stand still in the room.
FIRST = 16  # rows by which a column that is not all zero mostly shows
NO_LEVERS = np.zeros((0, 6, 0))


@dataclass(frozen=True, eq=False)
class Spectra:
    """One recording: scatter (K, Z, Z) per band of [motion (12), pushed (6 N), 1], and rows (K,) in each.

    lines                (F, Z + Q) of every run, from which the rest is
    room                 scatter (K, Q, Z + Q) of what stands still in the room (Q = 9 or 3) with these and itself
    judged, judged_rows  the same of the rows by which noise is judged: at rest not the means, which are mostly bias
    samples              rows of the recording that are in it
    hz                   (K,) rms frequency of each band
    """

    name: str
    still: bool
    lines: tuple[Array, ...]
    scatter: Array
    room: Array
    rows: Array
    judged: Array
    judged_rows: Array
    samples: int
    hz: Array

    def seen(self, room: bool) -> Array:
        """Return the scatter (K, 13 + Q, Z + Q) of [motion, 1, room] with all that is there; Q = 0 without `room`."""
        own = self.scatter[:, SEEN]
        if not room:
            return own
        beside = self.room[..., : own.shape[2]][..., SEEN].swapaxes(1, 2)
        return np.concatenate([np.concatenate([own, beside], axis=2), self.room], axis=1)


def regressors(levers: Array) -> Array:
    """Return the wrench (P + 6, 6, 13 + Q) that each of [phi (10), u (U,), bias (6)] makes of [motion, 1, room].

    levers  (U, 6, Q) of biases u that stand still in the room
    """
    count, width = len(levers), levers.shape[2]
    out = np.zeros((16 + count, 6, len(SEEN) + width))
    out[:10, :, :12], out[10:-6, :, len(SEEN) :], out[-6:, :, 12] = basis(), levers, np.eye(6)
    return out


def fade(rows: int, rate: float) -> Array:
    """Return the taper (T,) of a moving run, its mean square one."""
    ramp = max(1, int(min(FADE_SHARE * rows, FADE_S * rate)))
    window = np.ones(rows)
    rise = 0.5 - 0.5 * np.cos(np.pi * (np.arange(ramp) + 0.5) / ramp)
    window[:ramp], window[-ramp:] = rise, rise[::-1]
    return np.asarray(window / np.sqrt((window**2).mean()))


def frequencies(run: Run, highest_hz: float) -> Array:
    """Return the frequencies [Hz] of the rows of a run that are used."""
    size = len(run.motion)
    rows = min(size, int(2 * size * highest_hz / run.rate) + 1)
    return np.asarray(np.arange(rows) * (run.rate / (2 * size)), dtype=np.float64)


def band_edges(recordings: Sequence[BodyRows], highest_hz: float) -> Array:
    """Return the upper ends (K,) [Hz] of bands that all these recordings together fill."""
    every = np.sort(np.concatenate([frequencies(run, highest_hz)[1:] for r in recordings for run in r.runs]))
    edges: list[float] = []
    start = 0
    while len(every) - start >= 2 * ROWS:
        stop = start + ROWS
        if edges:
            stop = max(stop, int(np.searchsorted(every, RATIO * edges[-1])))
        if len(every) - stop < ROWS:
            break
        edges.append(float(every[stop - 1]))
        start = stop
    return np.array([*edges, np.inf])


def as_frequencies(columns: Sequence[Array], run: Run, highest_hz: float, faded: bool) -> Array:
    """Return columns (T, D) of a run's rows, side by side, as the frequencies (F, D) that are used.

    faded  whether rows are faded in and out
    """
    # Column after column: rows side by side take more than twice as long. Moments of passive gimbals are zero.
    every = [values for column in columns for values in column.T]
    there = np.array([values[:FIRST].any() or values.any() for values in every], np.bool_)
    window = fade(len(run.motion), run.rate) if faded else 1.0
    flat = np.empty((int(there.sum()), len(run.motion)))
    for line, k in zip(flat, np.flatnonzero(there), strict=True):
        np.multiply(every[k], window, out=line)
    rows = len(frequencies(run, highest_hz))
    out = np.zeros((rows, len(there)))
    out[:, there] = dct(flat, axis=1, norm="ortho", overwrite_x=True)[:, :rows].T
    return out


def gathered(recording: BodyRows, edges: Array, highest_hz: float) -> Spectra:
    """Return the scatter of one recording in the bands that end at `edges` (K,) [Hz]."""
    lines = []
    for run in recording.runs:
        columns = run.motion, run.pushed, np.ones((len(run.motion), 1)), run.room
        lines.append(as_frequencies(columns, run, highest_hz, not recording.still))
    return _in_bands(recording, tuple(lines), edges, highest_hz)


def with_rates(part: Spectra, recording: BodyRows, edges: Array, highest_hz: float) -> Spectra:
    """Return the same with what every robot's pushes change in a second beside them (12 N)."""
    lines = []
    for run, z in zip(recording.runs, part.lines, strict=True):
        rates = as_frequencies([slope(run.pushed, run.rate)], run, highest_hz, not recording.still)
        lines.append(np.insert(z, [12 + rates.shape[1]], rates, axis=1))
    return _in_bands(recording, tuple(lines), edges, highest_hz)


def _in_bands(recording: BodyRows, lines: tuple[Array, ...], edges: Array, highest_hz: float) -> Spectra:
    beside = recording.runs[0].room.shape[1]
    width = lines[0].shape[1] - beside
    scatter, rows = np.zeros((len(edges), width, width)), np.zeros(len(edges))
    room = np.zeros((len(edges), beside, width + beside))
    squares = rows.copy()
    judged, judged_rows = (scatter.copy(), rows.copy()) if recording.still else (scatter, rows)
    for run, z in zip(recording.runs, lines, strict=True):
        hz = frequencies(run, highest_hz)
        for band, chosen in enumerate(bands(hz, edges)):
            part = z[chosen, :width]
            scatter[band] += part.T @ part
            room[band] += z[chosen, width:].T @ z[chosen]
            rows[band] += chosen.stop - chosen.start
            squares[band] += hz[chosen] @ hz[chosen]
        for band, chosen in enumerate(bands(hz[1:], edges)) if recording.still else ():
            part = z[1:, :width][chosen]
            judged[band] += part.T @ part
            judged_rows[band] += len(part)
    samples = sum(len(run.motion) for run in recording.runs)
    middle = np.sqrt(squares / np.maximum(rows, 1.0))
    return Spectra(recording.name, recording.still, lines, scatter, room, rows, judged, judged_rows, samples, middle)


def band_power(values: Array, weight: Array, run: Run, edges: Array, highest_hz: float) -> Array:
    """Return the sum by `weight` (D,) of squares (3, K) per row, in every band, of noise (T, D) in a path.

    After 0, 1 and 2 differences; bands without rows get nan.
    """
    hz = frequencies(run, highest_hz)
    power = as_frequencies([values], run, highest_hz, True) ** 2 @ weight
    gain = (2 * run.rate * np.sin(np.pi * hz / run.rate)) ** 2
    out = np.full((3, len(edges)), np.nan)
    for band, chosen in enumerate(bands(hz, edges)):
        if chosen.stop > chosen.start:
            out[:, band] = [(power[chosen] * gain[chosen] ** k).mean() for k in range(3)]
    return out


def bands(hz: Array, edges: Array) -> list[slice]:
    """Return which rows each band holds."""
    ends: Integers = np.searchsorted(hz, edges, side="right")
    return [slice(int(a), int(b)) for a, b in zip([0, *ends[:-1]], ends, strict=True)]


def motion_noise(
    recordings: Sequence[BodyRows], residuals: Sequence[Array], path: Array, edges: Array, highest_hz: float, order: int
) -> Array:
    """Return the covariance (K, 6, 6) of angular acceleration and acceleration less gravity in every band.

    residuals  (T, N, 6) of each recording's rows     path  (6, 6) covariance of a row of the path, in B's axes
    order      differences from path to acceleration: 2 for poses, 1 for twists
    """
    shares = shares_of(recordings, residuals, edges, highest_hz)
    out = np.zeros((len(edges), 6, 6))
    if not recordings[0].still:
        out += shares[order, :, None, None] * path
    if order == 2:
        out[:, 3:, 3:] += shares[0, :, None, None] * tilt_noise(recordings, path)
    return out


def tilt_noise(recordings: Sequence[BodyRows], path: Array) -> Array:
    """Return the covariance (3, 3) of gravity in the body from that of its turns, the first of a path's row."""
    down = np.mean([mean(run.motion[:, 3:6]) for recording in recordings for run in recording.runs], axis=0)
    return np.asarray(cross_matrix(down) @ path[:3, :3] @ cross_matrix(down).T)


def shares_of(recordings: Sequence[BodyRows], residuals: Sequence[Array], edges: Array, highest_hz: float) -> Array:
    """Return the mean square per row (3, K) of noise of unit variance after 0, 1 and 2 differences."""
    total, rows = np.zeros((3, len(edges))), np.zeros(len(edges))
    for recording, residual in zip(recordings, residuals, strict=True):
        flat = residual.reshape(len(residual), -1)
        square = np.einsum("tk,tk->k", flat, flat) / len(flat)
        if not square.any():
            continue
        weight = np.where(square > 0, 1 / np.maximum(square, 1e-300), 0.0) / np.count_nonzero(square)
        for run in recording.runs:
            part = band_power(flat[run.rows], weight, run, edges, highest_hz)
            there = np.isfinite(part[0])
            total[:, there] += part[:, there] * len(run.motion)
            rows[there] += len(run.motion)
    return np.asarray(total / np.maximum(rows, 1.0))
