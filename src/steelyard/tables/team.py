"""A TeamEstimate as a table for people."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.spatial import Pose
from steelyard.tables.estimate import columns, estimate_table
from steelyard.tables.marks import PLAIN, Marks
from steelyard.tables.numbers import decimals, general, inertia_unit, plus_minus, principal, rpy_deg
from steelyard.tables.shown import Carried


@dataclass(frozen=True, eq=False)
class Known:
    """The truth of a simulated team: mass, com, inertia about it (10,), poses X_RG by name, clock offsets [s]."""

    people: Array
    grasps: dict[str, Pose]
    late_s: dict[str, float]


def team_table(estimate: Carried, title: str, known: Known | None = None, marks: Marks = PLAIN) -> str:
    """Return the table: the payload with ±, where every robot holds it, clocks, evidence, findings with remedies."""
    whole = estimate_table(estimate, title, None if known is None else known.people, marks=marks)
    head, gap, rest = whole.partition("\n\n")
    blocks = [
        head,
        *_principal_lines(estimate),
        *_hinge_lines(estimate, marks),
        "",
        *_grasp_lines(estimate, known, marks),
        *_taken_lines(estimate),
    ]
    return "\n".join(blocks) + gap + rest


def _principal_lines(estimate: Carried) -> list[str]:
    """Return the principal moments."""
    if estimate.inertia_com is None:
        return []
    moments, std, _ = principal(estimate)
    factor, unit = inertia_unit(float(moments.max()))
    rows = [(f"J{k + 1}", plus_minus(factor * float(moments[k]), factor * float(std[k]), unit)) for k in range(3)]
    return ["", "  principal moments of inertia", columns([(f"  {name}", said) for name, said in rows])]


def _hinge_lines(estimate: Carried, marks: Marks) -> list[str]:
    """Return what is known of each of two bodies with a hinge between them."""
    if estimate.hinge is None:
        return []
    rows = [("", "moment about the hinge", "mass times lever", "mass between")]
    for body in estimate.hinge.bodies:
        lever = float(np.linalg.norm(body.first_moment))
        low, high = map(float, body.mass_range)
        rows.append(
            (
                "  held by " + ", ".join(body.robots),
                _or_open(body.hinge_moment, body.hinge_moment_std, "kg m²"),
                _or_open(lever, body.lever_std, "kg m"),
                f"{general(low)} and {general(high)} kg" if np.isfinite(low) else "not shown",
            )
        )
    return ["", marks.title("  two bodies with a hinge"), columns(rows)]


def _or_open(value: float, std: float, unit: str) -> str:
    return plus_minus(value, std, unit) if np.isfinite(value) else "not shown"


def _grasp_lines(estimate: Carried, known: Known | None, marks: Marks) -> list[str]:
    """Return one row per robot: place and rotation of its grasp in the reference's, and how late its clock is."""
    heads = ["", "x", "y", "z", "roll, pitch, yaw", "clock late by"]
    if known is not None:
        heads += ["off by"]
    rows = [tuple(heads)]
    for name, grasp in estimate.grasps.items():
        own = name == estimate.reference
        cells = [name, *(["reference", "", "", ""] if own else _pose_cells(grasp)), _clock(estimate, name)]
        if known is not None:
            cells.append("" if own else _off(grasp, known.grasps[name]))
        rows.append(tuple(cells))
    if not estimate.clock_offsets_s:
        place = heads.index("clock late by")
        rows = [row[:place] + row[place + 1 :] for row in rows]
    return [marks.title("  grasps, from the reference"), columns(rows)]


def _taken_lines(estimate: Carried) -> list[str]:
    """Return whose wrench was put right, and how."""
    taken = estimate.wrenches_taken
    return [f"  put right: {'; '.join(f'{said} of {name}' for name, said in taken.items())}"] if taken else []


def _pose_cells(grasp: Any) -> list[str]:
    place = [plus_minus(1e3 * p, 1e3 * s, "mm") for p, s in zip(grasp.pose.position, grasp.std_m, strict=True)]
    std = float(grasp.std_deg.max())
    places = decimals(std)
    # Adding zero turns a minus zero, which rounding leaves, into a plain one.
    angles = ", ".join(f"{a:.{places}f}" for a in np.round(rpy_deg(grasp.pose.rotation), places) + 0.0)
    return [*place, f"({angles}) ± {std:.{places}f}°"]


def _clock(estimate: Carried, name: str) -> str:
    late = estimate.clock_offsets_s.get(name)
    if late is None or name == estimate.reference:
        return ""
    return plus_minus(1e3 * late, 1e3 * estimate.clock_offset_std_s.get(name, float("nan")), "ms")


def _off(grasp: Any, truth: Pose) -> str:
    """Return distance and angle from the true grasp."""
    gap, turn = grasp.away_from(truth)
    return f"{gap:.2f} mm, {turn:.3f}°"
