"""Jobs of a bench, in this process or in several."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from typing import TypeVar

Job = TypeVar("Job")
Row = TypeVar("Row")
BATCH = 20  # jobs: calls that each are done sooner than they are handed over


def spread(call: Callable[[Job], Row], jobs: Sequence[Job], workers: int, batch: int = 1) -> Iterator[Row]:
    """Yield what `call` makes of every job, in their order; processes are handed `batch` of them at a time."""
    if workers == 1:
        yield from map(call, jobs)
        return
    # Fresh processes: a fork would copy the locks of BLAS and Numba threads.
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
        yield from pool.map(call, jobs, chunksize=batch)
