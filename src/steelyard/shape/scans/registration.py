"""Poses that are slightly off: every view is moved until it agrees with the surface that all views give together."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from scipy.spatial import cKDTree

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.shape.scans.common_table import slid
from steelyard.shape.scans.depth_images import FACING
from steelyard.shape.scans.patches import no_surface, settled, settled_patches, surface_of, surfels, well_spread
from steelyard.shape.scans.pose_errors import PoseErrors
from steelyard.shape.scans.region import Region, object_on_table
from steelyard.shape.scans.scene import WINDOW, Scene
from steelyard.shape.scans.unsure_volume import unsure_volume
from steelyard.shape.scans.view_planes import INCIDENCE
from steelyard.shape.scans.view_steps import Sights, moved, moved_together

_REPORTED = np.radians(2.0), 0.01  # how far poses may be off before anything was seen of it, per axis [rad], [m]
_ANYWHERE = np.radians(15.0), 0.07  # the same where views are to show by themselves whether they are
_APART = 0.8  # of the depth noise: views that one fit moves apart by less are left where they are, rms
_NEARBY = 0.003  # views that one fit moves apart by less need no search [m], rms
_UNTOLD = 0.001  # nor those that it moves by less and whose table does not tell that they are off
_FINE = (0.006, 0.006, *[0.003] * 6)  # how far off the surface views may be, round by round [m]
_TOGETHER = 0.006  # in rounds of that and less all views step at once: farther off, one side may pass for another [m]
_FOOT = 0.003  # from what stands on the table: there it shows in some views only [m]
_LEVEL = 0.97  # cosine of the normals of a table with the vertical
_WINDOWS = (0.012, 0.012, *_FINE)
_FAR = (0.02, 0.02, 0.02, *_WINDOWS)
_MODEL = 2500  # points that views are fitted to
_NEAR = 0.005  # of the surface: what measures it, as far as it is asked whether the views agree [m]
_STANDS_OUT = 4.0  # times the depth noise: what is higher is not the table
_SAME = 0.1  # of the depth noise: views that spread by less are as good as each other
_ON = 3.0  # times the depth noise: so near the surface a pixel lies on it
_SAMPLES = 200_000  # pixels that are asked whether they do


@dataclass(frozen=True, eq=False)
class Seen:
    """The object as the views have it together.

    region   where it lies      patches  (N, 8) of its surface and of the table around it
    model    (M, 8) well-spread ones of those, which views are fitted to
    spread   median spread of the views about the surface, in standard deviations of depth
    errors   what is believed of the reported poses, None where the cameras are still there
    """

    region: Region
    patches: Array
    model: Array
    spread: float
    errors: PoseErrors | None = None

    @classmethod
    def by(cls, scene: Scene) -> Seen:
        """Return what the views see from where their cameras now are; CannotAnswer where they agree on nothing."""
        region = object_on_table(scene)
        patches = surfels(scene, region)
        model = well_spread(patches, _MODEL, 2 * scene.pixel)
        xyz, normal = _model(scene, model, _NEAR)
        support = settled(scene, xyz, normal, _NEAR, 1)
        good = support[:, 0] >= scene.enough
        if not good.any():
            raise no_surface()
        expected = _expected(scene, xyz[good], normal[good]) * _of_few(support[good, 0])
        return cls(region, patches, model, float(np.median(support[good, 2] / expected)))


def _of_few(views: Array) -> Array:
    """Return the median spread (N,) of so many views about their own mean, in standard deviations of one.

    Median of chi squared by Wilson and Hilferty: views that are few lie nearer to their mean than to the surface.
    """
    free = np.maximum(views - 1, 1)
    return np.asarray(np.sqrt(free / (free + 1) * (1 - 2 / (9 * free)) ** 3))


def _expected(scene: Scene, xyz: Array, normal: Array) -> Array:
    """Return the spread (N,) [m] that noise makes about points (N, 3): cameras are nearer to those high up."""
    far = (scene.p**2).sum(1)[:, None] - 2 * scene.p @ xyz.T + (xyz**2).sum(1)
    faces = scene.p @ normal.T - (xyz * normal).sum(1) > FACING * np.sqrt(far)
    square, seen = np.where(faces, far, 0.0).sum(0), faces.sum(0)
    usual = scene.distance**2
    return INCIDENCE * scene.noise * np.where(seen > 0, square / np.maximum(seen, 1), usual)


@dataclass(frozen=True, eq=False)
class _Try:
    """What the views see from cameras at R (V, 3, 3), p (V, 3), and how far they contradict it.

    crossed  share of what they say of the object's surface that is to have seen past it
    shown    pixels that lie on it, of those looked at
    """

    seen: Seen
    R: Array
    p: Array
    crossed: float
    shown: int

    @classmethod
    def of(cls, scene: Scene, seen: Seen) -> _Try:
        """Return the judgement of what is seen from where the cameras now are; CannotAnswer where that is nothing."""
        R, p = scene.R, scene.p
        scene.p = p.copy()
        xyz, normal = surface_of(scene, seen.patches, seen.region, _MODEL)
        on, past = settled(scene, xyz, normal, WINDOW, 0)[xyz[:, 2] > _STANDS_OUT * scene.sigma, :2].sum(0)
        pixels = scene.sampled(_SAMPLES)[:, :3]
        pixels = pixels[seen.region.holds(pixels)]
        away, row = cKDTree(xyz).query(pixels, distance_upper_bound=_NEAR)
        pixels, row = pixels[away < _NEAR], row[away < _NEAR]
        off = np.abs(((pixels - xyz[row]) * normal[row]).sum(1))
        # Nearer to it than to the table: a blurred rim must not pass the table's pixels for its own.
        shown = (off < _ON * scene.sigma) & (off < pixels[:, 2])
        return cls(seen, R, p, float(past / max(on + past, 1.0)), int(shown.sum()))


def agreed(scene: Scene, first: Seen, off: float) -> Seen:
    """Return what the views see, their cameras moved until they agree where that makes it better.

    first  from the poses as they are
    off    how far off views had the table before they were levelled, rms [m]; 0 where they were not

    Views and the surface that they give together are fitted to each other in turn. One such fit tells whether it is
    worth while: how far it would move the views apart. Where poses are off by more than a little, it is tried from
    where they are and from where `slid` brings them. A try that loses the object is none.
    """
    if len(scene.R) < 2 or _apart(scene, first, _FINE[-1], off > 0) < _APART * scene.sigma:
        return first
    given, tries = (scene.R, scene.p), []
    near = off < _NEARBY and _apart(scene, first, _FAR[0], off > 0) < (_NEARBY if off else _UNTOLD)
    fits: list[Callable[[], Seen]] = [
        lambda: first,
        lambda: _fitted(scene, first, _FINE if near else _FAR, off > 0, near),
    ]
    if off and not near:
        fits.append(lambda: _fit_slid(scene))
    for fit in fits:
        scene.R, scene.p = given
        with suppress(CannotAnswer):
            tries.append(_Try.of(scene, fit()))
    if not tries:
        raise no_surface()
    # Shares are added of what contradicts a try: views see past its surface, show less of it than of the best, and
    # spread more about it than about the best. Of a low object, which cannot be crossed, the last two tell.
    most, least = max(each.shown for each in tries), max(min(each.seen.spread for each in tries), _SAME)
    best = min(tries, key=lambda each: each.crossed - each.shown / max(most, 1) + each.seen.spread / least)
    scene.R, scene.p = best.R, best.p
    return best.seen


def left_open(scene: Scene, seen: Seen, xyz: Array, normal: Array) -> float:
    """Return the standard deviation of the volume [m^3] that moved cameras leave open, 0 where they are as reported.

    xyz, normal  even points (N, 3) of the object's surface and their normals
    """
    if seen.errors is None:
        return 0.0
    return unsure_volume(_sights(scene, seen, _FINE[-1]), seen.errors, xyz, normal)


def _fit_slid(scene: Scene) -> Seen:
    slid(scene)
    return _fitted(scene, Seen.by(scene), _WINDOWS, level=True)


def _apart(scene: Scene, seen: Seen, window: float, wrong: bool) -> float:
    """Return how far one fit to the surface would move apart what the views see of the object, rms [m].

    wrong  whether poses are known to be: else moves along the surface, such as those of a ruler along itself, are
           chance, and count as little as they show
    """
    sights = _sights(scene, seen, window)
    after = moved(sights, PoseErrors.unknown(scene.given.rotation.matrix, *_ANYWHERE)).images
    xyz, normal = sights.xyz, sights.normal
    high = xyz[:, 2] > _STANDS_OUT * scene.sigma
    xyz, normal = (xyz[high], normal[high]) if high.any() else (xyz, normal)
    shares, axes = np.linalg.eigh(normal.T @ normal / len(normal))
    # All of a move where normals point everywhere.
    shown = np.eye(3) if wrong else (axes * np.sqrt(np.minimum(3 * shares.clip(0), 1))).T
    turn = after.R @ np.swapaxes(scene.R, 1, 2)
    shift = after.p - np.einsum("vij,vj->vi", turn, scene.p)
    middle = xyz.mean(0)
    # Over all points: the mean of squares is that of the middle and of what turns about it do.
    about = (xyz - middle).T @ (xyz - middle) / len(xyz)
    turns = shown @ (turn - turn.mean(0))
    by_turns = np.einsum("vij,jk,vik->v", turns, about, turns).mean()
    return float(np.sqrt(((turn @ middle + shift) @ shown.T).var(0).sum() + by_turns))


def _fitted(scene: Scene, seen: Seen, windows: tuple[float, ...], level: bool, near: bool = False) -> Seen:
    """Return what the views see once they are fitted to their own surface, which may be off by windows [m] in turn.

    level  whether every view was turned and lifted until it had the table level: while views are far apart, what
           little of a low thing they share must not tilt them again
    near   whether the reported poses are: of what views hardly show, poses far off tell less than they do
    """
    errors = PoseErrors.unknown(scene.given.rotation.matrix, *_REPORTED)
    for window in windows:
        sights = _sights(scene, seen, window)
        errors = errors.seen(sights.off(), *sights.each_by_itself())
        sights = (
            moved(sights, errors, level) if window > _TOGETHER else moved_together(sights, errors if near else None)
        )
        scene.R, scene.p = sights.images.R, sights.images.p
        seen = replace(Seen.by(scene), errors=errors)
    return seen


def _sights(scene: Scene, seen: Seen, window: float) -> Sights:
    """Return the views and the surface that they give together, which may be off by a window [m]."""
    xyz, normal = _model(scene, seen.model, window)
    return Sights(scene.images, xyz, normal, window + 4 * scene.sigma, scene.noise, scene.given, xyz.mean(0))


def _model(scene: Scene, patches: Array, window: float) -> tuple[Array, Array]:
    """Return the points (N, 3) of patches (N, 8) as all views have them together, and their normals.

    CannotAnswer where they give none.
    """
    xyz, normal, support = settled_patches(scene, patches, window, 1)
    good = support[:, 0] >= scene.enough
    if not good.any():
        raise no_surface()
    xyz, normal = xyz[good], normal[good]
    clear = _clear_of_feet(xyz, normal, 4 * scene.sigma, _FOOT + 4 * scene.sigma)
    return (xyz[clear], normal[clear]) if clear.any() else (xyz, normal)


def _clear_of_feet(xyz: Array, normal: Array, low: float, near: float) -> Any:
    """Return which of points (N, 3) do not lie where things meet the table: no higher than `low` [m], and `near` [m].

    From one side views have the table there, from the other what stands on it: they would never agree, and push each
    other away from it.
    """
    clear = xyz[:, 2] >= low
    on_table = np.flatnonzero(~clear)
    away, _ = cKDTree(xyz[clear, :2]).query(xyz[on_table, :2], distance_upper_bound=near)
    clear[on_table] = (away >= near) & (normal[on_table, 2] >= _LEVEL)
    return clear
