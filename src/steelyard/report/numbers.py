"""A measured number in HTML: value, ± and unit, which no line break parts."""

from __future__ import annotations

from steelyard.report.markup import Html, tag
from steelyard.tables.numbers import fixed, places_of, spread

_THIN, _BOUND = "\u202f", "\u00a0"  # no line breaks at either


def measured(value: float, std: float, unit: str) -> Html:
    """Return value ± std with the unit."""
    bar = tag("span", f"{_THIN}±{_THIN}{spread(std)}", class_="pm") if std > 0 else ""
    bound = f"{_BOUND}{unit}".replace(" ", _BOUND)
    return tag(
        "span", tag("span", fixed(value, places_of(value, std)), class_="v"), bar, tag("span", bound, class_="u"),
        class_="q",
    )  # fmt: skip
