"""How much of a file is read: a few kB from a stranger may claim, or unpack to, many GB."""

from __future__ import annotations

from pathlib import Path

from steelyard.errors import BadFile

MOST_BYTES = 2 * 1024**3  # six hours of a log at 1 kHz, 80 million points


def require_bounded(path: Path, size: int, most: int | None = None) -> None:
    """Raise BadFile where reading would take more memory than `most`, MOST_BYTES if left out.

    size  [bytes] what would be unpacked, known before it is
    """
    most = MOST_BYTES if most is None else most
    if size > most:
        raise BadFile(
            f"{path}: holds {size / 1024**2:.0f} MiB, more than the {most // 1024**2} MiB that are read. "
            "Give fewer rows, points or views at once."
        )


def read_whole(path: Path) -> bytes:
    """Return the content of a file; raises BadFile where it cannot be read, is too large or a device."""
    try:
        if path.is_char_device():
            raise BadFile(f"{path}: this is a device, which has no end. Give a file.")
        require_bounded(path, path.stat().st_size)
        return path.read_bytes()
    except OSError as error:
        raise BadFile(f"{path}: cannot be read ({error.strerror}).") from None
