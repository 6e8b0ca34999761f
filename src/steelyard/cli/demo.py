"""`steelyard demo`."""

from __future__ import annotations

import tempfile
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from steelyard.cli.console import print_json, say, say_if_compiling

if TYPE_CHECKING:
    from steelyard.identify.estimate import Estimate
    from steelyard.parts.parts import Parts

SEED = 0


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--seed", type=int, default=SEED, show_default=True, help="Seed of the made noise.")
@click.option(
    "--keep", type=click.Path(path_type=Path), metavar="DIR", help="Keep the made log and mesh in this folder."
)
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def demo(seed: int, keep: Path | None, as_json: bool) -> None:
    """Make a hammer's log, write it as files, identify it from them, and compare with the truth."""
    say_if_compiling()
    from steelyard.cli.table import estimate_table
    from steelyard.cli.versus import summary, versus_table
    from steelyard.io import result_dict
    from steelyard.io.ply_files import write_mesh
    from steelyard.io.recording_files import write_recording
    from steelyard.simulate import hammer

    made = hammer.recording(seed)
    with tempfile.TemporaryDirectory() as scratch:
        log = write_recording(made.recording, keep or Path(scratch))
        mesh = log.with_name("hammer.ply")
        write_mesh(made.tool.mesh, mesh)
        answers = _answers(log, mesh, made.tool.parts.in_frame(made.tool.X_OS.inverse()))
    with_parts, *others = answers.values()
    if as_json:
        rivals = zip(("without_parts", "ols", "geo"), others, strict=True)
        extra = {"truth": made.truth.vector.tolist(), "truth_part_masses_kg": made.tool.masses.tolist(), "seed": seed}
        print_json(result_dict(with_parts) | extra | {key: summary(rival, made.truth) for key, rival in rivals})
        return
    parts = dict(enumerate(zip(made.tool.part_names, map(float, made.tool.masses), strict=True)))
    title = f"A hammer of three parts in slow motion, made log (seed {seed})"
    click.echo(estimate_table(with_parts, title, hammer.truth_for_people(made.truth), parts))
    click.echo("\n" + click.style("The same log in four ways", bold=True) + "\n" + versus_table(answers, made.truth))
    kept = f"The log is in {keep}; identify it with: steelyard identify {log} --parts {mesh}"
    say(kept if keep else "Keep log and mesh with --keep DIR.")


def _answers(log: Path, mesh: Path, parts: Parts) -> dict[str, Estimate]:
    """Return the answers from the files: with parts, without, and by the two rivals on the same aligned rows.

    parts  in the frame of the sensor

    GEO knows no bias: it gets the rows tared by what OLS found.
    """
    from steelyard import api
    from steelyard.identify.geodesic_shape import ShapeGeodesic, uniform_body
    from steelyard.identify.least_squares import LeastSquares
    from steelyard.io import read_recording
    from steelyard.logs.alignment import align

    recording = read_recording(log)
    with_parts, without = api.identify(recording, parts=mesh), api.identify(recording)
    rows = align(recording).log
    ordinary = LeastSquares("ordinary").identify(rows)
    tared = replace(rows, wrench=rows.wrench - ordinary.wrench_bias)
    return {
        "with parts": with_parts,
        "without parts": without,
        "OLS": ordinary,
        "GEO, uniform shape": ShapeGeodesic(uniform_body(parts)).identify(tared),
    }
