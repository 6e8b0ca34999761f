"""The scene as the page's script draws it: packed buffers in base64, and what is marked on it.

A vertex takes 16 bytes: place as three 16 bit shares of the box and two bytes of nothing, normal as three signed bytes,
colour as three bytes; a surface of 20 000 triangles then takes about half a megabyte of page.
"""

from __future__ import annotations

import base64
from dataclasses import dataclass
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.evidence import PartMass
from steelyard.identify.estimate import Estimate
from steelyard.report.contents import Report
from steelyard.report.palette import density_colours, hexadecimal, part_colour
from steelyard.report.scene import Body, Scene
from steelyard.report.surfaces import corner_normals
from steelyard.tables.numbers import fixed, mass_unit, places_of, principal, round_step
from steelyard.tables.printable import printable
from steelyard.team.estimate import TeamEstimate

PAYLOAD, UNSEEN = 0, (158, 168, 176)  # a team's ring through the grasps, and its colour
_CHI2_95 = 7.815  # three degrees of freedom
_VISIBLE = 0.05  # of the diagonal: how large the ellipsoid of the centre of mass is drawn at least
_VERTEX = np.dtype([("xyz", "<u2", 4), ("normal", "i1", 4), ("rgb", "u1", 4)])


@dataclass(frozen=True, eq=False)
class Frame:
    """The box that places are shares of, and how to look at it: `view` (3, 3) rows right, up, toward."""

    low: Array
    size: float
    view: Array

    @classmethod
    def of(cls, scene: Scene) -> Frame:
        """Return the box of the scene, seen as it asks, or by its shape: thinnest direction towards the eye."""
        vertices = np.concatenate([body.vertices for body in placed(scene)])
        low = vertices.min(0)
        size = float(np.ptp(vertices, axis=0).max())
        if scene.view is not None:
            return cls(low, size, scene.view)
        gap = vertices - vertices.mean(0)
        axes = np.linalg.eigh(gap.T @ gap)[1][:, ::-1].T
        axes = axes * np.sign(axes[np.arange(3), np.abs(axes).argmax(1)])[:, None]
        axes[2] = np.cross(axes[0], axes[1])
        return cls(low, size, axes)


def placed(scene: Scene) -> list[Body]:
    """Return the bodies in the sensor frame where it is known, else as they are."""
    X = scene.X_SO
    return [b if X is None else Body(b.label, X.apply(b.vertices), b.triangles, b.rgb) for b in scene.bodies]


def colours_of(report: Report) -> dict[int, tuple[int, int, int]]:
    """Return the colour that tells each part apart, in the legend and in the picture."""
    labels = {part.label for part in report.estimate.parts}
    if report.scene is not None:
        labels |= {body.label for body in report.scene.bodies}
    colours = {label: part_colour(number) for number, label in enumerate(sorted(labels))}
    # What nobody has seen is drawn in no colour of its own.
    return colours | {PAYLOAD: UNSEEN} if isinstance(report.estimate, TeamEstimate) else colours


def drawing(report: Report, scene: Scene) -> dict[str, Any]:
    """Return everything the script needs, as plain values."""
    bodies = placed(scene)
    frame = Frame.of(scene)
    known = {part.label: part for part in report.estimate.parts}
    told = [known[b.label] for b in bodies if b.label in known]
    density = dict(zip([p.label for p in told], density_colours(np.array([p.density for p in told])), strict=True))
    apart = colours_of(report)
    rows = []
    for body in bodies:
        part = known.get(body.label)
        rows.append({
            "label": body.label,
            "name": printable(report.name_of(body.label))[:80],
            "says": "" if part is None else _weight(part, report.estimate.mass),
            "colour": hexadecimal(apart[body.label]),
            "dense": hexadecimal(density.get(body.label, (150, 150, 150))),
            "middle": _plain(body.vertices.mean(0)),
            **_packed(body, frame),
        })  # fmt: skip
    return {
        "low": _plain(frame.low), "size": frame.size, "view": _plain(frame.view), "bodies": rows,
        "points": _points(scene, frame), "marks": _marks(report.estimate, scene, frame),
    }  # fmt: skip


def _weight(part: PartMass, whole: float) -> str:
    """Return the mass of a part with the digits that its standard deviation leaves, in the unit of the `whole` [kg]."""
    factor, unit = mass_unit(whole)
    return f"{fixed(factor * part.mass, places_of(factor * part.mass, factor * part.std))} {unit}"


def _packed(body: Body, frame: Frame) -> dict[str, Any]:
    """Return the vertices, split where normals differ, and the triangles over them."""
    table = np.zeros(3 * len(body.triangles), _VERTEX)
    corners = body.triangles.ravel()
    table["xyz"][:, :3] = _shares(body.vertices, frame)[corners]
    table["normal"][:, :3] = np.rint(127 * corner_normals(body.vertices, body.triangles).reshape(-1, 3))
    table["rgb"][:, :3] = body.rgb[corners]
    rows, index = np.unique(table.view([("all", "V16")])["all"], return_inverse=True)
    return {"vertices": _base64(rows), "indices": _base64(index.astype("<u4")), "count": int(corners.size)}


def _points(scene: Scene, frame: Frame) -> dict[str, Any] | None:
    """Return the cloud as vertices without normals."""
    cloud = scene.points
    if cloud is None:
        return None
    xyz = cloud.xyz if scene.X_SO is None else scene.X_SO.apply(cloud.xyz)
    inside = ((xyz >= frame.low - 1e-9) & (xyz <= frame.low + frame.size + 1e-9)).all(1)
    table = np.zeros(int(inside.sum()), _VERTEX)
    table["xyz"][:, :3] = _shares(xyz[inside], frame)
    table["rgb"][:, :3] = 128 if cloud.rgb is None else cloud.rgb[inside]
    return {"vertices": _base64(table), "count": len(table)}


def _marks(estimate: Estimate, scene: Scene, frame: Frame) -> dict[str, Any]:
    """Return centre of mass with its 95 % ellipsoid, inertia ellipsoid and sensor frame, where they are known."""
    if scene.X_SO is None or not estimate.mass > 0:
        return {}
    com = estimate.com
    spread = _ellipsoid(estimate.people_covariance[1:4, 1:4])
    larger = _magnified(float(np.linalg.norm(spread, axis=1).max()), frame.size)
    marks: dict[str, Any] = {"com": _plain(com), "spread": {"axes": _plain(spread * larger), "larger": larger}}
    if isinstance(estimate, TeamEstimate):
        marks |= {"grasps": _grasps(estimate, frame), "open": True}
    else:
        marks["sensor"] = {"at": [0.0, 0.0, 0.0], "axes": np.eye(3).tolist()}
    if (ellipsoid := even_ellipsoid(estimate)) is not None:
        marks["ellipsoid"] = _plain(ellipsoid)
    return marks


def even_ellipsoid(estimate: Estimate) -> Array | None:
    """Return the half axes (3, 3) [m], one per row, of the even ellipsoid with this inertia; None where none has it."""
    if estimate.inertia_com is None or not estimate.parameters.validity().consistent:
        return None
    moments, _, ways = principal(estimate)
    squares = 5 * (moments.sum() / 2 - moments) / estimate.mass  # I_x = m (b^2 + c^2) / 5
    return np.asarray((ways * np.sqrt(np.maximum(squares, 0))).T)  # of a plate, rounding may leave less than zero


def _grasps(estimate: TeamEstimate, frame: Frame) -> dict[str, Any]:
    """Return axes and 95 % ellipsoid of every grasp, all magnified alike."""
    spreads = np.stack([_ellipsoid(grasp.covariance[3:, 3:]) for grasp in estimate.grasps.values()])
    larger = _magnified(float(np.linalg.norm(spreads, axis=-1).max()), 2 * frame.size)  # to stand out of the grippers
    rows = [
        {"at": _plain(grasp.pose.position), "axes": _plain(grasp.pose.rotation.matrix.T), "spread": _plain(s * larger)}
        for grasp, s in zip(estimate.grasps.values(), spreads, strict=True)
    ]
    return {"rows": rows, "larger": larger}


def _ellipsoid(covariance: Array) -> Array:
    """Return the half axes (3, 3), one per row, of the ellipsoid that holds 95 % of errors with covariance (3, 3)."""
    values, axes = np.linalg.eigh(covariance)
    return np.asarray((axes * np.sqrt(_CHI2_95 * np.maximum(values, 0))).T)


def _magnified(half: float, size: float) -> int:
    """Return 1, 2, 5, 10, 20 ... : how many times larger the ellipsoid must be drawn to be seen."""
    if not 0 < half < _VISIBLE * size:
        return 1
    return int(round_step(_VISIBLE * size / half))


def _shares(xyz: Array, frame: Frame) -> Integers:
    return np.clip(np.rint((xyz - frame.low) / frame.size * 65535), 0, 65535).astype(np.int64)


def _base64(array: Any) -> str:
    return base64.b64encode(np.ascontiguousarray(array).tobytes()).decode("ascii")


def _plain(values: Array) -> Any:
    """Return nested lists of numbers with the digits that a drawing needs."""
    return np.vectorize(lambda x: float(f"{x:.7g}"))(values).tolist()
