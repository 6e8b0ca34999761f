"""Jobs of a bench, in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Job = TypeVar("Job")
Row = TypeVar("Row")


def batches(jobs: Sequence[Job], size: int = 20) -> list[Sequence[Job]]:
    """Return the jobs in order, `size` at a time: for calls that each are done sooner than they are handed over."""
    return [jobs[k : k + size] for k in range(0, len(jobs), size)]


def spread(call: Callable[[Job], Row], jobs: Sequence[Job], workers: int) -> Iterator[Row]:
    """Yield what `call` makes of every job, in their order."""
    if workers == 1:
        yield from map(call, jobs)
        return
    # Fresh processes: a fork would copy the locks of BLAS and Numba threads.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(call, jobs)
