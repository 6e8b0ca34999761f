"""A table left in a cloud is named; thin plates, open boxes and channels are none."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.shape.cloud import Cloud
from steelyard.shape.points.left_table import left_table
from steelyard.shape.volume import enclose
from steelyard.workshop.sheets import channel, sheet_of
from steelyard.workshop.solids import block, rod, union

THING = block((0, 80), (0, 40), (0, 30))
PLATE = block((0, 120), (0, 80), (0, 1.5))


def points(body: object, noise_mm: float = 0.0) -> np.ndarray:
    xyz = sheet_of("a body", body, np.random.default_rng(0), 2000).cloud.xyz
    return np.asarray(xyz + np.random.default_rng(2).normal(size=xyz.shape) * noise_mm * 1e-3)


def on_table(xyz: np.ndarray, side: float) -> np.ndarray:
    """Points of an object as cameras see it, from above, with so much table around it [m]."""
    apart = Cloud(xyz).near.spacing
    low, high = xyz[:, :2].min(0) - side, xyz[:, :2].max(0) + side
    table = np.random.default_rng(1).uniform(low, high, (int(np.prod(high - low) / apart**2), 2))
    free = ~((table > xyz[:, :2].min(0)) & (table < xyz[:, :2].max(0))).all(1)
    seen = xyz[xyz[:, 2] > apart]
    return np.concatenate([seen, np.column_stack([table[free], np.zeros(free.sum())])])


def spacing(xyz: np.ndarray) -> float:
    return Cloud(xyz).near.spacing


@pytest.mark.parametrize("side", [0.02, 0.05, 0.15])
@pytest.mark.parametrize("noise_mm", [0.0, 0.3])
def test_a_table_is_named(side: float, noise_mm: float) -> None:
    xyz = on_table(points(THING), side)
    xyz += np.random.default_rng(2).normal(size=xyz.shape) * noise_mm * 1e-3
    solid = enclose(Cloud(xyz))
    assert "table-in-cloud" in {finding.code for finding in solid.findings}
    assert solid.volume_std > 0.4


@pytest.mark.parametrize(
    "body",
    [
        THING,
        PLATE,
        union([PLATE, rod(8, 1.5, 60).translate([50, 40, 0])]),
        block((0, 100), (0, 80), (0, 50)) - block((1.5, 98.5), (1.5, 78.5), (1.5, 60)),
        channel(150, 15, 20, 1.5),
    ],
    ids=["brick", "plate", "post on a plate", "open box", "channel"],
)
@pytest.mark.parametrize("noise_mm", [0.0, 0.3])
def test_nothing_else_is_a_table(body: object, noise_mm: float) -> None:
    xyz = points(body, noise_mm)
    assert left_table(xyz, spacing(xyz)) is None
    turned = xyz @ np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    assert left_table(turned, spacing(turned)) is None


def test_what_views_gave_stands_on_no_table() -> None:
    xyz = on_table(points(THING), 0.05)
    solid = enclose(Cloud(xyz, seen=np.ones(len(xyz), np.bool_)))
    assert "table-in-cloud" not in {finding.code for finding in solid.findings}


def test_few_points_are_no_table_and_no_error() -> None:
    rng = np.random.default_rng(4)
    for count in range(22, 60):
        xyz = rng.uniform(size=(count, 3)) * [1.0, 1.0, rng.choice([0.2, 1.0])]
        xyz[: count // 4, 2] = 0
        left_table(xyz, 0.05 * rng.integers(1, 9))
