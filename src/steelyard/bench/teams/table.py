"""The result of `bench team` as text for people."""

from __future__ import annotations

from typing import Any

from steelyard.bench.tables import block

_COLUMNS = (
    ("grasp deg", "rotation_deg", 4),
    ("grasp mm", "position_mm", 3),
    ("% of p", "position_pct", 3),
    ("mass %", "mass_pct", 3),
    ("CoM mm", "com_mm", 2),
    ("   I1 %", "I1", 2),
    ("   I2 %", "I2", 2),
    ("   I3 %", "I3", 2),
    ("s CPU", "time_s", 3),
)
_SCALE = (
    ("grasp deg", "rotation_deg", 4),
    ("grasp mm", "position_mm", 3),
    ("   +-", "position_se", 3),
    ("s CPU", "time_s", 4),
)


def team_table(result: dict[str, Any]) -> str:
    """Return one block per case, the published errors beside case D, and the cost against the number of robots."""
    lines = [f"{result['trials']} trials a case, seeds from {result['seeds'][0]}; means of absolute errors"]
    for name, methods in result["cases"].items():
        rows = {method: _with_moments(values) for method, values in methods.items()}
        lines += ["", *block(f"case {name}", rows, _COLUMNS)]
    moments = " / ".join(f"{x:.1f}" for x in result["published"]["inertia_pct"])
    lines += ["", f"published on hardware (Table V): principal moments {moments} %"]
    sizes = {f"{row['method']}, N = {row['n']}": row for row in result["scale"]}
    if sizes:
        lines += ["", *block("grasps from white twists, 998 rows", sizes, _SCALE)]
    if "bound" in result:
        kinds = {k: v for k, v in result["bound"].items() if isinstance(v, dict)}
        said = ", ".join(f"{kind} {v['ratio']:.2f}" for kind, v in kinds.items())
        lines += ["", f"joint, rms error over the Cramer-Rao bound with white noise: {said}"]
    for row in result.get("times", ()):
        lines += [f"joint, {row['n']} robots, {row['rows']} rows, whole identification: {row['time_s']:.3f} s CPU"]
    lines += _events(result.get("events", {}))
    lines += _troubles(result.get("troubles", {}))
    lines += _laws(result.get("laws", {}))
    for noise, kinds in result.get("coverage", {}).items():
        if isinstance(kinds, dict):
            said = ", ".join(f"{kind} {v['coverage_pct']:.1f} %" for kind, v in kinds.items())
            lines += [f"joint, 95 % intervals hold the truth, {noise} noise: {said}"]
    return "\n".join(lines)


def _events(events: dict[str, Any]) -> list[str]:
    """Return lines on a late clock, slips and a robot that leaves."""
    if not events:
        return []
    late = events["late_clock"]
    error = late["offset_error_ms"]
    lines = [
        f"case {late['case']}, one robot {late['late_ms']:.0f} ms late: offset off by {error['mean']:.3f} ms, at worst "
        f"{error['worst']:.3f} ms; position error {late['ratio_clocks']:.2f} x that in step, "
        f"{late['ratio_without']:.1f} x without the estimate of clocks"
    ]
    for name, slip in events["slips"].items():
        lines.append(
            f"case {name}, slips of 5 mm: {slip['found']} of {slip['trials']} found within 0.3 s, "
            f"{slip['false']} false alarms in {slip['trials']} logs without"
        )
    for left in (events["leaving"], events["leaving_twists"]):
        shares = ", ".join(f"{kind} {left[kind]['ratio']:.2f}" for kind in left if isinstance(left[kind], dict))
        lines.append(
            f"case {left['case']}, one of {left['robots']} leaves at half: named in {left['named']} of "
            f"{left['trials']}; rms error over that when told: {shares}"
        )
    return lines


def _troubles(troubles: dict[str, Any]) -> list[str]:
    """Return a line for everything that was wrong and put right."""
    lines = []
    for name, told in troubles.items():
        if isinstance(told, dict):
            errors = ", ".join(
                f"{kind} {error['spoilt']:.3g} ({error['sound']:.3g})"
                for kind, error in told.items()
                if isinstance(error, dict)
            )
            lines.append(
                f"{name.replace('_', ' ')}: named in {told['named']} of {troubles['trials']}, falsely in "
                f"{told['false']}; with it (without): {errors}"
            )
    return lines


def _laws(laws: dict[str, Any]) -> list[str]:
    """Return a line for every motion and what it shows, and for every change that must not matter."""
    lines = []
    for sensed, motions in laws.get("motions", {}).items():
        for name, told in motions.items():
            least, most = told["shown"]
            lines.append(
                f"{sensed}, {name.replace('_', ' ')}: shows {told['asked']} of 6 (told {least} to {most}, named in "
                f"{told['named']} of {laws['trials']}), wrench rank {told['wrench_rank'][0]} to "
                f"{told['wrench_rank'][1]}; along what is shown {told['deg']:.4f} deg, {told['mm']:.3f} mm"
            )
    for session, changes in laws.get("same", {}).items():
        said = ", ".join(
            f"{name.replace('_', ' ')} {d['grasps']:.0e}, {d['parameters']:.0e}" for name, d in changes.items()
        )
        lines.append(f"{session}, largest difference of grasps and of parameters: {said}")
    return lines


def _with_moments(values: dict[str, Any]) -> dict[str, Any]:
    moments = values["inertia_pct"] or [None] * 3
    return values | {f"I{k + 1}": moment for k, moment in enumerate(moments)}
