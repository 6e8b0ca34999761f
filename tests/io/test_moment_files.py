"""Moments in files: what is written is read again and adds up; each wrong file has its one sentence."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io.moment_files import read_moments, write_moments
from steelyard.logs.log import Noise
from steelyard.logs.moments import SIZE, Moments

QUIET, LOUD = Noise.of_std(0.1, 0.01, 0.02, 0.001), Noise.of_std(0.8, 0.1, 0.3, 0.01)


def made(noise: tuple[Noise, ...] | None = (QUIET, LOUD), groups: int = 4) -> Moments:
    z = np.random.default_rng(0).normal(size=(groups, 50, SIZE))
    z[..., -1] = 1
    k = np.arange(groups)
    return Moments(np.swapaxes(z, 1, 2) @ z, k % 2, k // 2 - 1, k > 1, noise)


@pytest.mark.parametrize("groups", [0, 4])
@pytest.mark.parametrize("noise", [(QUIET, LOUD), None])
def test_moments_come_back_and_can_be_added(tmp_path: Path, noise: tuple[Noise, ...] | None, groups: int) -> None:
    moments, path = made(noise, groups), tmp_path / "moments.npz"
    write_moments(moments, path)
    assert [entry.name for entry in tmp_path.iterdir()] == ["moments.npz"]
    back = read_moments(path)
    for name in ("scatter", "noise_class", "block", "still"):
        assert np.array_equal(getattr(back, name), getattr(moments, name))
        assert getattr(back, name).dtype == getattr(moments, name).dtype
    assert (back.noise is None) == (noise is None)
    for mine, theirs in zip(noise or (), back.noise or (), strict=True):
        assert np.array_equal(mine.acceleration, theirs.acceleration)
        assert np.array_equal(mine.wrench, theirs.wrench)
    np.testing.assert_allclose((back + moments).sum, 2 * moments.sum, rtol=1e-13)


def test_a_file_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadFile) as caught:
        write_moments(made(), tmp_path / "no" / "moments.npz")
    assert str(caught.value) == f"{tmp_path}/no/moments.npz: cannot be written (No such file or directory)."


def lopsided() -> np.ndarray:
    scatter = made().scatter.copy()
    scatter[0, 0, 1] += 1
    return scatter


EVEN = "scatter must hold sums of z z^T: symmetric, with no diagonal entry below zero."
ROWS = "acceleration_variance and wrench_variance must have a row per noise class each; got (2, 6) and (3, 6)."
NAMES = "scatter, noise_class, block, still, acceleration_variance, wrench_variance"
WRONG: dict[str, tuple[dict[str, Any], str]] = {
    "missing": ({"still": None}, f'array "still" is missing. Moments have {NAMES}.'),
    "flat": ({"scatter": np.eye(SIZE)}, "scatter must have shape (G, 19, 19); got (19, 19)."),
    "small": ({"scatter": np.zeros((4, 3, 3))}, "scatter must have shape (..., 19, 19); got (4, 3, 3)."),
    "lopsided": ({"scatter": lopsided()}, EVEN),
    "negative": ({"scatter": -made().scatter}, EVEN),
    "short": ({"block": np.arange(3)}, "block needs one whole number per group (4,); got int64 of (3,)."),
    "broken": ({"noise_class": np.zeros(4)}, "noise_class needs one whole number per group (4,); got float64 of (4,)."),
    "unknown class": ({"noise_class": np.arange(4)}, "noise_class must number 2 noise classes from 0 on; got 0 to 3."),
    "block": ({"block": np.full(4, -2)}, "block must be -1 or a number from 0 on, and still 0 or 1."),
    "variances": ({"wrench_variance": np.ones((3, 6))}, ROWS),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_arrays_that_do_not_fit_together_are_named(tmp_path: Path, what: str) -> None:
    change, said = WRONG[what]
    path = tmp_path / "moments.npz"
    write_moments(made(), path)
    with np.load(path) as archive:
        arrays = {name: value for name, value in {**archive, **change}.items() if value is not None}
    np.savez(path, **arrays)
    with pytest.raises(BadFile) as caught:
        read_moments(path)
    assert str(caught.value) == f"{path}: {said}"


@pytest.mark.parametrize("content", [None, b"", b"not an npz", b"PK\x03\x04cut short"])
def test_a_file_that_is_no_npz_is_named(tmp_path: Path, content: bytes | None) -> None:
    path = tmp_path / "moments.npz"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(BadFile, match=r"moments\.npz"):
        read_moments(path)


def test_a_damaged_array_is_named(tmp_path: Path) -> None:
    path = tmp_path / "moments.npz"
    write_moments(made(), path)
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 255
    path.write_bytes(content)
    with pytest.raises(BadFile, match='array "scatter" is damaged'):
        read_moments(path)
