"""A table that is not flat, such as a cloth with folds: what lies on its crests is closed down to its mean plane."""

from __future__ import annotations

import numpy as np

from steelyard.findings import Finding
from steelyard.shape.scans.scene import Scene
from steelyard.shape.scans.underside import Underside
from steelyard.shape.scans.view_planes import INCIDENCE

_UNEVEN = 0.725  # times the depth noise: views that spread less have a table that is rougher than their noise
_CREST = 3.0  # times the roughness: what the underside is off by. Of four bodies on six cloths 2 to 4, of a mug up to 7


def uneven(scene: Scene, bottom: Underside, disagree: float) -> tuple[tuple[Finding, ...], float]:
    """Return what is said of a table that is rougher than depth is noisy, and what it adds to the volume's std [m^3].

    disagree  spread of the views about the object, in what the table seems to leave as depth noise
    """
    if disagree >= _UNEVEN:
        return (), 0.0
    rough = INCIDENCE * scene.sigma * float(np.sqrt(1 - disagree**2))
    text = (
        f"The table is not flat: views leave {1e3 * scene.sigma:.2g} mm (rms) about its plane, but spread "
        f"{1e3 * scene.sigma * disagree:.2g} mm about the object. The underside is closed on that plane, some of the "
        "roughness too high or too low, which the standard deviation of the volume holds."
    )
    foot = float(bottom.under.sum()) * bottom.grid.pitch**2
    return (Finding.of("table-uneven", text),), _CREST * rough * foot
