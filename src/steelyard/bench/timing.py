"""Times as the benches report them: CPU of the calling thread, warm, median of many, one BLAS thread."""

from __future__ import annotations

import os
import statistics
import sys
import time
from collections.abc import Callable

REPEATS = 20
_THREAD_VARIABLES = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS")


def one_blas_thread() -> bool:
    """Ask BLAS, OpenMP and Numba for one thread; return whether NumPy, not loaded yet, can still hear it."""
    for name in _THREAD_VARIABLES:
        os.environ[name] = "1"
    return "numpy" not in sys.modules


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
