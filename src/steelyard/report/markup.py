"""Markup made of tags: every string becomes text unless it is markup already, so no name can turn into a tag."""

from __future__ import annotations

import html
import json
from typing import Any

from steelyard.tables.numbers import fixed, places_of, spread
from steelyard.tables.printable import printable

_LONGEST = 2000  # characters of one text; what is longer was not written for people
_THIN, _BOUND = "\u202f", "\u00a0"  # no line breaks at either
_VOID = {"input", "meta", "br", "line", "rect", "circle", "path", "polygon"}
# Inside <script> a "<" could end the script, and two line ends are none in JSON.
_IN_SCRIPT = {ord(c): f"\\u{ord(c):04x}" for c in "<>&\u2028\u2029"}


class Html(str):
    """Text that is markup already."""

    __slots__ = ()


def text(value: object) -> Html:
    """Return a value as harmless text: markup escaped, characters that print nothing replaced, length bounded."""
    if isinstance(value, Html):
        return value
    words = str(value)
    if len(words) > _LONGEST:
        words = words[:_LONGEST] + " …"
    return Html(html.escape(printable(words)))


def tag(name: str, *children: object, **attributes: object) -> Html:
    """Return `<name attributes>children</name>`.

    Of attributes, None and False are left out, True stands alone, `_` in a name becomes `-`, and `class_` is class.
    """
    said = []
    for key, value in attributes.items():
        key = key.rstrip("_").replace("_", "-")
        if value is True:
            said.append(f" {key}")
        elif value is not None and value is not False:
            said.append(f' {key}="{text(value)}"')
    if name in _VOID and not children:
        return Html(f"<{name}{''.join(said)}/>")
    return Html(f"<{name}{''.join(said)}>{''.join(map(text, children))}</{name}>")


def joined(*children: object) -> Html:
    """Return the children one after another."""
    return Html("".join(map(text, children)))


def script_json(value: Any) -> Html:
    """Return a value as JSON that nothing inside can break out of its script element."""
    return Html(json.dumps(value, separators=(",", ":"), allow_nan=False).translate(_IN_SCRIPT))


def measured(value: float, std: float, unit: str) -> Html:
    """Return a measured number, value ± std with the unit, which no line break parts."""
    bar = tag("span", f"{_THIN}±{_THIN}{spread(std)}", class_="pm") if std > 0 else ""
    bound = f"{_BOUND}{unit}".replace(" ", _BOUND)
    return tag(
        "span", tag("span", fixed(value, places_of(value, std)), class_="v"), bar, tag("span", bound, class_="u"),
        class_="q",
    )  # fmt: skip
