"""`python -m steelyard` is the same command."""

from __future__ import annotations

import subprocess
import sys


def test_python_dash_m_is_the_command() -> None:
    done = subprocess.run([sys.executable, "-m", "steelyard", "--help"], capture_output=True, text=True, check=False)
    assert done.returncode == 0
    assert done.stdout.startswith("Usage: ")
    assert "identify" in done.stdout
