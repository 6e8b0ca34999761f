"""How many threads BLAS takes: one, unless the caller's environment says otherwise.

Products over a log are long and thin: a second thread mostly waits for the first, and where the machine has other work
to do each product waits for both. On two busy cores a log of a minute took 24 s of CPU with two, and 1.2 s with one.
"""

from __future__ import annotations

import os

BLAS = ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS")


def one_blas_thread() -> None:
    """Ask BLAS for one thread where nothing else was asked for; it hears this until NumPy is loaded."""
    for name in BLAS:
        os.environ.setdefault(name, "1")
