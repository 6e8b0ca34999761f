"""That kernels are compiled is said once per process: here before any test, so that none of them finds it on stderr."""

from __future__ import annotations

import numba
import pytest

from steelyard.cli.console import say_if_compiling


@pytest.fixture(scope="session", autouse=True)
def _compiling_was_said() -> None:
    say_if_compiling()
    numba.njit(lambda x: x)(1)
