"""Times as the benches report them: CPU of the calling thread, warm, median of many, one BLAS thread."""

from __future__ import annotations

import os
import statistics
import time
from collections.abc import Callable

from steelyard.threads import BLAS

REPEATS = 20


def one_thread() -> None:
    """Ask BLAS, OpenMP and Numba for one thread, whatever else was asked for; BLAS hears it until NumPy is loaded."""
    for name in (*BLAS, "NUMBA_NUM_THREADS"):
        os.environ[name] = "1"


def thread_ms(call: Callable[[], object], repeats: int = REPEATS, warm: int = 2) -> float:
    """Return the median CPU time [ms] of `call` on this thread over `repeats` calls, after `warm` untimed."""
    for _ in range(warm):
        call()
    times = []
    for _ in range(repeats):
        start = time.thread_time()
        call()
        times.append(time.thread_time() - start)
    return 1000 * statistics.median(times)
