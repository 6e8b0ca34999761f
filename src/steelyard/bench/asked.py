"""What a bench is asked for: how it tells of its progress, and names and counts that it cannot take."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from typing import TypeVar

from steelyard.errors import BadValue

Progress = Callable[[int, int], None]  # called with what is done and how much there is
Row = TypeVar("Row")


def told(rows: Iterable[Row], count: int, progress: Progress | None) -> Iterator[Row]:
    """Yield each of `count` rows, and tell of it once the next is asked for."""
    for done, row in enumerate(rows, start=1):
        yield row
        if progress is not None:
            progress(done, count)


def require_known(what: str, asked: Sequence[str], known: Collection[str]) -> None:
    """Raise BadValue where one of the names asked for is not known; `what` says what they name."""
    for name in asked:
        if name not in known:
            raise BadValue(f"There is no {what} '{name}'; there are: {', '.join(known)}.")


def require_one(what: str, count: int) -> None:
    """Raise BadValue where there is to be none of what a bench repeats."""
    if count < 1:
        raise BadValue(f"There must be at least one {what}; got {count}.")
