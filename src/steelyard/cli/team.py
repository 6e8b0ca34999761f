"""`steelyard team TEAM`."""

from __future__ import annotations

from pathlib import Path

import click

from steelyard.cli.console import print_json, require_output, say_if_compiling

METHODS = ("joint", "paper")


@click.command(context_settings={"help_option_names": ["-h", "--help"]})
@click.argument("team", type=click.Path(path_type=Path))
@click.option(
    "--data", type=click.Path(path_type=Path), help="Folder that relative paths in the description start from."
)
@click.option(
    "--method", type=click.Choice(METHODS), default="joint", show_default=True,
    help="One joint estimate, or the paper's steps one after another.",
)  # fmt: skip
@click.option("-o", "--output", type=click.Path(path_type=Path), help="Write the result as JSON.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as one JSON object.")
def team(team: Path, data: Path | None, method: str, output: Path | None, as_json: bool) -> None:
    """Find where every robot of TEAM (.toml) holds one payload, and its mass, centre of mass and inertia."""
    require_output(output, "a result", [".json"], team)
    say_if_compiling()
    from steelyard import api
    from steelyard.cli.team_table import team_table
    from steelyard.io import result_dict, write_result

    estimate = api.identify_team(team, method, data=data)  # type: ignore[arg-type]
    if output is not None:
        write_result(estimate, output)
    if as_json:
        print_json(result_dict(estimate))
    else:
        click.echo(team_table(estimate, f"{team}: what the team carries, in the grasp frame of {estimate.reference}"))
