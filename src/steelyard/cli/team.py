"""`steelyard team TEAM`."""

from __future__ import annotations

from pathlib import Path

import click

from steelyard.cli.console import STYLED, print_json, require_output, say_if_compiling, tell
from steelyard.cli.options import HELP, PATH, RESULT_AS_JSON, RESULT_FILE, STREAM_FOLDER

METHODS = ("joint", "paper")


@click.command(context_settings=HELP)
@click.argument("team", type=PATH)
@STREAM_FOLDER
@click.option(
    "--method", type=click.Choice(METHODS), default="joint",
    help="One joint estimate, or the paper's steps one after another.",
)  # fmt: skip
@RESULT_FILE
@RESULT_AS_JSON
def team(team: Path, data: Path | None, method: str, output: Path | None, as_json: bool) -> None:
    """Find where every robot of TEAM (.toml) holds one payload, and its mass, centre of mass and inertia."""
    require_output(output, "a result", [".json"], team)
    say_if_compiling()
    from steelyard import api
    from steelyard.io import result_dict, write_result
    from steelyard.tables.team import team_table

    estimate = api.identify_team(team, method, data=data)  # type: ignore[arg-type]
    if output is not None:
        write_result(estimate, output)
    if as_json:
        print_json(result_dict(estimate))
    else:
        title = f"{team}: what the team carries, in the grasp frame of {estimate.reference}"
        tell(team_table(estimate, title, marks=STYLED))
