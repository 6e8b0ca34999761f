"""The held-object bench: every object folder, noise scenario, seed and method; the paper's Table IV beside it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from steelyard import evaluate
from steelyard.bench.jobs import Progress, chosen_folders, require_known, require_one, spread, told
from steelyard.bench.objects import bound
from steelyard.bench.objects.cases import (
    METHODS,
    PART_METHODS,
    PARTS,
    RIVALS,
    Case,
    Method,
    load_case,
    methods_for,
    noisy_rows,
)
from steelyard.bench.objects.conditions import condition_means, conditions
from steelyard.bench.objects.summary import SCORES, Row, bound_means, summary, table_iv
from steelyard.bench.timing import REPEATS, thread_ms
from steelyard.check import Array
from steelyard.errors import BadValue, SteelyardError
from steelyard.identify.estimate import Estimate
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.simulate.handling import NOISE, noise_std

SCENARIOS = ("none", "low", "moderate", "high")
# A part that carries this share of the mass and is found with less than a hundredth of its own counts as zeroed.
ZERO_SHARE, ZERO_PART = 1e-3, 1e-2
RULES = (
    "Every method sees per row: noisy acceleration and angular acceleration, exact angular velocity and gravity in S, "
    "noisy physical wrench (gravity down, no bias); rows shuffled (seeded), no pose, no velocity, no time, a mark on "
    "rows at rest; standard deviations of the noise given (nothing at level 'none', which has one seed). ours-still: "
    "rows whose true speed is below 0.05 m/s and 0.1 rad/s. halves: 'uniform' where the uniform-density centre of "
    "mass is within 0.5 mm of the truth, else 'mixed'. riemannian over consistent results; consistent_pct over all "
    "runs, a failure counting as inconsistent. com_pct_floored: the same error cut to whole percents per axis, as the "
    "published code does. bound: Cramer-Rao with the true parts and free masses, to first order; groups: parts of "
    "equal density known as such. zeroed: parts with over 0.1 % of the mass found with less than a hundredth of "
    "their own. condition: of the regressor of all rows, first seed, mean over the objects; properly (columns of "
    "length 1) and as the paper counts it (entries scaled to 0..1, extremes over single rows), beside what it prints."
)
TIMING = (
    "CPU time of the calling thread, warm, median of the repeats, first seed: moments to Estimate; hps: rows to "
    "Estimate, since its rows are chosen one by one. A call above 50 ms is timed once."
)
SLOW_MS = 50.0


@dataclass(frozen=True)
class Plan:
    """What is done with each object."""

    parts: str
    noises: tuple[str, ...]
    seeds: int
    methods: tuple[str, ...]
    repeats: int


def run(
    data: Path | str,
    parts: str = "truth",
    seeds: int = 5,
    progress: Progress | None = None,
    *,
    objects: Sequence[str] = (),
    noises: Sequence[str] = (),
    methods: Sequence[str] = (),
    workers: int = 1,
    repeats: int = REPEATS,
) -> dict[str, Any]:
    """Return the bench over the object folders in `data`, in the shape of `formats`.

    `parts`: "segmented", found in the cloud with its labels unseen; "truth"; "truth-split", each true part in two or
    three pieces; "truth-merged", true parts of one density joined, and under `mixed_merge` the two heaviest parts of
    different density joined. Empty choices mean all there are (of the methods: those that use parts, where these are
    split or merged). `progress(done, objects)` is called after every object.
    """
    plans = [_plan(parts, tuple(noises), seeds, tuple(methods), repeats)]
    if parts == "truth-merged":
        plans.append(_plan("truth-merged-mixed", tuple(noises), seeds, tuple(methods), repeats))
    folders = chosen_folders(data, objects)
    rows = ((plan, each) for plan in plans for each in spread(partial(_object, plan), folders, workers))
    found: dict[Plan, list[Outcome]] = {plan: [] for plan in plans}
    for plan, outcome in told(rows, len(folders) * len(plans), progress):
        found[plan] += [outcome] if outcome is not None else []
    head = {
        "bench": "held-object",
        "rules": RULES,
        "timing": {"what": TIMING, "repeats": repeats},
        "seeds": list(range(seeds)),
    }
    result = head | _result(plans[0], found[plans[0]]) | {"table_iv": table_iv()}
    if len(plans) > 1:
        result["mixed_merge"] = _result(plans[1], found[plans[1]])
    return result


def _plan(parts: str, noises: tuple[str, ...], seeds: int, methods: tuple[str, ...], repeats: int) -> Plan:
    if parts not in PARTS:
        raise BadValue(f"parts must be one of {', '.join(PARTS)}; got {parts!r}.")
    require_one("seed", seeds)
    require_known("noise scenario", noises, NOISE)
    require_known("method", methods, METHODS)
    if "paper-route" in methods and parts != "segmented":
        raise BadValue(f'paper-route finds its own parts in the cloud; give parts "segmented", not {parts!r}.')
    everything = {"truth": (*PART_METHODS, *RIVALS), "segmented": (*PART_METHODS, "paper-route", *RIVALS)}.get(
        parts, PART_METHODS
    )
    return Plan(parts, noises or SCENARIOS, seeds, methods or everything, repeats)


@dataclass(frozen=True, eq=False)
class Outcome:
    """What one object gave: who it is, rows, and its bound per noise scenario."""

    entry: Row
    rows: list[Row]
    bounds: dict[str, dict[str, dict[str, float]]]


def _object(plan: Plan, folder: Path) -> Outcome | None:
    """Return all rows of one object, None where the plan's parts do not apply to it."""
    case = load_case(folder, plan.parts)
    if case is None:
        return None
    methods = methods_for(case, plan.methods)
    entry = {
        "object": case.known.name,
        "half": case.known.half,
        "parts": len(case.parts),
        "true_parts": len(case.true_parts),
        "densities": len(case.groups),
        "mass_kg": float(case.known.truth.mass),
        "still_rows": int(case.log.still.sum()),
    }
    if case.seen is not None:
        entry["segmentation"] = case.seen.scores
    rows, condition = [], {}
    for noise in plan.noises:
        for seed in range(plan.seeds if any(noise_std(noise)) else 1):
            log = noisy_rows(case, noise, seed)
            head = {"object": entry["object"], "half": entry["half"], "noise": noise, "seed": seed}
            rows += [head | _row(case, method, log, plan.repeats if seed == 0 else 0) for method in methods]
            if seed == 0:
                condition[noise] = conditions(log)
    entry["condition"] = condition
    bounds = {noise: _bound(case, noise) for noise in plan.noises if all(noise_std(noise))}
    return Outcome(entry, rows, bounds)


def _row(case: Case, method: Method, log: MotionLog, repeats: int) -> Row:
    """Return the scores of one method on one log; timed where `repeats` is above zero and the noise is declared."""
    row: Row = {"method": method.name} | dict.fromkeys(SCORES) | {"consistent": False, "solve_ms": None}
    try:
        seen = method.rows(log)
        estimate = method.identify(seen)
        row |= _scores(case, estimate)
        if repeats and log.noise is not None:
            row["solve_ms"] = _time(method, seen, repeats)
    except SteelyardError as error:
        row["failure"] = str(error)
    return row


def _scores(case: Case, estimate: Estimate) -> Row:
    truth = case.known.truth
    floored = evaluate.score_as_published(estimate.parameters, truth, case.known.box)
    row: Row = vars(evaluate.score(estimate.parameters, truth, case.bounds)) | {"com_pct_floored": floored.com_pct}
    if estimate.parts:
        row |= {"zeroed": _zeroed(case, estimate), "findings": sorted(estimate.codes())}
    return row


def _zeroed(case: Case, estimate: Estimate) -> int | None:
    """Return how many parts are wrongly at zero mass, None where the true masses are not known."""
    if case.part_masses is None:
        return None
    found = np.array([part.mass for part in estimate.parts])
    true = case.part_masses
    return int(((found < ZERO_PART * true) & (true > ZERO_SHARE * true.sum())).sum())


def _time(method: Method, log: MotionLog, repeats: int) -> float:
    call: Callable[[], Estimate] = partial(method.identify, log)
    if method.solve is not None:
        call = partial(method.solve, Moments.of_log(log))
    first = thread_ms(call, 1, warm=1)
    return thread_ms(call, repeats, warm=0) if first < SLOW_MS else first


def _bound(case: Case, noise: str) -> dict[str, dict[str, float]]:
    """Return the expected scores at the bound, with free masses and with groups of equal density known."""
    level = bound.noise_of(noise)
    out = {}
    for name, parts in (("free", case.true_parts), ("groups", case.true_parts.merged(case.groups))):
        spread: Array = bound.covariance(case.log, level, case.known.truth, parts)
        out[name] = bound.expected_scores(spread, case.known.truth, case.known.box)
    return out


def _result(plan: Plan, outcomes: list[Outcome]) -> dict[str, Any]:
    rows = [row for outcome in outcomes for row in outcome.rows]
    return {
        "parts": plan.parts,
        "objects": {outcome.entry["object"]: outcome.entry for outcome in outcomes},
        "methods": list(plan.methods),
        "mean": summary(rows, plan.noises, plan.methods, np.mean),
        "median": summary(rows, plan.noises, plan.methods, np.median),
        "condition": condition_means([outcome.entry["condition"] for outcome in outcomes]),
        "bound": bound_means([(outcome.entry["half"], outcome.bounds) for outcome in outcomes]),
        **_correlations(outcomes, rows),
        "rows": rows,
    }


def _correlations(outcomes: list[Outcome], rows: list[Row]) -> dict[str, Any]:
    """Return how scores of the segmentation rank with the error at low noise, where parts were found."""
    entries = [o.entry for o in outcomes if "segmentation" in o.entry]
    if not entries:
        return {}
    from steelyard.bench.objects.segmented import rank_correlations

    out = {}
    for method in ("ours", "paper-route"):
        errors: dict[str, list[float]] = {}
        for row in rows:
            if row["method"] == method and row["noise"] == "low" and row["riemannian"] is not None:
                errors.setdefault(row["object"], []).append(row["riemannian"])
        scored = [{"object": e["object"]} | e["segmentation"][method] for e in entries if e["object"] in errors]
        out[method] = rank_correlations(scored, {name: float(np.mean(e)) for name, e in errors.items()})
    return {"rank_correlation": out}
