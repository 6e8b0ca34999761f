"""The clock of a log: the stamps of a stream, how far apart they are, and how many there are per second."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription, BadValue
from steelyard.logs.recording import Stream


def stamps_of(stream: Stream) -> Array:
    """Return the stamps (N,) [s] of a stream; raises BadDescription where it has none."""
    if stream.time is None:
        raise BadDescription(f"'{stream.name}' has no time; streams with their own rows need a clock.")
    return stream.time


def median_step(time: Array) -> float:
    """Return the median step [s] of a clock (N,), of two stamps or more."""
    return float(np.median(np.diff(time)))


def sampling_rate(time: Array) -> float:
    """Return the median sampling rate [Hz] of a rising clock (N,) [s]; raises BadValue below two samples."""
    if len(time) < 2:
        raise BadValue("a clock needs at least two samples.")
    return 1.0 / median_step(time)
