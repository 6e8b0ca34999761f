"""Moments as NPZ files: the statistic of a log, kept to be added to that of another one of the same body."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadFile, BadValue
from steelyard.io.contents import in_file
from steelyard.io.tables.array_table import npz, read_arrays
from steelyard.logs.log import Noise
from steelyard.logs.moments import SIZE, Moments
from steelyard.whole_files import write_bytes

_NAMES = ("scatter", "noise_class", "block", "still", "acceleration_variance", "wrench_variance")
_EVEN = 1e-9  # how far a scatter matrix may be from symmetric, over its largest entry


def write_moments(moments: Moments, path: Path | str) -> None:
    """Write the statistic, complete or not at all; without noise classes the variances are empty. Raises BadFile."""
    noise = moments.noise or ()
    variances = (np.reshape([getattr(n, name) for n in noise], (-1, 6)) for name in ("acceleration", "wrench"))
    arrays = (moments.scatter, moments.noise_class, moments.block, moments.still, *variances)
    write_bytes(Path(path), npz(dict(zip(_NAMES, arrays, strict=True))))


def read_moments(path: Path | str) -> Moments:
    """Read what `write_moments` wrote; raises BadFile where arrays are missing, damaged or do not fit together."""
    path = Path(path)
    if not path.is_file():
        raise BadFile(f"{path}: no such file.")
    arrays = read_arrays(path, _NAMES, "Moments have")
    return in_file(path, lambda: _moments(arrays))


def _moments(arrays: dict[str, Any]) -> Moments:
    """Return the statistic of its arrays; raises BadValue where they do not fit together."""
    scatter = _scatter(arrays["scatter"])
    groups = len(scatter)
    kind, block, still = (_whole(name, arrays[name], groups) for name in ("noise_class", "block", "still"))
    pair = [check.vectors(name, arrays[name], 6) for name in ("acceleration_variance", "wrench_variance")]
    if pair[0].ndim != 2 or pair[0].shape != pair[1].shape:
        raise BadValue(
            "acceleration_variance and wrench_variance must have a row per noise class each; "
            f"got {pair[0].shape} and {pair[1].shape}."
        )
    classes = len(pair[0])
    if groups and (kind.min() < 0 or (classes and kind.max() >= classes)):
        raise BadValue(f"noise_class must number {classes} noise classes from 0 on; got {kind.min()} to {kind.max()}.")
    if groups and (block.min() < -1 or still.min() < 0 or still.max() > 1):
        raise BadValue("block must be -1 or a number from 0 on, and still 0 or 1.")
    noise = tuple(Noise(a, w) for a, w in zip(*pair, strict=True)) or None
    return Moments(scatter, kind, block, still.astype(np.bool_), noise)


def _scatter(values: Any) -> Array:
    """Return scatter matrices (G, 19, 19): symmetric, of sums of squares and a number of rows that are not negative."""
    scatter = check.matrices("scatter", values, SIZE, SIZE)
    if scatter.ndim != 3:
        raise BadValue(f"scatter must have shape (G, {SIZE}, {SIZE}); got {scatter.shape}.")
    uneven = np.abs(scatter - np.swapaxes(scatter, 1, 2)).max(initial=0.0) > _EVEN * np.abs(scatter).max(initial=0.0)
    if uneven or (np.einsum("gii->gi", scatter) < 0).any():
        raise BadValue("scatter must hold sums of z z^T: symmetric, with no diagonal entry below zero.")
    return scatter


def _whole(name: str, values: Any, groups: int) -> Integers:
    """Return one whole number per group."""
    if values.shape != (groups,) or values.dtype.kind not in "iub":
        raise BadValue(f"{name} needs one whole number per group ({groups},); got {values.dtype} of {values.shape}.")
    return np.asarray(values, np.int64)
