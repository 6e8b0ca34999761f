"""What verbs share: JSON on stdout and nothing else, everything to be read by people on stderr or as a table."""

from __future__ import annotations

import json
import os
import re
import shlex
import sys
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from typing import Any

import click

from steelyard.errors import BadFile, BadValue
from steelyard.tables.marks import Marks
from steelyard.tables.printable import printable

_STYLES = re.compile("(\x1b\\[(?:0|1|33)m)")  # what `STYLED` and click write for them
STYLED = Marks(partial(click.style, bold=True), partial(click.style, fg="yellow", bold=True))


def command_line(*words: object) -> str:
    """Return the line that runs a verb, quoted where a shell would take a word apart."""
    return shlex.join(["steelyard", *map(str, words)])


def tell(text: str, *, nl: bool = True, err: bool = False) -> None:
    """Print a text to be read by people; what names out of files hold beside letters is replaced, our styles stay."""
    pieces = _STYLES.split(text)
    click.echo("".join(piece if k % 2 else printable(piece) for k, piece in enumerate(pieces)), nl=nl, err=err)


def print_json(value: Any) -> None:
    """Print one JSON object on stdout."""
    click.echo(json.dumps(value, indent=1, allow_nan=False))


def say(text: str) -> None:
    """Tell the person at the terminal something, on stderr."""
    tell(text, err=True)


def require_output(output: Path | None, what: str, suffixes: Sequence[str], *inputs: Path | None) -> None:
    """Raise BadValue or BadFile, before any work is done, where `output` is no place to write `what` to.

    suffixes  what its name must end in; inputs  what is read, and must not be written over
    """
    if output is None:
        return
    if output.suffix.lower() not in suffixes:
        raise BadValue(f"{output}: {what} is written as {' or '.join(suffixes)}.")
    for given in inputs:
        if given is not None and given.resolve() == output.resolve():
            raise BadValue(f"{output} is what is read; give {what} another name.")
    if output.is_dir():
        raise BadFile(f"{output}: cannot be written: a folder has this name.")
    if not output.parent.is_dir():
        raise BadFile(f"{output}: cannot be written: there is no folder {output.parent}. Make it first.")
    if not os.access(output.parent, os.W_OK):
        raise BadFile(f"{output}: cannot be written: you may not write into the folder {output.parent}.")


def require_folder(folder: Path | None, what: str) -> None:
    """Raise BadValue, before any work is done, where `folder` is a file and so no place to write `what` into."""
    if folder is not None and folder.exists() and not folder.is_dir():
        raise BadValue(f"{folder}: this is a file; give a folder to write {what} into.")


@cache
def say_if_compiling() -> None:
    """Have it said once that kernels are compiled, when one is; nothing where all come from the cache.

    numba itself is asked: it tells of each kernel that it compiles, and of none that it loads.
    """
    from numba.core import event

    class Once(event.Listener):
        said = False

        def on_start(self, event: Any) -> None:
            if not self.said:
                self.said = True
                say("Compiling numerical kernels, each the first time it is used (up to some minutes) ...")

        def on_end(self, event: Any) -> None:
            """Nothing is said at the end."""

    event.register("numba:compile", Once())  # type: ignore[no-untyped-call]


def progress_bar(label: str) -> Callable[[int, int], None] | None:
    """Return progress(done, total) that draws a bar on a terminal's stderr, or None elsewhere."""
    if not sys.stderr.isatty():
        return None

    def draw(done: int, total: int) -> None:
        width = 30
        filled = width * done // max(total, 1)
        end = "\n" if done >= total else ""
        click.echo(f"\r{label} [{'#' * filled}{'.' * (width - filled)}] {done}/{total}{end}", nl=False, err=True)

    return draw
