"""The panel beside the picture: every part with its mass, and what the picture can show."""

from __future__ import annotations

import numpy as np

from steelyard.evidence import PartMass
from steelyard.findings import counted
from steelyard.report.contents import Report
from steelyard.report.drawing import colours_of, even_ellipsoid
from steelyard.report.markup import Html, joined, measured, tag
from steelyard.report.palette import hexadecimal, scale_stops
from steelyard.report.plots import share_bar, swatch
from steelyard.report.projection import picture
from steelyard.report.scene import Scene
from steelyard.tables.numbers import density, fixed, general, mass_unit, places_of
from steelyard.team.estimate import TeamEstimate

MOST_PARTS = 200
_HOW = (
    "Drag to turn, shift-drag or two fingers to move, wheel or pinch to zoom. "
    "Keys: arrows turn, shift-arrows move, + and − zoom, 0 resets."
)


def viewer(report: Report) -> Html:
    """Return picture, controls and legend; the legend alone where there is nothing to draw."""
    parts = _legend(report)
    if report.scene is None:
        return tag("section", tag("h2", "Parts"), parts, class_="parts alone") if report.estimate.parts else Html("")
    known = report.scene.X_SO is not None and report.estimate.mass > 0
    still = picture(report.scene, colours_of(report), report.estimate.com if known else None)
    stage = tag(
        "div", still,
        tag("canvas", tabindex=0, hidden=True, role="img", aria_describedby="how",
            aria_label="The parts of the object in 3D"),
        tag("div", class_="chips", aria_hidden="true"),
        class_="stage",
    )  # fmt: skip
    hint = tag("output", class_="hint", hidden=True)  # below the picture, where it covers none of it
    view = tag("div", stage, hint, _controls(report, report.scene, known), class_="view")
    return tag(
        "section",
        tag("h2", "The object", class_="unseen"),
        tag("div", view, parts, class_="viewer"),
        id="viewer", class_="object",
    )  # fmt: skip


def _controls(report: Report, scene: Scene, known: bool) -> Html:
    """Return the buttons and sliders; the script shows them when it draws."""
    painted = np.concatenate([body.rgb for body in scene.bodies])
    seen = report.estimate
    modes = {"parts": "Parts"}
    if (painted != painted[0]).any() and not isinstance(seen, TeamEstimate):
        modes["true"] = "Own colours"
    if seen.parts:
        modes["dense"] = "Density"
    shows = {"chips": "Labels"}
    if known:
        team = isinstance(seen, TeamEstimate)
        frames = {"grasps": "Grasp frames"} if team else {"sensor": "Sensor frame"}
        shows = {"com": "Centre of mass", **frames, **shows}
        if even_ellipsoid(seen) is not None:
            shows["ellipsoid"] = "Inertia ellipsoid"
    if scene.points is not None:
        shows["points"] = "Points"
    solid = not isinstance(seen, TeamEstimate)  # of a team's payload only its inertia is drawn
    pull = _slider("explode", "Pull apart") if solid and len(scene.bodies) > 1 else ""
    cut = _slider("cut", "Cut open") if solid else ""
    reset = tag("button", "Reset", type="button", data_do="reset")
    return tag(
        "div",
        _buttons("Colour by", "data_mode", modes) if len(modes) > 1 or not isinstance(seen, TeamEstimate) else "",
        _buttons("Show", "data_show", shows),
        tag("div", pull, cut, reset, class_="group sliders"),
        tag("p", _HOW, id="how", class_="how"),
        class_="controls",
        hidden=True,
    )


def _buttons(name: str, kind: str, said: dict[str, str]) -> Html:
    """Return a row of buttons that stay down; the script knows them by `kind`."""
    row = [
        tag("button", words, type="button", aria_pressed="true" if key == "parts" else "false", **{kind: key})
        for key, words in said.items()
    ]
    return tag("div", *row, class_="group", role="group", aria_label=name)


def _slider(name: str, said: str) -> Html:
    return tag("label", said, tag("input", type="range", min=0, max=100, value=0, data_slide=name))


def _legend(report: Report) -> Html:
    """Return a row per part, the heaviest first."""
    parts = sorted(report.estimate.parts, key=lambda p: (-p.mass, p.label))
    colours = colours_of(report)
    drawn = [] if report.scene is None else [b.label for b in report.scene.bodies]
    weighed = {p.label for p in parts}
    total = max(sum(p.mass for p in parts), 1e-300)
    rows = [_part(report, p, colours[p.label], p.mass / total, p.label in drawn) for p in parts[:MOST_PARTS]]
    rows += [_bare(report, label, colours[label]) for label in drawn if label not in weighed][:MOST_PARTS]
    more = len(parts) - MOST_PARTS
    rest = tag("p", f"and {more} lighter parts", class_="aside") if more > 0 else ""
    count = counted(len(rows), "part")
    if isinstance(report.estimate, TeamEstimate):
        count = f"One payload, {len(report.estimate.grasps)} robots"
    heading = tag("h2", count) if report.scene is not None else ""
    return tag("aside", heading, tag("ul", *rows, class_="legend"), rest, _density_note(parts), aria_label="Parts")


def _part(report: Report, part: PartMass, colour: tuple[int, int, int], share: float, drawn: bool) -> Html:
    factor, unit = mass_unit(report.estimate.mass)
    name = report.name_of(part.label)
    true = report.truth.masses.get(part.label) if report.truth is not None else None
    said: list[object] = [f"{general(1e6 * part.volume)} cm³ · {density(part)} kg/m³"]
    if part.material:
        said += [" · ", tag("b", part.material)]
    if true is not None:
        said.append(f" · truth {fixed(factor * true, places_of(factor * part.mass, factor * part.std))} {unit}")
    return tag(
        "li",
        tag("label", _switch(part.label, name, drawn), swatch(hexadecimal(colour)), tag("span", name, class_="name"),
            tag("span", measured(factor * part.mass, factor * part.std, unit), class_="mass")),
        share_bar(share, hexadecimal(colour)),
        tag("p", *said, class_="aside"),
        data_label=part.label,
    )  # fmt: skip


def _bare(report: Report, label: int, colour: tuple[int, int, int]) -> Html:
    """Return the row of a part whose mass nobody has found."""
    name = report.name_of(label)
    return tag(
        "li", tag("label", _switch(label, name, True), swatch(hexadecimal(colour)), tag("span", name, class_="name")),
        tag("p", report.says[label], class_="aside") if label in report.says else "",
        data_label=label,
    )  # fmt: skip


def _switch(label: int, name: str, drawn: bool) -> Html:
    if not drawn:
        return joined()
    return tag("input", type="checkbox", checked=True, hidden=True, data_part=label, aria_label=f"Show {name}")


def _density_note(parts: list[PartMass]) -> Html:
    """Return the scale of densities."""
    if not parts:
        return joined()
    low, high = min(p.density for p in parts), max(p.density for p in parts)
    stops = [tag("stop", offset=f"{place:.2f}", stop_color=colour) for place, colour in scale_stops()]
    bar = tag(
        "svg",
        tag("defs", tag("linearGradient", *stops, id="dense")),
        tag("rect", width="100%", height=8, rx=4, fill="url(#dense)"),
        width="100%",
        height=8,
        aria_hidden="true",
    )
    ends = (f"{general(low, 2)}", f"{general(high, 2)} kg/m³")
    return tag("div", bar, tag("p", *(tag("span", end) for end in ends), class_="aside"), class_="dense", hidden=True)
