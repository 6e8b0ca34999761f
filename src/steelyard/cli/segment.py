"""`steelyard segment CLOUD -o parts.npz`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from steelyard.cli.console import STYLED, print_json, require_output, say_if_compiling, tell
from steelyard.cli.options import HELP, JSON, PATH
from steelyard.findings import counted

if TYPE_CHECKING:
    from steelyard.pipelines.shape_in_parts import Shape


@click.command(context_settings=HELP)
@click.argument("scan", type=PATH)
@click.option("--parts", type=click.IntRange(1, 40), help="How many parts; chosen by shape and colour where left out.")
@click.option(
    "--cells",
    type=click.Choice(["delaunay", "ftetwild", "tetgen"]),
    default="delaunay",
    help="Fill the volume anew with the cells of this mesher, where it is installed (TetGen is under the AGPL).",
)
@click.option("-o", "--output", type=PATH, help="Write parts.npz.")
@JSON
def segment(scan: Path, parts: int | None, cells: str, output: Path | None, as_json: bool) -> None:
    """Close a SCAN, a cloud (.ply, .pcd, .npz) or a folder of views, and cut it into homogeneous parts."""
    require_output(output, "a solid in parts", [".npz"], scan)
    say_if_compiling()
    from steelyard.api import save_parts, shape_of

    shape = shape_of(scan, parts, cells)
    if output is not None:
        save_parts(shape, output)
    if as_json:
        print_json(_plain(shape, output))
    else:
        tell(_table(shape, scan, output))


def _plain(shape: Shape, output: Path | None) -> dict[str, Any]:
    made, parts = shape.segmentation, shape.parts
    sureness: Any = [] if made.cuts is None else made.sureness
    return {
        "volume_m3": shape.solid.mesh.volume,
        "volume_std_m3": shape.solid.volume_std * shape.solid.mesh.volume,
        "points": len(shape.solid.cloud),
        "tets": len(shape.solid.mesh),
        "parts": [
            {
                "label": k,
                "name": name,
                "volume_m3": float(parts.volume[k]),
                "centroid_m": parts.centroid[k].tolist(),
                "rgb": None if made.rgb is None else [round(float(c)) for c in made.rgb[k]],
            }
            for k, name in enumerate(made.names)
        ],
        "sureness": {n: round(float(s), 4) for n, s in enumerate(sureness, 1) if s > 1e-3},
        "notes": list(shape.notes),
        "findings": [finding.plain() for finding in shape.findings],
        "output": None if output is None else str(output),
    }


def _table(shape: Shape, scan: Path, output: Path | None) -> str:
    from steelyard.tables.estimate import finding_lines

    made, parts, volume = shape.segmentation, shape.parts, shape.solid.mesh.volume
    count = counted(len(made), "part")
    lines = [
        f"{scan}: {1e6 * volume:.4g} ± {1e6 * shape.solid.volume_std * volume:.2g} cm^3 in {count}",
        "",
        "  part   volume cm^3   share   centroid mm                 colour",
    ]
    for k in range(len(made)):
        x, y, z = (1e3 * parts.centroid[k]).round(1) + 0.0  # no minus zero
        colour = "" if made.rgb is None else "#" + "".join(f"{round(float(c)):02x}" for c in made.rgb[k])
        share = 100 * parts.volume[k] / volume
        lines.append(
            f"  {k:4d}   {1e6 * parts.volume[k]:11.4g}   {share:4.1f} %   {x:8.1f} {y:8.1f} {z:8.1f}   {colour}"
        )
    if made.cuts is not None:
        order = sorted(range(len(made.sureness)), key=lambda k: -made.sureness[k])[:4]
        said = ", ".join(f"{k + 1}: {100 * made.sureness[k]:.0f} %" for k in order if made.sureness[k] > 0.005)
        lines += ["", f"  How many parts, by shape and colour: {said}. A log of forces can decide further."]
    if shape.notes:
        lines += ["", *(f"  note   {note}" for note in shape.notes)]
    if output is not None:
        lines += ["", f"Parts written to {output}. Look at them: steelyard report RESULT --parts {output}"]
    return "\n".join([*lines, "", *finding_lines(shape.findings, STYLED)])
