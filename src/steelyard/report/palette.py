"""Colours: one per part that tell apart, a scale for density, and their names in markup."""

from __future__ import annotations

import colorsys

import numpy as np

from steelyard.check import Array

# Brass, steel, verdigris, oxide, and on: chosen to differ in lightness as well as in hue.
_PARTS = (
    (214, 158, 46), (58, 117, 176), (74, 158, 120), (190, 82, 66), (126, 104, 178),
    (86, 178, 190), (216, 128, 168), (140, 146, 70), (122, 98, 82), (160, 190, 110),
)  # fmt: skip
# From light to dense: viridis at five places.
_SCALE = np.array([[253, 231, 37], [94, 201, 98], [33, 145, 140], [59, 82, 139], [68, 1, 84]], float)


def part_colour(number: int) -> tuple[int, int, int]:
    """Return the colour of the part that is `number`-th in line; beyond the list by the golden angle."""
    if number < len(_PARTS):
        return _PARTS[number]
    red, green, blue = colorsys.hls_to_rgb((0.11 + 0.618034 * number) % 1.0, 0.52, 0.42)
    return round(255 * red), round(255 * green), round(255 * blue)


def density_colours(density: Array) -> list[tuple[int, int, int]]:
    """Return a colour for each density (P,), on a logarithmic scale from the lowest to the highest."""
    logs = np.log(np.maximum(density, 1e-6))
    low, high = logs.min(initial=np.inf), logs.max(initial=-np.inf)
    place = (logs - low) / (high - low) * (len(_SCALE) - 1) if high - low > 1e-9 else np.full(len(logs), 2.0)
    values = [np.interp(place, range(len(_SCALE)), _SCALE[:, k]) for k in range(3)]
    return [(round(r), round(g), round(b)) for r, g, b in np.stack(values, axis=1).tolist()]


def scale_stops() -> list[tuple[float, str]]:
    """Return place (0..1) and colour of the stops of the density scale."""
    stops = [hexadecimal((int(r), int(g), int(b))) for r, g, b in _SCALE.tolist()]
    return [(k / (len(stops) - 1), colour) for k, colour in enumerate(stops)]


def hexadecimal(colour: tuple[int, int, int]) -> str:
    """Return #rrggbb."""
    return "#{:02x}{:02x}{:02x}".format(*colour)
