"""The scene of a team: a ring through the grasps for the payload, and a gripper where each robot holds it.

Nobody has seen the payload, so its shape is not drawn: the ring only says which points are fixed to each other.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array, Integers
from steelyard.report.drawing import PAYLOAD, UNSEEN
from steelyard.report.scene import Body, Scene
from steelyard.spatial import Pose
from steelyard.team.estimate import TeamEstimate

_RING, _SPOKE, _GRIPPER, _DEEP = 0.012, 0.004, 0.026, 0.06  # of the team's size: radii, and a gripper's depth
_AROUND, _ALONG = 14, 40
_ELEVATION = np.deg2rad(20.0)  # of the first look; the page adds its own tilt
_ROBOT = (120, 128, 134)


def labels_of(estimate: TeamEstimate) -> dict[int, str]:
    """Return what each body of the scene is called."""
    return {PAYLOAD: "payload", **dict(enumerate(estimate.grasps, 1))}


def team_scene(estimate: TeamEstimate) -> Scene:
    """Return the payload's ring and the grippers, in the reference grasp."""
    poses = [grasp.pose for grasp in estimate.grasps.values()]
    places = np.array([pose.position for pose in poses])
    size = max(float(np.ptp(places, axis=0).max()), 1e-3)
    up = _up(places)
    loop = _loop(places, up)
    parts = [_tube(loop, _RING * size)]
    if estimate.mass > 0:
        parts += [_tube(np.linspace(place, estimate.com, 3), _SPOKE * size) for place in places]
    bodies = [_painted(PAYLOAD, *_joined(parts), UNSEEN)]
    for label, pose in enumerate(poses, 1):
        ends = pose.apply(np.array([[0, 0, 0.2], [0, 0, -1.0]]) * _DEEP * size)
        bodies.append(_painted(label, *_tube(ends, _GRIPPER * size), _ROBOT))
    return Scene(tuple(bodies), None, Pose.identity(), _view(places, up))


def _painted(label: int, vertices: Array, triangles: Integers, rgb: tuple[int, int, int]) -> Body:
    return Body(label, vertices, triangles, np.tile(np.array(rgb, np.uint8), (len(vertices), 1)))


def _up(places: Array) -> Array:
    """Return the unit vector that counts as up: across the grasps where they span a plane, on the side of R's z."""
    gap = places - places.mean(0)
    _, spread, axes = np.linalg.svd(gap, full_matrices=True)
    z = np.array([0.0, 0.0, 1.0])
    if len(places) < 3 or spread[1] < 0.05 * spread[0]:
        along = axes[0]
        up = z - along * (along @ z)
        return np.asarray(up / max(float(np.linalg.norm(up)), 1e-9)) if np.linalg.norm(up) > 0.1 else axes[2]
    return np.asarray(axes[2] if axes[2] @ z >= 0 else -axes[2])


def _view(places: Array, up: Array) -> Array:
    """Return the rows right, up, toward (3, 3) of a look from the side and above."""
    gap = places - places.mean(0)
    right = np.linalg.svd(gap - np.outer(gap @ up, up))[2][0]
    right = right - up * (right @ up)
    right /= np.linalg.norm(right)
    flat = np.cross(right, up)
    toward = np.cos(_ELEVATION) * flat + np.sin(_ELEVATION) * up
    return np.stack([right, np.cross(toward, right), toward])


def _loop(places: Array, up: Array) -> Array:
    """Return a smooth closed curve (K, 3) through the grasps in their order around the middle; a line through two."""
    if len(places) < 3:
        return places
    gap = places - places.mean(0)
    x = gap[0] - up * (gap[0] @ up)
    order = np.argsort(np.arctan2(gap @ np.cross(up, x), gap @ x), kind="stable")
    p = places[order]
    t = np.linspace(0, 1, _ALONG, endpoint=False)[:, None]
    curve = []
    for k in range(len(p)):  # uniform Catmull-Rom
        a, b, c, d = p[k - 1], p[k], p[(k + 1) % len(p)], p[(k + 2) % len(p)]
        curve.append(b + 0.5 * t * (c - a + t * (2 * a - 5 * b + 4 * c - d + t * (3 * (b - c) + d - a))))
    closed = np.concatenate(curve)
    return np.concatenate([closed, closed[:1]])


def _tube(curve: Array, radius: float) -> tuple[Array, Integers]:
    """Return a tube about a curve (K, 3) with flat ends."""
    way = np.gradient(curve, axis=0)
    way /= np.maximum(np.linalg.norm(way, axis=1, keepdims=True), 1e-12)
    closed = bool(np.abs(curve[0] - curve[-1]).max() < 1e-9)
    if closed:
        way[0] = way[-1] = (way[0] + way[-1]) / np.linalg.norm(way[0] + way[-1])
    side = np.cross(way[0], np.eye(3)[np.abs(way[0]).argmin()])
    sides = []
    for along in way:
        side = side - along * (side @ along)
        side = side / np.linalg.norm(side)
        sides.append(side)
    # What carrying the side once around a closed curve has turned it by is taken back on the way.
    across = np.cross(way[0], sides[0])
    turned = np.arctan2(sides[-1] @ across, sides[-1] @ sides[0]) if closed else 0.0
    rings = []
    for at, along, side, share in zip(curve, way, sides, np.linspace(0, 1, len(curve)), strict=True):
        turn = (np.linspace(0, 2 * np.pi, _AROUND, endpoint=False) - share * turned)[:, None]
        rings.append(at + radius * (np.cos(turn) * side + np.sin(turn) * np.cross(along, side)))
    vertices = np.concatenate([*rings, curve[:1], curve[-1:]])
    k, j = np.meshgrid(np.arange(len(curve) - 1), np.arange(_AROUND), indexing="ij")
    a, b = (k * _AROUND + j).ravel(), (k * _AROUND + (j + 1) % _AROUND).ravel()
    walls = np.concatenate([np.stack([a, b, b + _AROUND], 1), np.stack([a, b + _AROUND, a + _AROUND], 1)])
    if closed:
        return vertices, walls
    rim = np.arange(_AROUND)
    after = (rim + 1) % _AROUND
    first, last = len(vertices) - 2, len(vertices) - 1
    end = (len(curve) - 1) * _AROUND
    caps = [
        np.stack([np.full(_AROUND, first), after, rim], 1),
        np.stack([np.full(_AROUND, last), end + rim, end + after], 1),
    ]
    return vertices, np.concatenate([walls, *caps])


def _joined(parts: list[tuple[Array, Integers]]) -> tuple[Array, Integers]:
    """Return several surfaces as one."""
    start = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts])
    return vertices, np.concatenate([t + s for (_, t), s in zip(parts, start[:-1], strict=True)])
