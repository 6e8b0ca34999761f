"""`steelyard report RESULT`."""

from __future__ import annotations

import math
import sys
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, cast

import click

from steelyard.cli.console import command_line, print_json, require_output, say, say_if_compiling
from steelyard.cli.options import HELP, JSON, PATH
from steelyard.errors import BadValue

if TYPE_CHECKING:
    from steelyard.identify.estimate import Estimate
    from steelyard.io.shapes.parts_files import SavedParts
    from steelyard.parts.parts import Parts
    from steelyard.report import Residuals, Scene, Truth
    from steelyard.shape.cloud import Cloud
    from steelyard.shape.mesh import TriangleMesh
    from steelyard.spatial import Pose

_SAME_VOLUME = 0.02
# [m] Centroids of the same parts in the same place agree to rounding; a page does not show less.
_SAME_PLACE = 1e-3


@click.command(context_settings=HELP)
@click.argument("result", type=PATH)
@click.option("--parts", type=PATH, help="Parts to draw: parts.npz, or a mesh (.ply) with a part per face.")
@click.option(
    "--scan",
    type=PATH,
    help="Cloud of the object (.ply, .pcd, .npz): its points, and colours of --parts. "
    "Without --parts the cloud, or a folder of views, is cut into parts as identify --scan does.",
)
@click.option("--log", type=PATH, help="The log of the result: residuals over time, and where the object sits.")
@click.option("--data", type=PATH, help="Folder that relative paths in the log's description start from.")
@click.option("--tool", type=PATH, help="Result (.json) of the gripper that was taken away: the log weighs it too.")
@click.option("--pose-in-sensor", metavar="POSE", help="Where the object sits in the sensor, as for identify.")
@click.option("--truth", type=PATH, help="truth.json of an object folder: the true object beside the answer.")
@click.option("--rival", "rivals", multiple=True, metavar="NAME=FILE", help="Another method's result; may be repeated.")
@click.option("--title", help="Heading of the page.")
@click.option("-o", "--output", type=PATH, default=Path("report.html"), help="The page to write.")
@JSON
def report(result: Path, parts: Path | None, scan: Path | None, log: Path | None, data: Path | None,
           tool: Path | None, pose_in_sensor: str | None, truth: Path | None, rivals: tuple[str, ...],
           title: str | None, output: Path, as_json: bool) -> None:  # fmt: skip
    """Write one self-contained page about RESULT (.json): numbers, parts in 3D, residuals, findings."""
    from steelyard.io import read_result, read_team
    from steelyard.report import Report, write_report
    from steelyard.report.team_page import team_page
    from steelyard.team.estimate import TeamEstimate

    require_output(output, "a page", [".html", ".htm"], result, parts, scan, log, tool, truth)
    estimate = read_result(result)
    others = {name: read_result(path) for name, path in map(_rival, rivals)}
    said = {"command": command_line(*sys.argv[1:])}
    if isinstance(estimate, TeamEstimate):
        if any(given is not None for given in (parts, scan, truth, tool, pose_in_sensor)):
            raise BadValue(
                "A team's result has no parts to draw: leave --parts, --scan, --truth, --tool and --pose-in-sensor out."
            )
        rows = None if log is None else read_team(log, data)
        heading = title or f"{result.stem}: what the team carries"
        page = team_page(heading, estimate, rows, rivals=others, provenance=said)
    else:
        facts = _Facts() if truth is None else _Facts.read(truth, estimate)
        of_log, residuals = (None, None) if log is None else _from_log(log, data, tool, estimate)
        placed = _given_pose(pose_in_sensor) or of_log or facts.X_SO
        drawing, names = (None, {}) if parts is None and scan is None else _scene(parts, scan, placed, estimate)
        heading = title or f"{result.stem}: what the robot holds"
        page = Report(heading, estimate, drawing, residuals, others, facts.truth, {**names, **facts.names}, said)
    write_report(page, output)
    scene = page.scene
    drawn = 0 if scene is None else len(scene.bodies)
    size = output.stat().st_size
    if as_json:
        print_json({"report": str(output), "bytes": size, "parts_drawn": drawn,
                    "placed": scene is not None and scene.X_SO is not None})  # fmt: skip
        return
    if scene is not None and scene.X_SO is None:
        say(
            "Where the object sits in the sensor is not known: only its shape is drawn. Give --pose-in-sensor or --log."
        )
    say(f"{output} ({size / 1024:.0f} KiB): open it in a browser.")


@dataclass(frozen=True, eq=False)
class _Facts:
    """What truth.json says of the object, and of those of its parts that are the result's; nothing without one."""

    truth: Truth | None = None
    names: Mapping[int, str] = field(default_factory=dict)
    X_SO: Pose | None = None

    @classmethod
    def read(cls, path: Path, estimate: Estimate) -> _Facts:
        """A part of the result is one of the truth's when label and volume are the same."""
        from steelyard.io.object_folders import read_truth, truth_in_sensor
        from steelyard.report import Truth

        facts = read_truth(path)
        body, X_SO = truth_in_sensor(path, facts)
        volumes = {part.label: part.volume for part in estimate.parts}
        masses, names = {}, {}
        for row in facts.get("parts", []):
            label, volume = row.get("label"), row.get("solid_volume_m3") or 0.0
            if abs(volumes.get(label, math.inf) - volume) > _SAME_VOLUME * volume:
                continue
            names[label] = str(row.get("name") or "")
            mass = row.get("mass_kg", row.get("mass_fitted_kg"))
            if isinstance(mass, float | int):
                masses[label] = float(mass)
        return cls(Truth(body, masses), names, X_SO)


def _given_pose(pose_in_sensor: str | None) -> Pose | None:
    from steelyard.io.recordings.description import read_object_pose

    return None if pose_in_sensor is None else read_object_pose(pose_in_sensor).pose


def _rival(said: str) -> tuple[str, str]:
    """Return name and file of NAME=FILE."""
    name, sign, path = said.partition("=")
    if not (name and sign and path):
        raise BadValue(f"--rival needs NAME=FILE, as in --rival OLS=ols.json; got {said!r}.")
    return name, path


def _from_log(
    log: Path, data: Path | None, tool: Path | None, estimate: Estimate
) -> tuple[Pose | None, Residuals | None]:
    """Return where the log says the object sits, and what the answer leaves over of its rows, where they have times."""
    from steelyard.io import read_recording, read_result
    from steelyard.pipelines.left_over import left_over, of_another_fit
    from steelyard.report import Residuals

    recording = read_recording(log, data)
    rows, left = left_over(recording, estimate, None if tool is None else read_result(tool))
    if of_another_fit(estimate, left):
        say(
            f"{log} leaves much more than the result says: was it made of another log, or a tool taken away? "
            "Give its result with --tool."
        )
    return recording.object_pose, Residuals.of(rows, left)


def _scene(
    parts: Path | None, scan: Path | None, placed: Pose | None, estimate: Estimate
) -> tuple[Scene, Mapping[int, str]]:
    """Return what is drawn, and the names of its parts; `placed` is where the object is said to sit (X_SO)."""
    from steelyard.io.ply_files import read_mesh
    from steelyard.report import scene_of_mesh, scene_of_solid

    if parts is not None and parts.suffix.lower() == ".ply":
        mesh, cloud = read_mesh(parts), None if scan is None else _cloud(scan)
        return scene_of_mesh(mesh, cloud, _where(placed, _enclosed(parts, mesh, estimate), estimate)), {}
    saved, cloud = _saved(parts, scan)
    if estimate.parts:
        try:
            saved = saved.recut([part.volume for part in estimate.parts])
        except BadValue as error:
            raise BadValue(f"{parts or scan}: {error}") from None
    placed = _where(placed, saved.parts, estimate)
    return scene_of_solid(saved.solid, saved.labels, cloud, saved.rgb, placed), dict(enumerate(saved.names))


def _saved(parts: Path | None, scan: Path | None) -> tuple[SavedParts, Cloud | None]:
    """Return the solid in parts and the points to draw; without `parts` the scan is cut, as `identify --scan` does."""
    if parts is not None:
        from steelyard.io.shapes.parts_files import read_parts

        return read_parts(parts), None if scan is None else _cloud(scan)
    from steelyard.api import saved_parts, shape_of

    say_if_compiling()
    shape = shape_of(cast(Path, scan))
    return saved_parts(shape), shape.solid.cloud


def _enclosed(path: Path, mesh: TriangleMesh, estimate: Estimate) -> Parts | None:
    """Return the parts of a mesh, None where it encloses nothing; raises BadValue where they are not the result's."""
    from steelyard.parts.from_mesh import parts_of_mesh

    try:
        parts = parts_of_mesh(mesh)
    except BadValue:  # can still be drawn
        return None
    drawn = dict(zip(parts.label.tolist(), parts.volume.tolist(), strict=True))
    for part in estimate.parts:
        if abs(drawn.get(part.label, 0.0) - part.volume) > _SAME_VOLUME * part.volume:
            raise BadValue(
                f"{path}: part {part.label} has {1e6 * drawn.get(part.label, 0.0):.4g} cm^3, in the result "
                f"{1e6 * part.volume:.4g} cm^3. Give the mesh that the result was made with."
            )
    return parts


def _cloud(scan: Path) -> Cloud:
    from steelyard.io.cloud_files import read_cloud

    return read_cloud(scan)


def _where(said: Pose | None, parts: Parts | None, estimate: Estimate) -> Pose | None:
    """Return X_SO: where the object is `said` to sit, or where the result has its parts if that is elsewhere.

    None where nothing fits: drawn beside its centre of mass, a shape would be worse than alone.
    """
    import numpy as np

    from steelyard.report.scene import pose_from_centroids

    told = {part.label: part.centroid for part in estimate.parts}
    if parts is None or not told or set(parts.label.tolist()) != set(told):
        return said
    centroids = np.stack([told[label] for label in parts.label.tolist()])
    own = pose_from_centroids(centroids, parts.centroid)
    if said is None:
        return own
    off = float(np.linalg.norm(said.apply(parts.centroid) - centroids, axis=1).max())
    if off < _SAME_PLACE:
        return said
    say(
        f"Log, pose or truth put the parts up to {1e3 * off:.3g} mm from where the result has them, and were passed "
        "over. Give the --log or --pose-in-sensor that the result was made with."
    )
    return own
