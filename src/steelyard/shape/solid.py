"""A solid made of the cells behind a cloud, and how wrong it may be: what is said of it, and its volume's deviation."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers
from steelyard.findings import Finding
from steelyard.shape.cloud import Cloud
from steelyard.shape.filling import Filled
from steelyard.shape.orient import Oriented
from steelyard.shape.tets import TetMesh
from steelyard.shape.working_cloud import WorkingCloud

# Doubt (see `filling`) above which walls could not be told from gaps. Found on made sheets: nearly
# all whose volume comes out wrong lie above it, and few of the others.
BLURRED = 0.41
# Length of the sum of all areas as vectors, over the sum of their sizes: 0 for a closed surface. Above this a side is
# missing (0.12 and more without an underside). Patterns of points that are unlike on two sides leave up to 0.10, or
# 0.135 where one is five times as dense.
_OPEN = 0.11
_LOST = 0.4  # of the spacing: thinner walls, told by their layers, lose 8 to 45 % of their own volume
_NOISY = 0.3  # of the points: so many that are nearer to the other side make the solid doubtful
_WITHIN = 4.0  # standard deviations of noise that two layers of points must be apart to be told as two
_FACING = -0.5  # cosine between normals of two sides
_FEW_SEEN = 0.25  # of the points: scans with views from all sides show the colour of about half
_NEAREST = 6  # neighbours across which the surface is a chord
_SMOOTH = np.radians(60.0)  # neighbours whose normals are farther apart lie on two faces
# Standard deviation of the volume: of any solid; per share between points of round surfaces and their chords; per share
# of cells unsure; per share that a skin as thick as the noise has; where walls blur, else per share in thin ones;
# per share left open.
_STD, _CHORDS, _UNSURE, _SKIN, _THIN, _HOLE = 0.025, 0.7, 0.1, 0.1, 0.5, 1.0
# Per share that a skin as thick as a voxel has: six faces are rounded, each by itself.
_ROUNDED = (12 * 6) ** -0.5


@dataclass(frozen=True, eq=False)
class Solid:
    """A closed volume made of tetrahedra over the points of a cloud.

    mesh        the cells inside; its vertices are the points of `cloud`, row by row
    cloud       the points used [m]: the given ones without repeats and thinned, with their outward normals
    sure        (T,) how sure each cell is to lie inside, 0 (could be either) to 1
    volume_std  standard deviation of the volume, as a share of it
    surface_m   standard deviation of where the surface lies, all of it moved alike [m]
    findings    what one must know about it
    around      all cells of the complex that `mesh` was chosen from; None where the cells are no longer of one
    inside      (T,) which of those the cells of `mesh` are
    """

    mesh: TetMesh
    cloud: Cloud
    sure: Array
    volume_std: float
    surface_m: float
    findings: tuple[Finding, ...]
    around: TetMesh | None = None
    inside: Integers | None = None

    def over(self, cloud: Cloud, order: Integers) -> Solid:
        """Return the same cells over a cloud whose row order[k] is the k-th of the points here."""

        def anew(cells: TetMesh) -> TetMesh:
            return TetMesh.known(cloud.xyz, order[cells.tets], cells.volumes, cells.neighbours)

        around = None if self.around is None else anew(self.around)
        return replace(self, mesh=anew(self.mesh), around=around, cloud=cloud)


def judged(used: WorkingCloud, surface: Oriented, found: Filled, turned: tuple[Finding, ...]) -> Solid:
    """Return the cells behind a surface as a solid that knows how wrong it may be.

    turned  what is said of normals that came with the points
    """
    mesh, diagonal = found.solid, used.cloud.diagonal
    sure = np.minimum(2 * found.score[found.inside], 1.0)
    total = float(surface.area.sum())
    gap = float(np.linalg.norm((surface.area[:, None] * surface.normals).sum(0))) / total
    hole = gap > _OPEN
    thin, wrong = _thin_walls(used, surface, found)
    findings = (*used.findings, *turned, *thin, *(_open(gap) if hole else ()))
    unsure = float((mesh.volumes * (1 - sure)).sum() / mesh.volume)
    wrong = 1.0 if any(finding.code == "table-in-cloud" for finding in findings) else wrong
    few = _CHORDS * _lacking(surface, mesh.volume / diagonal**3)
    skin = float(np.hypot(_SKIN * used.noise, _ROUNDED * used.voxel)) * total * diagonal**2 / mesh.volume
    std = float(np.linalg.norm([max(_STD, few), _UNSURE * unsure, skin, _THIN * wrong, _HOLE * gap * hole]))
    surface_m = std * mesh.volume / (total * diagonal**2)
    inside = np.flatnonzero(found.inside)
    return Solid(mesh, used.cloud.with_normals(surface.normals), sure, std, surface_m, findings, found.mesh, inside)


def _open(gap: float) -> tuple[Finding]:
    text = f"The surface does not close: what faces one way misses {100 * gap:.0f} % of the whole on the other side."
    return (Finding.of("surface-open", text),)


def _thin_walls(used: WorkingCloud, surface: Oriented, found: Filled) -> tuple[tuple[Finding, ...], float]:
    """Return what is said of walls that points do not tell from gaps, and the share of the volume it makes wrong."""
    diagonal, layers, wrong = used.cloud.diagonal, surface.layers, 1.0
    apart = surface.sites.spacing * diagonal * 1e3
    if found.doubt > BLURRED:
        return (_blurred(used.cloud, apart, found.doubt),), wrong
    if (share := _share_within_noise(surface, used.noise / diagonal)) > _NOISY:
        text = f"Walls or gaps at {100 * share:.0f} % of the points are thinner than {_WITHIN:.0f} times their "
        text += f"noise of {used.noise * 1e3:.2g} mm."
    elif layers is not None and layers.thickness < _LOST * surface.sites.spacing:
        text = f"Walls are about {layers.thickness * diagonal * 1e3:.2g} mm thick, and points {apart:.2g} mm apart: "
        text += "some of what they hold is lost."
        wrong = min(layers.volume(surface.area) * diagonal**3 / found.solid.volume, 1.0)
    else:
        return (), 0.0
    return (Finding.of("thin-thickened", text),), wrong


def _blurred(cloud: Cloud, apart: float, doubt: float) -> Finding:
    """Return why inside and outside of points `apart` [mm] are hard to tell: few were seen, or else thin walls."""
    what = f"what should be 1 inside and 0 outside is blurred to {1 - doubt:.2f} inside."
    if cloud.seen is not None and (share := float(cloud.seen.mean())) < _FEW_SEEN:
        text = f"Cameras saw only {100 * share:.0f} % of the points, and the rest closes what is left: {what}"
        return Finding("thin-thickened", text, "Take more views, from all sides and heights.")
    text = f"Walls are too thin for points {apart:.2g} mm apart to tell them from gaps: {what}"
    return Finding.of("thin-thickened", text)


def _share_within_noise(surface: Oriented, noise: float) -> float:
    """Return the share of points with the other side of a wall or gap nearer than noise lets see."""
    facing = np.einsum("nd,nkd->nk", surface.normals, surface.normals[surface.sites.near.index]) < _FACING
    return float((facing & (surface.sites.near.distance < _WITHIN * noise)).any(1).mean())


def _lacking(surface: Oriented, volume: float) -> float:
    """Return the volume between the surface and its chords as a share of the solid's.

    volume  of the solid, in units of the surface

    A chord of length d between normals t apart leaves a gap of d t / 8 in its middle. Round bodies come out smaller by
    about half of this, hollows larger.
    """
    index, apart = surface.sites.near.index[:, :_NEAREST], surface.sites.near.distance[:, :_NEAREST]
    turn = np.arccos(np.clip(np.einsum("nkd,nd->nk", surface.normals[index], surface.normals), -1, 1))
    smooth = turn < _SMOOTH
    gap = (apart * turn * smooth).sum(1) / (8 * np.maximum(smooth.sum(1), 1))
    return float((surface.area * gap).sum() / volume)
