"""Views that contradict what the others show: their pose is another image's, or the object lay elsewhere then.

A view that stands where it says measures the surface that all views give together, or something before it. Behind it
lies nothing but what a wrong pose puts there. So a few such views tell themselves from views that are all a little off,
of which each sees past a little.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from steelyard.findings import Finding, counted
from steelyard.shape.scans.patches import settled_patches
from steelyard.shape.scans.registration import Seen
from steelyard.shape.scans.scene import WINDOW, Scene
from steelyard.shape.scans.sight_lines import said

_STANDS_OUT = 4.0  # times the depth noise: what is higher is not the table
_CLEARLY = 0.004  # behind a point, beside the noise: a view that is a little off sees past edges by less [m]
_PAST, _AGREED = 0.2, 0.05  # of the object's surface that a view sees past: it contradicts the others; it agrees
_MOST = 0.75  # of the views agree where some of them are wrong in their poses, and not all in something else
_FEW = 30  # points of which a view says too little to judge it
_NAMED = 6  # views


def strangers(scene: Scene, seen: Seen) -> Any:
    """Return which of the views (V,) see past so much of the object's surface, as most show it, that they are wrong."""
    xyz, normal, support = settled_patches(scene, seen.model, WINDOW, 1)
    rows = (support[:, 0] >= scene.enough) & (xyz[:, 2] > _STANDS_OUT * scene.sigma)
    on, past = said(scene.images, xyz[rows], normal[rows], _CLEARLY, scene.noise).T
    share = past / np.maximum(on + past, 1)
    agreed = float(np.mean(share < _AGREED))
    return (share > _PAST) & (on + past >= _FEW) & (agreed >= _MOST)


def left_out(names: tuple[str, ...]) -> Finding:
    """Return the finding on views that were left out because they contradict the others."""
    named = ", ".join(names[:_NAMED]) + (", ..." if len(names) > _NAMED else "")
    text = (
        f"{counted(len(names), 'view')} ({named}) looked past what all others show of the object, and "
        f"{'was' if len(names) == 1 else 'were'} left out."
    )
    remedy = (
        "Check their rows in poses.csv: poses may be exchanged or of another moment. Or was the object moved meanwhile?"
    )
    return Finding("views-disagree", text, remedy)
