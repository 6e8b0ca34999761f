"""Entry: typed access to one table of a description; its errors say where, and what would have been right."""

from __future__ import annotations

import difflib
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription

_MOST_LISTED = 60
_LONGEST_NAME = 60
_LARGEST_INTEGER = 10**300


def listed(names: Sequence[object]) -> str:
    """Return names for a message, separated by commas; very many or very long ones are cut."""
    shown = ", ".join(str(name)[:_LONGEST_NAME] for name in names[:_MOST_LISTED])
    return f"{shown}, .. ({len(names)} in all)" if len(names) > _MOST_LISTED else shown


def close_match(wrong: str, right: Sequence[str]) -> str:
    """Return ' Did you mean "x"?' for the nearest of `right`, or nothing when none is near."""
    folded = {name.lower(): name for name in reversed(right)}
    near = difflib.get_close_matches(wrong.lower(), list(folded), n=1)
    return f' Did you mean "{folded[near[0]]}"?' if near else ""


def gathered(steps: Mapping[Any, Callable[[], Any]]) -> dict[Any, Any]:
    """Return what every step returns, by its key; raises one BadDescription with a line for each that fails."""
    found, mistakes = {}, []
    for key, step in steps.items():
        try:
            found[key] = step()
        except BadDescription as error:
            mistakes.append(str(error))
    if mistakes:
        raise BadDescription("\n".join(mistakes))
    return found


@dataclass(frozen=True)
class Entry:
    """One table of a description: its values, and `where` it stands, for messages."""

    values: Mapping[str, Any]
    where: str

    def __contains__(self, key: str) -> bool:
        return key in self.values

    def error(self, text: str) -> BadDescription:
        """Return the error that says `text` about this place."""
        return BadDescription(f"{self.where}: {text}")

    def only(self, *allowed: str, places: Mapping[str, str] | None = None) -> None:
        """Raise BadDescription at a key that is not allowed here, with its place or the nearest one that is."""
        for key in self.values:
            if key not in allowed:
                place = (places or {}).get(key)
                near = f" It stands in {place}." if place else close_match(key, allowed)
                raise self.error(f'unknown key "{key}".{near} Keys here: {listed(allowed)}.')

    def require(self, key: str, example: str) -> Any:
        """Return the value, or raise BadDescription with an example line."""
        if key not in self.values:
            raise self.error(f'"{key}" is missing. Example: {example}')
        return self.values[key]

    def table(self, key: str) -> Entry:
        """Return the table under `key`; an empty one where it is left out."""
        return self._inner(key, key, f"table such as {key} = {{ .. }}")

    def section(self, key: str) -> Entry:
        """Return the section that starts with [key]; an empty one where it is left out."""
        return self._inner(key, f"[{key}]", f"section that starts with [{key}]")

    def _inner(self, key: str, called: str, what: str) -> Entry:
        value = self.values.get(key, {})
        if not isinstance(value, Mapping):
            raise self.error(f'"{key}" must be a {what}; got {value!r}.')
        return Entry(value, f"{self.where}, {called}")

    def sections(self, key: str, written: str, called: str) -> list[Entry]:
        """Return the sections that start with `written`, none where `key` is left out; messages number them."""
        value = self.values.get(key, [])
        if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
            raise self.error(f'"{key}" is written as sections that start with {written}.')
        return [Entry(item, f"{self.where}, {called} {k}") for k, item in enumerate(value, 1)]

    def text(self, key: str) -> str | None:
        """Return a string, None where it is left out."""
        value = self.values.get(key)
        if value is not None and not isinstance(value, str):
            raise self.error(f'"{key}" must be text in quotes; got {value!r}.')
        return value

    def choice(self, key: str, choices: Sequence[str], default: str) -> str:
        """Return one of `choices`, or raise BadDescription listing them."""
        value = self.values.get(key, default)
        if value not in choices:
            near = close_match(str(value), choices)
            raise self.error(f'unknown {key} "{value}".{near} Possible here: {listed(choices)}.')
        return str(value)

    def flag(self, key: str) -> bool:
        """Return true or false, false where it is left out."""
        value = self.values.get(key, False)
        if not isinstance(value, bool):
            raise self.error(f'"{key}" must be true or false; got {value!r}.')
        return value

    def number(self, key: str) -> float:
        """Return one finite number."""
        value: Any = self.values.get(key)
        if not is_number(value):
            raise self.error(f'"{key}" must be a finite number; got {value!r}.')
        return float(value)

    def spread(self, key: str, largest: float = math.inf) -> float:
        """Return one finite standard deviation, zero or more, and not above `largest`."""
        value = self.number(key)
        if value < 0:
            raise self.error(f'"{key}" must be zero or more; got {value:g}.')
        return self.bounded(key, value, largest)

    def positive(self, key: str, largest: float = math.inf) -> float:
        """Return one finite number above zero, and not above `largest`."""
        value = self.number(key)
        if value <= 0:
            raise self.error(f'"{key}" must be above zero; got {value:g}.')
        return self.bounded(key, value, largest)

    def bounded(self, key: str, value: float, largest: float) -> float:
        """Return `value`, or raise BadDescription where its size is above `largest`."""
        if abs(value) > largest:
            raise self.error(f'"{key}" must be no larger than {largest:g}; got {value:g}. Check its unit.')
        return value

    def numbers(self, key: str, *counts: int) -> Array:
        """Return finite numbers, as many as one of `counts`."""
        value = self.values.get(key)
        wanted = " or ".join(str(count) for count in counts)
        good = isinstance(value, list) and len(value) in counts and all(map(is_number, value))
        if not good:
            raise self.error(f'"{key}" must be a list of {wanted} finite numbers; got {value!r}.')
        return np.array(value, dtype=np.float64)


def each(entries: Sequence[Entry], parse: Callable[[Entry], Any]) -> tuple[Any, ...]:
    """Return every entry as it is parsed; raises one BadDescription with what is wrong in any."""
    return tuple(gathered({entry.where: partial(parse, entry) for entry in entries}).values())


def is_number(value: object) -> bool:
    """Return whether a value of a file is one finite number, and not true or false."""
    if isinstance(value, bool) or not isinstance(value, int | float):
        return False
    return math.isfinite(value) if isinstance(value, float) else abs(value) < _LARGEST_INTEGER
