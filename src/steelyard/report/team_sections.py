"""The section of a team's page: where every robot holds the payload, how late its clock is, and the truth beside it."""

from __future__ import annotations

import numpy as np

from steelyard.report.contents import Report
from steelyard.report.drawing import colours_of
from steelyard.report.markup import Html, joined, measured, tag
from steelyard.report.palette import hexadecimal
from steelyard.report.plots import swatch
from steelyard.report.sections import section, table
from steelyard.spatial import Pose
from steelyard.tables.numbers import decimals, fixed, general, rpy_deg
from steelyard.team.estimate import GraspEstimate, TeamEstimate


def grasps(report: Report) -> Html:
    """Return the table of grasps; nothing for one robot."""
    seen = report.estimate
    if not isinstance(seen, TeamEstimate):
        return Html("")
    true = {} if report.truth is None else report.truth.grasps
    late = bool(seen.clock_offsets_s)
    heads = ["robot", "x", "y", "z", "roll, pitch, yaw"]
    heads += ["clock is late by"] if late else []
    heads += ["put right"] if seen.wrench_maps else []
    heads += ["away from the truth"] if true else []
    lines = [_line(report, seen, name, true.get(name), bool(true), late) for name in seen.grasps]
    lead = (
        f"Pose of every grasp in that of {seen.reference}, one standard deviation. Nobody measured these: they follow "
        f"from how the robots saw {'one rigid body' if seen.hinge is None else 'two bodies with a hinge'} move."
    )
    return section(
        "Where the robots hold", table(tuple(heads), lines), *_rivals(report, seen), name="grasps", lead=lead
    )


def bodies(report: Report) -> Html:
    """Return the table of two bodies with a hinge; nothing for one body."""
    seen = report.estimate
    if not isinstance(seen, TeamEstimate) or seen.hinge is None:
        return Html("")
    lines = []
    for body in seen.hinge.bodies:
        lever, (low, high) = float(np.linalg.norm(body.first_moment)), map(float, body.mass_range)
        cells = (
            _shown(body.hinge_moment, body.hinge_moment_std, "kg m²"), _shown(lever, body.lever_std, "kg m"),
            f"{general(low)} to {general(high)} kg" if np.isfinite(low) else "not shown",
        )  # fmt: skip
        lines.append(tag("tr", tag("th", ", ".join(body.robots), scope="row"), *(tag("td", cell) for cell in cells)))
    lead = (
        f"The hinge between them swung by {fixed(float(np.rad2deg(seen.hinge.swing)), 0)}° to either side of its mean, "
        "where the other numbers of this page hold for both bodies together. No motion tells how their mass is shared."
    )
    heads = ("held by", "moment about the hinge", "mass times lever", "mass")
    return section("Two bodies with a hinge", table(heads, lines), name="bodies", lead=lead)


def _shown(value: float, std: float, unit: str) -> Html | str:
    return measured(value, std, unit) if np.isfinite(value) else "not shown"


def _line(report: Report, seen: TeamEstimate, name: str, true: Pose | None, compared: bool, late: bool) -> Html:
    grasp, own = seen.grasps[name], name == seen.reference
    colour = colours_of(report).get(1 + list(seen.grasps).index(name), (150, 150, 150))
    cells = [tag("th", swatch(hexadecimal(colour)), " ", name, scope="row")]
    if own:
        cells.append(tag("td", "the reference", colspan=4, class_="aside"))
    else:
        cells += [
            tag("td", measured(1e3 * float(p), 1e3 * float(s), "mm"))
            for p, s in zip(grasp.pose.position, grasp.std_m, strict=True)
        ]
        cells.append(tag("td", _angles(grasp)))
    if late:
        said = "" if own else _late(seen, name)
        cells.append(tag("td", said))
    if seen.wrench_maps:
        cells.append(tag("td", seen.wrenches_taken.get(name, "")))
    if compared:
        cells.append(tag("td", "" if own or true is None else _away(grasp, true)))
    return tag("tr", *cells)


def _angles(grasp: GraspEstimate) -> Html:
    std = float(grasp.std_deg.max())
    places = decimals(std) if std > 0 else 2
    shown = ", ".join(fixed(float(a), places) for a in rpy_deg(grasp.pose.rotation))
    bar = tag("span", f" ± {fixed(std, places)}", class_="pm") if std > 0 else ""
    return tag("span", tag("span", shown, class_="v"), bar, tag("span", "°", class_="u"), class_="angles")


def _late(seen: TeamEstimate, name: str) -> Html:
    std = seen.clock_offset_std_s.get(name, 0.0)
    return measured(1e3 * seen.clock_offsets_s.get(name, 0.0), 1e3 * std, "ms")


def _away(grasp: GraspEstimate, true: Pose) -> str:
    gap, turn = grasp.away_from(true)
    return f"{general(gap, 2)} mm, {general(turn, 2)}°"


def _rivals(report: Report, seen: TeamEstimate) -> list[Html]:
    """Return what the other methods' grasps are off by, where the truth is known."""
    rows, true = [], {} if report.truth is None else report.truth.grasps
    for name, rival in report.rivals.items():
        if true and isinstance(rival, TeamEstimate):
            (own, _), (gap, turn) = (each.away_from(true) for each in (seen, rival))
            rows.append(
                f"{name}: {general(gap, 2)} mm and {general(turn, 2)}° on average, "
                f"{general(gap / max(own, 1e-12), 2)} times as far."
            )
    return [joined(tag("p", row, class_="aside")) for row in rows]
