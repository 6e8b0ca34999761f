"""How often the 95 % intervals hold the truth, and how wide they are for the errors actually made."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from steelyard.bench.jobs import BATCH, Progress, require_one, spread, told
from steelyard.check import Array
from steelyard.errors import SteelyardError
from steelyard.identify.noise_aware import NoiseAware
from steelyard.inertia import InertialParameters
from steelyard.simulate import scenarios, simulate_log
from steelyard.simulate.noise import Spectrum

HALF_WIDTH = 1.96
ENTRIES = ("mass", "com_x", "com_y", "com_z", "i_xx", "i_xy", "i_xz", "i_yy", "i_yz", "i_zz")
KINDS = {"mass": slice(0, 1), "com": slice(1, 4), "inertia": slice(4, 10)}
BIAS_STD = np.repeat([0.2, 5.0], 3)
RULES = (
    "Ordered logs with a clock; 95 % interval = estimate +- 1.96 std, of what the estimate calls identified. "
    "coverage_pct pools all intervals of a kind. width_ratio = mean half-width / rms error for each "
    "(object, entry), averaged within the kind with the number of intervals as weight; width_ratio_pooled = "
    "the same over the whole kind at once, each object in its own scale (mass, radius of gyration, half the "
    "trace of the inertia about the centre of mass). An honest interval has a ratio of 1.96."
)


@dataclass(frozen=True)
class Case:
    """What all logs of one table have in common.

    declared  whether the log says its noise level; bias "free": an unknown bias is added and estimated
    """

    motion: str
    noise: str
    spectrum: Spectrum
    declared: bool = True
    bias: str = "none"


@dataclass(frozen=True, eq=False)
class Outcome:
    """One fit: errors and half-widths (10,) of mass, com, inertia about the CoM, in the object's scale."""

    name: str
    error: Array
    half_width: Array
    identified: np.ndarray[Any, np.dtype[np.bool_]]


def run(
    seeds: int = 1000,
    motion: str = "stop_go",
    noise: str = "moderate",
    spectra: Sequence[Spectrum] = ("white", "2hz"),
    progress: Progress | None = None,
    *,
    all_objects: bool = False,
    declared: bool = True,
    bias: str = "none",
    workers: int = 1,
) -> dict[str, Any]:
    """Return coverage and width per spectrum and kind over `seeds` logs (x ten objects with `all_objects`).

    Without `all_objects` seed k uses object k mod 10. `workers` processes share the fits.
    """
    require_one("seed", seeds)
    names = scenarios.object_names()
    jobs = [(s, n) for s in range(seeds) for n in (names if all_objects else (names[s % len(names)],))]
    cases = [Case(motion, noise, spectrum, declared, bias) for spectrum in spectra]
    found: dict[str, list[Outcome | str]] = {case.spectrum: [] for case in cases}
    fits = ((case, fit) for case in cases for fit in spread(partial(_fit, case), jobs, workers, BATCH))
    for case, outcome in told(fits, len(jobs) * len(cases), progress):
        found[case.spectrum].append(outcome)
    return {
        "bench": "coverage",
        "rules": RULES,
        "seeds": list(range(seeds)),
        "motion": motion,
        "noise": noise,
        "noise_declared": declared,
        "bias": bias,
        "cases": {spectrum: summary(outcomes) for spectrum, outcomes in found.items()},
    }


def _fit(case: Case, job: tuple[int, str]) -> Outcome | str:
    """Return the outcome of the log of a seed and an object, or the message of the error that it raised."""
    seed, name = job
    bias = np.random.default_rng([seed, 1]).normal(0, BIAS_STD) if case.bias == "free" else None
    options: dict[str, Any] = {"shuffled": False, "spectrum": case.spectrum, "bias": bias}
    log, true = simulate_log(name, case.motion, case.noise, seed, **options)
    try:
        estimate = NoiseAware(bias=case.bias).identify(log if case.declared else replace(log, noise=None))
    except SteelyardError as reason:
        return f"{name}, seed {seed}: {reason}"
    scale = object_scale(true)
    error = (estimate.parameters.people - true.people) / scale
    return Outcome(name, error, HALF_WIDTH * estimate.std / scale, estimate.identified)


def object_scale(body: InertialParameters) -> Array:
    """Return the size (10,) of mass, radius of gyration and half the trace of the inertia about the CoM."""
    half_trace = float(np.trace(body.inertia_com)) / 2
    return np.repeat([float(body.mass), np.sqrt(half_trace / float(body.mass)), half_trace], [1, 3, 6])


def summary(outcomes: Sequence[Outcome | str]) -> dict[str, Any]:
    """Return coverage and width ratios by kind and by entry, and what was identified per object."""
    good = [outcome for outcome in outcomes if isinstance(outcome, Outcome)]
    failures = [outcome for outcome in outcomes if isinstance(outcome, str)]
    objects = _identified(good)
    return {
        "logs": len(outcomes),
        "failures": failures,
        "kinds": {kind: widths(_by_group(good, which)) for kind, which in KINDS.items()},
        "entries": {name: widths(_by_group(good, slice(k, k + 1))) for k, name in enumerate(ENTRIES)},
        "objects": objects,
        "all_six_objects": sum(entry["inertia_identified"] == 6 for entry in objects.values()),
    }


def widths(groups: Sequence[Array]) -> dict[str, Any]:
    """Return coverage and width ratios of groups (n, 2) of errors and half-widths; None where there are none."""
    if not groups:
        return {"coverage_pct": None, "width_ratio": None, "width_ratio_pooled": None, "intervals": 0}
    everything = np.concatenate(groups)
    ratios = [float(group[:, 1].mean()) / rms_error(group) for group in groups]
    return {
        "coverage_pct": float(100 * np.mean(np.abs(everything[:, 0]) <= everything[:, 1])),
        "width_ratio": float(np.average(ratios, weights=[len(group) for group in groups])),
        "width_ratio_pooled": float(everything[:, 1].mean()) / rms_error(everything),
        "intervals": len(everything),
    }


def _by_group(outcomes: Sequence[Outcome], which: slice) -> list[Array]:
    """Return error and half-width (n, 2) of what was identified, per object and entry."""
    groups: dict[tuple[str, int], list[tuple[float, float]]] = {}
    for outcome in outcomes:
        for k in range(*which.indices(10)):
            if outcome.identified[k]:
                pair = float(outcome.error[k]), float(outcome.half_width[k])
                groups.setdefault((outcome.name, k), []).append(pair)
    return [np.array(group) for group in groups.values()]


def rms_error(pairs: Array) -> float:
    """Return the rms of the errors in pairs (n, 2) of error and half-width."""
    return float(np.sqrt(np.mean(pairs[:, 0] ** 2)))


def _identified(outcomes: Sequence[Outcome]) -> dict[str, dict[str, float]]:
    """Return per object how many of six inertia entries the estimates call identified."""
    counts: dict[str, list[int]] = {}
    for outcome in outcomes:
        counts.setdefault(outcome.name, []).append(int(outcome.identified[4:].sum()))
    return {
        name: {
            "inertia_identified": float(np.median(count)),
            "all_six_pct": 100 * float(np.mean(np.equal(count, 6))),
        }
        for name, count in counts.items()
    }
