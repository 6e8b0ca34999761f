"""A long log: how fast the moment pass runs, and that chunks add up to the whole."""

from __future__ import annotations

import itertools
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard import evaluate
from steelyard.bench.timing import thread_ms
from steelyard.check import Array
from steelyard.identify.noise_aware import NoiseAware
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.simulate import bounds, scenarios, simulate_log

OBJECT, MOTION, NOISE = "hammer", "stop_go", "moderate"
CHUNKS = 1000


def run(samples: int, seed: int, repeats: int) -> dict[str, Any]:
    """Return the entries `million` and `chunks` for a log of about `samples` rows in time order.

    The log is the stop-and-go motion played again and again with new noise. `moment_pass_ms` is the pass over
    all rows into one scatter matrix, `marked_pass_ms` with still rows and poses marked, one matrix for each;
    `plain_numpy_ms` is the rival beside it: the same 19 features stacked and multiplied with NumPy.
    """
    plays = max(1, samples // int(scenarios.bench()["samples"]))
    log, true = simulate_log(OBJECT, MOTION, NOISE, seed, shuffled=False, repeats=plays)
    estimator = NoiseAware(bias="none")
    unmarked = replace(log, still=np.zeros(len(log), np.bool_), pose=np.full(len(log), -1))
    moments = Moments.of_log(log)
    found = estimator.solve(moments)
    pass_ms = thread_ms(lambda: Moments.of_log(unmarked), repeats)
    marked_ms = thread_ms(lambda: Moments.of_log(log), repeats)
    numpy_ms = thread_ms(lambda: _numpy_scatter(log), repeats=5, warm=1)
    million = {
        "samples": len(log),
        "groups": len(moments.scatter),
        "seed": seed,
        "moment_pass_ms": pass_ms,
        "samples_per_s": 1000 * len(log) / pass_ms,
        "marked_pass_ms": marked_ms,
        "marked_samples_per_s": 1000 * len(log) / marked_ms,
        "plain_numpy_ms": numpy_ms,
        "plain_numpy / moment_pass": numpy_ms / pass_ms,
        "solve_ms": thread_ms(lambda: estimator.solve(moments), repeats),
        **vars(evaluate.score(found.parameters, true, bounds(OBJECT))),
    }
    return {"million": million, "chunks": _chunks(log, moments, found.parameters.vector, estimator)}


def _numpy_scatter(log: MotionLog) -> Array:
    """Return the scatter matrix (19, 19) of all rows the plain way."""
    x, y, z = log.angular_velocity.T
    squares = np.stack([x * x, x * y, x * z, y * y, y * z, z * z], axis=1)
    motion = [log.angular_acceleration, log.acceleration - log.gravity, squares]
    features = np.concatenate([*motion, log.wrench, np.ones((len(log), 1))], axis=1)
    return np.asarray(features.T @ features)


def _chunks(log: MotionLog, whole: Moments, answer: Array, estimator: NoiseAware) -> dict[str, float]:
    """Return the largest relative differences between the log taken whole and in chunks added up."""
    edges = np.linspace(0, len(log), CHUNKS + 1).astype(int)
    pieces = (log.rows(slice(a, b)) for a, b in itertools.pairwise(edges))
    added = Moments.total([Moments.of_log(piece) for piece in pieces])
    scale = np.sqrt(np.outer(np.diag(whole.sum), np.diag(whole.sum)))
    again = estimator.solve(added).parameters.vector
    return {
        "count": CHUNKS,
        "scatter_rel": float(np.abs((added.sum - whole.sum) / scale).max()),
        "answer_rel": float((np.abs(again - answer) / _size(answer)).max()),
    }


def _size(phi: Array) -> Array:
    """Return what each of the ten parameters is measured against: the length of its own kind (m, h, I)."""
    parts = [phi[:1], phi[1:4], phi[4:]]
    return np.concatenate([np.full(len(part), np.linalg.norm(part)) for part in parts])
