"""Scene: the parts of an object as coloured surfaces, with where the sensor sees them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadValue
from steelyard.report.surfaces import evened, part_skins, thinned
from steelyard.shape.cloud import Cloud
from steelyard.shape.eight_bits import Colours
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.points.spacing import nearest
from steelyard.shape.tets import TetMesh
from steelyard.spatial import Pose, Rotation

MOST_TRIANGLES = 20_000
MOST_POINTS = 6_000
MOST_BODIES = 200
_GREY = np.array([150, 150, 150], np.uint8)
_EXACT = 1e-3  # of the spread of the centroids: how well they must lie on one another to say where the object is


@dataclass(frozen=True, eq=False)
class Body:
    """One part as it is drawn.

    label      of the part
    vertices   (V, 3) [m] in the object's frame O
    triangles  (F, 3) numbers of the corners, counter-clockwise seen from outside
    rgb        (V, 3) colour of each vertex
    """

    label: int
    vertices: Array
    triangles: Integers
    rgb: Colours


@dataclass(frozen=True, eq=False)
class Scene:
    """What is drawn.

    bodies  the parts, in frame O
    points  the cloud they were made of, in O
    X_SO    pose of O in the sensor frame; None where it is not known: then only the shape is drawn
    view    rows right, up, toward (3, 3) of the first look; None = the longest direction across, the thinnest towards
            the eye
    """

    bodies: tuple[Body, ...]
    points: Cloud | None = None
    X_SO: Pose | None = None
    view: Array | None = None

    def __post_init__(self) -> None:
        if not self.bodies:
            raise BadValue("a scene needs at least one part to draw.")
        if not float(np.ptp(np.concatenate([b.vertices for b in self.bodies]), axis=0).max()) > 0:
            raise BadValue("a scene needs parts that have a size.")


def scene_of_solid(
    solid: TetMesh, labels: Integers, cloud: Cloud | None = None, rgb: Array | None = None, X_SO: Pose | None = None
) -> Scene:
    """Return the scene of a solid whose cells belong to parts; what its noise makes stick out is evened.

    labels  (T,) part of each cell
    cloud   gives every vertex the colour of its nearest point
    rgb     (P, 3) mean colours 0..255 of the parts, labels rising, used where the cloud has none
    X_SO    where the object sits in the sensor, None where nothing says

    Raises BadValue where cells and labels differ in number.
    """
    labels = np.asarray(labels, np.int64)
    if labels.shape != (len(solid),):
        raise BadValue(f"{len(solid)} cells need one label each; got {labels.shape}.")
    vertices = evened(solid.vertices, solid.surface)
    skins = [(k, vertices, faces) for k, faces in part_skins(solid, labels)]
    return Scene(_bodies(skins, cloud, rgb), _thinned_cloud(cloud), X_SO)


def scene_of_mesh(mesh: TriangleMesh, cloud: Cloud | None = None, X_SO: Pose | None = None) -> Scene:
    """Return the scene of a mesh whose triangles belong to parts; its own colours win over the cloud's."""
    rgb = None
    if mesh.rgb is not None:
        rgb = np.stack([mesh.rgb[mesh.part == k].mean(0) for k in mesh.labels])
    skins = [(int(k), mesh.vertices, mesh.triangles[mesh.part == k]) for k in mesh.labels]
    return Scene(_bodies(skins, None if rgb is not None else cloud, rgb), _thinned_cloud(cloud), X_SO)


def _bodies(skins: Sequence[tuple[int, Array, Integers]], cloud: Cloud | None, rgb: Array | None) -> tuple[Body, ...]:
    """Return the skins as bodies, thinned together; the smallest beyond MOST_BODIES are left out."""
    if rgb is not None and np.shape(rgb) != (len(skins), 3):
        raise BadValue(f"{len(skins)} parts need one colour each; got {np.shape(rgb)}.")
    total = sum(len(triangles) for *_, triangles in skins)
    share = min(1.0, MOST_TRIANGLES / max(total, 1))
    kept = set(np.argsort([-len(triangles) for *_, triangles in skins], kind="stable")[:MOST_BODIES].tolist())
    bodies = []
    for number, (label, vertices, triangles) in enumerate(skins):
        if number not in kept:
            continue
        v, t = thinned(vertices, triangles, max(int(share * len(triangles)), 12))
        if not len(t):
            continue
        colour = _GREY if rgb is None else np.clip(np.rint(rgb[number]), 0, 255).astype(np.uint8)
        bodies.append(Body(label, v, t, _colours(v, cloud, colour)))
    return tuple(bodies)


def _colours(vertices: Array, cloud: Cloud | None, colour: Colours) -> Colours:
    """Return a colour (V, 3) per vertex."""
    if cloud is None or cloud.rgb is None:
        return np.tile(colour, (len(vertices), 1))
    return np.asarray(cloud.rgb[nearest(cloud.xyz, vertices)])


def _thinned_cloud(cloud: Cloud | None) -> Cloud | None:
    """Return at most MOST_POINTS of the points, evenly over their order."""
    if cloud is None or len(cloud) <= MOST_POINTS:
        return cloud
    return cloud.chosen(np.linspace(0, len(cloud) - 1, MOST_POINTS).astype(np.int64))


def pose_from_centroids(in_sensor: Array, in_object: Array) -> Pose | None:
    """Return X_SO from the centroids (P, 3) of the same parts in S and in O, None where they do not fix it.

    Three or more that are not on one line are needed, and both sets must have the same shape.
    Source: Kabsch 1976.
    """
    a, b = check.vectors("centroids", in_sensor), check.vectors("centroids", in_object)
    if a.shape == b.shape and np.allclose(a, b, rtol=0, atol=1e-6):
        return Pose(Rotation.identity(), np.zeros(3))
    if a.shape != b.shape or len(a) < 3:
        return None
    middle_a, middle_b = a.mean(0), b.mean(0)
    match = (a - middle_a).T @ (b - middle_b)
    spread = np.linalg.svd(match, compute_uv=False)
    if spread[1] < _EXACT * spread[0]:
        return None
    turn = Rotation.aligning(match)
    found = Pose(turn, middle_a - turn.apply(middle_b))
    gap = np.linalg.norm(found.apply(b) - a, axis=1).max()
    return found if gap < _EXACT * np.sqrt(spread[0]) else None
