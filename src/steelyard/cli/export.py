"""`steelyard export RESULT --to TARGET`."""

from __future__ import annotations

from pathlib import Path

import click

from steelyard.cli.console import say
from steelyard.cli.options import HELP, PATH


@click.command(context_settings=HELP)
@click.argument("result", type=PATH)
@click.option(
    "--to",
    "target",
    required=True,
    type=click.Choice(["urdf", "sdf", "mjcf", "drake", "ur", "franka"]),
    help="What is to be told.",
)
@click.option(
    "--pose-of-sensor",
    "pose",
    metavar="POSE",
    help="Pose of the result's frame in the link, body or flange that is written, as a table in quotes: "
    '\'{ position = [0, 0, 0.05], unit = "m", rotation = [1, 0, 0, 0], form = "quaternion-wxyz" }\'. '
    "Left out, theirs is the same.",
)
@click.option("--guess", is_flag=True, help="Write the best guess of an inertia that the log leaves open.")
def export(result: Path, target: str, pose: str | None, guess: bool) -> None:
    """Print RESULT (.json) as a robot or a simulator takes it: one inertial element, or one call."""
    from steelyard.io import read_result
    from steelyard.io.inertial_texts import inertial_text
    from steelyard.io.recordings.description import read_pose

    estimate = read_result(result)
    place = None if pose is None else read_pose(pose, "--pose-of-sensor")
    click.echo(inertial_text(estimate, target, place, guess), nl=False)
    if not estimate.identified[4:].all():
        say("The log leaves the inertia open: " + ("this is a best guess." if guess else "none is told."))
