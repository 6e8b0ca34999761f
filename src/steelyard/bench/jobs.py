"""What a bench is asked for, and its jobs: how it tells of its progress, in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

from steelyard.errors import BadValue
from steelyard.io.object_folders import object_folders

Progress = Callable[[int, int], None]  # called with what is done and how much there is
Job = TypeVar("Job")
Row = TypeVar("Row")
BATCH = 20  # jobs: calls that each are done sooner than they are handed over


def told(rows: Iterable[Row], count: int, progress: Progress | None) -> Iterator[Row]:
    """Yield each of `count` rows, and tell of it once the next is asked for."""
    for done, row in enumerate(rows, start=1):
        yield row
        if progress is not None:
            progress(done, count)


def spread(call: Callable[[Job], Row], jobs: Sequence[Job], workers: int, batch: int = 1) -> Iterator[Row]:
    """Yield what `call` makes of every job, in their order; processes are handed `batch` of them at a time."""
    if workers == 1:
        yield from map(call, jobs)
        return
    # Fresh processes: a fork would copy the locks of BLAS and Numba threads.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(call, jobs, chunksize=batch)


def chosen_folders(data: Path | str, names: Sequence[str]) -> list[Path]:
    """Return the object folders in `data` called `names`, all where none is named; raises BadValue for others."""
    there = {folder.name: folder for folder in object_folders(data)}
    require_known("object", names, tuple(there))
    return [there[name] for name in names or there]


def require_known(what: str, asked: Sequence[str], known: Collection[str]) -> None:
    """Raise BadValue where one of the names asked for is not known; `what` says what they name."""
    for name in asked:
        if name not in known:
            raise BadValue(f"There is no {what} '{name}'; there are: {', '.join(known)}.")


def require_one(what: str, count: int) -> None:
    """Raise BadValue where there is to be none of what a bench repeats."""
    if count < 1:
        raise BadValue(f"There must be at least one {what}; got {count}.")
