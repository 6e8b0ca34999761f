"""Files that appear complete or not at all."""

from __future__ import annotations

import contextlib
import os
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
