"""What every test shares: a fixed Hypothesis profile (same tree, same verdict) and where the data are."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from hypothesis import settings

from steelyard.threads import one_blas_thread

one_blas_thread()
settings.register_profile("steelyard", derandomize=True, max_examples=25, deadline=None, database=None)
settings.load_profile("steelyard")

ROOT = Path(__file__).resolve().parents[1]


@pytest.fixture(scope="session")
def data_dir() -> Path:
    """Folder of real recordings: $STEELYARD_DATA, or shared/data beside the project; else skips."""
    for folder in (os.environ.get("STEELYARD_DATA"), ROOT.parent / "shared" / "data"):
        if folder and Path(folder).is_dir():
            return Path(folder)
    pytest.skip("no real recordings here: set STEELYARD_DATA to their folder")


@pytest.fixture(scope="session")
def examples_dir() -> Path:
    """The example descriptions."""
    return ROOT / "examples"
