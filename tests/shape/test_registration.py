"""Views that are moved until they agree with the surface they give together: which way there is kept, and when."""

from __future__ import annotations

import numpy as np
import pytest
from tools_seen import right, right_volume, seen, volume
from views_apart import apart

from steelyard.errors import CannotAnswer
from steelyard.shape.scan import fuse
from steelyard.shape.scans import registration
from steelyard.shape.scans.common_table import levelled
from steelyard.shape.scans.region import object_on_table
from steelyard.shape.scans.registration import Seen, agreed
from steelyard.shape.scans.scene import Scene, scene_of
from steelyard.shape.views import Views
from steelyard.simulate.camera import disturbed
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop.catalogue import build
from steelyard.workshop.finish import painted


def wrong_by(views: Views, mm: float, deg: float) -> Views:
    return views.posed(disturbed(views.X_WC, mm, deg, np.random.default_rng(1)))


def test_to_seek_the_object_changes_nothing() -> None:
    scene = scene_of(seen().views)
    before = dict(vars(scene))
    region = object_on_table(scene)
    assert vars(scene) == before
    assert region.stands.any()
    assert 0 < region.highest < 0.1
    assert np.all(region.mask[region.stands])


def test_moves_of_a_ruler_along_itself_are_chance_unless_poses_are_known_to_be_wrong() -> None:
    scene = scene_of(seen("ruler").views)
    first = Seen.by(scene)
    plain, shown = (registration._apart(scene, first, 0.003, wrong) for wrong in (True, False))
    assert shown < 0.3 * plain
    assert shown < 0.2 * scene.sigma


def test_views_that_are_turned_about_the_object_are_turned_back() -> None:
    views = seen().views
    up = np.random.default_rng(0).normal(size=(36, 1)) * np.array([0, 0, np.radians(2.0)])
    about = np.array([*right().cloud.xyz.mean(0)[:2], 0.0])
    turn = Rotation.exp(up)
    turned = Pose(turn, about - turn.apply(about)) @ views.X_WC
    found = fuse(views.posed(turned))
    assert found.moved_m is not None
    assert volume(found) == pytest.approx(right_volume(), rel=0.04)


def test_a_low_object_is_found_from_where_what_stands_on_the_table_brings_the_views() -> None:
    """From where they were reported no fit finds it; the level of the table tells that they are far off."""
    assert volume(fuse(wrong_by(seen("ruler").views, 6.0, 1.5))) == pytest.approx(right_volume("ruler"), rel=0.25)


def test_a_wrinkle_of_the_table_is_no_low_object() -> None:
    """Of an error at the wrist: one fit agrees on the table alone, and better than on the ruler."""
    made = scan_mesh(painted(build("ruler")), 0, count=48)
    axis, shift = np.array([0.607, -0.754, -0.25]), np.array([0.254, 0.788, -0.561])
    wrong = Pose(Rotation.exp(np.radians(2.0) * axis), 6e-3 * shift)
    found = fuse(made.views.posed(made.views.X_WC @ wrong))
    assert volume(found) == pytest.approx(volume(fuse(made.views)), rel=0.1)


def test_what_little_views_share_of_a_low_object_does_not_tilt_them_again() -> None:
    """Poses far off: all views came to agree on a table 2.5 degrees askew, of which half stood out as the object."""
    made = scan_mesh(painted(build("allen-key")), 9, count=24, pose_std=(6.0, 1.5))
    assert volume(fuse(made.views)) == pytest.approx(right_volume("allen-key"), rel=0.15)


def test_a_surface_that_shows_less_is_not_taken_for_being_crossed_less() -> None:
    scene = scene_of(wrong_by(seen("screwdriver").views, 6.0, 1.5))
    off = levelled(scene)
    agreed(scene, Seen.by(scene), off)
    assert apart(scene, seen("screwdriver").views.X_WC) < 1e-3


def test_a_try_that_loses_the_object_is_none(monkeypatch: pytest.MonkeyPatch) -> None:
    scene = scene_of(wrong_by(seen().views, 4.0, 1.0))
    off, first = levelled(scene), Seen.by(scene)
    R = scene.R

    def lost(scene: Scene, seen: Seen, windows: tuple[float, ...], level: bool, near: bool = False) -> Seen:
        if windows in given:
            raise CannotAnswer("no object was found.")
        return fitted(scene, seen, windows, level, near)

    fitted, given = registration._fitted, [registration._FAR]
    monkeypatch.setattr(registration, "_fitted", lost)
    agreed(scene, first, off)
    assert scene.R is not R  # brought by the other try
    given.append(registration._WINDOWS)
    scene.R = R
    assert agreed(scene, first, off) is first
    assert scene.R is R


@pytest.mark.parametrize("count", [1, 2])
def test_the_spread_of_few_views_is_a_number(count: int) -> None:
    """Whoever prints it as JSON needs one."""
    views = seen().views
    first = Seen.by(scene_of(views.chosen(np.arange(count))))
    assert np.isfinite(first.spread)
