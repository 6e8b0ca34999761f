"""`steelyard bench ...`: a verb for every table of BENCHMARK.md."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from steelyard.bench.timing import one_thread
from steelyard.cli.console import print_json, progress_bar, say
from steelyard.cli.groups import Group
from steelyard.cli.options import HELP, JSON

_FOLDERS = click.option(
    "--data", required=True, type=click.Path(path_type=Path), help="Folder of object folders, or one of them."
)


@click.group(cls=Group, context_settings=HELP)
def bench() -> None:
    """Make every number that the README and BENCHMARK.md claim again: a command per table."""
    one_thread()


@bench.command()
@click.option("--seeds", type=click.IntRange(min=1), default=5, show_default=True, help="Seeds 0, 1, ...")
@click.option("--objects", multiple=True, help="Only these objects (repeat the option).")
@click.option("--motions", multiple=True, help="Only these motions.")
@click.option("--noise", "noises", multiple=True, help="Only these noise levels.")
@click.option("--methods", multiple=True, help="Only these methods.")
@click.option(
    "--million",
    type=click.IntRange(min=0),
    default=1_000_000,
    show_default=True,
    help="Rows of the long log.",
)
@click.option("--data", type=click.Path(path_type=Path), help="Has no effect: the bench makes its own data.")
@JSON
def identify(seeds: int, data: Path | None, as_json: bool, **choices: Any) -> None:
    """Ten bodies, three motions, four noise levels: our methods and, where installed, the peers'."""
    from steelyard.bench import identify as job
    from steelyard.bench.tables import identify_table

    result = job.run(range(seeds), progress=progress_bar("bench identify"), **choices)
    for note in result["notes"]:
        say(note)
    print_json(result) if as_json else click.echo(identify_table(result))


@bench.command()
@click.option("--seeds", type=click.IntRange(min=1), default=1000, show_default=True, help="Seeds 0, 1, ...")
@click.option("--motion", default="stop_go", show_default=True, help="Motion of the logs, as in bench identify.")
@click.option("--noise", default="moderate", show_default=True, help="Noise level, as in bench identify.")
@click.option(
    "--spectrum",
    type=click.Choice(["white", "2hz", "both"]),
    default="both",
    show_default=True,
    help="White noise, noise correlated below 2 Hz, or each in turn.",
)
@click.option("--all-objects", is_flag=True, help="Every seed on all ten objects instead of one in turn.")
@click.option("--noise-unknown", is_flag=True, help="The log does not declare its noise: it is estimated.")
@click.option(
    "--bias",
    type=click.Choice(["free", "none"]),
    default="none",
    show_default=True,
    help="The sensor's bias is estimated, or known to be none.",
)
@click.option("--workers", type=click.IntRange(min=1), default=1, show_default=True, help="Processes.")
@JSON
def coverage(seeds: int, spectrum: str, noise_unknown: bool, as_json: bool, **choices: Any) -> None:
    """Do 95 % intervals hold the truth 95 % of the time, white and correlated noise?"""
    from steelyard.bench import coverage as job
    from steelyard.bench.tables import coverage_table
    from steelyard.simulate.noise import SPECTRA

    spectra = SPECTRA if spectrum == "both" else tuple(s for s in SPECTRA if s == spectrum)
    progress = progress_bar("bench coverage")
    result = job.run(seeds, spectra=spectra, declared=not noise_unknown, progress=progress, **choices)
    print_json(result) if as_json else click.echo(coverage_table(result))


@bench.command("held-object")
@_FOLDERS
@click.option(
    "--parts",
    type=click.Choice(["segmented", "truth", "truth-split", "truth-merged"]),
    default="segmented",
    show_default=True,
    help="Parts: found in the clouds with labels unseen, the true ones, each cut in pieces, or joined.",
)
@click.option("--seeds", type=click.IntRange(min=1), default=5, show_default=True, help="Seeds 0, 1, ...")
@click.option("--objects", multiple=True, help="Only these objects (repeat the option).")
@click.option("--noise", "noises", multiple=True, help="Only these scenarios: none, low, moderate, high, high-code.")
@click.option("--methods", multiple=True, help="Only these methods.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
@JSON
def held_object(data: Path, as_json: bool, **choices: Any) -> None:
    """The paper's identification benchmark: every object, four noise scenarios, ours beside its rivals."""
    from steelyard.bench import held_object as job
    from steelyard.bench.objects.table import held_object_table

    result = job.run(data, progress=progress_bar("bench held-object"), **choices)
    print_json(result) if as_json else click.echo(held_object_table(result))


@bench.command("part-coverage")
@_FOLDERS
@click.option("--seeds", type=click.IntRange(min=1), default=1000, show_default=True, help="Logs per case.")
@click.option("--noise", "noises", default="low,high", show_default=True, help="Scenarios, with commas between them.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
@JSON
def part_coverage(data: Path, seeds: int, noises: str, workers: int, as_json: bool) -> None:
    """Do 95 % intervals of part masses and of the whole hold the truth, and how long does an answer take?"""
    from steelyard.bench import part_coverage as job
    from steelyard.bench.objects.part_tables import part_coverage_table

    progress = progress_bar("bench part-coverage")
    result = job.run(data, seeds, progress, noises=tuple(noises.split(",")), workers=workers)
    print_json(result) if as_json else click.echo(part_coverage_table(result))


@bench.command()
@_FOLDERS
@click.option("--seeds", type=click.IntRange(min=1), default=5, show_default=True, help="Seeds 0, 1, ...")
@JSON
def materials(data: Path, seeds: int, as_json: bool) -> None:
    """How often is the right density picked from a list, at low noise?"""
    from steelyard.bench import materials as job
    from steelyard.bench.objects.part_tables import materials_table

    result = job.run(data, seeds, progress_bar("bench materials"))
    print_json(result) if as_json else click.echo(materials_table(result))


@bench.command()
@_FOLDERS
@click.option("--objects", multiple=True, help="Only these objects (repeat the option).")
@click.option("--noise-mm", type=click.FloatRange(min=0), default=0.0, show_default=True, help="Noise of the points.")
@click.option(
    "--colour-noise", type=click.FloatRange(min=0), default=0.0, show_default=True, help="Of channels 0..255."
)
@JSON
def segment(data: Path, as_json: bool, **choices: Any) -> None:
    """Parts of unlabelled clouds against the true ones, beside the paper's Tables I and II."""
    from steelyard.bench import segment as job
    from steelyard.bench.shapes.segment_table import segment_table

    result = job.run(data, progress_bar("bench segment"), **choices)
    print_json(result) if as_json else click.echo(segment_table(result))


@bench.command()
@click.option("--trials", type=click.IntRange(min=1), default=24, show_default=True, help="Seeds 100, 101, ...")
@click.option("--cases", multiple=True, help="Only these cases: A, B, C, D (repeat the option).")
@click.option("--methods", multiple=True, help="Only these methods.")
@click.option("--sizes", type=click.IntRange(min=2), multiple=True, help="Only these numbers of robots in the scaling.")
@click.option("--workers", type=click.IntRange(min=1), default=2, show_default=True, help="Processes.")
@click.option("--coverage", type=click.IntRange(min=0), default=0, show_default=True, help="Trials of the intervals.")
@click.option("--slips", type=click.IntRange(min=0), default=40, show_default=True, help="Slips, and logs without.")
@JSON
def team(trials: int, as_json: bool, **choices: Any) -> None:
    """One payload, three robots, noise from clean to that of the paper; and cost against the number of robots."""
    from steelyard.bench import team as job
    from steelyard.bench.teams.table import team_table

    result = job.run(trials, progress_bar("bench team"), **choices)
    print_json(result) if as_json else click.echo(team_table(result))


@bench.command()
@click.option("--tets", type=click.IntRange(min=100), default=5000, show_default=True, help="Tetrahedra of the solid.")
@click.option("--many", type=click.IntRange(min=0), default=150_000, show_default=True, help="And of the large one.")
@click.option("--repeats", type=click.IntRange(min=1), default=20, show_default=True, help="Runs per time.")
@click.option(
    "--hull-sets", type=click.IntRange(min=0), default=12_000, show_default=True, help="Sets of points against Qhull."
)
@JSON
def speed(tets: int, many: int, repeats: int, hull_sets: int, as_json: bool) -> None:
    """How fast are clusters and hulls, beside the same algorithm with SciPy's Qhull?"""
    from steelyard.bench import speed as job

    result = job.run(tets, many, repeats, progress_bar("bench speed"), sets=hull_sets)
    print_json(result) if as_json else click.echo(job.speed_table(result))


@bench.command()
@click.option("--count", type=click.IntRange(min=1), default=60, show_default=True, help="Channels, plates and tubes.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of sizes and points.")
@JSON
def sheets(count: int, seed: int, as_json: bool) -> None:
    """Thin channels, plates and open tubes from bare points: is the volume right, and are wrong ones named?"""
    from steelyard.bench import sheets as job

    result = job.run(count, seed, progress_bar("bench sheets"))
    print_json(result) if as_json else click.echo(job.sheets_table(result))


@bench.command()
@click.option("--tools", multiple=True, help="Only these families (repeat the option).")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Seed of pose, arc and noise.")
@click.option("--views", "count", type=click.IntRange(min=8), default=127, show_default=True, help="Images per scan.")
@click.option("--pose-mm", type=float, default=0.0, show_default=True, help="Error of the reported camera positions.")
@click.option("--pose-deg", type=float, default=0.0, show_default=True, help="Error of the reported camera rotations.")
@JSON
def scan(tools: tuple[str, ...], pose_mm: float, pose_deg: float, as_json: bool, **choices: Any) -> None:
    """Built tools scanned by simulated views on a table: volume against the truth, CPU of every stage."""
    from steelyard.bench import scan as job

    result = job.run(tools, pose_std=(pose_mm, pose_deg), progress=progress_bar("bench scan"), **choices)
    print_json(result) if as_json else click.echo(job.scan_table(result))
