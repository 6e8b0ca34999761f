"""What an object looks like: views or a cloud become a closed solid in homogeneous parts.

views -> fuse -> cloud -> enclose -> solid -> segment -> parts, and the cuts that a log may still choose from
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding
from steelyard.identify.masses.shape_error import MEASURED, ShapeError
from steelyard.parts.parts import Parts
from steelyard.parts.segment import segment
from steelyard.parts.segmentation import Segmentation
from steelyard.shape import carving
from steelyard.shape.cloud import Cloud
from steelyard.shape.known_space import Kept, KeptSpace
from steelyard.shape.scan import Scan, fuse
from steelyard.shape.solid import Solid
from steelyard.shape.tets import TetMesh
from steelyard.shape.views import Views
from steelyard.shape.volume import enclose

# A finer cut than this is not offered to a log: ten numbers cannot tell so many masses.
MOST_PARTS = 16
# What shape and colour say never rules out what the forces ask for.
LEAST_SURE = 0.03
# Relative error of second moments over that of the volume: 1.2 where lengths err along all three axes, 2 where along
# one only. With this, 95 % of the intervals of diagonal entries from scans of made tools hold the truth.
STRETCH = 1.5
# The same over the share of the volume that cells carry across borders between parts.
BORDER = 0.6
_CHANGED = "points of the cloud are not those that its scan wrote: where its views looked past the object was not used"


@dataclass(frozen=True, eq=False)
class Shape:
    """A solid in parts, in the frame of the scan O.

    solid         the closed volume
    segmentation  its parts as shape and colour alone say
    scan          what its views said: their fusion, or what the cloud that was written of it keeps; None where the
                  cloud comes from elsewhere
    asked         whether the number of parts was asked for, so that a log is offered no other
    notes         what was done to the points as they were given
    """

    solid: Solid
    segmentation: Segmentation
    scan: Scan | Kept | None = None
    asked: bool = False
    notes: tuple[str, ...] = ()

    @property
    def parts(self) -> Parts:
        """The parts as shape and colour alone say, with how wrong the solid may be."""
        error = self.error
        return replace(self.segmentation.parts, com_std=error.com_m, stretch=error.stretch, turn_std=error.turn_rad)

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What one must know of views, solid and parts."""
        seen = () if self.scan is None else self.scan.findings
        return (*seen, *self.solid.findings, *self.segmentation.findings)

    @property
    def error(self) -> ShapeError:
        """How wrong the shape may be: no less than a measured mesh, more as far as solid and cameras are unsure."""
        stretch = float(np.hypot(STRETCH * self.solid.volume_std, BORDER * self.segmentation.border_share))
        error = MEASURED.at_least(self.solid.surface_m, stretch)
        return error if self.scan is None else error.laid(*self.scan.place_std)

    def cuts(self) -> Cuts:
        """Return the cuts that a log may choose from: about the number shape and colour chose, and half of it.

        Which seams are between materials is what the forces know better.
        """
        made = self.segmentation
        if self.asked or made.cuts is None:
            return Cuts((len(made),), (made.parts,), np.zeros(1))
        chosen, most = len(made), min(MOST_PARTS, len(made.cuts.length))
        wanted = {max(1, chosen // 2), chosen - 1, chosen, chosen + 1}
        numbers = tuple(sorted({min(k, most) for k in wanted if k >= 1}))
        sure = np.maximum(made.sureness[[k - 1 for k in numbers]], LEAST_SURE)
        return Cuts(numbers, tuple(made.cut(k).parts for k in numbers), np.log(sure))


@dataclass(frozen=True, eq=False)
class Cuts:
    """Cuts of one shape: numbers of parts, the parts of each, and the log weight (K,) that shape and colour give it."""

    numbers: tuple[int, ...]
    parts: tuple[Parts, ...]
    prior: Array


def shape_of(
    seen: Views | Scan | Cloud, parts: int | None = None, refill: Callable[[TetMesh], TetMesh] | None = None
) -> Shape:
    """Return the solid in parts behind views, a fused scan or a cloud.

    parts  how many, where that is known; chosen by shape and colour where not
    refill fills the same volume with other cells; None keeps those of Delaunay

    Raises CannotAnswer or BadInput where nothing closed can be made of it.
    """
    if isinstance(seen, Views):
        seen = fuse(seen)
    scan, cloud = (seen, seen.cloud) if isinstance(seen, Scan) else (seen.kept, seen)
    solid, notes = _solid(cloud, scan)
    if refill is not None:
        mesh = refill(solid.mesh)
        solid = replace(solid, mesh=mesh, sure=np.ones(len(mesh)), around=None, inside=None)
    # Normals that were found and not measured blur at edges: they would split one colour by its shading.
    measured = cloud.normals is not None
    made = segment(solid.cloud if measured else solid.cloud.with_normals(None), solid, parts=parts)
    return Shape(solid, made, scan, parts is not None, (*_notes(cloud), *notes))


def kept(scan: Scan) -> Cloud:
    """Return the cloud of a scan with what its views know beside it, so that a file of it answers as the views do."""
    try:
        space = carving.kept(enclose(scan.cloud, one=True), scan.space)
    except (BadValue, CannotAnswer):
        space = KeptSpace(scan.space.unseen, scan.space.unsure_m3)
    return replace(scan.cloud, kept=Kept(scan.findings, space, scan.place_std))


def _solid(cloud: Cloud, scan: Scan | Kept | None) -> tuple[Solid, tuple[str, ...]]:
    """Return the solid of a cloud, carved by what its views saw where that is known, and what was not used."""
    solid = enclose(cloud, one=scan is not None)
    match scan:
        case Scan():
            return carving.carved(solid, scan.space), ()
        case Kept(space=space) if space.fits(solid.around):
            return carving.carved(solid, space), ()
        case Kept(space=space):
            return carving.uncarved(solid, space), (_CHANGED,)
        case None if cloud.seen is not None:
            return carving.uncarved(solid, KeptSpace(1 - float(cloud.seen.mean()))), ()
        case None:
            return solid, ()


def _notes(given: Cloud) -> tuple[str, ...]:
    """Return how many points of a cloud had no place or no normal, if any."""
    if not given.left_out:
        return ()
    of = len(given) + given.left_out
    return (f"{given.left_out} of {of} points of the cloud left out: no finite place or normal",)
