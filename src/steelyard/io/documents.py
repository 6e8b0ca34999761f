"""JSON and TOML files read whole, with or without the mark that Windows editors put in front of UTF-8."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

from steelyard.errors import BadDescription, BadFile

_LARGEST_JSON = 64_000_000
_LARGEST_TOML = 4_000_000
_MOST_DOTS = 200  # in a line: Python takes the square of their number of steps for a key with dots


def load_json(path: Path, what: str, hint: str) -> dict[str, Any]:
    """Return the one object of a JSON file; raises BadFile.

    what  is in the file, in words
    hint  ends what is said of a file that is something else
    """
    try:
        values = json.loads(small_text(path, what, "JSON", _LARGEST_JSON))
    except UnicodeDecodeError:
        raise BadFile(f"{path}: not {what}: a binary file, where JSON was expected. {hint}") from None
    except (ValueError, RecursionError) as error:  # ValueError also of a number with thousands of digits
        raise BadFile(f"{path}: not {what}: not valid JSON ({error}). {hint}") from None
    if not isinstance(values, dict):
        raise BadFile(f"{path}: not {what}: expected one JSON object. {hint}")
    return values


def load_toml(path: Path) -> dict[str, Any]:
    """Return the tables of a description; raises BadFile or BadDescription."""
    try:
        text = small_text(path, "a log description", "TOML", _LARGEST_TOML)
    except UnicodeDecodeError:
        raise BadFile(f"{path}: expected a TOML text in UTF-8; found a binary file.") from None
    return parse_toml(text, str(path))


def parse_toml(text: str, where: str) -> dict[str, Any]:
    """Return the tables of a TOML text; `where` it stands begins the message. Raises BadDescription."""
    deepest = max((line.count(".") for line in text.split("\n")), default=0)
    if deepest > _MOST_DOTS:
        raise BadDescription(f"{where}: a line has {deepest} dots; no description has keys as deep.")
    try:
        return tomllib.loads(text)
    except (ValueError, RecursionError) as error:
        raise BadDescription(f"{where}: not valid TOML: {error}.") from None


def small_text(path: Path, what: str, kind: str, largest: int) -> str:
    """Return a text of at most `largest` bytes; raises BadFile, and UnicodeDecodeError where it is none.

    No more is read than that: a pipe or a device does not tell its size before.
    """
    try:
        with path.open("rb") as file:
            content = file.read(largest + 1)
        if len(content) > largest:
            size = max(path.stat().st_size, len(content))
            raise BadFile(f"{path}: {what} is a small {kind} text; this file has {size} bytes.")
    except OSError as error:
        raise BadFile(f"{path}: cannot be read ({error.strerror}).") from None
    return content.decode("utf-8-sig")
