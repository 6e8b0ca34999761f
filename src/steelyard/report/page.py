"""The page: sections put into one file that loads nothing, with a policy that lets nothing else run."""

from __future__ import annotations

import base64
import contextlib
import hashlib
from functools import cache
from importlib import resources
from pathlib import Path
from string import Template

from steelyard import check
from steelyard.findings import counted
from steelyard.report import sections, team_sections
from steelyard.report.contents import Report
from steelyard.report.drawing import drawing
from steelyard.report.legend import viewer
from steelyard.report.markup import joined, script_json, tag, text
from steelyard.whole_files import write_text


def write_report(report: Report, path: Path | str) -> None:
    """Write the page; the file appears complete or not at all. Raises BadFile."""
    write_text(Path(path), render(report))


def render(report: Report, version: str | None = None) -> str:
    """Return the page as one HTML text that needs no network.

    Only the page's own script and style may run, by their digests, so that even markup smuggled into a name would be
    dead. Raises BadValue where the numbers of the report are not finite.
    """
    check.finite("the parameters' covariance", report.estimate.covariance)
    style, script = _template("page.css"), _template("viewer.js")
    body = joined(
        sections.headline(report),
        viewer(report),
        team_sections.grasps(report),
        team_sections.bodies(report),
        sections.comparison(report),
        sections.residuals(report),
        sections.findings(report),
        tag("div", sections.numbers(report), sections.evidence(report), class_="pair"),
        sections.notes(report),
    )
    scene = "" if report.scene is None else tag("script", script_json(drawing(report, report.scene)),
                                                 type="application/json", id="scene")  # fmt: skip
    return Template(_template("page.html")).substitute(
        title=text(report.title),
        policy=f"default-src 'none'; img-src data:; style-src '{_digest(style)}'; script-src '{_digest(script)}'",
        style=style,
        script=script,
        subtitle=text(_subtitle(report)),
        body=body,
        footer=sections.provenance(report, version or _version()),
        scene=scene,
    )


def _subtitle(report: Report) -> str:
    """Return one line on what the answer rests on."""
    seen = report.estimate
    said = [f"method {seen.method}"]
    if seen.evidence.samples:
        said.append(f"{seen.evidence.samples} samples, {seen.at_rest}")
    if seen.parts:
        said.append(counted(len(seen.parts), "part"))
    count = len(seen.findings)
    said.append("no findings" if not count else counted(count, "finding"))
    return " · ".join(said)


def _version() -> str:
    from importlib.metadata import PackageNotFoundError, version

    with contextlib.suppress(PackageNotFoundError):
        return version("steelyard")
    return ""


@cache
def _template(name: str) -> str:
    return (resources.files("steelyard.report") / "templates" / name).read_text(encoding="utf-8")


def _digest(source: str) -> str:
    """Return the digest by which a content security policy knows a script or style."""
    return "sha256-" + base64.b64encode(hashlib.sha256(source.encode()).digest()).decode()
