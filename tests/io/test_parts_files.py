"""parts.npz: round trip, and one clear error for each wrong file."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial import Delaunay

from steelyard.errors import BadFile, BadValue
from steelyard.io.shapes import parts_files
from steelyard.io.shapes.parts_files import SavedParts, read_parts, write_parts
from steelyard.parts.hierarchy import Hierarchy
from steelyard.shape.tets import TetMesh


@pytest.fixture(scope="module")
def saved() -> SavedParts:
    points = np.random.default_rng(0).normal(size=(30, 3)) * 0.1
    solid = TetMesh(points, Delaunay(points).simplices)
    labels = np.digitize(solid.centroids[:, 0], np.quantile(solid.centroids[:, 0], [1 / 3, 2 / 3]))
    tree = Hierarchy(labels, np.array([[0, 1], [2, 3]]), np.array([0.1, np.inf]))
    return SavedParts(
        solid,
        labels,
        np.array([[1, 2, 3], [4, 5, 6], [250, 251, 252.5]]),
        tree,
        ("head", "shaft", "griß"),
        4e-4,
        0.03,
        0.01,
    )


def test_round_trip(saved: SavedParts, tmp_path: Path) -> None:
    write_parts(saved, tmp_path / "p.npz")
    back = read_parts(tmp_path / "p.npz")
    np.testing.assert_array_equal(back.solid.vertices, saved.solid.vertices)
    np.testing.assert_array_equal(back.solid.tets, saved.solid.tets)
    np.testing.assert_array_equal(back.labels, saved.labels)
    np.testing.assert_array_equal(back.rgb, saved.rgb)
    assert back.names == saved.names
    assert (back.parts.com_std, back.parts.stretch, back.parts.turn_std) == (4e-4, 0.03, 0.01)
    assert back.tree is not None
    assert saved.tree is not None
    for name in ("piece", "merges", "cost"):
        np.testing.assert_array_equal(getattr(back.tree, name), getattr(saved.tree, name))
    np.testing.assert_allclose(back.parts.moments, saved.parts.moments, rtol=1e-12)
    assert [path.name for path in tmp_path.iterdir()] == ["p.npz"]


def test_names_of_the_format(saved: SavedParts, tmp_path: Path) -> None:
    write_parts(saved, tmp_path / "p.npz")
    with np.load(tmp_path / "p.npz") as archive:
        shapes = {name: archive[name].shape for name in archive.files}
    count = len(saved.solid)
    wanted = {"vertices": (30, 3), "tets": (count, 4), "labels": (count,), "merges": (2, 2), "cost": (2,), "piece": (count,),
              "rgb": (3, 3), "volume_m3": (3,), "centroid_m": (3, 3), "names": (3,), "com_std_m": (), "stretch": (), "turn_std_rad": ()}  # fmt: skip
    assert shapes == wanted


def test_one_part_without_colours_or_tree(saved: SavedParts, tmp_path: Path) -> None:
    write_parts(SavedParts(saved.solid, np.zeros(len(saved.solid))), tmp_path / "p.npz")
    back = read_parts(tmp_path / "p.npz")
    assert (back.count, back.rgb, back.tree, back.names) == (1, None, None, ())
    assert back.parts.volume[0] == pytest.approx(saved.solid.volume)


def write_wrong(saved: SavedParts, path: Path, **changed: Any) -> None:
    write_parts(saved, path)
    with np.load(path) as archive:
        arrays = {name: archive[name] for name in archive.files} | changed
    np.savez(path, allow_pickle=True, **{name: array for name, array in arrays.items() if array is not None})


@pytest.mark.parametrize(
    ("changed", "reason"),
    [
        ({"tets": None}, 'array "tets" is missing, so this is no file of parts. A cloud is given with --scan; '
         "parts are written by: steelyard segment CLOUD -o parts.npz."),
        ({"tets": np.array([[0, 1, 2, 99]])}, "tets must name vertices 0..29; got 0..99."),
        ({"tets": np.array([[0, 1, 2, 3.5]])}, "tets must be whole numbers; got 3.5."),
        ({"tets": np.array([[0, 1, 2, np.nan]])}, "tets must be finite; 1 entry is not, the first at index (0, 3)."),
        ({"tets": np.array([[0, 0, 1, 1]]), "labels": np.array([0]), "rgb": None, "names": None, "piece": None}, "part 0 has a volume of 0 m^3; volumes must be above zero. Check that its surface is closed and its triangles face outward."),
        ({"vertices": np.full((30, 3), np.inf)}, "vertices must be finite; 90 entries are not, the first at index (0, 0)."),
        ({"labels": np.array([0, 1])}, "cells needs one label; got (2,)."),
        ({"rgb": np.zeros((2, 3))}, "3 parts need one colour 0..255 each (P, 3); got shape (2, 3)."),
        ({"rgb": np.full((3, 3), 300)}, "3 parts need one colour 0..255 each (P, 3); got shape (3, 3)."),
        ({"names": np.array(["a"])}, "3 parts need one name each; got 1."),
        ({"names": np.array("a")}, "3 parts need one name each; got 1."),
        ({"com_std_m": np.array([1e-4, 1e-4])}, 'array "com_std_m" must hold one number; it has the shape (2,).'),
        ({"stretch": np.float64(np.nan)}, "standard deviations of a shape must not be negative; got 0.0004, nan, 0.01."),
        ({"names": np.zeros(3)}, 'array "names" must hold text; it holds float64.'),
        ({"labels": np.array(["x"])}, 'array "labels" must hold real numbers; it holds <U1.'),
        ({"merges": np.array([[0, 1], [0, 2]])}, "every node but the last must be joined once, after it was made; these merges are no tree."),
        ({"volume_m3": np.ones(3)}, '"volume_m3" is not that of the cells and labels in the file. Save the file again.'),
        ({"centroid_m": np.ones((2, 3))}, '"centroid_m" is not that of the cells and labels in the file. Save the file again.'),
        ({"labels": np.array([object()])}, 'array "labels" holds pickled Python objects, which can run code when opened; it was not opened. Save it as plain numbers (float64).'),
    ],
)  # fmt: skip
def test_wrong_files(saved: SavedParts, tmp_path: Path, changed: dict[str, Any], reason: str) -> None:
    path = tmp_path / "p.npz"
    write_wrong(saved, path, **changed)
    with pytest.raises(BadFile) as caught:
        read_parts(path)
    assert str(caught.value).startswith(f"{path}: ")
    assert str(caught.value).endswith(reason)


def test_labels_without_gaps(saved: SavedParts, tmp_path: Path) -> None:
    write_wrong(saved, tmp_path / "p.npz", labels=np.where(saved.labels == 1, 0, saved.labels))
    with pytest.raises(
        BadFile, match=r"labels must be 0, 1, 2 \.\.\. with at least one cell each; these leave numbers out"
    ):
        read_parts(tmp_path / "p.npz")
    for labels in (saved.labels - 1, saved.labels * 10**12):
        write_wrong(saved, tmp_path / "p.npz", labels=labels)
        with pytest.raises(BadFile, match="leave numbers out"):
            read_parts(tmp_path / "p.npz")


def test_millimetres_are_named(saved: SavedParts, tmp_path: Path) -> None:
    write_wrong(saved, tmp_path / "p.npz", vertices=1e3 * saved.solid.vertices)
    with pytest.raises(BadFile, match=r"over 100 m long\. Vertices are in metres; are these millimetres"):
        read_parts(tmp_path / "p.npz")


def test_no_archive_no_file_damaged(saved: SavedParts, tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    with pytest.raises(BadFile, match=r"cannot be read \(No such file or directory\)"):
        read_parts(path)
    path.write_bytes(b"solid parts")
    with pytest.raises(BadFile, match="expected an NPZ file"):
        read_parts(path)
    write_parts(saved, path)
    content = bytearray(path.read_bytes())
    content[200:260] = bytes(60)
    path.write_bytes(content)
    with pytest.raises(BadFile, match=r"p\.npz: "):
        read_parts(path)


def test_whatever_byte_is_wrong_the_file_is_refused_or_read(saved: SavedParts, tmp_path: Path) -> None:
    path = tmp_path / "p.npz"
    write_parts(saved, path)
    right = path.read_bytes()
    refused = 0
    for k in range(0, len(right), max(1, len(right) // 500)):
        wrong = bytearray(right)
        wrong[k] ^= 255
        path.write_bytes(wrong)
        try:
            read_parts(path)
        except BadFile:
            refused += 1
    assert refused > 400


def test_a_file_that_unpacks_to_very_much_is_not_unpacked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(parts_files, "MOST_BYTES", 2**20)
    np.savez_compressed(tmp_path / "p.npz", vertices=np.zeros((2**16, 8)))
    with pytest.raises(BadFile, match="holds 4 MiB, more than the 1 MiB that are read"):
        read_parts(tmp_path / "p.npz")


def test_wrong_values_are_named(saved: SavedParts) -> None:
    with pytest.raises(BadValue, match="the tree is of 2 cells"):
        SavedParts(saved.solid, saved.labels, tree=Hierarchy(np.array([0, 1]), np.array([[0, 1]]), np.array([0.1])))


def test_the_cut_of_a_result_is_told_by_its_volumes(saved: SavedParts) -> None:
    whole = saved.parts.volume
    assert saved.recut(whole) is saved
    joined = saved.recut([whole[2], whole[0] + whole[1]])
    np.testing.assert_array_equal(joined.labels, np.array([1, 1, 0])[saved.labels])
    np.testing.assert_allclose(joined.parts.volume, [whole[2], whole[0] + whole[1]])
    assert joined.rgb is not None
    np.testing.assert_allclose(joined.rgb[0], [250, 251, 252.5])
    np.testing.assert_allclose(joined.rgb[1], np.average([[1, 2, 3], [4, 5, 6]], axis=0, weights=whole[:2]))


@pytest.mark.parametrize("factors", [(1.01, 1, 1), (1, 1), (1, 1, 1, 1)])
def test_volumes_of_another_solid_are_refused(saved: SavedParts, factors: tuple[float, ...]) -> None:
    whole = [*saved.parts.volume, saved.parts.volume[0]]
    with pytest.raises(BadValue, match="no cut of these parts has the"):
        saved.recut([volume * factor for volume, factor in zip(whole, factors, strict=False)])


@pytest.mark.parametrize("name", ["readme.txt", "labels"])
def test_other_members_of_the_archive_are_passed_over(saved: SavedParts, tmp_path: Path, name: str) -> None:
    path = tmp_path / "p.npz"
    write_parts(saved, path)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, "read me")
    np.testing.assert_array_equal(read_parts(path).labels, saved.labels)
