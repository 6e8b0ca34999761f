"""The bench dictionaries as text for people."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

_IDENTIFY = (
    ("mass %", "mass_pct", 3),
    ("CoM mm", "com_mm", 3),
    ("CoM %", "com_pct", 3),
    ("inertia %", "inertia_pct", 2),
    ("Riemannian", "riemannian", 3),
    ("consistent %", "consistent_pct", 0),
    ("failures", "failures", 0),
    ("solve ms", "solve_ms", 3),
    ("log ms", "identify_ms", 2),
)
COVERAGE = (
    ("coverage %", "coverage_pct", 1),
    ("width ratio", "width_ratio", 2),
    ("pooled", "width_ratio_pooled", 2),
    ("intervals", "intervals", 0),
)


def identify_table(result: dict[str, Any]) -> str:
    """Return the medians of `bench identify`, one block per motion and noise level."""
    lines = [f"seeds {_listed(result['seeds'])}; {len(result['objects'])} objects; medians"]
    for motion, noises in result["median"].items():
        for noise, methods in noises.items():
            lines += ["", *block(f"{motion}, {noise}", methods, _IDENTIFY)]
    if result["speed"]:
        lines += ["", "solve time as a multiple of ours, in this run:"]
        lines += [f"  {name.split(' / ')[0]:24s} {ratio:8.1f} x" for name, ratio in result["speed"].items()]
    return "\n".join([*lines, *_long(result), *(f"note: {note}" for note in result["notes"])])


def _long(result: dict[str, Any]) -> list[str]:
    """Return the lines on the long log, if it was run."""
    if "million" not in result:
        return []
    long, chunks = result["million"], result["chunks"]
    return [
        "",
        f"{long['samples']:,} samples: moment pass {long['moment_pass_ms']:.1f} ms "
        f"({long['samples_per_s'] / 1e6:.1f} million samples/s; with poses marked "
        f"{long['marked_samples_per_s'] / 1e6:.1f}; plain NumPy takes "
        f"{long['plain_numpy / moment_pass']:.1f} x as long), solve {long['solve_ms']:.3f} ms, "
        f"mass {long['mass_pct']:.5f} %",
        f"in {chunks['count']} chunks: moments differ by {chunks['scatter_rel']:.1e}, "
        f"the answer by {chunks['answer_rel']:.1e} (relative)",
    ]


def coverage_table(result: dict[str, Any]) -> str:
    """Return the coverage of the 95 % intervals, one block per case."""
    lines = [f"seeds {_listed(result['seeds'])}; {result['motion']}, {result['noise']}; 95 % intervals"]
    for name, case in result["cases"].items():
        lines += ["", *block(f"{name} ({case['logs']} logs)", case["kinds"], COVERAGE)]
        lines.append("inertia entries called identified (median of six):")
        lines += [f"  {_entries(case['objects'])}"]
    return "\n".join(lines)


def _entries(objects: dict[str, Any]) -> str:
    return ", ".join(f"{name} {entry['inertia_identified']:g}" for name, entry in objects.items())


def block(title: str, rows: dict[str, dict[str, Any]], columns: Sequence[tuple[str, str, int]]) -> list[str]:
    """Return a titled table with one line per row, numbers right-aligned under their heads."""
    width = max(len(title), *(len(name) for name in rows)) + 2
    lines = [title.ljust(width) + "".join(head.rjust(len(head) + 3) for head, _, _ in columns)]
    for name, row in rows.items():
        cells = (_cell(row[key], digits).rjust(len(head) + 3) for head, key, digits in columns)
        lines.append(f"  {name}".ljust(width) + "".join(cells))
    return lines


def _cell(value: float | None, digits: int) -> str:
    return "-" if value is None else f"{value:.{digits}f}"


def _listed(seeds: Sequence[int]) -> str:
    return f"{seeds[0]}..{seeds[-1]}" if len(seeds) > 1 else str(seeds[0])
