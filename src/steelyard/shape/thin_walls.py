"""What is said of a solid whose walls could not be told from its gaps."""

from __future__ import annotations

import numpy as np

from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.orient import Oriented

_WITHIN = 4.0  # standard deviations of noise that two layers of points must be apart to be told as two
_FACING = -0.5  # cosine between normals of two sides
_FEW_SEEN = 0.25  # of the points: scans with views from all sides show the colour of about half


def blurred_walls(cloud: Cloud, apart: float, doubt: float) -> Finding:
    """Return why inside and outside of points `apart` [mm] are hard to tell: few were seen, or else thin walls."""
    what = f"what should be 1 inside and 0 outside is blurred to {1 - doubt:.2f} inside."
    if cloud.seen is not None and (share := float(cloud.seen.mean())) < _FEW_SEEN:
        text = f"Cameras saw only {100 * share:.0f} % of the points, and the rest closes what is left: {what}"
        return Finding("thin-thickened", text, "Take more views, from all sides and heights.")
    text = f"Walls are too thin for points {apart:.2g} mm apart to tell them from gaps: {what}"
    return Finding.of("thin-thickened", text)


def thinner_than_seen(thickness: float, apart: float) -> Finding:
    """Return that walls `thickness` [mm] thick are lost in part between points `apart` [mm]."""
    text = f"Walls are about {thickness:.2g} mm thick, and points {apart:.2g} mm apart: some of what they hold is lost."
    return Finding.of("thin-thickened", text)


def within_noise(share: float, noise: float) -> Finding:
    """Return that walls or gaps at a share of the points are thinner than their noise [m] lets see."""
    text = f"Walls or gaps at {100 * share:.0f} % of the points are thinner than {_WITHIN:.0f} times their "
    return Finding.of("thin-thickened", f"{text}noise of {noise * 1e3:.2g} mm.")


def share_within_noise(surface: Oriented, noise: float) -> float:
    """Return the share of points with the other side of a wall or gap nearer than noise lets see."""
    facing = np.einsum("nd,nkd->nk", surface.normals, surface.normals[surface.sites.near.index]) < _FACING
    return float((facing & (surface.sites.near.distance < _WITHIN * noise)).any(1).mean())
