"""The benches of part masses as text for people."""

from __future__ import annotations

from typing import Any

from steelyard.bench.tables import COVERAGE, block

_TIMES = (
    ("parts", "parts", 0),
    ("free ms", "free_ms", 2),
    ("averaged ms", "averaged_ms", 2),
    ("log file ms", "log_file_ms", 2),
    ("read ms", "read_ms", 2),
    ("folder ms", "folder_ms", 2),
)
_PICKS = (
    ("parts", "parts", 0),
    ("right %", "right_pct", 1),
    ("tied %", "tied_pct", 1),
    ("right or tied %", "right_or_tied_pct", 1),
    ("wrong alone %", "wrong_alone_pct", 1),
    ("all right, runs %", "all_right_runs_pct", 1),
)


def part_coverage_table(result: dict[str, Any]) -> str:
    """Return the coverage of `bench part-coverage`, a block per noise scenario and truth, and the times."""
    lines = [f"{len(result['seeds'])} seeds over {len(result['objects'])} objects; 95 % intervals"]
    for name, case in result["cases"].items():
        if case["kinds"]:
            lines += ["", *block(f"{name} ({case['logs']} logs)", case["kinds"], COVERAGE)]
        said = f"part-not-homogeneous in {case['not_homogeneous']}; failures {len(case['failures'])}"
        lines += [f"  {said}", *(f"  {failure}" for failure in case["failures"][:3])]
    if result["timing"]["objects"]:
        lines += ["", *block("times", result["timing"]["objects"], _TIMES)]
    return "\n".join(lines)


def materials_table(result: dict[str, Any]) -> str:
    """Return how often the right density was picked, a line per object, and what was picked instead."""
    rows = {**result["objects"], "all": result["overall"]}
    overall = result["overall"]
    claim = (
        f"every part of at least 5 % of the mass has the right density in {overall['all_right']} of {overall['runs']} "
        f"runs ({overall['all_right_runs_pct']:.1f} %)"
    )
    lines = [claim, "", *block(f"noise {result['noise']}, {len(result['seeds'])} seeds", rows, _PICKS)]
    wrong = [
        f"  {name} part {part['label']} ({part['mass_pct']:.0f} %), {part['true']}: {_listed(part['picked'])}"
        for name, entry in result["objects"].items()
        for part in entry["picked"]
        if set(part["picked"]) != {part["true"]}
    ]
    return "\n".join([*lines, *(["picked otherwise or not alone:", *wrong] if wrong else []), *result["failures"]])


def _listed(picked: dict[str, int]) -> str:
    return ", ".join(f"{name} {count}" for name, count in picked.items())
