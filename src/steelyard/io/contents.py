"""Files read whole, no larger than is bounded: JSON and TOML as tables, words and JSON as numbers of a known shape.

What is wrong names the file. A few kB from a stranger may claim, or unpack to, many GB; true is no 1 in JSON, and "0.7"
no 0.7.
"""

from __future__ import annotations

import json
import tomllib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, TypeVar

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io.entries import is_number

MOST_BYTES = 2 * 1024**3  # six hours of a log at 1 kHz, 80 million points

_LARGEST_JSON = 64_000_000
_LARGEST_TOML = 4_000_000
_MOST_DOTS = 200  # in a line: Python takes the square of their number of steps for a key with dots

T = TypeVar("T")

_LONGEST_NUMBER = 400  # characters: the longest that Python writes of a double has some 330

Shape = tuple[int | None, ...]  # () is one number, None any length


def require_bounded(path: Path, size: int, most: int | None = None) -> None:
    """Raise BadFile where reading would take more memory than `most`, MOST_BYTES if left out.

    size  [bytes] what would be unpacked, known before it is
    """
    most = MOST_BYTES if most is None else most
    if size > most:
        raise BadFile(
            f"{path}: holds {size / 1024**2:.0f} MiB, more than the {most // 1024**2} MiB that are read. "
            "Give fewer rows, points or views at once."
        )


@contextmanager
def readable(path: Path | str) -> Iterator[None]:
    """Raise BadFile where the file, or another that is read with it, cannot be read."""
    try:
        yield
    except OSError as error:
        raise BadFile(f"{error.filename or path}: cannot be read ({error.strerror or error}).") from None


def read_whole(path: Path) -> bytes:
    """Return the content of a file; raises BadFile where it cannot be read, is too large or a device."""
    with readable(path):
        if path.is_char_device():
            raise BadFile(f"{path}: this is a device, which has no end. Give a file.")
        require_bounded(path, path.stat().st_size)
        return path.read_bytes()


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
    with readable(path):
        with path.open("rb") as file:
            content = file.read(largest + 1)
        if len(content) > largest:
            size = max(path.stat().st_size, len(content))
            raise BadFile(f"{path}: {what} is a small {kind} text; this file has {size} bytes.")
    return content.decode("utf-8-sig")


def in_file(path: Path, make: Callable[[], T]) -> T:
    """Return make(), with the path in front of what is wrong with the numbers."""
    try:
        return make()
    except BadValue as error:
        raise BadFile(f"{path}: {error}") from None


def numbers(path: Path, what: str, words: Sequence[bytes]) -> Array:
    """Return words (N,) as numbers; raises BadFile, which names `what` they are of, where one is none."""
    other = BadFile(f"{path}: {what} holds a word that is no number.")
    if max(map(len, words), default=0) > _LONGEST_NUMBER:
        raise other  # an array of words gives each of them the room of the longest
    try:
        return np.array(words, dtype="S").astype(np.float64)
    except ValueError:
        raise other from None


def typed(path: Path, what: str, values: Array, kind: str | np.dtype[Any]) -> np.ndarray[Any, np.dtype[Any]]:
    """Return values (N, ..) as `kind`; raises BadFile where `what` counts in integers and a value does not fit.

    NaN and numbers beyond the range would become any integer, and of fractions the whole part would be left.
    """
    dtype = np.dtype(kind)
    if dtype.kind in "iu":
        low, high = int(np.iinfo(dtype).min), int(np.iinfo(dtype).max)
        good = (values >= low) & (values < float(high) + 1) & (values == np.rint(values))
        if not good.all():
            raise BadFile(
                f"{path}: {what} holds {values[~good].flat[0]:g}; expected integers from {low} to {high}. "
                "Save the file again."
            )
    return values.astype(dtype)


def array_of(path: Path, entry: Mapping[str, Any], key: str, shape: Shape, of: str = "") -> Array:
    """Return the finite numbers of a shape under `key`; raises BadFile, which says what they are `of` in words."""
    value = entry.get(key)
    if not _fits(value, shape):
        raise _unfit(path, f'"{key}"{of}', "finite ", shape, "")
    return np.array(value, np.float64)


def array_or_none(path: Path, entry: Mapping[str, Any], key: str, shape: Shape) -> Array | None:
    """Return the same, None where the entry is missing or null, whole or in part."""
    value = entry.get(key)
    if value is None:
        return None
    if not _fits(value, shape, gaps=True):
        raise _unfit(path, f'"{key}"', "", shape, " or null")
    return np.array(value, np.float64) if _fits(value, shape) else None


def object_of(path: Path, entry: Mapping[str, Any], key: str, of: str = "") -> Mapping[str, Any]:
    """Return the object under `key`, empty where it is missing or null; raises BadFile, which says what it is `of`."""
    value = entry.get(key) or {}
    if not isinstance(value, dict):
        raise BadFile(f'{path}: "{key}" must be one object{of}.')
    return value


def arrays_of(path: Path, entry: Mapping[str, Any], key: str, shape: Shape, of: str) -> dict[str, Array]:
    """Return the arrays of one shape that the object under `key` names; raises BadFile."""
    values = object_of(path, entry, key, of)
    return {str(name): array_of(path, values, name, shape, f" of {key}") for name in values}


def _fits(value: Any, shape: Shape, gaps: bool = False) -> bool:
    """Whether a value is lists of lists of finite numbers, or with `gaps` of null, as long as the shape says."""
    if not shape:
        return is_number(value) or (gaps and value is None)
    if not isinstance(value, list) or shape[0] not in (None, len(value)):
        return False
    return all(_fits(item, shape[1:], gaps) for item in value)


def _unfit(path: Path, what: str, finite: str, shape: Shape, or_else: str) -> BadFile:
    count = " x ".join("n" if length is None else str(length) for length in shape) or "one"
    numbers = "numbers" if shape else "number"
    return BadFile(f"{path}: {what} must be {count} {finite}{numbers}{or_else}; found something else.")
