"""What a scan has to tell: of the surface it found, and of what was put right of the views."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, counted
from steelyard.shape.scans.image_borders import cut_off
from steelyard.shape.scans.placement import Placement
from steelyard.shape.scans.scene import Scene
from steelyard.shape.views import Intrinsics

_WRONG = 2.5  # times the depth noise: views that spread more are wrong in something else than their noise
_FAR = 0.02  # rms move of the cameras [m] that no arm's error explains
TABLE_OFF = 0.003  # of the table in the views, rms [m], from which on poses or camera are said to be wrong
_LEAST_SEEN = 0.25  # of the points: scans with views from all sides see half
_LOST = 0.1  # of where the object stands: so much without surface is not a ragged rim


@dataclass(frozen=True, eq=False)
class Surface:
    """What was seen of the object: points (N, 3) and normals, and how well the views agree on them.

    others    objects that stand beside it
    disagree  spread of the views, in depth noise
    shift     rms move of the cameras that made them agree [m], None where none was needed
    lost      share of where the object stands without surface
    unsure_m3  standard deviation of the volume that moved cameras leave open [m^3]
    """

    xyz: Array
    normal: Array
    others: int
    disagree: float
    shift: float | None
    lost: float
    unsure_m3: float = 0.0


@dataclass(frozen=True)
class Level:
    """How far off the views had the table before they were levelled, rms [m], 0 where they were not; the lens as it was
    given, and the one with which they have one table, None where the given one is as good."""

    off: float
    given: Intrinsics
    lens: Intrinsics | None


def findings_of(
    scene: Scene, surface: Surface, level: Level, placed: Placement | None, mistake: Callable[[], str]
) -> tuple[Finding, ...]:
    """Return what to say of the surface, and of the views: `placed` after registration, None where none was needed.

    mistake  what is likely wrong with all views alike, in words; it is asked only where they do not agree
    """
    return tuple(_found(scene, surface, level, placed, mistake))


def _found(
    scene: Scene, surface: Surface, level: Level, placed: Placement | None, mistake: Callable[[], str]
) -> Iterator[Finding]:
    disagree, shift = surface.disagree, surface.shift
    if others := surface.others:
        kept = "the largest where most cameras look was kept"
        text = f"{others + 1} separate objects stand on the table where the cameras look; {kept}."
        yield Finding.of("several-objects", text)
    far = shift is not None and (shift > _FAR or level.off > TABLE_OFF)
    why = " " + said if (disagree > _WRONG or far) and (said := mistake()) else ""
    if disagree > _WRONG:
        text = (
            f"The views of one surface spread {disagree:.1f} times as far as the depth noise of "
            f"{1e3 * scene.sigma:.2g} mm, even where moving the cameras was tried; expected below {_WRONG:g}."
        )
        yield Finding.of("views-disagree", text + why)
    if far or level.lens or (placed and placed.at_wrist):
        yield Finding.of("views-disagree", _said_of(level, shift, placed) + why)
    if cut := cut_off(scene, surface.xyz, surface.normal):
        yield cut
    # What is cut off has no surface for that reason.
    elif (lost := surface.lost) > _LOST:
        text = (
            f"Of where the object stands on the table {100 * lost:.0f} % has no surface in the cloud: it is too "
            f"low, or too narrow for pixels {1e3 * scene.pixel:.2g} mm wide. Bring the camera nearer, and check "
            "fx, fy, cx, cy in camera.json."
        )
        yield Finding.of("surface-open", text)


def few_seen(share: float, views: int, enough: int) -> tuple[Finding, ...]:
    """Return the finding on a surface that is mostly what closes it; `share` of the points were seen.

    enough  views that must see a place of the surface
    """
    if share >= _LEAST_SEEN:
        return ()
    text = (
        f"Only {100 * share:.0f} % of the points were seen, in {counted(views, 'view')}; the rest closes what is left."
    )
    remedy = f"Take more views, from all sides and heights: {enough} must see each place of the surface."
    return (Finding("surface-open", text, remedy),)


def _said_of(level: Level, shift: float | None, placed: Placement | None) -> str:
    """Return what was put right of views that did not agree, `shift` [m] of the cameras by registration."""
    said = []
    if level.off:
        said.append(f"The views have the table {1e3 * level.off:.2g} mm (rms) too high or too low at the object.")
    if lens := level.lens:
        said.append(f"They were read with {_named(lens)} instead of {_named(level.given)}: then they have one table.")
    if shift:
        said.append(f"The cameras had to be moved by {1e3 * shift:.2g} mm (rms) until the views agreed.")
    if placed and (wrist := placed.at_wrist):
        said.append(
            f"A camera that sits {1e3 * wrist[0]:.2g} mm and {np.degrees(wrist[1]):.2g} degrees from where its pose at "
            "the wrist says explains most of that: calibrate it anew."
        )
    return " ".join(said)


def _named(lens: Intrinsics) -> str:
    return f"fx {lens.fx:.0f}, fy {lens.fy:.0f}, cx {lens.cx:.0f}, cy {lens.cy:.0f}"
