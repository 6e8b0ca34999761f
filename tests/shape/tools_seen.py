"""Workshop tools on a table as cameras see them, and the scans that this gives, made once for all tests."""

from __future__ import annotations

from functools import cache

import numpy as np

from steelyard.shape.carving import carved
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.volume import enclose
from steelyard.simulate.scanning import Scanned, scan_mesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build
from steelyard.workshop.finish import painted

HAND_EYE = Pose(Rotation.exp(np.radians([0.6, -0.8, 0.3])), np.array([0.003, -0.002, 0.003]))


@cache
def seen(tool: str = "pliers") -> Scanned:
    return scan_mesh(painted(build(tool)), 0, count=36)


@cache
def right(tool: str = "pliers") -> Scan:
    """Return the scan from poses that are right."""
    return fuse(seen(tool).views)


@cache
def askew() -> Scan:
    """Return the scan of the pliers with a camera that sits `HAND_EYE` from where its pose at the wrist says."""
    views = seen().views
    return fuse(views.posed(views.X_WC @ HAND_EYE))


def volume(scan: Scan) -> float:
    return carved(enclose(scan.cloud), scan.space).mesh.volume


@cache
def right_volume(tool: str = "pliers") -> float:
    return volume(right(tool))
