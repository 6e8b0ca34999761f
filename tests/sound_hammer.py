"""The made log of a hammer that many tests spoil, and its answer as it is, worked out once for all of them."""

from __future__ import annotations

from functools import cache

import steelyard as sy
from steelyard.logs.recording import Recording
from steelyard.simulate import hammer


@cache
def hammer_log() -> Recording:
    return hammer.recording(0).recording


@cache
def hammer_answer() -> sy.Estimate:
    return sy.identify(hammer_log())
