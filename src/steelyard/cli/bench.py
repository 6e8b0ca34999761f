"""`steelyard bench`: the numbers of the README, re-made."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

import click


def _list(_context: click.Context, _option: click.Parameter, value: str | None) -> tuple[str, ...]:
    """Return a comma-separated option as a tuple."""
    return tuple(part.strip() for part in (value or "").split(",") if part.strip())


def _progress(label: str) -> Callable[[int, int], None] | None:
    """Return a counter on stderr, or None where nobody watches."""
    if not sys.stderr.isatty():
        return None

    def show(done: int, total: int) -> None:
        click.echo(f"\r{label} {done}/{total}" + ("\n" if done == total else ""), err=True, nl=False)

    return show


def _print(result: dict[str, Any], as_json: bool, table: Callable[[dict[str, Any]], str]) -> None:
    """Print one JSON object, or the table; notes go to stderr with the JSON."""
    if as_json:
        for note in result.get("notes", ()):
            click.echo(note, err=True)
        click.echo(json.dumps(result, allow_nan=False))
    else:
        click.echo(table(result))


@click.group()
def bench() -> None:
    """Re-make the numbers of the README from fixed seeds."""
    from steelyard.bench.timing import one_blas_thread

    one_blas_thread()


@bench.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout.")
@click.option("--seeds", default=5, show_default=True, type=click.IntRange(1), help="Seeds 0 .. N-1.")
@click.option("--objects", callback=_list, help="Comma-separated; all ten if left out.")
@click.option("--motions", callback=_list, help="Comma-separated: stop_go, dyn_slow, dyn_fast.")
@click.option("--noise", "noises", callback=_list, help="Comma-separated: none, low, moderate, high.")
@click.option("--methods", callback=_list, help="Comma-separated; ours and all installed peers if left out.")
@click.option("--million/--no-million", default=True, help="The log of a million samples as well.")
@click.option("--data", hidden=True, help="Accepted like everywhere; this bench makes its own data.")
def identify(
    as_json: bool,
    seeds: int,
    objects: tuple[str, ...],
    motions: tuple[str, ...],
    noises: tuple[str, ...],
    methods: tuple[str, ...],
    million: bool,
    data: str | None,
) -> None:
    """Our methods and the installed peers on ten objects, three motions and four noise levels."""
    from steelyard.bench import identify as rooms
    from steelyard.bench.tables import identify_table

    result = rooms.run(
        range(seeds),
        methods,
        _progress("logs"),
        objects=objects,
        motions=motions,
        noises=noises,
        million=1_000_000 if million else 0,
    )
    _print(result, as_json, identify_table)


@bench.command()
@click.option("--json", "as_json", is_flag=True, help="One JSON object on stdout.")
@click.option("--seeds", default=1000, show_default=True, type=click.IntRange(1), help="Seeds 0 .. N-1.")
@click.option("--motion", default="stop_go", show_default=True)
@click.option("--noise", default="moderate", show_default=True)
@click.option("--spectrum", default="both", show_default=True, type=click.Choice(["white", "2hz", "both"]))
@click.option("--all-objects", is_flag=True, help="All ten objects for every seed, not one in turn.")
@click.option("--undeclared", is_flag=True, help="The logs do not say their noise level: it is estimated.")
@click.option("--bias", default="none", show_default=True, type=click.Choice(["none", "free"]))
@click.option("--workers", default=1, show_default=True, type=click.IntRange(1), help="Processes.")
def coverage(
    as_json: bool,
    seeds: int,
    motion: str,
    noise: str,
    spectrum: str,
    all_objects: bool,
    undeclared: bool,
    bias: str,
    workers: int,
) -> None:
    """How often the 95 % intervals hold the truth, by kind, and how wide they are."""
    from steelyard.bench import coverage as rooms
    from steelyard.bench.tables import coverage_table
    from steelyard.simulate.noise import SPECTRA

    result = rooms.run(
        seeds,
        motion,
        noise,
        [name for name in SPECTRA if spectrum in (name, "both")],
        _progress("fits"),
        all_objects=all_objects,
        declared=not undeclared,
        bias=bias,
        workers=workers,
    )
    _print(result, as_json, coverage_table)
