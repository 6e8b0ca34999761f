"""The identification bench: ten objects, three motions, four noise levels, our methods beside the peers."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any

import numpy as np

from steelyard import evaluate
from steelyard.bench.jobs import Progress, told
from steelyard.bench.logs import long_log
from steelyard.bench.logs.methods import Method, choose, own_methods
from steelyard.bench.logs.peers import peer_methods
from steelyard.bench.middles import middle_of
from steelyard.bench.timing import REPEATS, thread_ms
from steelyard.check import Array
from steelyard.errors import SteelyardError
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.simulate import bounds, scenarios, simulate_log

TIMES = ("solve_ms", "identify_ms")
SCORES = ("mass_pct", "com_mm", "com_pct", "inertia_pct", "riemannian")
RULES = (
    "Every method sees per row: noisy acceleration and angular acceleration, exact angular velocity and "
    "gravity in S, noisy wrench; rows shuffled (seeded), no pose, no velocity, no time, a mark on rows at "
    "rest. The standard deviations of the noise are given (nothing at level 'none'); no shape is given. The "
    "wrench has no bias and no method estimates one. Medians over objects and seeds; riemannian over "
    "consistent results only; consistent_pct over all runs, a failure counting as inconsistent."
)
TIMING = (
    "CPU time of the calling thread, warm, median of the repeats, on the first seed; null where not taken. "
    "solve_ms: compressed log to answer (slow methods: first object only; ours need a declared noise). "
    "identify_ms: the scored answer from the log, with compression, check of rest and error bars (first "
    "object, no slow methods)."
)
Row = dict[str, Any]


def run(
    seeds: Sequence[int] = range(5),
    methods: Sequence[str] = (),
    progress: Progress | None = None,
    *,
    objects: Sequence[str] = (),
    motions: Sequence[str] = (),
    noises: Sequence[str] = (),
    repeats: int = REPEATS,
    million: int = 1_000_000,
) -> dict[str, Any]:
    """Return the bench as a dictionary in the shape of `formats`; empty choices mean all there are.

    `repeats` timed calls per timed row (the first seed; slow methods: its first object). `million` is the
    length of the long log, 0 to leave it out. `progress(done, logs)` is called after every log.
    """
    peers, notes = peer_methods()
    chosen = choose(own_methods() | peers, tuple(methods))
    names = (
        tuple(objects) or scenarios.object_names(),
        tuple(motions) or scenarios.motion_names(),
        tuple(noises) or scenarios.noise_names(),
    )
    rows = _rows(names, tuple(seeds), chosen, repeats, progress)
    median = medians(rows)
    result: dict[str, Any] = {
        "bench": "identify",
        "rules": RULES,
        "seeds": [int(seed) for seed in seeds],
        "objects": list(names[0]),
        "methods": list(chosen),
        "timing": _timing(chosen, repeats),
        "notes": list(notes),
        "median": median,
        "speed": speed(median),
    }
    if million:
        result |= long_log.run(million, seed=int(seeds[0]), repeats=repeats)
    return result | {"rows": rows}


def _timing(methods: dict[str, Method], repeats: int) -> dict[str, Any]:
    return {
        "what": TIMING,
        "repeats": repeats,
        "solve_covers": {name: method.timed for name, method in methods.items()},
        "blas_threads": os.environ.get("OPENBLAS_NUM_THREADS", "not set"),
    }


def _rows(
    names: tuple[tuple[str, ...], tuple[str, ...], tuple[str, ...]],
    seeds: tuple[int, ...],
    methods: dict[str, Method],
    repeats: int,
    progress: Progress | None,
) -> list[Row]:
    """Return one row per log and method."""
    objects, motions, noises = names
    cases = [(o, m, n, s) for m in motions for n in noises for o in objects for s in seeds]
    rows: list[Row] = []
    for name, motion, noise, seed in told(cases, len(cases), progress):
        log, true = simulate_log(name, motion, noise, seed)
        head = {"object": name, "motion": motion, "noise": noise, "seed": int(seed)}
        for method in methods.values():
            row = _row(method, log, true, bounds(name))
            if seed == seeds[0] and "failure" not in row:
                row |= _times(method, log, name == objects[0], repeats)
            rows.append(head | row)
    return rows


def _row(method: Method, log: MotionLog, true: InertialParameters, box: Array) -> Row:
    """Return the scores of one method on one log, not timed."""
    row: Row = {"method": method.name} | dict.fromkeys((*SCORES, *TIMES)) | {"consistent": False}
    try:
        row |= vars(evaluate.score(method.identify(log), true, box))
    except SteelyardError as error:
        row["failure"] = str(error)
    return row


def _times(method: Method, log: MotionLog, first_object: bool, repeats: int) -> Row:
    """Return the times of one method on one log, as far as `TIMING` says that they are taken."""
    times: Row = {}
    if (first_object or not method.slow) and not (method.needs_noise and log.noise is None):
        data = method.compress(log)
        times["solve_ms"] = thread_ms(lambda: method.solve(data), repeats)
    if first_object and not method.slow:
        times["identify_ms"] = thread_ms(lambda: method.identify(log), repeats)
    return times


def medians(rows: Sequence[Row]) -> dict[str, dict[str, dict[str, Row]]]:
    """Return median.<motion>.<noise>.<method> with the scores, consistent_pct, failures and runs."""
    groups: dict[tuple[str, str, str], list[Row]] = {}
    for row in rows:
        groups.setdefault((row["motion"], row["noise"], row["method"]), []).append(row)
    out: dict[str, dict[str, dict[str, Row]]] = {}
    for (motion, noise, method), group in groups.items():
        out.setdefault(motion, {}).setdefault(noise, {})[method] = {
            **{key: middle_of([row[key] for row in group], np.median) for key in (*SCORES, *TIMES)},
            "consistent_pct": 100 * sum(row["consistent"] for row in group) / len(group),
            "failures": sum("failure" in row for row in group),
            "runs": len(group),
        }
    return out


def speed(median: dict[str, dict[str, dict[str, Row]]]) -> dict[str, float]:
    """Return "<method> / noise-aware": ratio of solve times in this run, median over motions and levels."""
    ratios: dict[str, list[float]] = {}
    for group in (methods for noises in median.values() for methods in noises.values()):
        ours = group.get("noise-aware", {}).get("solve_ms")
        for name, entry in group.items():
            if ours and entry["solve_ms"] and name != "noise-aware":
                ratios.setdefault(f"{name} / noise-aware", []).append(entry["solve_ms"] / ours)
    return {name: float(np.median(values)) for name, values in ratios.items()}
