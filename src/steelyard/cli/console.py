"""What verbs share: JSON on stdout and nothing else, everything to be read by people on stderr or as a table."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable
from typing import Any

import click


def print_json(value: Any) -> None:
    """Print one JSON object on stdout."""
    click.echo(json.dumps(value, indent=1, allow_nan=False))


def say(text: str) -> None:
    """Tell the person at the terminal something, on stderr."""
    click.echo(text, err=True)


def say_if_compiling() -> None:
    """Say once that kernels are compiled when no compiled ones are cached yet."""
    from pathlib import Path

    import steelyard

    root = Path(steelyard.__file__).parent
    if sys.stderr.isatty() and not any(root.glob("identify/__pycache__/*.nbi")):
        say("Compiling numerical kernels (first run only, about a minute) ...")


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
