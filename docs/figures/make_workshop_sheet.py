"""Draw the sheet of the twenty workshop tools: python docs/figures/make_workshop_sheet.py [SEED].

With a seed it draws a random variant of each family to workshop-SEED.png.
Needs matplotlib: pip install 'steelyard[plot]'.
"""

from __future__ import annotations

import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from steelyard.workshop.catalogue import FAMILIES, build
from steelyard.workshop.finish import painted
from steelyard.workshop.tools import Tool

SIZE, FINER = (420, 300), 3
LIGHT = np.array([0.25, 0.6, 0.76]) / np.linalg.norm([0.25, 0.6, 0.76])
UPRIGHT = {"vise-clamp": (0, 2, 1), "c-clamp": (0, 1, 2), "measuring-tape": (0, 1, 2)}  # axes to the right, up, near


def main(seed: int | None) -> None:
    """Draw all tools, five in a row."""
    figure, axes = plt.subplots(4, 5, figsize=(15, 9.4), layout="constrained")
    for panel, name in zip(axes.ravel(), FAMILIES, strict=True):
        tool = build(name, seed)
        panel.imshow(picture(tool), interpolation="antialiased")
        panel.set_title(
            f"{name}\n{1e3 * tool.truth.mass:.0f} g, {len(tool.parts)} part{'s' * (len(tool.parts) > 1)}", fontsize=10
        )
        panel.axis("off")
    where = Path(__file__).parent / ("workshop.png" if seed is None else f"workshop-{seed}.png")
    figure.savefig(where, dpi=80)


def picture(tool: Tool) -> np.ndarray:
    """Return a shaded picture (H, W, 3) of the tool, the long side along the panel."""
    mesh = painted(tool)
    turn = view(mesh.vertices, UPRIGHT.get(tool.name))
    corners = mesh.corners @ turn.T
    corners -= 0.5 * (corners.reshape(-1, 3).min(0) + corners.reshape(-1, 3).max(0))
    wide, high = SIZE[0] * FINER, SIZE[1] * FINER
    extent = np.ptp(corners.reshape(-1, 3), axis=0)
    corners = corners * min(0.94 * wide / extent[0], 0.94 * high / extent[1]) * [1, -1, 1] + [wide / 2, high / 2, 0]
    image, depth, face = raster(corners, shaded(mesh.corners @ turn.T, mesh.rgb / 255.0), wide, high)
    part = np.where(face >= 0, mesh.part[face], -1)
    normal = normals(mesh.corners)
    edge, crease = np.zeros_like(depth, bool), np.zeros_like(depth, bool)
    for axis in (0, 1):
        near = np.roll(part, 1, axis) != part
        edge |= near | (np.abs(np.roll(depth, 1, axis) - depth) > 14 * FINER) & (part >= 0)
        crease |= (normal[face] * np.roll(normal[face], 1, axis)).sum(-1) < 0.75
    image[crease & (part >= 0)] *= 0.7
    image[edge] *= 0.35
    blocks = image.reshape(SIZE[1], FINER, SIZE[0], FINER, 3)
    return np.clip(blocks.mean((1, 3)), 0, 1)


def view(points: np.ndarray, upright: tuple[int, int, int] | None) -> np.ndarray:
    """Return the rotation that lays the longest side along x, the thinnest near the view, and tilts both a little."""
    axes = np.eye(3)[np.argsort(np.ptp(points, axis=0))[::-1] if upright is None else list(upright)]
    axes[2] *= np.sign(np.linalg.det(axes))
    a, b, c = np.radians([-32, 24, 16])
    about_x = np.array([[1, 0, 0], [0, np.cos(a), -np.sin(a)], [0, np.sin(a), np.cos(a)]])
    about_y = np.array([[np.cos(b), 0, np.sin(b)], [0, 1, 0], [-np.sin(b), 0, np.cos(b)]])
    about_z = np.array([[np.cos(c), -np.sin(c), 0], [np.sin(c), np.cos(c), 0], [0, 0, 1]])
    return about_z @ about_y @ about_x.T @ axes


def shaded(corners: np.ndarray, rgb: np.ndarray) -> np.ndarray:
    """Return colours (F, 3) under one lamp and a soft sky."""
    normal = normals(corners)
    lamp = np.clip(normal @ LIGHT, 0, 1)
    half_way = LIGHT + np.array([0, 0, 1])
    gloss = np.clip(normal @ (half_way / np.linalg.norm(half_way)), 0, 1) ** 24
    return rgb * (0.45 + 0.12 * normal[:, 1:2] + 0.55 * lamp[:, None]) + 0.15 * gloss[:, None]


def normals(corners: np.ndarray) -> np.ndarray:
    """Return outward unit normals (F, 3)."""
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    return normal / np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)


def raster(corners: np.ndarray, colour: np.ndarray, wide: int, high: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return image, depth and face number per pixel: a plain depth buffer."""
    image, depth = np.ones((high, wide, 3)), np.full((high, wide), -1e9)
    face = np.full((high, wide), -1)
    for number, (a, b, c) in enumerate(corners):
        low = np.maximum(np.floor(np.minimum(np.minimum(a, b), c)[:2]).astype(int), 0)
        top = np.minimum(np.ceil(np.maximum(np.maximum(a, b), c)[:2]).astype(int) + 1, [wide, high])
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        if area >= 0 or (top <= low).any():
            continue
        x, y = np.meshgrid(np.arange(low[0], top[0]) + 0.5, np.arange(low[1], top[1]) + 0.5)
        u = ((x - a[0]) * (c[1] - a[1]) - (y - a[1]) * (c[0] - a[0])) / area
        v = ((b[0] - a[0]) * (y - a[1]) - (b[1] - a[1]) * (x - a[0])) / area
        z = a[2] + u * (b[2] - a[2]) + v * (c[2] - a[2])
        window = np.s_[low[1] : top[1], low[0] : top[0]]
        seen = (u >= 0) & (v >= 0) & (u + v <= 1) & (z > depth[window])
        image[window][seen], depth[window][seen], face[window][seen] = colour[number], z[seen], number
    return image, depth, face


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else None)
