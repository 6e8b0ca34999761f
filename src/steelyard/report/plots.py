"""Small charts as inline SVG: residuals over time, and an interval with the truth on it.

Charts stretch with the page: places are per cent of the width, and curves lie in an inner picture that is stretched
while its lines keep their width; so text keeps its size on a phone.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.runs import runs
from steelyard.report.contents import Residuals
from steelyard.report.markup import Html, tag
from steelyard.tables.numbers import general, round_step

COLUMNS = 420
RUN = 6
_HEIGHT, _TOP, _BOTTOM = 190, 12, 24


def residual_plot(residuals: Residuals, values: Array, unit: str, title: str, rms: float | None = None) -> Html:
    """Return the three axes of values (N, 3) over time: lowest and highest of each column, and means as a line.

    rms  what is said of their size, where that is not the root mean square of `values` per axis
    """
    time = residuals.time
    start, length = float(time[0]), max(float(time[-1] - time[0]), 1e-9)
    column = np.clip(((time - start) / length * COLUMNS).astype(np.int64), 0, COLUMNS - 1)
    top = max(float(np.abs(values).max()), 1e-12)
    step = round_step(top)
    reach = step * np.ceil(top / step - 1e-9) * 1.06
    inner = tag(
        "svg", *_still_bands(residuals, start, length), *_curves(column, values, reach),
        x=0, y=_TOP, width="100%", height=_HEIGHT - _TOP - _BOTTOM,
        viewBox=f"0 0 {COLUMNS} 100", preserveAspectRatio="none",
    )  # fmt: skip
    each = [f" {general(r)} {unit}" if rms is None else "" for r in np.sqrt((values**2).mean(0))]
    named = [tag("li", tag("b", axis, class_=axis), said) for axis, said in zip("xyz", each, strict=True)]
    size = "rms" if rms is None else f"rms {general(rms)} {unit} per axis, unsmoothed"
    return tag(
        "figure",
        tag("figcaption", tag("h3", title),
            tag("ul", tag("li", size), *named, class_="key", aria_label="root mean square per axis")),
        tag(
            "svg", *_grid(step, reach, unit), inner, *_time_axis(start, length),
            width="100%", height=_HEIGHT, class_="plot", role="img",
            aria_label=f"{title}: residuals over time, at most {general(top)} {unit}",
        ),
    )  # fmt: skip


def _curves(column: Integers, values: Array, reach: float) -> list[Html]:
    """Return a band from lowest to highest of each column for every axis, and the means over it."""
    used, place = np.unique(column, return_inverse=True)
    low, high = np.full((len(used), 3), np.inf), np.full((len(used), 3), -np.inf)
    np.minimum.at(low, place, values)
    np.maximum.at(high, place, values)
    x = used + 0.5

    def y(v: Array) -> Array:
        return np.asarray(50 - 50 * v / reach)

    bands, means = [], []
    for k, axis in enumerate("xyz"):
        edge = np.concatenate([np.stack([x, y(high[:, k])], 1), np.stack([x, y(low[:, k])], 1)[::-1]])
        bands.append(tag("polygon", points=_points(edge), class_=f"band {axis}"))
        middle, mean = _means(column, values[:, k])
        means.append(tag("polyline", points=_points(np.stack([middle, y(mean)], 1)), class_=f"curve {axis}"))
    return bands + means


def _means(column: Integers, values: Array) -> tuple[Array, Array]:
    """Return place and mean of runs of RUN columns: what noise hides and a wrong model leaves."""
    run = column // RUN
    count = np.bincount(run)
    used = np.flatnonzero(count)
    return np.asarray(RUN * (used + 0.5)), np.asarray(np.bincount(run, values)[used] / count[used])


def _still_bands(residuals: Residuals, start: float, length: float) -> list[Html]:
    """Return a shade for every stretch of rows at rest."""
    first, stop = runs(residuals.still).T
    x = (residuals.time - start) / length * COLUMNS
    shades: list[list[float]] = []
    for a, b in zip(x[first].tolist(), x[stop - 1].tolist(), strict=True):
        if not shades or a > shades[-1][1] + 0.5:
            shades.append([a, b])
        else:
            shades[-1][1] = b
    return [
        tag("rect", x=f"{a:.2f}", y=0, width=f"{max(b - a, 0.3):.2f}", height=100, class_="rest") for a, b in shades
    ]


def _grid(step: float, reach: float, unit: str) -> list[Html]:
    """Return lines and numbers of the upright axis."""
    inner = _HEIGHT - _TOP - _BOTTOM
    rows = []
    most = int(np.floor(reach / step))
    for k in range(-most, most + 1):
        y = _TOP + inner * (0.5 - 0.5 * k * step / reach)
        rows.append(tag("line", x1=0, x2="100%", y1=f"{y:.1f}", y2=f"{y:.1f}", class_="grid" if k else "grid zero"))
        if k:
            said = f"{'+' if k > 0 else '−'}{abs(k) * step:g} {unit}"
            rows.append(tag("text", said, x=0, y=f"{y - 4:.1f}", class_="tick"))
    return rows


def _time_axis(start: float, length: float) -> list[Html]:
    """Return the numbers of the time axis, about six of them."""
    step = round_step(length / 3)
    marks = np.arange(np.ceil(start / step), np.floor((start + length) / step) + 1) * step
    out = []
    for t in marks.tolist():
        share = 100 * (t - start) / length
        anchor = "start" if share < 4 else "end" if share > 96 else "middle"
        said = f"{t:g} s" if t == marks[-1] else f"{t:g}"
        out.append(tag("text", said, x=f"{share:.2f}%", y=_HEIGHT - 6, text_anchor=anchor, class_="tick"))
    return out


def _points(places: Array) -> Html:
    return Html(" ".join(f"{x:.4g},{y:.3g}" for x, y in places.tolist()))


def interval(value: float, std: float, truth: float | None) -> Html:
    """Return a bar of two standard deviations about the value and the truth as a mark on it, nothing without truth."""
    if not std > 0 or truth is None:
        return Html("")
    away = abs(truth - value)
    reach = max(3.2 * std, 1.15 * away)

    def x(v: float) -> str:
        return f"{50 + 48 * (v - value) / reach:.2f}%"

    parts = [
        tag("line", x1="2%", x2="98%", y1=9, y2=9, class_="rail"),
        tag("line", x1=x(value - 2 * std), x2=x(value + 2 * std), y1=9, y2=9, class_="bar"),
        tag("circle", cx="50%", cy=9, r=4, class_="dot"),
        tag("line", x1=x(truth), x2=x(truth), y1=1, y2=17, class_="truth"),
    ]
    return tag(
        "svg", *parts, width="100%", height=18, class_="interval", role="img",
        aria_label=f"two standard deviations either side; the truth lies {general(away / std, 2)} of them away",
    )  # fmt: skip


def interval_signs() -> list[Html]:
    """Return what the signs of an interval mean: each sign, and a word beside it."""
    signs = {
        "the answer": (10, tag("circle", cx=5, cy=9, r=4, class_="dot")),
        "two standard deviations either side": (26, tag("line", x1=3, x2=23, y1=9, y2=9, class_="bar")),
        "the truth": (6, tag("line", x1=3, x2=3, y1=1, y2=17, class_="truth")),
    }
    return [
        tag("span", tag("svg", sign, width=width, height=18, class_="interval", aria_hidden="true"), " ", said)
        for said, (width, sign) in signs.items()
    ]


def swatch(colour: str) -> Html:
    """Return a square of a colour, beside the name of what is drawn in it."""
    square = tag("rect", width=12, height=12, rx=3, fill=colour)
    return tag("svg", square, width=12, height=12, class_="swatch", aria_hidden="true")


def share_bar(share: float, colour: str) -> Html:
    """Return a thin bar of a colour that fills `share` (0..1) of its cell."""
    width = f"{100 * min(max(share, 0.0), 1.0):.1f}%"
    return tag(
        "svg", tag("rect", width="100%", height=5, rx=2.5, class_="rail"),
        tag("rect", width=width, height=5, rx=2.5, fill=colour),
        width="100%", height=5, class_="share", aria_hidden="true",
    )  # fmt: skip
