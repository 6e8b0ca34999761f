"""An Estimate as a table for people."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.people import NAMES
from steelyard.tables.marks import PLAIN, Marks
from steelyard.tables.numbers import (
    bias,
    density,
    inertia_unit,
    largest_inertia,
    mass_unit,
    places_of,
    plain,
    plus_minus,
    spread,
)
from steelyard.tables.shown import Weighed

INERTIA = NAMES[4:]


def estimate_table(
    estimate: Weighed,
    title: str,
    truth: Array | None = None,
    parts_truth: Mapping[int, tuple[str, float]] | None = None,
    marks: Marks = PLAIN,
) -> str:
    """Return the table: what is held with ±, sensor bias, evidence, findings with remedies.

    `truth` (10,) of mass, com, inertia about the CoM and `parts_truth`, label -> name and mass [kg], stand beside
    where they are known.
    """
    blocks = [
        marks.title(title),
        columns(_body_rows(estimate, truth)),
        *_inertia_note(estimate),
        *_part_lines(estimate, parts_truth or {}),
        "",
        *_evidence_lines(estimate),
        "",
        *finding_lines(estimate.findings, marks),
    ]
    return "\n".join(blocks)


def _body_rows(estimate: Weighed, truth: Array | None) -> list[tuple[str, str, str]]:
    """Return the rows name, value ± std, and truth."""
    values = estimate.parameters.people
    factor, unit = inertia_unit(largest_inertia(estimate))
    scales = np.repeat([1.0, 1e3, factor], [1, 3, 6])
    units = ["kg"] + ["mm"] * 3 + [unit] * 6
    jackknife = estimate.evidence.jackknife_people
    rows = []
    for k, name in enumerate(NAMES):
        if k >= 4 and not estimate.identified[k]:
            continue
        value, std, beside = float(values[k] * scales[k]), float(estimate.std[k] * scales[k]), ""
        if truth is not None:
            beside = f"truth {truth[k] * scales[k]:.{places_of(value, std)}f}"
        elif jackknife is not None:
            beside = plain(f"leave-one-out ± {spread(float(jackknife[k] * scales[k]))}")
        rows.append((name, plus_minus(value, std, units[k]), beside))
    return rows


def columns(rows: Sequence[tuple[str, ...]]) -> str:
    """Return rows as aligned columns."""
    widths = [max(len(cell) for cell in column) for column in zip(*rows, strict=True)]
    return "\n".join("  " + "   ".join(c.ljust(w) for c, w in zip(row, widths, strict=True)).rstrip() for row in rows)


def _inertia_note(estimate: Weighed) -> list[str]:
    """Return which entries of the inertia are not told, if any."""
    weak = [name for name, known in zip(INERTIA, estimate.identified[4:], strict=True) if not known]
    if not weak:
        return []
    return [f"  {'inertia' if len(weak) == len(INERTIA) else ', '.join(weak)}    not identified by these data"]


def _part_lines(estimate: Weighed, truth: Mapping[int, tuple[str, float]]) -> list[str]:
    """Return the parts with their masses and densities, and where it is known the truth."""
    if not estimate.parts:
        return []
    rows, (factor, unit) = [], mass_unit(float(estimate.parameters.mass))
    for part in estimate.parts:
        name, known = "", ""
        if part.label in truth:
            name, mass = truth[part.label]
            known = f"truth {factor * mass:.{places_of(factor * part.mass, factor * part.std)}f}"
        mass_cell = plus_minus(factor * part.mass, factor * part.std, unit)
        place = ", ".join(f"{round(1e3 * value)}" for value in part.centroid)
        row = (
            f"part {part.label} {name}".rstrip(), mass_cell, known, f"{density(part)} kg/m³", f"at ({place}) mm",
            part.material or "",
        )  # fmt: skip
        rows.append(tuple(cell for cell, shown in zip(row, (1, 1, truth, 1, 1, 1), strict=True) if shown))
    return ["", columns(rows)]


def _evidence_lines(estimate: Weighed) -> list[str]:
    """Return bias, residuals, hold-out and method in a few lines."""
    seen = estimate.evidence
    explained = (
        "; leave-one-out: how much the answer moves when poses are left out"
        + (", the shape staying as it is" if estimate.parts else "")
        if seen.jackknife_people is not None
        else ""
    )
    lines = [
        f"  ±          one standard deviation{explained}",
        f"  method     {estimate.method}, rank {seen.rank}, {seen.samples} rows of which {estimate.at_rest}",
        f"  residual   {seen.residual_force_N:.3g} N, {seen.residual_torque_Nm:.3g} N m rms"
        + ("" if seen.chi2_per_dof is None else f"; chi² per degree of freedom {seen.chi2_per_dof:.2f}"),
    ]
    if seen.holdout_force_N is not None and seen.holdout_torque_Nm is not None:
        lines.append(
            f"  left out   {seen.holdout_force_N:.3g} N, {seen.holdout_torque_Nm:.3g} N m rms when predicted unseen"
        )
    if estimate.bias_covariance.any():
        torque, force = map(plain, bias(estimate))
        lines.append(f"  bias       force {force} N, torque {torque} N m (subtract from the wrench as logged, in S)")
    lines += [f"  delay      {1e3 * delay:+.2f} ms  {name}" for name, delay in estimate.delays_s.items() if delay]
    lines += [f"  note       {note}" for note in estimate.notes]
    return lines


def finding_lines(findings: Sequence[Finding], marks: Marks = PLAIN) -> list[str]:
    """Return the findings, each with its remedy."""
    if not findings:
        return ["  no findings"]
    lines = []
    for finding in findings:
        lines.append(f"  {marks.code(finding.code)}: {finding.message}")
        lines.append(f"      -> {finding.remedy}")
    return lines
