"""`steelyard demo [held-object|team]`."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from steelyard.cli.console import (
    STYLED,
    command_line,
    print_json,
    require_folder,
    require_output,
    say,
    say_if_compiling,
    tell,
)
from steelyard.cli.options import HELP, JSON, PATH

if TYPE_CHECKING:
    from steelyard.identify.estimate import Estimate
    from steelyard.logs.log import MotionLog
    from steelyard.logs.recording import Recording
    from steelyard.pipelines.shape_in_parts import Shape
    from steelyard.report import Report
    from steelyard.simulate.hammer import Seen
    from steelyard.spatial import Pose

SEED = 0


@click.command(context_settings=HELP)
@click.argument("story", type=click.Choice(["held-object", "team"]), default="held-object")
@click.option("--seed", type=int, default=SEED, help="Seed of the made noise.")
@click.option(
    "-o", "--output", type=PATH, show_default="report.html; team.html for team",
    help="The page to write.",
)  # fmt: skip
@click.option(
    "--keep", type=PATH, metavar="DIR",
    help="Keep the made files and the result in this folder; of the hammer the views too (20 MB, needs "
    "steelyard[images]).",
)  # fmt: skip
@JSON
def demo(story: str, seed: int, output: Path | None, keep: Path | None, as_json: bool) -> None:
    """A whole story on made data, against the truth.

    held-object: scan a hammer, cut the scan into parts, identify it from a log. team: three robots carry one payload;
    from their joint angles and spring torques, where do they hold it and what is it?
    """
    page = output or Path("team.html" if story == "team" else "report.html")
    require_output(page, "a page", [".html", ".htm"])
    require_folder(keep, "the made files")
    if story == "team":
        from steelyard.cli.demo_team import demo_team

        demo_team(seed, page, keep, as_json)
    else:
        _held_object(seed, page, keep, as_json)


def _held_object(seed: int, output: Path, keep: Path | None, as_json: bool) -> None:
    """Scan a made hammer, cut the scan into parts, identify it from a made log, and compare with the truth."""
    say_if_compiling()
    from steelyard import api
    from steelyard.cli.versus import summary, versus_table
    from steelyard.io import read_recording, result_dict, write_result
    from steelyard.io.cloud_files import write_cloud
    from steelyard.io.recordings.recording_files import write_recording
    from steelyard.logs.alignment import align
    from steelyard.pipelines.shape_in_parts import kept, shape_of
    from steelyard.report import write_report
    from steelyard.shape.scan import fuse
    from steelyard.simulate import hammer
    from steelyard.tables.estimate import estimate_table

    seen = hammer.scanned(seed)
    scan = fuse(seen.views)
    shape = shape_of(scan)
    with tempfile.TemporaryDirectory() as scratch:
        folder = keep or Path(scratch)
        log = write_recording(seen.recording, folder)
        write_cloud(kept(scan), folder / "hammer.ply")
        recording = read_recording(log)
        rows = align(recording).log
        answers = _answers(log, shape, rows, seen.X_SW)
        best = next(iter(answers.values()))
        write_result(best, folder / "result.json")
        names = [name for name, _ in _names(best, shape, seen).values()]
        chosen = shape.segmentation.cut(len(best.parts)).named(names)
        api.save_parts(replace(shape, segmentation=chosen), folder / "parts.npz")
        views = keep and _kept_views(seen, keep / "views")
    write_report(_page(answers, shape, recording, seen, seed), output)
    if as_json:
        keys = ("without_scan", "ols", "geo")
        others = {key: summary(rival, seen.truth) for key, rival in zip(keys, list(answers.values())[1:], strict=True)}
        extra = {"truth": seen.truth.vector.tolist(), "seed": seed, "report": str(output)}
        print_json(result_dict(best) | extra | others)
        return
    title = f"A hammer, scanned from {len(seen.views)} views and turned slowly, made data (seed {seed})"
    tell(estimate_table(best, title, seen.truth.people, _names(best, shape, seen), STYLED))
    tell("\n" + click.style("The same log in four ways", bold=True) + "\n" + versus_table(answers, seen.truth))
    say(f"The page with the parts in 3D: {output}")
    _say_what_is_kept(keep, log, views)


def _kept_views(seen: Seen, folder: Path) -> Path | None:
    """Write the views as a camera would have left them; return the folder, None where nothing writes images here."""
    from steelyard.errors import MissingDependency
    from steelyard.io.view_folders import write_views

    try:
        write_views(seen.views, folder)
    except MissingDependency:
        return None
    return folder


def _say_what_is_kept(keep: Path | None, log: Path, views: Path | None) -> None:
    """Say where the made files are, and what to try on them."""
    if keep is None:
        say("Keep log, views, cloud and parts with --keep DIR.")
        return
    say(f"Log, cloud and parts are in {keep}; try: {command_line('identify', log, '--parts', keep / 'parts.npz')}")
    if views:
        say(f"The views are in {views}; try: {command_line('scan', views, '-o', keep / 'cloud.ply')}")
    else:
        say("The views are not kept: that needs pip install 'steelyard[images]'.")


def _answers(log: Path, shape: Shape, rows: MotionLog, X_SW: Pose) -> dict[str, Estimate]:
    """Return the answers: from the files with the scan and without, and by the two rivals on the same aligned rows.

    GEO knows no bias: it gets the rows tared by what OLS found, and one density over the scanned shape.
    """
    from steelyard import api
    from steelyard.identify.geodesic_shape import ShapeGeodesic
    from steelyard.identify.least_squares import LeastSquares

    ordinary = LeastSquares("ordinary").identify(rows)
    tared = replace(rows, wrench=rows.wrench - ordinary.wrench_bias)
    return {
        "with the scan": api.identify(log, scan=shape),
        "without the scan": api.identify(log),
        "OLS": ordinary,
        "GEO, uniform shape": ShapeGeodesic(shape.parts.in_frame(X_SW).uniform()).identify(tared),
    }


def _names(best: Estimate, shape: Shape, seen: Seen) -> dict[int, tuple[str, float]]:
    """Return what each part found is called, by the true part that fills most of it, and the true mass inside it."""
    import numpy as np

    from steelyard.parts.segment import nearest_cell

    made = shape.segmentation.cut(len(best.parts))
    found = ((made.labels[nearest_cell(points, made.mesh.centroids)], volume) for points, volume in seen.filled())
    volumes = np.stack([np.bincount(part, volume, len(made)) for part, volume in found])
    masses = seen.tool.densities @ volumes
    return {k: (seen.tool.part_names[int(volumes[:, k].argmax())], float(masses[k])) for k in range(len(made))}


def _page(answers: Mapping[str, Estimate], shape: Shape, recording: Recording, seen: Seen, seed: int) -> Report:
    """Return the page: the parts of the cut that the log chose, in the colours they were seen in."""
    from steelyard.pipelines.left_over import left_over
    from steelyard.report import Report, Residuals, Truth, scene_of_solid

    (_, best), *rivals = answers.items()
    made = shape.segmentation.cut(len(best.parts))
    rows, left = left_over(recording, best)
    names = {k: name for k, (name, _) in _names(best, shape, seen).items()}
    return Report(
        "A hammer, scanned and weighed",
        best,
        scene_of_solid(made.mesh, made.labels, shape.solid.cloud, made.rgb, seen.X_SW),
        Residuals.of(rows, left),
        dict(rivals),
        Truth(seen.truth),
        names,
        {"command": f"steelyard demo --seed {seed}", "seed": str(seed)},
    )
