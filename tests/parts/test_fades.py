"""Colours that fade into one another are one material; a leap, or a third colour between the two, is not."""

from __future__ import annotations

import numpy as np
import pytest
from parts_blocks import body, solid

from steelyard.parts.colour.fades import without_fades
from steelyard.parts.colour.modes import colour_modes
from steelyard.parts.skin import skin_of

BAR = ((0, 0, 0), (0.12, 0.02, 0.02))
BROWN, GREY, STEEL = (np.array(rgb, dtype=float) for rgb in ((200, 160, 110), (150, 148, 144), (60, 62, 68)))


def coloured(paint, sigma=0.0):
    """Return the modes of a bar painted along its length x [m], what fades being joined, and the x of its points."""
    cloud = body([BAR], [(0, 0, 0)])
    x = cloud.xyz[:, 0]
    rgb = paint(x) + np.random.default_rng(0).normal(size=(len(x), 3)) * sigma
    skin = skin_of(solid(cloud, [BAR]))
    modes = colour_modes(np.clip(np.round(rgb), 0, 255).astype(np.uint8), skin)
    return modes, without_fades(modes, skin), x


def ramp(x, begin, end):
    return np.clip((x - begin) / (end - begin), 0, 1)[:, None]


@pytest.mark.parametrize("sigma", [0, 3])
def test_a_worn_end_has_the_colour_it_fades_into(sigma):
    modes, label, _ = coloured(lambda x: BROWN + ramp(x, 0.07, 0.085) * (GREY - BROWN), sigma)
    assert np.bincount(modes.label).max() < 0.7 * len(label)
    assert np.bincount(label).max() > 0.98 * len(label)  # specks of noise are left to the prints


@pytest.mark.parametrize("sigma", [0, 4])
def test_a_leap_is_kept(sigma):
    modes, label, _ = coloured(lambda x: np.where((x > 0.07)[:, None], GREY, BROWN), sigma)
    np.testing.assert_array_equal(label, modes.label)
    assert np.ptp(label) == 1


def test_a_blur_narrower_than_a_step_between_points_is_a_leap():
    modes, label, _ = coloured(lambda x: BROWN + ramp(x, 0.07, 0.072) * (GREY - BROWN))
    np.testing.assert_array_equal(label, modes.label)
    assert np.ptp(label) == 1


def test_a_ring_of_a_colour_between_the_two_joins_nothing():
    middle = (BROWN + STEEL) / 2
    ring = lambda x: np.where((x < 0.06)[:, None], BROWN, np.where((x < 0.064)[:, None], middle, STEEL))  # noqa: E731
    _, label, x = coloured(ring)
    assert not set(label[x < 0.055]) & set(label[x > 0.07])


def test_two_materials_that_wear_to_one_grey_stay_two():
    """Brown and steel meet at 0.06 in a patch worn grey on both sides: it is shared out, and joins the two not."""
    _, label, x = coloured(
        lambda x: (
            np.where((x < 0.06)[:, None], BROWN, STEEL)
            + ramp(np.abs(x - 0.06), 0.027, 0.012) * (GREY - np.where((x < 0.06)[:, None], BROWN, STEEL))
        )
    )
    assert len(np.unique(label)) == 2
    assert np.mean((label == label[x.argmin()]) == (x < 0.06)) > 0.95
