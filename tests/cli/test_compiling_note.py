"""It is said once that kernels are compiled, on a terminal and elsewhere, and only when one is."""

from __future__ import annotations

import importlib.util
import sys
from pathlib import Path

import pytest

from steelyard.cli import console

NOTE = "Compiling numerical kernels, each the first time it is used (up to some minutes) ...\n"
KERNEL = "import numba\n\n@numba.njit(cache=True)\ndef {}(x):\n    return x + 1\n"


def call(path: Path, name: str) -> None:
    """Call the kernel of a module that is loaded anew, from its cache where there is one."""
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if spec is None or spec.loader is None:
        pytest.fail("no module")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    assert getattr(module, name)(1) == 2


@pytest.mark.parametrize("terminal", [True, False])
def test_said_once_when_a_kernel_is_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], terminal: bool
) -> None:
    monkeypatch.setattr(sys.stderr, "isatty", lambda: terminal)
    for name in ("one", "two"):
        (tmp_path / f"{name}.py").write_text(KERNEL.format(name))
    call(tmp_path / "one.py", "one")
    console.say_if_compiling.cache_clear()
    console.say_if_compiling()
    call(tmp_path / "one.py", "one")
    assert capsys.readouterr().err == ""
    call(tmp_path / "two.py", "two")
    (tmp_path / "three.py").write_text(KERNEL.format("three"))
    call(tmp_path / "three.py", "three")
    assert capsys.readouterr() == ("", NOTE)
