"""The sections of the page, each from the report alone; an empty one where there is nothing to say."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.inertia.people import ENTRIES
from steelyard.report.contents import Report
from steelyard.report.drawing import colours_of
from steelyard.report.markup import Html, joined, measured, tag
from steelyard.report.palette import hexadecimal
from steelyard.report.plots import interval, interval_signs, residual_plot
from steelyard.tables.numbers import (
    bias,
    fixed,
    general,
    inertia_unit,
    largest_inertia,
    mass_unit,
    places_of,
    principal,
)
from steelyard.team.estimate import TeamEstimate

_NUMBERS = ("mass", *"xyz", *ENTRIES)
_MOST = 60  # findings, notes: what a person may still read


def section(title: str, *children: object, name: str, lead: str = "") -> Html:
    """Return a section with a heading."""
    heading = joined(tag("h2", title, id=name), tag("p", lead, class_="lead") if lead else "")
    return tag("section", heading, *children, aria_labelledby=name, class_=name)


def headline(report: Report) -> Html:
    """Return the three cards: mass, centre of mass, principal moments of inertia."""
    seen, truth = report.estimate, report.truth
    true = None if truth is None else truth.body.people
    factor, unit = mass_unit(seen.mass)
    value = measured(factor * seen.mass, factor * float(seen.std[0]), unit)
    mass = _card(
        "Mass",
        tag("p", value, class_=_big(factor * seen.mass, factor * float(seen.std[0]))),
        interval(seen.mass, float(seen.std[0]), None if true is None else float(true[0])),
        _stack(report),
        tag("p", _share_of(float(seen.std[0]), seen.mass), class_="aside"),
    )
    rows = [
        _row(axis, 1e3 * seen.com[k], 1e3 * float(seen.std[1 + k]), "mm", None if true is None else 1e3 * true[1 + k])
        for k, axis in enumerate("xyz")
    ]
    com = _card("Centre of mass", tag("dl", *rows), tag("p", _place(seen), class_="aside"))
    return joined(tag("div", mass, com, _moments_card(report), class_="cards"), _signs(report))


def _signs(report: Report) -> Html:
    """Return what ± means on this page, and the signs of the intervals where a truth is drawn on them."""
    stated = bool((report.estimate.std > 0).any())
    drawn = interval_signs() if stated and report.truth is not None else []
    if not stated:
        return Html("")
    what = "± is one standard deviation: of noise, not of the sensor's calibration."
    return tag("p", tag("span", what), *drawn, class_="signs")


def _big(value: float, std: float) -> str:
    """Return the class of a large number by how many digits have to stand in one line."""
    digits = len(str(round(value))) + places_of(value, std)
    return "big" if digits <= 5 else "big long" if digits <= 6 else "big longer"


def _place(seen: Estimate) -> str:
    return f"in the sensor frame {seen.frame}" if seen.frame == "S" else f"in the grasp frame of {seen.frame}"


def _stack(report: Report) -> Html:
    """Return the parts' shares of the mass as one bar in their colours, the heaviest first."""
    parts = sorted((p for p in report.estimate.parts if p.mass > 0), key=lambda p: (-p.mass, p.label))
    if len(parts) < 2:
        return Html("")
    colours, total = colours_of(report), sum(p.mass for p in parts)
    pieces, start = [], 0.0
    for part in parts[:_MOST]:
        width = 100 * part.mass / total
        pieces.append(tag("rect", x=f"{start:.2f}%", width=f"{max(width - 0.4, 0.2):.2f}%", height=10,
                          fill=hexadecimal(colours[part.label])))  # fmt: skip
        start += width
    return tag("svg", *pieces, width="100%", height=10, class_="stack", role="img", aria_label="shares of the parts")


def _moments_card(report: Report) -> Html:
    """Return the principal moments, or that the data do not fix them."""
    seen, truth = report.estimate, report.truth
    if seen.inertia_com is None or not seen.mass > 0:
        return _open_card(seen)
    moments, std, _ = principal(seen)
    true = None if truth is None else truth.body.principal()[0]
    factor, unit = inertia_unit(float(moments.max()))
    rows = [
        _row(f"J{'₁₂₃'[k]}", factor * moments[k], factor * std[k], unit, None if true is None else factor * true[k])
        for k in range(3)
    ]
    return _card("Principal inertia", tag("dl", *rows), tag("p", "about the centre of mass", class_="aside"))


def _open_card(seen: Estimate) -> Html:
    """Return that the data do not fix the principal moments, and which entries of the inertia they do fix."""
    known = [bool(fixed) and seen.mass > 0 for fixed in seen.identified[4:]]
    told, missing = (
        ", ".join(f"I{entry}" for entry, fixed in zip(ENTRIES, known, strict=True) if fixed is which)
        for which in (True, False)
    )
    state, said = "not fixed", "These data do not determine the inertia; see the findings."
    if told:
        state, said = (
            "partly fixed",
            f"These data determine {told} (in the table), and not {missing}; see the findings.",
        )
    return _card("Principal inertia", tag("p", state, class_="big quiet"), tag("p", said, class_="aside"))


def _card(title: str, *children: object) -> Html:
    return tag("article", tag("h2", title), *children, class_="card")


def _row(name: str, value: float, std: float, unit: str, truth: float | None) -> Html:
    return tag("div", tag("dt", name), tag("dd", measured(value, std, unit), interval(value, std, truth)))


def _share_of(std: float, value: float) -> str:
    return f"± {general(100 * std / abs(value), 2)} % of it" if std > 0 and value else "given as exact"


def comparison(report: Report) -> Html:
    """Return every method's error against the truth, or their answers side by side where there is no truth."""
    answers = {"Steelyard": report.estimate, **report.rivals}
    if report.truth is None:
        return _side_by_side(answers) if report.rivals else Html("")
    true = report.truth.body.people
    size = float(np.linalg.norm(report.truth.body.inertia_com))
    rows = []
    for estimate in answers.values():
        gap = estimate.parameters.people - true
        turned = np.linalg.norm(gap[4:] * np.sqrt([1, 2, 2, 1, 2, 1]))
        rows.append([
            100 * abs(gap[0]) / true[0], 1e3 * float(np.linalg.norm(gap[1:4])), 100 * float(turned) / size,
        ])  # fmt: skip
    heads = ("", "mass error", "centre of mass error", "inertia error", "rigid body")
    lines = []
    for place, (name, estimate) in enumerate(answers.items()):
        cells = [_error_cell(np.array(rows)[:, k], place, unit) for k, unit in enumerate((" %", " mm", " %"))]
        known = estimate.parameters.validity().consistent
        verdict = tag("td", "yes" if known else "impossible", class_="" if known else "bad")
        lines.append(tag("tr", tag("th", name, scope="row"), *cells, verdict, class_="ours" if not place else None))
    lead = "How far each method is from the true object, from the same log. Inertia is about the centre of mass."
    return section("Against the truth", table(heads, lines), name="against", lead=lead)


def _error_cell(errors: Array, place: int, unit: str) -> Html:
    """Return one error with a bar whose length is its share of the worst that fits."""
    best = bool(errors[place] <= errors.min() * (1 + 1e-9))
    worst = float(np.max(errors, initial=1e-300))
    width = f"{max(100 * errors[place] / worst, 0.8):.1f}%"
    bar = tag(
        "svg", tag("rect", width=width, height=5, rx=2.5, class_="fill"), width="100%", height=5, class_="share",
        aria_hidden="true",
    )  # fmt: skip
    return tag("td", tag("span", general(float(errors[place])) + unit), bar, class_="best" if best else None)


def _side_by_side(answers: dict[str, Estimate]) -> Html:
    lines = []
    for name, estimate in answers.items():
        factor, unit = mass_unit(estimate.mass)
        cells = [measured(factor * estimate.mass, factor * float(estimate.std[0]), unit)]
        cells += [measured(1e3 * estimate.com[k], 1e3 * float(estimate.std[1 + k]), "mm") for k in range(3)]
        lines.append(tag("tr", tag("th", name, scope="row"), *(tag("td", cell) for cell in cells)))
    return section("Side by side", table(("", "mass", "x", "y", "z"), lines), name="against")


def table(heads: tuple[str, ...], lines: list[Html]) -> Html:
    """Return a table that scrolls sideways on small screens."""
    head = tag("thead", tag("tr", *(tag("th", h, scope="col") if h else tag("td") for h in heads)))
    return tag("div", tag("table", head, tag("tbody", *lines)), class_="scroll", tabindex=0, role="region",
               aria_label="table")  # fmt: skip


def residuals(report: Report) -> Html:
    """Return what the answer leaves unexplained over time, force and torque."""
    seen = report.residuals
    if seen is None:
        return Html("")
    team, evidence = isinstance(report.estimate, TeamEstimate), report.estimate.evidence
    shown = ", below 3 Hz, of all robots together, without the bias of each recording" if team else ""
    lead = (
        f"Measured less predicted{shown}. The band holds every sample, the line is a running mean; shaded stretches "
        "are at rest. A good answer leaves only noise about zero."
    )
    # Of a team the rows are smoothed, and its moments are told elsewhere: the answer's own rms is said, as everywhere.
    force, torque = (evidence.residual_force_N, evidence.residual_torque_Nm) if team else (None, None)
    plots = (
        residual_plot(seen, seen.force, "N", "Force", force),
        residual_plot(seen, seen.torque, "N m", "Torque", torque),
    )
    return section("What is left over", *plots, name="residuals", lead=lead)


def findings(report: Report) -> Html:
    """Return the findings with their remedies."""
    seen = report.estimate.findings
    if not seen:
        body = tag(
            "p", "Nothing to report: the checks of signs, units, clocks, noise and shape all passed.", class_="fine"
        )
        return section("Findings", body, name="findings")
    items = [
        tag("li", tag("code", f.code), tag("p", f.message), tag("p", f.remedy, class_="remedy")) for f in seen[:_MOST]
    ]
    more = [tag("li", tag("p", f"and {len(seen) - _MOST} more"))] if len(seen) > _MOST else []
    return section("Findings", tag("ul", *items, *more, class_="list"), name="findings")


def numbers(report: Report) -> Html:
    """Return the ten numbers with their standard deviations, and the truth where it is known."""
    seen = report.estimate
    values, std, inertia = seen.parameters.people, seen.std, inertia_unit(largest_inertia(seen))
    true = None if report.truth is None else report.truth.body.people
    lines = []
    for k, name in enumerate(_NUMBERS):
        factor, unit = mass_unit(seen.mass) if k == 0 else (1e3, "mm") if k < 4 else inertia
        group = ("", "centre of mass ", "inertia ")[(k > 0) + (k > 3)]
        known = bool(seen.identified[k])
        cells = [
            tag("th", group, tag("b", name), scope="row"),
            tag("td", measured(factor * values[k], factor * std[k], unit) if known else "not fixed by these data"),
        ]
        if true is not None:
            shown = places_of(factor * values[k], factor * std[k])
            away = abs(values[k] - true[k]) / std[k] if std[k] > 0 and known else None
            cells.append(tag("td", fixed(factor * true[k], shown)))
            cells.append(tag("td", "" if away is None else f"{fixed(away, 1)} σ", class_="bad" if away and away > 3 else None))  # fmt: skip  # noqa: E501
        lines.append(tag("tr", *cells))
    heads = ("parameter", "found", *(("truth", "away") if true is not None else ()))
    place = _place(seen)
    lead = f"{place[:1].upper()}{place[1:]}; inertia about the centre of mass."
    return section("All ten parameters", table(heads, lines), name="numbers", lead=lead)


def evidence(report: Report) -> Html:
    """Return what the data had to say: rows, rank, condition, residuals, hold-out, bias, delays."""
    seen = report.estimate.evidence
    rows: list[tuple[str, object, str]] = [("method", report.estimate.method, "")]
    of_what = ", of all robots together, unsmoothed" if isinstance(report.estimate, TeamEstimate) else ""
    if seen.samples:
        rows += [
            ("samples", f"{seen.samples}, of which {report.estimate.at_rest}", ""),
            ("rank", *_rank(report.estimate)),
            ("condition", general(seen.condition), "1 would be the best motion possible"),
            ("residual", f"{general(seen.residual_force_N)} N, {general(seen.residual_torque_Nm)} N m",
             "root mean square per axis" + of_what),
        ]  # fmt: skip
    if seen.chi2_per_dof is not None:
        rows.append(("chi² per degree of freedom", general(seen.chi2_per_dof), "1 where noise explains what is left"))
    if seen.holdout_force_N is not None and seen.holdout_torque_Nm is not None:
        said = f"{general(seen.holdout_force_N)} N, {general(seen.holdout_torque_Nm)} N m"
        rows.append(("left out", said, "error at poses that the fit never saw"))
    if report.estimate.bias_covariance.any():
        torque, force = bias(report.estimate)
        rows.append(("sensor bias", f"{force} N, {torque} N m", "subtract from the wrench as logged, in S"))
    delays = [(name, d) for name, d in report.estimate.delays_s.items() if d]
    rows += [("delay", f"{fixed(1e3 * delay, 2)} ms", name) for name, delay in delays[:_MOST]]
    items = [tag("div", tag("dt", n), tag("dd", v, tag("small", why) if why else "")) for n, v, why in rows]
    return section("Evidence", tag("dl", *items, class_="facts"), name="evidence")


def notes(report: Report) -> Html:
    """Return what was chosen and assumed, one sentence each; nothing where there is nothing to say."""
    said = [tag("li", note) for note in report.estimate.notes[:_MOST]]
    return section("Notes", tag("ul", *said, class_="notes"), name="notes") if said else joined()


def _rank(seen: Estimate) -> tuple[str, str]:
    """Return how many directions of how many parameters the motion shows: a hinge adds seven."""
    if isinstance(seen, TeamEstimate) and seen.hinge is not None:
        return f"{seen.evidence.rank} of 17", "directions of the parameters of two bodies with a hinge that show"
    return f"{seen.evidence.rank} of 10", "directions of the ten parameters that the motion shows"


def provenance(report: Report, version: str) -> Html:
    """Return where the page comes from."""
    rows = {"made by": f"Steelyard {version}", **report.provenance}
    items = [tag("div", tag("dt", k), tag("dd", v)) for k, v in list(rows.items())[:_MOST]]
    return tag("footer", tag("dl", *items, class_="facts"))
