"""Small pieces of a solid, each of one colour, that creases do not cross: what the parts are put together from."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np

from steelyard.check import Array, Integers
from steelyard.parts.groups import root
from steelyard.parts.skin import Skin
from steelyard.shape.tets import TetMesh

PIECE = 1 / 200  # of the volume: a tenth of the finest part that is looked for
TINY = 1 / 2000  # of the volume: less is no part ...
TINY_SKIN = 1 / 1000  # ... unless it is seen, as foil is: this share of the boundary
_CREASE = 0.6  # a turn [rad] that is certainly a crease
_OTHER_COLOUR = 1e-3  # pull of a face between two colours, for a piece that holds no point
_UNCREASED = 0.05  # of a face's area, what is left of its pull where it ends in creases only


def cell_colours(mesh: TetMesh, label: Integers) -> Integers:
    """Return the colour (T,) of every tet: of most of its corners, in a tie that of the corner nearest its centroid."""
    return np.asarray(_cell_colours(mesh.vertices, mesh.tets, mesh.centroids, np.asarray(label, dtype=np.int64)))


@numba.njit(cache=True, nogil=True)
def _cell_colours(vertices: Array, tets: Any, centroids: Array, label: Any) -> Any:
    found, gap = np.empty(len(tets), np.int64), np.empty(4)
    for t in range(len(tets)):
        far = 0.0
        for i in range(4):
            gap[i] = 0.0
            for d in range(3):
                gap[i] += (vertices[tets[t, i], d] - centroids[t, d]) ** 2
            gap[i] = np.sqrt(gap[i])
            far = max(far, gap[i])
        most = -1.0
        for i in range(4):
            votes = -0.5 * gap[i] / far
            for j in range(4):
                if label[tets[t, j]] == label[tets[t, i]]:
                    votes += 1.0
            if votes > most:
                most, found[t] = votes, label[tets[t, i]]
    return found


def pieces_of(mesh: TetMesh, skin: Skin, colour: Integers) -> tuple[Integers, Integers]:
    """Return the piece (T,) of every tet, numbered from 0, and the colour (N,) of every piece.

    Small clusters of one colour join the neighbour with which they share the most face, faces between creases counting
    little; then what is left too small to be seen joins a neighbour of another colour.

    colour  (T,) of every tet
    """
    pairs, areas, crease = mesh.dual, mesh.inner_areas, np.zeros(len(mesh.vertices))
    np.maximum.at(crease, skin.edges.ravel(), np.repeat(skin.turning, 2))
    pull = areas * (1 + _UNCREASED - np.clip(crease[mesh.inner_faces].mean(1) / _CREASE, 0, 1))
    one_colour = colour[pairs[:, 0]] == colour[pairs[:, 1]]
    piece = np.arange(len(mesh))
    piece = _absorbed(piece, mesh.volumes, pairs[one_colour], pull[one_colour], mesh.volume * PIECE)
    seen = np.bincount(skin.cell, skin.areas, len(mesh)) / skin.areas.sum()
    size = np.maximum(mesh.volumes / mesh.volume / TINY, seen / TINY_SKIN)
    piece = _absorbed(piece, size, pairs, areas, 1.0)
    # A sliver that hangs free is skin all over, and was foil for that.
    touching = np.isin(piece, piece[pairs][piece[pairs[:, 0]] != piece[pairs[:, 1]]])
    piece = _specks_to_nearest(mesh, piece, np.where(touching, size, mesh.volumes / mesh.volume / TINY))
    return piece, _main_colours(piece, colour, mesh.volumes)


def _main_colours(piece: Integers, colour: Integers, volumes: Array) -> Integers:
    """Return the colour (N,) of most of the volume of every piece, by the piece and colour (T,) of tets."""
    count, colours = int(piece.max()) + 1, int(colour.max()) + 1
    volume = np.bincount(piece * colours + colour, volumes, count * colours).reshape(count, colours)
    return np.asarray(volume.argmax(1))


def with_points(mesh: TetMesh, piece: Integers, colour: Integers, nearest: Integers) -> tuple[Integers, Integers]:
    """Return pieces (T,) and their colours with those that hold no point joined to a neighbour, rather of their colour.

    Nothing is known of a piece that nobody sees: it is no part of its own.

    colour   (N,) of every piece
    nearest  (points,) the tet of every point of the cloud
    """
    points = np.bincount(nearest, minlength=len(mesh)).astype(np.float64)
    seen = np.bincount(piece, points) > 0
    if seen.all():
        return piece, colour
    one, other = colour[piece[mesh.dual]].T
    pull = np.where(one == other, 1, _OTHER_COLOUR) * mesh.inner_areas
    whole = _absorbed(piece, points, mesh.dual, pull, 1.0)
    whole = _specks_to_nearest(mesh, whole, points)
    known = seen[piece]
    return whole, _main_colours(whole[known], colour[piece[known]], mesh.volumes[known])


def _absorbed(piece: Integers, size: Array, pairs: Integers, pull: Array, least: float) -> Integers:
    """Return pieces joined, round by round, each below the `least` size to the neighbour that pulls it most.

    size  (T,) summed over the tets of a piece; a piece below the least joins larger ones or others below it
    """
    return np.unique(_rounds(piece, size, np.ascontiguousarray(pairs), pull, least), return_inverse=True)[1]


@numba.njit(cache=True, nogil=True)
def _rounds(piece: Any, size: Array, pairs: Any, pull: Array, least: float) -> Any:
    count = piece.max() + 1
    parent, total = np.arange(count), np.zeros(count)
    for t in range(len(piece)):
        total[piece[t]] += size[t]
    joined = True
    while joined:
        joined = False
        goal = _strongest(total, least, _contacts(parent, piece, pairs, pull))
        for a in range(count):
            if goal[a] >= 0:
                p, q = root(parent, a), root(parent, goal[a])
                if p != q:
                    parent[max(p, q)] = min(p, q)
                    total[min(p, q)] += total[max(p, q)]
                    joined = True
    label = np.empty(len(piece), np.int64)
    for t in range(len(piece)):
        label[t] = root(parent, piece[t])
    return label


@numba.njit(cache=True, nogil=True)
def _contacts(parent: Any, piece: Any, pairs: Any, pull: Array) -> tuple[Any, Any, Array]:
    """Return the contacts of each cluster a, start[a] to start[a + 1]: the cluster beyond, and how much it pulls."""
    start = np.zeros(len(parent) + 1, np.int64)
    for e in range(len(pairs)):
        a, b = root(parent, piece[pairs[e, 0]]), root(parent, piece[pairs[e, 1]])
        if a != b:
            start[a + 1] += 1
            start[b + 1] += 1
    start = np.cumsum(start)
    fill, far, weight = start[:-1].copy(), np.empty(start[-1], np.int64), np.empty(start[-1])
    for e in range(len(pairs)):
        a, b = root(parent, piece[pairs[e, 0]]), root(parent, piece[pairs[e, 1]])
        if a != b:
            far[fill[a]], far[fill[b]] = b, a
            weight[fill[a]] = weight[fill[b]] = pull[e]
            fill[a] += 1
            fill[b] += 1
    return start, far, weight


@numba.njit(cache=True, nogil=True)
def _strongest(total: Array, least: float, contacts: tuple[Any, Any, Array]) -> Any:
    """Return the neighbour that pulls each cluster below the least size most, -1 where there is none."""
    start, far, weight = contacts
    goal, strength = np.full(len(total), -1, np.int64), np.zeros(len(total))
    for a in range(len(total)):
        if total[a] >= least:
            continue
        for k in range(start[a], start[a + 1]):
            strength[far[k]] += weight[k]
        for k in range(start[a], start[a + 1]):
            if goal[a] < 0 or strength[far[k]] > strength[goal[a]]:
                goal[a] = far[k]
        for k in range(start[a], start[a + 1]):
            strength[far[k]] = 0.0
    return goal


def _specks_to_nearest(mesh: TetMesh, piece: Integers, size: Array) -> Integers:
    """Return pieces with those that are too small and touch nothing joined to the nearest other piece."""
    from scipy.spatial import cKDTree

    total = np.bincount(piece, size)
    lost = np.flatnonzero(total < 1)
    if not len(lost) or len(lost) == len(total):
        return piece
    kept = np.flatnonzero(total[piece] >= 1)
    loose = np.flatnonzero(total[piece] < 1)
    gap, row = cKDTree(mesh.centroids[kept]).query(mesh.centroids[loose])
    order = np.lexsort((gap, piece[loose]))
    first = np.r_[True, np.diff(piece[loose][order]) > 0]
    goal = np.arange(len(total))
    goal[piece[loose][order][first]] = piece[kept[row[order][first]]]
    return np.unique(goal[piece], return_inverse=True)[1]
