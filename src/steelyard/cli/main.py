"""`steelyard`: the list of verbs. Each is imported when it is called, so that --help stays quick."""

from __future__ import annotations

import io
import os
import sys
from importlib import import_module

import click

from steelyard import __version__
from steelyard.cli.console import say
from steelyard.cli.groups import Group
from steelyard.cli.options import HELP
from steelyard.errors import SteelyardError
from steelyard.threads import one_blas_thread

# Verb -> (module and function, one line of help).
VERBS: dict[str, tuple[str, str]] = {
    "identify": (
        "steelyard.cli.identify:identify",
        "Log -> mass, centre of mass, inertia, error bars, findings.",
    ),
    "team": ("steelyard.cli.team:team", "Logs of several robots with one payload -> grasps, mass, CoM, inertia."),
    "scan": ("steelyard.cli.scan:scan", "Posed RGB-D views -> one coloured cloud of the object."),
    "segment": ("steelyard.cli.segment:segment", "Cloud or views -> closed volume in homogeneous parts."),
    "compare": ("steelyard.cli.compare:compare", "Two results: the same object or not, with a p-value."),
    "report": ("steelyard.cli.report:report", "Result -> one page: numbers, the parts in 3D, residuals, findings."),
    "export": ("steelyard.cli.export:export", "Result -> URDF, SDF, MuJoCo, Drake, UR, Franka."),
    "demo": ("steelyard.cli.demo:demo", "Made data, the answer, the truth: a scanned hammer, or a team of three."),
    "doctor": (
        "steelyard.cli.doctor:doctor",
        "Versions, what is installed, a tiny identification with a known answer.",
    ),
    "workshop": ("steelyard.cli.workshop:workshop", "Twenty workshop tools as object folders with exact truth."),
    "bench": ("steelyard.cli.bench:bench", "Every number that the README claims, made again."),
}


class _Verbs(Group):
    """A group whose verbs are imported on call."""

    def list_commands(self, ctx: click.Context) -> list[str]:
        return list(VERBS)

    def get_command(self, ctx: click.Context, name: str) -> click.Command | None:
        if name not in VERBS:
            return None
        module, function = VERBS[name][0].split(":")
        command: click.Command = getattr(import_module(module), function)
        return command

    def line_of(self, ctx: click.Context, name: str) -> str:
        return VERBS[name][1]


@click.group(cls=_Verbs, context_settings=HELP)
@click.version_option(__version__, prog_name="steelyard")
def cli() -> None:
    """Tell a robot what it holds: mass, centre of mass and inertia, with honest error bars.

    Exit status: 0 an answer, 2 bad input, 3 the data cannot answer.
    """


def main(arguments: list[str] | None = None) -> None:
    """Run the command line; one clear line on stderr for every error that is ours, or of where the answer goes."""
    one_blas_thread()
    for stream in (sys.stdout, sys.stderr):
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="replace")  # a name may hold letters that this terminal does not have
    try:
        # NO_COLOR (no-color.org): any text in it turns styles off; else click decides, by whether there is a terminal.
        cli(arguments, prog_name="steelyard", color=False if os.environ.get("NO_COLOR") else None)
    except SteelyardError as error:
        say(f"steelyard: {error}")
        sys.exit(error.exit_status)
    except OSError as error:
        say(f"steelyard: {error.filename or 'standard output'}: {error.strerror}.")
        sys.exit(SteelyardError.exit_status)
