"""`steelyard scan VIEWS -o cloud.ply`."""

from __future__ import annotations

import time
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from steelyard.cli.console import STYLED, command_line, print_json, progress_bar, require_output, say_if_compiling, tell
from steelyard.cli.options import HELP, JSON, PATH

if TYPE_CHECKING:
    from steelyard.shape.scan import Scan


@click.command(context_settings=HELP)
@click.argument("views", type=PATH)
@click.option("-o", "--output", type=PATH, help="Write the cloud (.ply or .npz).")
@click.option("--points", type=click.IntRange(200, 50_000), default=3000, help="About so many points.")
@JSON
def scan(views: Path, output: Path | None, points: int, as_json: bool) -> None:
    """Fuse the posed RGB-D images in the folder VIEWS into one cloud of the object on the table, underside closed."""
    from steelyard.io.cloud_files import write_cloud
    from steelyard.io.view_folders import read_views
    from steelyard.pipelines.shape_in_parts import kept
    from steelyard.shape.scan import fuse

    require_output(output, "a cloud", [".ply", ".npz"], views)
    say_if_compiling()
    read = read_views(views, progress_bar("reading views"))
    begun = time.process_time()
    fused = fuse(read, points)
    seconds = time.process_time() - begun
    if output is not None:
        write_cloud(kept(fused), output)
    if as_json:
        print_json(_plain(fused, output, seconds))
    else:
        tell(_table(fused, views, output, seconds))


def _plain(fused: Scan, output: Path | None, seconds: float) -> dict[str, Any]:
    placed = fused.placement
    wrist = placed.at_wrist if placed else None
    return {
        "views": fused.views,
        "points": len(fused.cloud),
        "seen_points": fused.seen,
        "spacing_m": fused.spacing,
        "table": {"normal": fused.table.normal.tolist(), "offset_m": fused.table.offset},
        "depth_noise_m": fused.noise_std,
        "disagreement": fused.disagree,
        "cameras_moved_m": fused.moved_m,
        "place_std": {"m": placed.std_m, "rad": placed.std_rad} if placed else None,
        "camera_off_at_wrist": {"m": wrist[0], "rad": wrist[1]} if wrist else None,
        "cpu_s": round(seconds, 4),
        "stages": {name: round(value, 4) for name, value in fused.stages.items()},
        "findings": [finding.plain() for finding in fused.findings],
        "output": None if output is None else str(output),
    }


def _table(fused: Scan, views: Path, output: Path | None, seconds: float) -> str:
    from steelyard.tables.estimate import finding_lines

    cloud, n = fused.cloud, fused.table.normal.round(3) + 0.0  # no minus zero
    size = " x ".join(f"{1e3 * length:.0f}" for length in cloud.xyz.max(0) - cloud.xyz.min(0))
    placed, moved = fused.placement, "as reported"
    if placed and fused.moved_m is not None:
        unsure = f"{1e3 * placed.std_m:.2g} mm and {degrees(placed.std_rad):.2g} degrees"
        moved = f"moved by {1e3 * fused.moved_m:.1f} mm (rms) until they agree; the cloud is placed to {unsure}"
    rows = [
        ("views", f"{fused.views}, poses {moved}"),
        ("points", f"{len(cloud)}: {fused.seen} seen, {len(cloud) - fused.seen} close the underside"),
        ("box", f"{size} mm along x, y, z of W"),
        ("spacing", f"{1e3 * fused.spacing:.2f} mm"),
        ("table", f"normal {n[0]:.3f} {n[1]:.3f} {n[2]:.3f}, offset {1e3 * fused.table.offset:.1f} mm"),
        ("depth noise", f"{1e3 * fused.noise_std:.2f} mm per view, views spread {fused.disagree:.2f} times that"),
        ("time", f"{seconds:.2f} s CPU"),
    ]
    lines = [f"{views}: the object on the table", ""] + [f"  {name:12s} {text}" for name, text in rows]
    if output is not None:
        lines += ["", f"Cloud written to {output}. It lies in W of the views, not in a mesh's frame."]
        if (place := views / "object.toml").is_file():
            lines += ["Try: " + command_line("identify", "log.toml", "--scan", output, "--pose-in-sensor", place)]
    return "\n".join([*lines, "", *finding_lines(fused.findings, STYLED)])
