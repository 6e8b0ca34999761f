"""Text as TOML writes it."""

from __future__ import annotations

import json


def toml_string(text: str) -> str:
    """Return a text in quotes, as a TOML file in UTF-8 holds it."""
    # TOML knows no surrogate pairs, and takes no delete character as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")
