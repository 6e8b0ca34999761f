"""Colours of a surface: light taken out, noise averaged, prints and mixtures told from parts."""

from __future__ import annotations

import warnings

import numpy as np
import pytest
from parts_blocks import body, inside, solid
from scipy.spatial import cKDTree

from steelyard.parts.colour.light import Light
from steelyard.parts.colour.modes import _without_blends, colour_modes
from steelyard.parts.colour.prints import without_prints
from steelyard.parts.skin import skin_of
from steelyard.shape.cloud import Cloud
from steelyard.shape.volume import enclose

BAR = ((0, 0, 0), (0.12, 0.02, 0.02))
HALVES = [((0, 0, 0), (0.06, 0.02, 0.02)), ((0.06, 0, 0), (0.12, 0.02, 0.02))]
LAMP = np.array([0.15, -0.25, 0.41])
SIDES = np.concatenate([np.eye(3), -np.eye(3)])


def noisy(rgb, sigma, seed=0):
    return np.clip(np.round(rgb + np.random.default_rng(seed).normal(size=rgb.shape) * sigma), 0, 255).astype(np.uint8)


def two_halves(one, two):
    cloud = body(HALVES, [one, two])
    return cloud, skin_of(solid(cloud, [BAR]))


def agreement(label, true):
    """Share of points whose colour is that of most points of their true colour."""
    return max(np.mean(label == true), np.mean(label == 1 - true)) if label.max() == 1 else 0.0


def test_one_colour_is_one_mode():
    cloud = body([BAR], [(120, 130, 140)])
    modes = colour_modes(cloud.rgb, skin_of(solid(cloud, [BAR])))
    assert len(modes.rgb) == 1
    assert not modes.light.seen
    assert modes.noise == 0
    np.testing.assert_allclose(modes.rgb[0], (120, 130, 140), atol=0.5)


@pytest.mark.parametrize("sigma", [0, 5, 10])
def test_two_colours_are_told_apart_under_the_noise_of_a_camera(sigma):
    cloud, skin = two_halves((200, 60, 50), (60, 62, 66))
    modes = colour_modes(noisy(cloud.rgb, sigma), skin)
    assert len(modes.rgb) == 2
    assert agreement(modes.label, cloud.labels) > 0.98


def test_near_greys_without_noise_are_two_colours():
    cloud, skin = two_halves((229, 229, 229), (229, 234, 237))
    modes = colour_modes(cloud.rgb, skin)
    assert len(modes.rgb) == 2
    assert agreement(modes.label, cloud.labels) > 0.98


@pytest.mark.parametrize("sigma", [0, 3])
def test_a_lamp_is_found_and_taken_out(sigma):
    cloud = body([BAR], [(200, 204, 208)])
    skin = skin_of(solid(cloud, [BAR]))
    face = np.zeros_like(cloud.xyz)  # true normals: colours of a scan do not know of our triangles
    for axis in range(3):
        face[cloud.xyz[:, axis] == BAR[0][axis], axis] = -1
        face[cloud.xyz[:, axis] == BAR[1][axis], axis] = 1
    lit = noisy(0.7 * cloud.rgb * (1 + face @ LAMP)[:, None], sigma)
    modes = colour_modes(lit, skin)
    np.testing.assert_allclose(modes.light.on(SIDES) / modes.light.on(SIDES).mean(), 1 + SIDES @ LAMP, atol=0.03)
    assert np.bincount(modes.label).max() > 0.97 * len(cloud)


def test_what_nobody_saw_tells_nothing_of_the_lamp_and_is_lent_its_colour():
    """An underside has the colour of the lit points beside it: it must not be darkened once more."""
    cloud = body([BAR], [(200, 204, 208)])
    skin = skin_of(solid(cloud, [BAR]))
    face = np.zeros_like(cloud.xyz)
    for axis, (low, high) in enumerate(zip(*BAR, strict=True)):
        face[np.isclose(cloud.xyz[:, axis], low), axis] = -1
        face[np.isclose(cloud.xyz[:, axis], high), axis] = 1
    face /= np.linalg.norm(face, axis=1, keepdims=True)
    seen = ~np.isclose(cloud.xyz[:, 2], BAR[0][2])
    lit = cloud.rgb * (1 + face @ LAMP)[:, None]
    lit[~seen] = lit[seen][np.linalg.norm(cloud.xyz[~seen][:, None] - cloud.xyz[seen], axis=2).argmin(1)]
    modes = colour_modes(np.clip(lit, 0, 255).astype(np.uint8), skin, face, seen)
    assert modes.light.seen
    assert len(modes.rgb) == 1


def test_no_lamp_is_seen_where_colours_differ_by_part():
    cloud, skin = two_halves((220, 220, 220), (70, 70, 70))
    assert not colour_modes(noisy(cloud.rgb, 5), skin).light.seen


def test_a_run_from_one_colour_to_the_other_is_no_third():
    cloud, skin = two_halves((0, 255, 255), (229, 229, 229))
    along = np.clip((cloud.xyz[:, 0] - 0.055) / 0.01, 0, 1)[:, None]
    rgb = ((1 - along) * np.array([0, 255, 255]) + along * np.array([229, 229, 229])).astype(np.uint8)
    assert len(colour_modes(rgb, skin).rgb) == 2


def test_a_print_is_no_part_but_a_ring_is():
    cloud = body([BAR], [(230, 230, 230)], points=3000)
    skin = skin_of(solid(cloud, [BAR]))
    x, y, z = cloud.xyz.T
    label = np.zeros(len(cloud), dtype=np.int64)
    printed = (z == 0.02) & (abs(x - 0.03) < 0.006) & (abs(y - 0.01) < 0.006)
    ring = abs(x - 0.09) < 0.006
    label[printed], label[ring] = 1, 2
    cleaned = without_prints(label, skin)
    assert printed.sum() > 20
    assert not cleaned[printed].any()
    assert (cleaned[ring] == 2).mean() > 0.97


def test_what_is_written_on_a_label_is_no_part_either():
    cloud = body([BAR], [(230, 230, 230)], points=6000)
    skin = skin_of(solid(cloud, [BAR]))
    x, y, z = cloud.xyz.T
    label = np.zeros(len(cloud), dtype=np.int64)
    for number, half in ((1, 0.009), (2, 0.0055), (1, 0.003)):
        label[(z == 0.02) & (abs(x - 0.05) < half) & (abs(y - 0.01) < half)] = number
    assert np.bincount(label)[1:].min() > 20
    assert not without_prints(label, skin).any()


def test_the_order_of_points_changes_nothing():
    cloud, skin = two_halves((200, 60, 50), (60, 62, 66))
    rgb = noisy(cloud.rgb, 8)
    order = np.random.default_rng(1).permutation(len(cloud))
    moved = cloud.chosen(order)
    other = colour_modes(rgb[order], skin_of(solid(moved, [BAR])))
    np.testing.assert_array_equal(colour_modes(rgb, skin).label[order], other.label)


def test_a_lamp_on_a_round_body_is_found_under_the_noise_of_a_camera():
    """Near places of a ball differ little in brightness, less than the noise of one pixel."""
    k = np.arange(2500) + 0.5
    z, turn = 1 - 2 * k / 2500, np.pi * (1 + 5**0.5) * k
    normal = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    cloud = Cloud(0.03 * normal, noisy(np.array([200, 40, 40]) * (0.85 + 0.15 * normal[:, [0]]), 4))
    mesh = enclose(cloud).mesh
    modes = colour_modes(cloud.rgb[cKDTree(cloud.xyz).query(mesh.vertices)[1]], skin_of(mesh))
    np.testing.assert_allclose(
        modes.light.on(SIDES) / modes.light.on(SIDES).mean(), 1 + SIDES[:, 0] * 0.15 / 0.85, atol=0.03
    )
    assert np.bincount(modes.label).max() > 0.97 * len(mesh.vertices)


def half_lit(normals):
    """Brightness under one lamp, and a third of it from all about: the sides that face away are alike dark."""
    return 0.35 + 0.65 * np.maximum(0, normals @ np.array([0.29, -0.39, 0.87]))


def face_normals(xyz, boxes):
    """Outward normals on the faces of boxes; of the last box that a point lies on."""
    normals = np.zeros_like(xyz)
    for low, high in boxes:
        for axis in range(3):
            for bound, sign in ((low, -1), (high, 1)):
                on = np.isclose(xyz[:, axis], bound[axis]) & inside(xyz, (low, high), 1e-9)
                normals[on] = sign * np.eye(3)[axis]
    return normals


def test_a_lamp_that_leaves_the_far_side_alike_dark_splits_no_ball():
    k = np.arange(2500) + 0.5
    z, turn = 1 - 2 * k / 2500, np.pi * (1 + 5**0.5) * k
    normal = np.stack([np.sqrt(1 - z**2) * np.cos(turn), np.sqrt(1 - z**2) * np.sin(turn), z], axis=1)
    skin = skin_of(enclose(Cloud(0.03 * normal, np.zeros((2500, 3), np.uint8))).mesh)
    facing = skin.vertices / np.linalg.norm(skin.vertices, axis=1, keepdims=True)
    modes = colour_modes(noisy(np.array([200, 60, 50]) * half_lit(facing)[:, None], 4), skin, facing)
    ratio = modes.light.on(normal) / half_lit(normal)
    assert np.std(ratio) < 0.02 * np.mean(ratio)
    assert len(modes.rgb) == 1


def test_a_lamp_is_seen_on_walls_thinner_than_the_spacing():
    """Neighbours of a point on a thin wall lie on both of its sides, which are flat nevertheless."""
    walls = [((0, 0, 0), (0.16, 0.1, 0.002)), ((0, 0, 0), (0.002, 0.1, 0.06)), ((0, 0, 0), (0.16, 0.002, 0.06))]
    cloud = body(walls, [(200, 110, 30)] * 3, points=2500)
    facing = face_normals(cloud.xyz, walls)
    modes = colour_modes(noisy(cloud.rgb * half_lit(facing)[:, None], 4), skin_of(solid(cloud, walls)), facing)
    assert modes.light.seen
    assert len(modes.rgb) == 1


def test_a_thin_rod_under_a_lamp_keeps_its_colour():
    """No place of a rod is flat beside a block; it has a colour of its own all the same."""
    boxes = [((0, 0, 0), (0.08, 0.04, 0.04)), ((0.08, 0.018, 0.018), (0.2, 0.022, 0.022))]
    cloud = body(boxes, [(190, 40, 40), (90, 95, 105)], points=2500)
    facing = face_normals(cloud.xyz, boxes)
    modes = colour_modes(noisy(cloud.rgb * half_lit(facing)[:, None], 4), skin_of(solid(cloud, boxes)), facing)
    assert modes.light.seen
    assert len(modes.rgb) == 2
    assert agreement(modes.label, cloud.labels) > 0.97


@pytest.mark.parametrize("measured", [False, True], ids=["noisy points", "noisy normals"])
def test_a_lamp_is_taken_out_where_normals_are_noisy(measured):
    """The light goes by true normals; those of a rough surface, or of a camera, scatter about them."""
    rng = np.random.default_rng(2)
    facing = rng.normal(size=(3000, 3))
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    xyz = facing * [0.02, 0.03, 0.05]
    facing = facing / [0.02, 0.03, 0.05]
    facing /= np.linalg.norm(facing, axis=1, keepdims=True)
    skin = skin_of(enclose(Cloud(xyz + (0.0 if measured else 3e-4) * rng.normal(size=xyz.shape))).mesh)
    rgb = noisy(np.array([190, 180, 40]) * (0.72 + 0.36 * facing @ [0.3, -0.5, 0.81])[:, None], 3)
    told = facing + 0.15 * rng.normal(size=facing.shape)
    modes = colour_modes(rgb, skin, told / np.linalg.norm(told, axis=1, keepdims=True) if measured else None)
    assert modes.light.seen
    assert len(modes.rgb) == 1


def test_no_side_is_black_however_little_tells_of_it():
    """The fit knows the sides that are seen; on others harmonics may pass zero, and colours would burst."""
    light = Light(np.array([0.9, 0, 0, 0, 0, 0, -0.9, 0, 0, 0, 0.0]))
    assert light.on(SIDES).min() == pytest.approx(0.1)
    np.testing.assert_allclose(light.on(SIDES)[[0, 1, 2]], [1.45, 1.45, 1.0])


def test_a_colour_that_no_point_has_any_more_is_dropped_without_a_warning():
    label = np.repeat([0, 2], 10)
    modes = np.array([[0.1, 0.1, 0.1], [0.5, 0.5, 0.5], [0.9, 0.9, 0.9]])
    near = np.arange(20)[:, None] + np.arange(1, 5) - np.where(np.arange(20) < 10, 0, 10)[:, None]
    with np.errstate(all="raise"), warnings.catch_warnings():
        warnings.simplefilter("error")
        found, left = _without_blends(label, modes, near % 20, modes[label], 0.03)
    np.testing.assert_array_equal(found, np.repeat([0, 1], 10))
    np.testing.assert_array_equal(left, modes[[0, 2]])
