"""`steelyard demo`."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click

from steelyard.cli.console import print_json, say, say_if_compiling

SEED = 0


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.option("--seed", type=int, default=SEED, show_default=True, help="Seed of the made noise.")
@click.option("--keep", type=click.Path(path_type=Path), metavar="DIR", help="Keep the made log in this folder.")
@click.option("--json", "as_json", is_flag=True, help="Print one JSON object.")
def demo(seed: int, keep: Path | None, as_json: bool) -> None:
    """Make a hammer's log, write it as files, identify it from them, and compare with the truth."""
    say_if_compiling()
    from steelyard import api
    from steelyard.cli.table import estimate_table
    from steelyard.io import result_dict
    from steelyard.io.recording_files import write_recording
    from steelyard.simulate import hammer

    made = hammer.recording(seed)
    with tempfile.TemporaryDirectory() as scratch:
        log = write_recording(made.recording, keep or Path(scratch))
        estimate = api.identify(log)
    truth = hammer.truth_for_people(made.truth)
    if as_json:
        print_json(result_dict(estimate) | {"truth": made.truth.vector.tolist(), "seed": seed})
        return
    click.echo(estimate_table(estimate, f"A hammer of wood and steel, made log (seed {seed})", truth))
    say(
        f"The log is in {keep}; identify it with: steelyard identify {log}" if keep else "Keep the log with --keep DIR."
    )
