"""A text table, also gzipped: its first lines, and its rows in blocks; what is not text is refused."""

from __future__ import annotations

import codecs
import gzip
import re
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, cast

from steelyard.errors import BadFile

_HEAD = 1 << 16
_LONGEST_HEAD = 1 << 24
_COMMENTS = re.compile(rb"(?:\xef\xbb\xbf)?(?:[ \t]*+(?:#[^\r\n]*+)?(?:\r\n?|\n|\Z))*+")
_BLOCK = 1 << 23
_LONGEST_LINE = 1 << 20
_FREE, _DENSEST = 1 << 26, 100  # tables pack to a third or a tenth; a few kB of other texts become many GB
_BOM = b"\xef\xbb\xbf"
_CONTROL = re.compile(rb"[\x01-\x08\x0e-\x1f\x7f]")


def _open(path: Path) -> BinaryIO:
    if path.suffix.lower() == ".gz":
        return cast(BinaryIO, gzip.open(path, "rb"))
    return path.open("rb")


def _read(path: Path, stream: BinaryIO, size: int) -> bytes:
    try:
        return stream.read(size)
    except (OSError, EOFError, zlib.error) as error:
        raise BadFile(f"{path}: cannot be read ({error}).") from None


def head_lines(path: Path) -> list[str]:
    """Return the complete lines of the first 64 kB, of more where those are comments; raises BadFile when not text."""
    with _open(path) as stream:
        head = _read(path, stream, _HEAD)
        while len(head) < _LONGEST_HEAD and len(head) % _HEAD == 0 and _COMMENTS.fullmatch(head):
            more = _read(path, stream, len(head))
            if not more:
                break
            head += more
    _require_text(path, head)
    text = decoded(head.removeprefix(_BOM)).replace("\r\n", "\n").replace("\r", "\n")
    if head and len(head) % _HEAD == 0:
        text = text[: text.rfind("\n") + 1]
        if not text:
            raise BadFile(f"{path}: expected a table with one row per line; found no line end in the first 64 kB.")
    return text.split("\n")


def decoded(text: bytes) -> str:
    """Return the start of a text, which may end within a character: UTF-8, or what Windows wrote before it."""
    try:
        return codecs.getincrementaldecoder("utf-8")().decode(text)
    except UnicodeDecodeError:
        return text.decode("cp1252", "replace")


def _require_text(path: Path, block: bytes) -> None:
    if block.startswith((b"\xff\xfe", b"\xfe\xff")) or _every_other_is_zero(block[:_HEAD]):
        raise BadFile(f"{path}: the text is in UTF-16. Save it in UTF-8.")
    if b"\0" in block or _CONTROL.search(block, 0, _HEAD):
        raise BadFile(f"{path}: expected a text table; found binary data. Readable are text tables, .npz and .parquet.")


def _every_other_is_zero(block: bytes) -> bool:
    """Whether a text has two bytes per character, one of them zero: UTF-16 without its mark."""
    return any(
        len(zeros) > 1 and not zeros.strip(b"\0") and b"\0" not in text and not _CONTROL.search(text)
        for zeros, text in ((block[1::2], block[::2]), (block[::2], block[1::2]))
    )


def blocks(path: Path, skip: int) -> Iterator[str]:
    """Yield the text below the header, about 8 MB at a time, cut at line ends."""
    most = max(_FREE, _DENSEST * path.stat().st_size)
    with _open(path) as stream:
        rest = _read(path, stream, _BLOCK)
        unpacked = len(rest)
        rest = _below(rest.removeprefix(_BOM), skip)
        while True:
            more = _read(path, stream, _BLOCK)
            unpacked += len(more)
            if unpacked > most:
                raise BadFile(
                    f"{path}: unpacks to more than {_DENSEST} times its size. Unpack it and look at it first."
                )
            block = rest + more
            _require_text(path, block)
            cut = block.rfind(b"\n") + 1 if more else len(block)
            if more and len(block) - cut > _LONGEST_LINE:
                raise BadFile(f"{path}: a line longer than {_LONGEST_LINE >> 20} MB is not a row of a table.")
            if cut:
                yield block[:cut].decode("latin-1").replace("\r\n", "\n").replace("\r", "\n")
            rest = block[cut:]
            if not more:
                return


def _below(block: bytes, skip: int) -> bytes:
    for _ in range(skip):
        newline, carriage = block.find(b"\n"), block.find(b"\r")
        at = newline if newline >= 0 else carriage
        block = block[at + 1 :] if at >= 0 else b""
    return block
