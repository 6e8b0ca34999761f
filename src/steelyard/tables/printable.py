"""Text that only prints: names out of files may hold what moves a cursor, turns the reading or is no character."""

from __future__ import annotations

import unicodedata

REPLACEMENT = "\ufffd"


def printable(text: str) -> str:
    """Return a text with every character that prints nothing replaced; blanks, tabs and line ends stay."""
    if text.isprintable():
        return text
    return "".join(REPLACEMENT if _prints_nothing(c) else c for c in text)


def _prints_nothing(c: str) -> bool:
    """Whether a character is a control, a turn of direction or no character at all."""
    return unicodedata.category(c).startswith("C") and c not in "\n\t"
