"""The parts as a flat picture, for browsers without WebGL, for print, and before the script runs."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.report.drawing import Frame, placed
from steelyard.report.markup import Html, joined, tag
from steelyard.report.palette import hexadecimal
from steelyard.report.scene import Scene
from steelyard.report.surfaces import thinned
from steelyard.spatial import Rotation, area_vectors, unit_vectors

MOST_TRIANGLES = 1600
_WIDTH, _HEIGHT, _MARGIN = 960.0, 540.0, 40.0
_LIGHT = np.array([-0.45, 0.7, 0.55]) / np.linalg.norm([-0.45, 0.7, 0.55])


def turned_view(frame: Frame) -> Array:
    """Return the rows right, up, toward (3, 3) of the first look: a little from the right and from above."""
    about_up, about_right = Rotation.exp(np.deg2rad([[0.0, -28.0, 0.0], [22.0, 0.0, 0.0]])).matrix
    return np.asarray(about_right @ about_up @ frame.view)


def picture(scene: Scene, colours: dict[int, tuple[int, int, int]], com: Array | None) -> Html:
    """Return the parts as an SVG: triangles from far to near, lit from above left; `com` (3,) [m] as a mark."""
    view = turned_view(Frame.of(scene))
    corners, fill = _lit(scene, colours, view)
    if not len(corners):
        return Html("")
    low, high = corners[..., :2].min((0, 1)), corners[..., :2].max((0, 1))
    scale = float(np.min((np.array([_WIDTH, _HEIGHT]) - 2 * _MARGIN) / np.maximum(high - low, 1e-12)))
    centre = (low + high) / 2

    def on_paper(points: Array) -> Array:
        return np.asarray((points[..., :2] - centre) * scale * [1, -1] + [_WIDTH / 2, _HEIGHT / 2])

    order = np.argsort(corners[..., 2].mean(1), kind="stable")
    flat = np.round(on_paper(corners), 1).reshape(-1, 6)[order]
    paint = [hexadecimal((round(r), round(g), round(b))) for r, g, b in fill[order].tolist()]
    shapes = [
        Html(f'<path d="M{a:g} {b:g}L{c:g} {d:g} {e:g} {f:g}Z" fill="{p}" stroke="{p}"/>')
        for (a, b, c, d, e, f), p in zip(flat.tolist(), paint, strict=True)
    ]
    mark = joined() if com is None else _mark(*on_paper(view @ com).tolist())
    return tag(
        "svg", tag("g", *shapes, stroke_width=0.6, stroke_linejoin="round"), mark,
        viewBox=f"0 0 {_WIDTH:g} {_HEIGHT:g}", role="img", aria_label="The parts of the object", class_="still",
    )  # fmt: skip


def _lit(scene: Scene, colours: dict[int, tuple[int, int, int]], view: Array) -> tuple[Array, Array]:
    """Return the triangles (F, 3, 3) that face the viewer, in the axes of `view` (3, 3), and their colours (F, 3)."""
    bodies = placed(scene)
    total = sum(len(b.triangles) for b in bodies)
    faces, fills = [], []
    for body in bodies:
        most = max(int(MOST_TRIANGLES * len(body.triangles) / max(total, 1)), 12)
        v, t = thinned(body.vertices, body.triangles, most)
        corners = v[t] @ view.T
        unit = unit_vectors(area_vectors(corners))
        near = unit[:, 2] > 0
        light = 0.42 + 0.62 * np.maximum(unit @ _LIGHT, 0)
        faces.append(corners[near])
        fills.append(np.clip(light[near, None] * np.array(colours[body.label]), 0, 255))
    return np.concatenate(faces), np.concatenate(fills)


def _mark(x: float, y: float) -> Html:
    """Return the sign of a centre of mass."""
    return joined(
        tag("circle", cx=f"{x:.1f}", cy=f"{y:.1f}", r=9, fill="#fff", stroke="#111", stroke_width=2),
        Html(f'<path d="M{x:.1f} {y:.1f}v-9a9 9 0 0 1 9 9zv9a9 9 0 0 1-9-9z" fill="#111"/>'),
    )
