"""Values made of what a file holds: where they are wrong, the error names the file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from steelyard.errors import BadFile, BadValue

T = TypeVar("T")


def in_file(path: Path, make: Callable[[], T]) -> T:
    """Return make(), with the path in front of what is wrong with the numbers."""
    try:
        return make()
    except BadValue as error:
        raise BadFile(f"{path}: {error}") from None
