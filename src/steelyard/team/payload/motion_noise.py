"""How noise of the fused path enters accelerations and the direction of gravity, band by band.

Its size comes from the joint fit, its colour from the residuals of the same fit: structures and encoders err slowly,
and second derivatives weigh every frequency by its fourth power.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.spatial import cross_matrix
from steelyard.team.payload.body_rows import BodyRows
from steelyard.team.payload.spectra import band_power


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
    down = np.mean([run.motion[:, 3:6].mean(0) for recording in recordings for run in recording.runs], axis=0)
    return np.asarray(cross_matrix(down) @ path[:3, :3] @ cross_matrix(down).T)


def shares_of(recordings: Sequence[BodyRows], residuals: Sequence[Array], edges: Array, highest_hz: float) -> Array:
    """Return the mean square per row (3, K) of noise of unit variance after 0, 1 and 2 differences."""
    total, rows = np.zeros((3, len(edges))), np.zeros(len(edges))
    for recording, residual in zip(recordings, residuals, strict=True):
        flat = residual.reshape(len(residual), -1)
        size = np.sqrt((flat**2).mean(0))
        flat = flat[:, size > 0] / size[size > 0]
        if not flat.shape[1]:
            continue
        for run in recording.runs:
            part = band_power(flat[run.rows], run, edges, highest_hz)
            there = np.isfinite(part[0])
            total[:, there] += part[:, there] * len(run.motion)
            rows[there] += len(run.motion)
    return np.asarray(total / np.maximum(rows, 1.0))
