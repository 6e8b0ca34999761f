"""Files and folders that appear complete or not at all."""

from __future__ import annotations

import contextlib
import os
import shutil
from collections.abc import Iterator
from pathlib import Path

from steelyard.errors import BadFile


def write_text(path: Path, text: str) -> None:
    """Write a text file, complete or not at all; raises BadFile."""
    write_bytes(path, text.encode())


def write_bytes(path: Path, content: bytes) -> None:
    """Write a file by way of a temporary one beside it; raises BadFile where that is not possible."""
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        temporary.write_bytes(content)
        temporary.replace(path)
    except OSError as error:
        raise BadFile(f"{path}: cannot be written ({error.strerror}).") from None
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink(missing_ok=True)


@contextlib.contextmanager
def whole_folder(folder: Path) -> Iterator[Path]:
    """Give an empty folder to write into; at the end what it holds goes into `folder`, after an error nothing.

    Files of the same names are replaced; all others in `folder` stay. Raises BadFile where that is not possible, and
    what the block raises.
    """
    missing = [path for path in (folder, *folder.parents) if not path.exists()]
    temporary = folder / f".{os.getpid()}.part"
    try:
        temporary.mkdir(parents=True)
        yield temporary
        _move(temporary, folder)
    except OSError as error:
        raise BadFile(f"{folder}: cannot be written ({error.strerror}).") from None
    finally:
        shutil.rmtree(temporary, ignore_errors=True)
        for path in missing:
            with contextlib.suppress(OSError):
                path.rmdir()  # where the block came to nothing: a folder that holds a file is kept


def _move(temporary: Path, folder: Path) -> None:
    """Move the files of one folder into another, those deeper inside first; raises BadFile before the first."""
    written = sorted((path for path in temporary.rglob("*") if path.is_file()), key=lambda p: (-len(p.parts), p))
    goals = [folder / path.relative_to(temporary) for path in written]
    for goal in goals:
        if goal.is_dir():
            raise BadFile(f"{goal}: cannot be written (a folder has this name).")
        goal.parent.mkdir(parents=True, exist_ok=True)
    for path, goal in zip(written, goals, strict=True):
        path.replace(goal)
