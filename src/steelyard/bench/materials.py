"""Which share of parts gets the right density from a list, at low noise."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from steelyard.bench.jobs import Progress, chosen_folders, require_one, told
from steelyard.bench.objects.cases import SAME_DENSITY, Case, densities, load_case, noisy_rows
from steelyard.errors import SteelyardError
from steelyard.identify.estimate import Estimate
from steelyard.identify.part_masses import PartMasses
from steelyard.parts.material import Material

NOISE = "low"
# Parts that carry at least this share of the mass count.
COUNTED = 0.05
# The list in the README of the published data set.
PUBLISHED = (
    Material("carbon or chrome steel", 7800, 0.01),
    Material("alloy steel", 7700, 0.01),
    Material("ductile iron", 7100, 0.01),
    Material("brass", 8500, 0.01),
    Material("1060 aluminium", 2700, 0.01),
    Material("PVC", 1300, 0.01),
    Material("rubber", 1000, 0.01),
    Material("oak", 563, 0.02),
)
OWN_TOLERANCE = 0.01
RULES = (
    "Noise 'low', declared, no bias, shape error 0.1 mm and 0.3 %; wrench as the folder gives it. Counted: parts with "
    "at least 5 % of the mass. List: for published folders the eight densities of their README (1 %, oak 2 %), "
    "for folders of our own the densities of that object (1 %). right: the likeliest density is the true one. tied: "
    "another one is named as possible too. right_or_tied: the true one is the likeliest or named as possible. "
    "wrong_alone: a wrong one without a tie. all_right_runs_pct: runs in which every counted part is right."
)
Counts = dict[str, int]
EMPTY: Counts = {"parts": 0, "right": 0, "tied": 0, "right_or_tied": 0, "wrong_alone": 0, "runs": 0, "all_right": 0}


def run(
    data: Path | str, seeds: int = 5, progress: Progress | None = None, *, objects: Sequence[str] = ()
) -> dict[str, Any]:
    """Return how often the right density is picked, over all objects and for each. Empty `objects` means all."""
    require_one("seed", seeds)
    folders = chosen_folders(data, objects)
    found: dict[str, Any] = {}
    failures: list[str] = []
    for folder in told(folders, len(folders), progress):
        case = load_case(folder, "truth")
        if case is not None and case.part_masses is not None:
            found[folder.name] = _object(case, seeds, failures)
    return {
        "bench": "materials",
        "rules": RULES,
        "seeds": list(range(seeds)),
        "noise": NOISE,
        "overall": _with_shares({key: sum(entry[key] for entry in found.values()) for key in EMPTY}),
        "objects": found,
        "failures": failures,
    }


def material_list(case: Case) -> tuple[Material, ...]:
    """Return the densities to choose from: the published list, or those of an object that states its masses."""
    if not any("mass_kg" in row for row in case.known.facts.get("parts", ())):
        return PUBLISHED
    out: list[Material] = []
    for name, density in zip(case.known.part_materials, densities(case.parts, case.part_masses), strict=True):
        if not any(_same(m.density, density) for m in out):
            out.append(Material(f"{name} {density:.0f}", float(density), OWN_TOLERANCE))
    return tuple(out)


def _same(one: float, other: float) -> bool:
    return abs(one / other - 1) < SAME_DENSITY


def _object(case: Case, seeds: int, failures: list[str]) -> dict[str, Any]:
    """Return the counts of one object, and for each counted part what was picked how often."""
    materials = material_list(case)
    density = densities(case.parts, case.part_masses)
    masses = density * case.parts.volume
    true = [next((m for m in materials if _same(m.density, d)), None) for d in density]
    counted = [k for k in range(len(density)) if masses[k] >= COUNTED * masses.sum()]
    picks: dict[int, dict[str, int]] = {k: {} for k in counted}
    counts = dict(EMPTY)
    for seed in range(seeds):
        counts["runs"] += 1
        try:
            estimate = PartMasses(case.parts, bias="none", materials=materials).identify(noisy_rows(case, NOISE, seed))
        except SteelyardError as reason:
            failures.append(f"{case.known.name}, seed {seed}: {reason}")
            counts["parts"] += len(counted)
            continue
        verdicts = [_verdict(estimate, k, true[k]) for k in counted]
        for k, verdict in zip(counted, verdicts, strict=True):
            picked = estimate.parts[k].material or "none"
            picks[k][picked] = picks[k].get(picked, 0) + 1
            for key, value in verdict.items():
                counts[key] += value
        counts["all_right"] += all(verdict["right"] for verdict in verdicts)
    parts = [
        {"label": int(case.parts.label[k]), "mass_pct": float(100 * masses[k] / masses.sum()),
         "true": getattr(true[k], "name", None), "density_kg_m3": density[k], "picked": picks[k]}
        for k in counted
    ]  # fmt: skip
    return _with_shares(counts) | {"list": [m.name for m in materials], "picked": parts}


def _verdict(estimate: Estimate, k: int, true: Material | None) -> Counts:
    """Return what counts for part k: whether it is right, tied, and whether a tie names the right one."""
    part = estimate.parts[k]
    picked = part.material or ""
    tied = picked.endswith("?")
    right = true is not None and picked.removesuffix("?") == true.name
    named = right or (tied and true is not None and _named(estimate, part.label, true.name))
    return {"parts": 1, "right": right, "tied": tied, "right_or_tied": named, "wrong_alone": not right and not tied}


def _named(estimate: Estimate, label: int, name: str) -> bool:
    """Say whether the finding on ties names the material for the part."""
    text = " ".join(f.message for f in estimate.findings if f.code == "materials-tied")
    _, _, rest = text.partition(f"part {label}: ")
    return f"{name} (" in rest.split(";")[0]


def _with_shares(counts: Counts) -> dict[str, Any]:
    parts, runs = max(counts["parts"], 1), max(counts["runs"], 1)
    shares = {f"{key}_pct": 100 * counts[key] / parts for key in ("right", "tied", "right_or_tied", "wrong_alone")}
    return counts | shares | {"all_right_runs_pct": 100 * counts["all_right"] / runs}
