"""`steelyard workshop build`."""

from __future__ import annotations

import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from steelyard.cli.console import command_line, print_json, progress_bar, require_folder, say, say_if_compiling, tell
from steelyard.cli.groups import Group
from steelyard.cli.options import HELP, JSON, PATH
from steelyard.findings import counted

if TYPE_CHECKING:
    from steelyard.workshop.tools import Tool


@click.group(cls=Group, context_settings=HELP)
def workshop() -> None:
    """Make the embedded data set: twenty families of workshop tools with exact truth."""


@workshop.command()
@click.argument("folder", type=PATH, metavar="DIR")
@click.option(
    "--variants",
    type=click.IntRange(min=0),
    default=0,
    help="Random variants of each family (sizes, materials, colours) instead of the nominal tools.",
)
@click.option("--seed", type=click.IntRange(min=0), default=0, help="Seed of variants, clouds and noise.")
@click.option("--tools", multiple=True, help="Only these families, such as hammer (repeat the option).")
@click.option("--graded", is_flag=True, help="The graded families: tools with parts that are not homogeneous.")
@click.option(
    "--motion",
    type=click.Choice(["paper", "slow", "static"]),
    default="paper",
    help="Motion of the log: the paper's brisk one, one below 0.25 m/s everywhere, or still poses only.",
)
@click.option(
    "--noise",
    type=click.Choice(["none", "low", "moderate", "high"]),
    default="none",
    help="Noise of the log that log.toml describes, as in the paper's Table III; motion.npz stays exact.",
)
@click.option(
    "--views",
    is_flag=True,
    help="RGB-D views of each tool on a table too, for scan and identify --scan (20 MB each; needs steelyard[images]).",
)
@JSON
def build(
    folder: Path,
    variants: int,
    seed: int,
    tools: tuple[str, ...],
    graded: bool,
    motion: str,
    noise: str,
    views: bool,
    as_json: bool,
) -> None:
    """Write one object folder per tool into DIR: mesh, coloured labelled cloud, motion and truth."""
    from steelyard.io.view_folders import require_images
    from steelyard.workshop.catalogue import FAMILIES, build_graded, require
    from steelyard.workshop.catalogue import build as build_even
    from steelyard.workshop.graded import GRADED

    say_if_compiling()
    begun = time.perf_counter()
    build_tool, families = (build_graded, GRADED) if graded else (build_even, FAMILIES)
    for name in tools:  # all of them before the first is written
        require(name, graded=graded)
    require_folder(folder, "the tools")
    if views:
        require_images()
    jobs = [(name, k) for k in range(max(variants, 1)) for name in dict.fromkeys(tools or families)]
    progress = progress_bar("workshop build")
    rows: list[dict[str, Any]] = []
    for done, (name, k) in enumerate(jobs, start=1):
        tool = build_tool(name, (seed, k) if variants else None)
        called = f"{tool.name}-s{seed}-{k}" if variants else tool.name
        rows.append(_written(tool, called, folder, seed, motion, noise, views))
        if progress:
            progress(done, len(jobs))
    seconds = time.perf_counter() - begun
    if as_json:
        print_json({"folder": str(folder), "seed": seed, "seconds": round(seconds, 3), "objects": rows})
    else:
        _tell(rows, folder, f"seed {seed}, {seconds:.1f} s", views)


def _tell(rows: list[dict[str, Any]], folder: Path, how: str, views: bool) -> None:
    """Print a line for each tool written, and the command to try next."""
    for row in rows:
        tell(f"{row['name']:26s} {1e3 * row['mass_kg']:7.1f} g  {counted(row['parts'], 'part'):8s}  {row['half']}")
    say(f"{counted(len(rows), 'object folder')} in {folder} ({how}).")
    if views:
        one = folder / rows[0]["name"]
        say(
            "Try: "
            + command_line(
                "identify", one / "log.toml", "--scan", one / "views", "--pose-in-sensor", one / "views/object.toml"
            )
        )


def _written(tool: Tool, name: str, folder: Path, seed: int, motion: str, noise: str, views: bool) -> dict[str, Any]:
    """Write the object folder of one tool; return what is told of it."""
    from steelyard.io.object_folders import write_object, write_object_views
    from steelyard.simulate.workshop import known_object, scan_of, sensed

    known = replace(known_object(tool, seed, motion), name=name)
    log = () if noise == "none" or known.track is None else sensed(known.track.columns(), noise, seed, name)
    write_object(known, folder / name, *log)
    if views:
        write_object_views(*scan_of(known, seed), folder / name / "views")
    return {
        "name": name, "mass_kg": float(known.truth.mass), "parts": len(known.parts), "half": known.half,
        "findings": [finding.code for finding in known.findings],
    }  # fmt: skip
