"""`steelyard bench ...`: a verb for every table of BENCHMARK.md."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeVar

import click

from steelyard.bench.timing import one_thread
from steelyard.cli.console import print_json, progress_bar, say, tell
from steelyard.cli.groups import Group
from steelyard.cli.options import HELP, JSON, PATH

Verb = TypeVar("Verb", bound=Callable[..., Any])

_FOLDERS = click.option("--data", required=True, type=PATH, help="Folder of object folders, or one of them.")
_OBJECTS = click.option("--objects", multiple=True, help="Only these objects (repeat the option).")
_METHODS = click.option("--methods", multiple=True, help="Only these methods.")


def _count(name: str, default: int, said: str, *, least: int = 1, into: str | None = None) -> Callable[[Verb], Verb]:
    """Return the option of a whole number from `least` on; `into` is the argument it goes to, where not of its name."""
    names = (name,) if into is None else (name, into)
    return click.option(*names, type=click.IntRange(min=least), default=default, help=said)


_WORKERS = _count("--workers", 2, "Processes.")


def _tell(result: dict[str, Any], as_json: bool, table: Callable[[dict[str, Any]], str]) -> None:
    """Print what a bench found, as JSON or for people."""
    if as_json:
        print_json(result)
    else:
        tell(table(result))


@click.group(cls=Group, context_settings=HELP)
def bench() -> None:
    """Make every number that the README and BENCHMARK.md claim again: a command per table."""
    one_thread()


@bench.command()
@_count("--seeds", 5, "Seeds 0, 1, ...")
@_OBJECTS
@click.option("--motions", multiple=True, help="Only these motions.")
@click.option("--noise", "noises", multiple=True, help="Only these noise levels.")
@_METHODS
@_count("--million", 1_000_000, "Rows of the long log.", least=0)
@click.option("--data", type=PATH, help="Has no effect: the bench makes its own data.")
@JSON
def identify(seeds: int, data: Path | None, as_json: bool, **choices: Any) -> None:
    """Ten bodies, three motions, four noise levels: our methods and, where installed, the peers'."""
    from steelyard.bench import identify as job
    from steelyard.bench.tables import identify_table

    result = job.run(range(seeds), progress=progress_bar("bench identify"), **choices)
    for note in result["notes"]:
        say(note)
    _tell(result, as_json, identify_table)


@bench.command()
@_count("--seeds", 1000, "Seeds 0, 1, ...")
@click.option("--motion", default="stop_go", help="Motion of the logs, as in bench identify.")
@click.option("--noise", default="moderate", help="Noise level, as in bench identify.")
@click.option(
    "--spectrum",
    type=click.Choice(["white", "2hz", "both"]),
    default="both",
    help="White noise, noise correlated below 2 Hz, or each in turn.",
)
@click.option("--all-objects", is_flag=True, help="Every seed on all ten objects instead of one in turn.")
@click.option("--noise-unknown", is_flag=True, help="The log does not declare its noise: it is estimated.")
@click.option(
    "--bias",
    type=click.Choice(["free", "none"]),
    default="none",
    help="The sensor's bias is estimated, or known to be none.",
)
@_count("--workers", 1, "Processes.")
@JSON
def coverage(seeds: int, spectrum: str, noise_unknown: bool, as_json: bool, **choices: Any) -> None:
    """Do 95 % intervals hold the truth 95 % of the time, white and correlated noise?"""
    from steelyard.bench import coverage as job
    from steelyard.bench.tables import coverage_table
    from steelyard.simulate.noise import SPECTRA

    spectra = SPECTRA if spectrum == "both" else tuple(s for s in SPECTRA if s == spectrum)
    progress = progress_bar("bench coverage")
    result = job.run(seeds, spectra=spectra, declared=not noise_unknown, progress=progress, **choices)
    _tell(result, as_json, coverage_table)


@bench.command("held-object")
@_FOLDERS
@click.option(
    "--parts",
    type=click.Choice(["segmented", "truth", "truth-split", "truth-merged"]),
    default="segmented",
    help="Parts: found in the clouds with labels unseen, the true ones, each cut in pieces, or joined.",
)
@_count("--seeds", 5, "Seeds 0, 1, ...")
@_OBJECTS
@click.option("--noise", "noises", multiple=True, help="Only these scenarios: none, low, moderate, high, high-code.")
@_METHODS
@_WORKERS
@JSON
def held_object(data: Path, as_json: bool, **choices: Any) -> None:
    """The paper's identification benchmark: every object, four noise scenarios, ours beside its rivals."""
    from steelyard.bench import held_object as job
    from steelyard.bench.objects.table import held_object_table

    result = job.run(data, progress=progress_bar("bench held-object"), **choices)
    _tell(result, as_json, held_object_table)


@bench.command("part-coverage")
@_FOLDERS
@_count("--seeds", 1000, "Logs per case.")
@click.option("--noise", "noises", default="low,high", help="Scenarios, with commas between them.")
@_WORKERS
@JSON
def part_coverage(data: Path, seeds: int, noises: str, workers: int, as_json: bool) -> None:
    """Do 95 % intervals of part masses and of the whole hold the truth, and how long does an answer take?"""
    from steelyard.bench import part_coverage as job
    from steelyard.bench.objects.part_tables import part_coverage_table

    progress = progress_bar("bench part-coverage")
    result = job.run(data, seeds, progress, noises=tuple(noises.split(",")), workers=workers)
    _tell(result, as_json, part_coverage_table)


@bench.command()
@_FOLDERS
@_count("--seeds", 5, "Seeds 0, 1, ...")
@JSON
def materials(data: Path, seeds: int, as_json: bool) -> None:
    """How often is the right density picked from a list, at low noise?"""
    from steelyard.bench import materials as job
    from steelyard.bench.objects.part_tables import materials_table

    result = job.run(data, seeds, progress_bar("bench materials"))
    _tell(result, as_json, materials_table)


@bench.command()
@_FOLDERS
@_OBJECTS
@click.option("--noise-mm", type=click.FloatRange(min=0), default=0.0, help="Noise of the points.")
@click.option("--colour-noise", type=click.FloatRange(min=0), default=0.0, help="Of channels 0..255.")
@JSON
def segment(data: Path, as_json: bool, **choices: Any) -> None:
    """Parts of unlabelled clouds against the true ones, beside the paper's Tables I and II."""
    from steelyard.bench import segment as job
    from steelyard.bench.shapes.segment_table import segment_table

    result = job.run(data, progress_bar("bench segment"), **choices)
    _tell(result, as_json, segment_table)


@bench.command()
@_count("--trials", 24, "Seeds 100, 101, ...")
@click.option("--cases", multiple=True, help="Only these cases: A, B, C, D (repeat the option).")
@_METHODS
@click.option("--sizes", type=click.IntRange(min=2), multiple=True, help="Only these numbers of robots in the scaling.")
@_WORKERS
@_count("--coverage", 0, "Trials of the intervals.", least=0)
@_count("--slips", 40, "Slips, and logs without.", least=0)
@JSON
def team(trials: int, as_json: bool, **choices: Any) -> None:
    """One payload, three robots, noise from clean to that of the paper; and cost against the number of robots."""
    from steelyard.bench import team as job
    from steelyard.bench.teams.table import team_table

    result = job.run(trials, progress_bar("bench team"), **choices)
    _tell(result, as_json, team_table)


@bench.command()
@_count("--tets", 5000, "Tetrahedra of the solid.", least=100)
@_count("--many", 150_000, "And of the large one.", least=0)
@_count("--repeats", 20, "Runs per time.")
@_count("--hull-sets", 12_000, "Sets of points against Qhull.", least=0)
@JSON
def speed(tets: int, many: int, repeats: int, hull_sets: int, as_json: bool) -> None:
    """How fast are clusters and hulls, beside the same algorithm with SciPy's Qhull?"""
    from steelyard.bench import speed as job

    result = job.run(tets, many, repeats, progress_bar("bench speed"), sets=hull_sets)
    _tell(result, as_json, job.speed_table)


@bench.command()
@_count("--count", 60, "Channels, plates and tubes.")
@_count("--seed", 0, "Seed of sizes and points.", least=0)
@JSON
def sheets(count: int, seed: int, as_json: bool) -> None:
    """Thin channels, plates and open tubes from bare points: is the volume right, and are wrong ones named?"""
    from steelyard.bench import sheets as job

    result = job.run(count, seed, progress_bar("bench sheets"))
    _tell(result, as_json, job.sheets_table)


@bench.command()
@click.option("--tools", multiple=True, help="Only these families (repeat the option).")
@_count("--seed", 0, "Seed of pose, arc and noise.", least=0)
@_count("--views", 127, "Images per scan.", least=8, into="count")
@click.option("--pose-mm", type=float, default=0.0, help="Error of the reported camera positions.")
@click.option("--pose-deg", type=float, default=0.0, help="Error of the reported camera rotations.")
@JSON
def scan(tools: tuple[str, ...], pose_mm: float, pose_deg: float, as_json: bool, **choices: Any) -> None:
    """Built tools scanned by simulated views on a table: volume against the truth, CPU of every stage."""
    from steelyard.bench import scan as job

    result = job.run(tools, pose_std=(pose_mm, pose_deg), progress=progress_bar("bench scan"), **choices)
    _tell(result, as_json, job.scan_table)
