"""Object folders made of boxes, small enough for quick tests, with everything known in closed form."""

import numpy as np

from steelyard.datasets.known_object import KnownObject
from steelyard.datasets.track import Track
from steelyard.io.object_folders import write_object
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.simulate.handling import motion_arrays
from steelyard.spatial import Pose, Rotation

X_SO = Pose(Rotation.from_rpy([0.4, -0.2, 1.1]), np.array([0.01, -0.02, 0.05]))
CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)
FACES = [
    [0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1],
    [2, 3, 7], [2, 7, 6], [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3],
]  # fmt: skip


def boxes_mesh(boxes):
    """Return the mesh of boxes given as (lower corner, edges) [m], one part each."""
    vertices = [np.asarray(low) + np.asarray(edges) * CORNERS for low, edges in boxes]
    triangles = np.concatenate([np.array(FACES) + 8 * k for k in range(len(boxes))])
    return TriangleMesh(np.concatenate(vertices), triangles, np.repeat(np.arange(len(boxes)), 12))


def known_boxes(name, boxes, densities, variant="paper"):
    """Return a known object of boxes with a density [kg/m^3] each."""
    mesh = boxes_mesh(boxes)
    parts = parts_of_mesh(mesh)
    masses = parts.volume * np.asarray(densities, float)
    truth = parts.in_frame(X_SO).whole(masses)
    columns = motion_arrays(variant, truth)
    track = Track(*columns.values())
    cloud = Cloud(mesh.corners.mean(1), np.full((len(mesh), 3), 128, np.uint8), mesh.part)
    box = np.ptp(X_SO.apply(mesh.vertices), axis=0)
    materials = tuple(f"density {d:g}" for d in densities)
    return KnownObject(name, mesh, parts, masses, materials, truth, X_SO, cloud, box, track)


BOXES = [
    ((0, 0, 0), (0.03, 0.02, 0.15)),
    ((-0.02, -0.01, 0.15), (0.08, 0.04, 0.03)),
    ((0.06, -0.01, 0.15), (0.02, 0.04, 0.03)),
    ((-0.01, 0.02, 0.05), (0.01, 0.03, 0.06)),
]
CLUB = ("club", BOXES, (700, 7800, 7800, 2700))
BRICK = ("brick", BOXES[:2], (2700, 2700))


def write_tools(folder):
    """Write a club of three densities (mixed) and a brick of one (uniform) into `folder`."""
    for tool in (CLUB, BRICK):
        write_object(known_boxes(*tool), folder / tool[0])
    return folder
