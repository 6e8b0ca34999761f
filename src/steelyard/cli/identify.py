"""`steelyard identify LOG`."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NoReturn, cast

import click

from steelyard.cli.console import STYLED, print_json, require_output, say, say_if_compiling, tell
from steelyard.cli.options import HELP, PATH, RESULT_AS_JSON, RESULT_FILE, STREAM_FOLDER
from steelyard.errors import BadValue, NoDescription

METHODS = ("auto", "noise-aware", "least-squares", "geodesic")


@click.command(context_settings=HELP)
@click.argument("log", required=False, type=PATH)
@STREAM_FOLDER
@click.option("--method", type=click.Choice(METHODS), default="auto", help="Estimator.")
@click.option(
    "--bias",
    type=click.Choice(["free", "none"]),
    default="free",
    help="Estimate the sensor's bias, or trust that it is tared.",
)
@click.option("--drift", is_flag=True, help="Let the bias grow linearly over the log.")
@click.option(
    "--gravity",
    type=click.Choice(["given", "unknown"]),
    default="given",
    help="Trust the direction of gravity in the description, or estimate it (tilted base).",
)
@click.option(
    "--tool",
    type=PATH,
    help="Result (.json) or log of the gripper alone: taken away, sharing one sensor bias.",
)
@click.option(
    "--parts",
    type=PATH,
    help="Parts of the object: a mesh (.ply) whose faces carry part numbers, or parts.npz of `steelyard segment`.",
)
@click.option(
    "--scan",
    type=PATH,
    help="Cloud of the object (.ply, .pcd, .npz) or folder of views: closed, cut into parts, and used for the inertia.",
)
@click.option(
    "--pose-in-sensor",
    metavar="POSE",
    help="Where the object sits in the sensor: a file with [object] pose_in_sensor, or the table itself in quotes.",
)
@click.option(
    "--object-size",
    type=float,
    metavar="M",
    help="Rough longest dimension of the object [m]; used only where the data leave the inertia open.",
)
@click.option(
    "--materials",
    metavar="LIST",
    help='What the parts may be made of [kg/m^3]: "steel=7850, rubber=1150+-5%" (2 % where nothing is said).',
)
@click.option("--pendant", is_flag=True, help="Type poses and readings by hand, one pose per line.")
@click.option("--describe", is_flag=True, help="Print a description of LOG, a data file or bag, and do nothing else.")
@RESULT_FILE
@RESULT_AS_JSON
def identify(log: Path | None, data: Path | None, tool: Path | None, parts: Path | None, scan: Path | None,
             pendant: bool, pose_in_sensor: str | None, materials: str | None, describe: bool, output: Path | None,
             as_json: bool, **chosen: Any) -> None:  # fmt: skip
    """Identify what a robot holds from LOG: a description (.toml) or a data file with the usual column names."""
    if pendant == (log is not None) or (pendant and describe):
        raise BadValue("Give either a LOG or --pendant. Example: steelyard identify log.toml")
    if describe:
        from steelyard.io.log_files import describe_file

        return tell(describe_file(cast(Path, log), data), nl=False)
    place = None if pose_in_sensor is None or "{" in pose_in_sensor else Path(pose_in_sensor)
    require_output(output, "a result", [".json"], log, tool, parts, scan, place)
    say_if_compiling()
    from steelyard import api
    from steelyard.io import read_pendant, result_dict, write_result
    from steelyard.parts.material import materials_of
    from steelyard.pipelines.options import Options
    from steelyard.tables.estimate import estimate_table

    recording = read_pendant(_typed()) if pendant else cast(Path, log)
    given = {"tool": tool, "parts": parts, "scan": scan, "pose_in_sensor": pose_in_sensor, "data": data}
    options = Options(**chosen, materials=() if materials is None else materials_of(materials))
    try:
        estimate = api.identify(recording, options, **given)
    except NoDescription as error:
        if as_json or not error.example:
            raise
        _show_example(error)
    if output is not None:
        write_result(estimate, output)
    if as_json:
        print_json(result_dict(estimate))
    else:
        title = f"{log or 'pendant'}: what the robot holds, in the sensor frame"
        tell(estimate_table(estimate, title, marks=STYLED))


def _show_example(error: NoDescription) -> NoReturn:
    """Print the description to start from on stdout, so that it can be sent to a file; what is said of it on stderr."""
    say(f"steelyard: {error.words}")
    tell(error.example, nl=False)
    say("The description alone is on standard output: save it beside the data with > log.toml, and identify that.")
    sys.exit(error.exit_status)


def _typed() -> list[str]:
    """Return the lines typed by hand, up to an empty one or the end of input."""
    from steelyard.io.pendant import PENDANT_COLUMNS

    if sys.stdin.isatty():
        say(f"One pose per line: {PENDANT_COLUMNS}. An empty line ends.")
    lines: list[str] = []
    for line in sys.stdin:
        if not line.strip() and lines:
            break
        lines.append(line)
    return lines
