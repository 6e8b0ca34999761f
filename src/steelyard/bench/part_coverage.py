"""How often the 95 % intervals of PartMasses hold the truth, on object folders, and how long an answer takes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.bench.coverage import HALF_WIDTH, object_scale, rms_error, widths
from steelyard.bench.jobs import BATCH, Progress, require_one, spread, told
from steelyard.bench.objects.cases import Case, load_case, noisy_rows
from steelyard.bench.objects.part_timing import TIMING, timings
from steelyard.bench.timing import REPEATS
from steelyard.check import Array
from steelyard.errors import BadValue, SteelyardError
from steelyard.identify.masses.shape_error import EXACT, MEASURED
from steelyard.identify.part_masses import PartMasses
from steelyard.io.object_folders import object_folders
from steelyard.simulate.handling import NOISE, noise_std

TRUTHS = ("summed", "published")
NOISES = ("low", "high")
# An error below this share of the object's scale is rounding, or symmetry.
ROUNDING = 1e-6
RULES = (
    "Seed k uses object k mod n; rows as in bench held-object, noise declared, no bias, densities averaged. 95 % "
    "interval = estimate +- 1.96 std. summed: truth and wrench are those of the parts with their masses, summed from "
    "the same solids, and the shape is exact. published: truth and wrench as the folder gives them, shape error 0.1 "
    "mm and 0.3 %. coverage_pct pools all intervals of a kind. width_ratio = mean half-width / rms error for each "
    "(object, entry), averaged within the kind with the number of intervals as weight; width_ratio_pooled = the same "
    "over the whole kind at once, each object in its own scale (part masses: mass of the whole). Honest is 1.96. "
    "Entries that are never wrong by a millionth of that scale are left out. part_5pct: parts with at least 5 % of "
    "the mass."
)
Job = tuple[Path, int, str, str]


@dataclass(frozen=True, eq=False)
class Outcome:
    """One fit: per kind the errors and half-widths (2, k) in the object's scale, and the codes of findings."""

    name: str
    pairs: dict[str, Array]
    codes: frozenset[str]


def run(
    data: Path | str,
    seeds: int = 1000,
    progress: Progress | None = None,
    *,
    noises: Sequence[str] = NOISES,
    workers: int = 1,
    repeats: int = REPEATS,
) -> dict[str, Any]:
    """Return coverage and widths per noise scenario, truth and kind over `seeds` logs, and times per object.

    `repeats` = 0 leaves the times out. `progress(done, fits)` is called after every fit.
    """
    require_one("seed", seeds)
    usable = [name for name in NOISE if any(noise_std(name))]
    for name in noises:
        if name not in usable:
            raise BadValue(f"There is no noise scenario '{name}' here; there are: {', '.join(usable)}.")
    folders = object_folders(data)
    times = timings(folders, repeats) if repeats else {}
    asked = [(noise, truth) for noise in noises for truth in TRUTHS]
    jobs = [(folders[k % len(folders)], k, *case) for case in asked for k in range(seeds)]
    fits = list(told(spread(_fit, jobs, workers, BATCH), len(jobs), progress))
    cases = {", ".join(case): summary(fits[k * seeds : (k + 1) * seeds]) for k, case in enumerate(asked)}
    return {
        "bench": "part-coverage",
        "rules": RULES,
        "seeds": list(range(seeds)),
        "objects": [folder.name for folder in folders],
        "cases": cases,
        "timing": {"what": TIMING, "repeats": repeats, "objects": times},
    }


@lru_cache(maxsize=64)
def _case(folder: Path, truth: str) -> tuple[Case, Array] | None:
    """Return the case and the true masses (P,) of its parts; None where these are not known."""
    case = load_case(folder, "truth")
    if case is None or case.part_masses is None:
        return None
    if truth == "published":
        return case, case.part_masses
    body = case.parts.whole(case.part_masses)
    log = replace(case.log, wrench=case.log.predicted(body.vector))
    return replace(case, known=replace(case.known, truth=body), log=log), case.part_masses


def _fit(job: Job) -> Outcome | str:
    """Return the outcome of one log, or the message of the error that it raised."""
    folder, seed, noise, truth = job
    try:
        loaded = _case(folder, truth)
        if loaded is None:
            return f"{folder.name}: the true masses of its parts are not known"
        case, masses = loaded
        method = PartMasses(case.parts, bias="none", shape_error=EXACT if truth == "summed" else MEASURED)
        estimate = method.identify(noisy_rows(case, noise, seed))
    except SteelyardError as reason:
        return f"{folder.name}, seed {seed}: {reason}"
    true = case.known.truth
    scale = object_scale(true)
    pairs = np.stack([estimate.parameters.people - true.people, HALF_WIDTH * estimate.std]) / scale
    out = {"mass": pairs[:, :1], "com": pairs[:, 1:4], "inertia": pairs[:, 4:]}
    if truth == "summed":
        found = np.array([[part.mass, HALF_WIDTH * part.std] for part in estimate.parts]).T
        found[0] -= masses
        out["part"] = found / float(true.mass)
        out["part_5pct"] = np.where(masses >= 0.05 * masses.sum(), out["part"], np.nan)
    return Outcome(case.known.name, out, frozenset(estimate.codes()))


def summary(outcomes: Sequence[Outcome | str]) -> dict[str, Any]:
    """Return coverage and width ratios by kind, over all objects and for each."""
    good = [outcome for outcome in outcomes if isinstance(outcome, Outcome)]
    names = sorted({outcome.name for outcome in good})
    return {
        "logs": len(outcomes),
        "failures": [outcome for outcome in outcomes if isinstance(outcome, str)],
        "kinds": _kinds(good),
        "objects": {name: _kinds([outcome for outcome in good if outcome.name == name]) for name in names},
        "not_homogeneous": sum("part-not-homogeneous" in outcome.codes for outcome in good),
    }


def _kinds(outcomes: Sequence[Outcome]) -> dict[str, dict[str, Any]]:
    kinds = outcomes[0].pairs if outcomes else {}
    return {kind: widths(_groups(outcomes, kind)) for kind in kinds}


def _groups(outcomes: Sequence[Outcome], kind: str) -> list[Array]:
    """Return errors and half-widths (n, 2) per object and entry, those without any error left out."""
    groups: dict[tuple[str, int], list[Array]] = {}
    for outcome in outcomes:
        for k, pair in enumerate(outcome.pairs[kind].T):
            if np.isfinite(pair).all():
                groups.setdefault((outcome.name, k), []).append(pair)
    stacked = [np.stack(group) for group in groups.values()]
    return [group for group in stacked if rms_error(group) > ROUNDING]
