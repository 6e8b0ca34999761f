"""The objects of the held-object bench: their parts true, split or merged, their rows, and the methods compared."""

from __future__ import annotations

import zlib
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from steelyard.bench.objects.cuts import interior_points, slabs
from steelyard.check import Array
from steelyard.datasets.known_object import KnownObject
from steelyard.errors import BadValue
from steelyard.identify.estimate import Estimate
from steelyard.identify.geodesic_shape import ShapeGeodesic, published_prior
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.part_cuts import PartCuts
from steelyard.identify.part_masses import PartMasses
from steelyard.identify.part_masses_published import PublishedPartMasses
from steelyard.identify.point_masses import PointMasses
from steelyard.io.object_folders import read_object
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments
from steelyard.parts.parts import Parts
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.nesting import solids_of
from steelyard.simulate.handling import STILL_ANGULAR_SPEED, STILL_SPEED, with_noise

if TYPE_CHECKING:
    from steelyard.bench.objects.segmented import Segmented

PARTS = ("segmented", "truth", "truth-split", "truth-merged", "truth-merged-mixed")
PART_METHODS = ("ours", "ours-still", "hps")
RIVALS = ("geo", "geo-published-prior", "ols", "point-mass")
METHODS = (*PART_METHODS, "paper-route", *RIVALS)
POINTS = 600
# A thousandth of the scenario "low".
TRACE = Noise.of_std(2.5e-4, 2.5e-5, 5e-5, 2.5e-6)
# Densities that differ by less than the first share are the same material, by more than the second another one.
SAME_DENSITY, OTHER_DENSITY = 1e-3, 0.2
# A piece with less than this share of its part is no piece.
SMALLEST_PIECE = 0.02


@dataclass(frozen=True, eq=False)
class Case:
    """An object with the parts given to the estimators, and its exact rows.

    parts        in S; part_masses (P,) [kg] their true masses, None where unknown
    log          exact and ordered, rows at rest marked by their true speed
    true_parts   the object's own parts in S, for the bound; groups of them share a density
    seen         what its cloud gives, where the parts are found and not given
    """

    known: KnownObject
    parts: Parts
    part_masses: Array | None
    log: MotionLog
    true_parts: Parts
    groups: tuple[tuple[int, ...], ...]
    seen: Segmented | None = None

    @property
    def bounds(self) -> Array:
        """Corners (2, 3) [m] of a box with the edges of the object's box in S."""
        return np.stack([np.zeros(3), self.known.box])


def load_case(folder: Path, parts: str) -> Case | None:
    """Return the case of an object folder, None where `parts` does not apply to the object (nothing to merge)."""
    known = read_object(folder)
    own = known.parts_in_sensor
    groups = _same_density(own, known.part_masses)
    chosen = own
    masses = known.part_masses
    seen = None
    if parts == "segmented":
        from steelyard.bench.objects.segmented import segmented

        seen = segmented(known)
        chosen, masses = seen.parts, None
    elif parts == "truth-split":
        chosen, owner = split_parts(known)
        share = chosen.volume / own.volume[owner]
        masses = None if masses is None else masses[owner] * share
    elif parts != "truth":
        joined = groups if parts == "truth-merged" else _different_density(own, masses)
        if joined is None:
            return None
        chosen = own.merged(joined)
        masses = None if masses is None else np.array([masses[list(g)].sum() for g in joined])
    return Case(known, chosen, masses, exact_rows(known), own, tuple(tuple(g) for g in groups), seen)


def exact_rows(known: KnownObject) -> MotionLog:
    """Return the noise-free rows of the object's motion; rows at rest are marked by their true speed."""
    track = known.track
    if track is None:
        raise BadValue(f"{known.name} has no motion.npz, so there is nothing to identify it from.")
    speed, turn = (np.linalg.norm(v, axis=1) for v in (track.velocity, track.angular_velocity))
    return MotionLog(
        wrench=np.concatenate([track.torque, track.force], 1),
        gravity=track.gravity,
        acceleration=track.acceleration,
        angular_velocity=track.angular_velocity,
        angular_acceleration=track.angular_acceleration,
        still=(speed < STILL_SPEED) & (turn < STILL_ANGULAR_SPEED),
    )


def noisy_rows(case: Case, noise: str, seed: int) -> MotionLog:
    """Return the rows with the noise of a scenario, shuffled; the draw is that of (seed, object, scenario)."""
    rng = np.random.default_rng([seed, zlib.crc32(case.known.name.encode()), zlib.crc32(noise.encode())])
    log = with_noise(case.log, noise, rng)
    if log.noise is None:
        # Without noise there is none to estimate either: rows marked still do accelerate. A trace is declared.
        log = replace(log, noise=(TRACE,))
    return log.rows(rng.permutation(len(log)))


def densities(parts: Parts, masses: Array | None) -> Array:
    """Return what parts of these masses (P,) are made of (P,) [kg/m^3]; raises BadValue where they are not known."""
    if masses is None:
        raise BadValue("The true masses of the parts are not in truth.json, so neither are their densities.")
    return masses / parts.volume


def _same_density(parts: Parts, masses: Array | None) -> list[list[int]]:
    """Return groups of parts with one density; every part alone where densities are not known."""
    if masses is None:
        return [[k] for k in range(len(parts))]
    density = densities(parts, masses)
    groups: list[list[int]] = []
    for k in range(len(parts)):
        home = next((g for g in groups if abs(density[g[0]] / density[k] - 1) < SAME_DENSITY), None)
        if home is None:
            groups.append([k])
        else:
            home.append(k)
    return groups


def _different_density(parts: Parts, masses: Array | None) -> list[list[int]] | None:
    """Return groups that join the heaviest two parts of different density, None where there are none."""
    density = densities(parts, masses)
    mass = density * parts.volume
    pairs = [
        (mass[i] + mass[j], i, j)
        for i in range(len(parts))
        for j in range(i)
        if abs(np.log(density[i] / density[j])) > OTHER_DENSITY
    ]
    if not pairs:
        return None
    _, i, j = max(pairs)
    return [[j, i], *([k] for k in range(len(parts)) if k not in (i, j))]


def split_parts(known: KnownObject) -> tuple[Parts, np.ndarray[tuple[int], np.dtype[np.int64]]]:
    """Return the true parts in S cut across their longest axis in two or three pieces (by a fixed draw), and whose
    part each piece is. Moments are exact and add up to those of the part.
    """
    mesh = known.mesh.in_frame(known.X_SO)
    solids = solids_of(mesh)
    rng = np.random.default_rng(zlib.crc32(known.name.encode()))
    moments, owner = [], []
    for k, label in enumerate(known.parts.label):
        labels = [int(label), *solids.void[solids.parent == label].tolist()]
        pieces = _pieces(mesh, labels, known.parts_in_sensor.moments[k], int(rng.integers(2, 4)))
        moments.append(pieces)
        owner += [k] * len(pieces)
    stacked = np.concatenate(moments)
    return Parts(np.arange(len(stacked)), stacked), np.array(owner)


def _pieces(mesh: TriangleMesh, labels: list[int], whole: Array, count: int) -> Array:
    """Return the moments of a part cut in `count` pieces: where a rod of its length would be cut in equal ones."""
    corners = mesh.corners[np.isin(mesh.part, labels)]
    centroid = whole[1:4] / whole[0]
    second = -whole[[[4, 5, 6], [5, 7, 8], [6, 8, 9]]]
    values, axes = np.linalg.eigh((second - np.trace(second) / 2 * np.eye(3)) / whole[0] - np.outer(centroid, centroid))
    length = np.sqrt(12 * values[-1])
    offsets = centroid @ axes[:, -1] + length * (np.arange(1, count) / count - 0.5)
    pieces = slabs(corners, whole, axes[:, -1], offsets)
    if pieces[:, 0].min() > SMALLEST_PIECE * whole[0]:
        return pieces
    return whole[None] if count == 2 else _pieces(mesh, labels, whole, 2)


@dataclass(frozen=True, eq=False)
class Method:
    """One method on one object.

    identify  log -> Estimate: what is scored
    rows      the rows it is given, from all
    solve     moments -> Estimate, the timed step; None = `identify` itself is timed, rows and all
    """

    name: str
    identify: Callable[[MotionLog], Estimate]
    rows: Callable[[MotionLog], MotionLog]
    solve: Callable[[Moments], Estimate] | None


def methods_for(case: Case, names: tuple[str, ...]) -> list[Method]:
    """Return the methods of those names for one object; the wrench has no bias and none estimates one."""
    estimators: dict[str, Callable[[], PartMasses | PartCuts | ShapeGeodesic | LeastSquares | PointMasses]] = {
        "ours": lambda: _ours(case),
        "ours-still": lambda: _ours(case),
        "geo": lambda: ShapeGeodesic(case.true_parts.uniform()),
        "geo-published-prior": lambda: ShapeGeodesic(published_prior(_inside(case)), float(case.known.truth.mass)),
        "ols": lambda: LeastSquares("ordinary", bias="none"),
        "point-mass": lambda: PointMasses(_inside(case)),
    }
    out = []
    for name in names:
        if name == "hps" or (name == "paper-route" and case.seen is not None):
            parts = case.parts if name == "hps" or case.seen is None else case.seen.paper
            out.append(Method(name, PublishedPartMasses(parts).identify, _all_rows, None))
            continue
        if name not in estimators:
            raise BadValue(f"There is no method '{name}' here; there are: {', '.join(METHODS)}.")
        made = estimators[name]()
        out.append(Method(name, made.identify, _still_rows if name == "ours-still" else _all_rows, made.solve))
    return out


def _ours(case: Case) -> PartMasses | PartCuts:
    """Return our estimator: with the parts given, or over the cuts of what was seen."""
    if case.seen is None:
        return PartMasses(case.parts, bias="none")
    return PartCuts(case.seen.cuts, case.seen.prior, bias="none", shape_error=case.seen.error)


def _inside(case: Case) -> Array:
    """Return points (K, 3) inside the object, in S."""
    return interior_points(case.known.mesh.in_frame(case.known.X_SO), POINTS)


def _all_rows(log: MotionLog) -> MotionLog:
    return log


def _still_rows(log: MotionLog) -> MotionLog:
    """Return the rows at rest, as rows that still accelerate a little: the reading stays, with its noise."""
    chosen = log.rows(log.still)
    return replace(chosen, still=np.zeros(len(chosen), np.bool_))
