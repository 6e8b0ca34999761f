"""How titles and codes stand out where a table is shown; in plain text they do not."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple


def _as_it_is(text: str) -> str:
    return text


class Marks(NamedTuple):
    """What makes a title and the code of a finding stand out."""

    title: Callable[[str], str] = _as_it_is
    code: Callable[[str], str] = _as_it_is


PLAIN = Marks()
