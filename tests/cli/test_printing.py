"""What is printed whatever the names are and wherever it goes; and no work for an answer that has no place."""

from __future__ import annotations

import io
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import steelyard as sy
from steelyard.cli.console import STYLED, tell
from steelyard.cli.main import main
from steelyard.io import write_result
from steelyard.spatial import Rotation
from steelyard.tables.printable import printable

TURNS = Rotation.exp(2 * np.random.default_rng(0).normal(size=(24, 3)))


class Screen(io.StringIO):
    """A terminal that knows every letter."""

    def isatty(self) -> bool:
        return True


def log(path: Path) -> Path:
    """Still poses of a kilogram in a bare table."""
    force = TURNS.inverse().apply(np.tile([0, 0, 9.81], (24, 1)))
    torque = np.cross([0, 0.01, 0.05], force)
    table = np.column_stack([force, torque, TURNS.quaternion_wxyz()]) + 1e-4 * np.sin(np.arange(240)).reshape(24, 10)
    np.savetxt(path, table, delimiter=",", header="fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", comments="", fmt="%.9g")
    return path


def on_a_terminal(monkeypatch: pytest.MonkeyPatch, *arguments: object) -> str:
    screen = Screen()
    monkeypatch.setattr(sys, "stdout", screen)
    main_until_its_end(*arguments)
    return screen.getvalue()


def main_until_its_end(*arguments: object) -> int:
    with pytest.raises(SystemExit) as end:
        main([str(a) for a in arguments])
    return int(end.value.code or 0)


@pytest.mark.parametrize("hostile", ["\x1b", "\x9b", "\x07", "\r", "\x00", "\u202e", "\u2066", "\ufeff", "\udce9"])
def test_only_what_prints_is_printed(hostile: str) -> None:
    assert printable(f"ä {hostile}[2J\n\t±日") == "ä \ufffd[2J\n\t±日"


def test_a_name_does_not_move_the_cursor_and_styles_stay(monkeypatch: pytest.MonkeyPatch) -> None:
    screen = Screen()
    monkeypatch.setattr(sys, "stdout", screen)
    tell(STYLED.title("a\x1b[2Jb") + " " + STYLED.code("c"))
    assert screen.getvalue() == "\x1b[1ma\ufffd[2Jb\x1b[0m \x1b[33m\x1b[1mc\x1b[0m\n"


def test_a_table_on_a_terminal_has_styles_unless_they_are_not_wanted(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.delenv("NO_COLOR", raising=False)
    path = log(tmp_path / "log.csv")
    assert on_a_terminal(monkeypatch, "identify", path).startswith("\x1b[1m")
    monkeypatch.setenv("NO_COLOR", "1")
    assert "\x1b" not in on_a_terminal(monkeypatch, "identify", path)


@pytest.mark.parametrize(("name", "shown"), [("日本.csv", "??.csv"), (os.fsdecode(b"caf\xe9.csv"), "caf?.csv")])
def test_letters_that_a_terminal_does_not_have_end_nothing(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, name: str, shown: str
) -> None:
    raw = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(raw, encoding="latin-1", write_through=True))
    assert main_until_its_end("identify", log(tmp_path / name)) == 0
    assert shown in raw.getvalue().decode("latin-1").splitlines()[0]


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="no device here that is always full")
def test_a_full_disk_is_one_line(tmp_path: Path) -> None:
    one = tmp_path / "one.json"
    write_result(sy.identify(log(tmp_path / "log.csv")), one)
    with Path("/dev/full").open("w") as full:
        run = subprocess.run(
            [Path(sys.executable).with_name("steelyard"), "compare", one, one],
            stdout=full, stderr=subprocess.PIPE, text=True, check=False,
        )  # fmt: skip
    assert run.returncode == 2
    assert run.stderr == "steelyard: standard output: No space left on device.\n"


@pytest.mark.parametrize("verb", ["identify", "team", "report", "segment", "scan"])
def test_no_work_is_done_for_what_cannot_be_written(
    verb: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    suffix = {"report": ".html", "segment": ".npz", "scan": ".ply"}.get(verb, ".json")
    path = tmp_path / f"out{suffix}"
    path.mkdir()
    assert main_until_its_end(verb, tmp_path / "missing", "-o", path) == 2
    assert capsys.readouterr().err == f"steelyard: {path}: cannot be written: a folder has this name.\n"
    path.rmdir()
    monkeypatch.setattr(os, "access", lambda where, mode: False)
    assert main_until_its_end(verb, tmp_path / "missing", "-o", path) == 2
    assert capsys.readouterr().err == (
        f"steelyard: {path}: cannot be written: you may not write into the folder {tmp_path}.\n"
    )


@pytest.mark.parametrize("story", ["held-object", "team"])
def test_the_demo_begins_nothing_that_it_cannot_keep(
    story: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    keep = tmp_path / "a file"
    keep.touch()
    assert main_until_its_end("demo", story, "--keep", keep) == 2
    assert (
        capsys.readouterr().err == f"steelyard: {keep}: this is a file; give a folder to write the made files into.\n"
    )
    assert list(tmp_path.iterdir()) == [keep]
