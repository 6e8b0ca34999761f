"""Clouds: written and read again, PCD in all three kinds, wrong files named."""

from __future__ import annotations

import struct
import zipfile
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io.cloud_files import read_cloud, write_cloud
from steelyard.shape.cloud import Cloud

RNG = np.random.default_rng(0)
NORMALS = RNG.normal(size=(50, 3))
# Files hold single precision.
NORMALS = (NORMALS / np.linalg.norm(NORMALS, axis=1, keepdims=True)).astype(np.float32)
CLOUD = Cloud(
    RNG.normal(size=(50, 3)), RNG.integers(0, 256, (50, 3)), RNG.integers(0, 4, 50), NORMALS, RNG.integers(0, 2, 50)
)


@pytest.mark.parametrize("suffix", [".ply", ".npz"])
def test_a_written_cloud_is_read_again(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"cloud{suffix}"
    write_cloud(CLOUD, path)
    read = read_cloud(path)
    for name in ("xyz", "rgb", "label", "normals", "seen"):
        assert np.array_equal(getattr(read, name), getattr(CLOUD, name))
    assert [file.name for file in tmp_path.iterdir()] == [path.name]


def pcd(kind: str) -> bytes:
    packed = CLOUD.rgb.astype(np.uint32) @ np.array([65536, 256, 1], np.uint32)  # type: ignore[union-attr]
    table = np.zeros(50, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("rgb", "<u4")])
    for k, axis in enumerate("xyz"):
        table[axis] = CLOUD.xyz[:, k]
    table["rgb"] = packed
    head = (
        "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z rgb\nSIZE 4 4 4 4\nTYPE F F F U\nCOUNT 1 1 1 1\n"
        f"WIDTH 50\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS 50\nDATA {kind}\n"
    ).encode()
    if kind == "ascii":
        return (
            head
            + "\n".join(
                f"{r['x']!r:} {r['y']!r} {r['z']!r} {r['rgb']}".replace("np.float32(", "").replace(")", "")
                for r in table
            ).encode()
        )
    if kind == "binary":
        return head + table.tobytes()
    columns = b"".join(table[name].tobytes() for name in table.dtype.names or ())
    runs = [columns[i : i + 32] for i in range(0, len(columns), 32)]
    packed_bytes = b"".join(bytes([len(run) - 1]) + run for run in runs)
    return head + struct.pack("<II", len(packed_bytes), len(columns)) + packed_bytes


def labelled(label: str, name: str = "label") -> bytes:
    head = f"FIELDS x y z {name}\nSIZE 4 4 4 1\nTYPE F F F U\nPOINTS 2\nDATA ascii\n"
    return f"{head}1 2 3 0\n4 5 6 {label}\n".encode()


def test_padding_may_hold_anything(tmp_path: Path) -> None:
    (tmp_path / "a.pcd").write_bytes(labelled("nan", "_"))
    assert read_cloud(tmp_path / "a.pcd").xyz.tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize("kind", ["ascii", "binary", "binary_compressed"])
def test_pcd(tmp_path: Path, kind: str) -> None:
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd(kind))
    read = read_cloud(path)
    assert read.xyz == pytest.approx(CLOUD.xyz, abs=1e-6)
    assert np.array_equal(read.rgb, CLOUD.rgb)


@pytest.mark.parametrize(
    ("old", "new"), [(b"FIELDS", b"COLUMNS"), (b"POINTS 50\n", b""), (b"WIDTH 50\nHEIGHT 1\n", b"")]
)
def test_old_words_of_a_pcd_header(tmp_path: Path, old: bytes, new: bytes) -> None:
    path = tmp_path / "cloud.pcd"
    path.write_bytes(pcd("binary").replace(old, new))
    assert np.array_equal(read_cloud(path).rgb, CLOUD.rgb)


def test_runs_that_repeat_are_undone() -> None:
    from steelyard.io.shapes.pcd_files import _inflate

    out = np.zeros(11, np.uint8)
    # two plain bytes "ab", then nine bytes copied from two back
    assert _inflate(np.array([1, 97, 98, 0b111_00000, 0, 1], np.uint8), out) == 11
    assert out.tobytes() == b"abababababa"


def packed(points: int) -> bytes:
    """Return a file of a few bytes that says that it unpacks to very many points."""
    header = f"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nPOINTS {points}\nDATA binary_compressed\n"
    return header.encode() + struct.pack("<II", 10, 12 * points) + bytes(10)


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.pcd", b"x", "expected a PCD file"),
        ("a.pcd", pcd("binary")[:-9], "ends before its 50 points"),
        ("a.pcd", pcd("binary_compressed")[:-9], "ends before its 50 points"),
        ("a.pcd", pcd("ascii").replace(b"FIELDS x y", b"FIELDS x"), "that fit each other"),
        ("a.pcd", pcd("ascii").replace(b"SIZE", b"SIZES"), "found VERSION, FIELDS, SIZES, TYPE"),
        ("a.pcd", pcd("binary").replace(b"FIELDS x y", b"FIELDS x w"), '"y" is missing'),
        (
            "a.pcd",
            b"FIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 99999999999\nPOINTS 1\nDATA ascii\n",
            "that fit each",
        ),
        ("a.pcd", labelled("nan"), 'field "label" holds nan; expected integers from 0 to 255'),
        ("a.pcd", labelled("256"), 'field "label" holds 256; expected integers from 0 to 255'),
        ("a.pcd", labelled("-1"), 'field "label" holds -1; expected integers from 0 to 255'),
        ("a.pcd", labelled("1.5"), r'field "label" holds 1\.5; expected integers from 0 to 255'),
        ("a.pcd", labelled("1" * 500), "a point holds a word that is no number"),
        (
            "a.pcd",
            b"FIELDS" + b" x" * 1001 + b"\nPOINTS 1\nDATA ascii\n",
            "has 1001 fields, more than the 1000 that are read",
        ),
        ("a.pcd", packed(1_000_000), "the compressed points are damaged"),
        ("a.pcd", packed(300_000_000), "holds 3433 MiB, more than the 2048 MiB that are read"),
        ("a.pcd", b"FIELDS _ _0 x\nSIZE 4 4 4\nTYPE F F F\nPOINTS 1\nDATA ascii\n1 2 3\n", '"y" is missing'),
        ("a.ply", b"x", "expected a PLY file"),
        ("a.npz", b"x", "expected an NPZ file"),
        ("a.xyz", b"1 2 3", "is no cloud"),
    ],
)
def test_wrong_clouds(tmp_path: Path, name: str, content: bytes, message: str) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(BadFile, match=message):
        read_cloud(path)


def test_holes_of_an_organised_cloud_are_left_out(tmp_path: Path) -> None:
    xyz = CLOUD.xyz.copy()
    xyz[::2] = np.nan
    np.savez(tmp_path / "a.npz", xyz=xyz, rgb=CLOUD.rgb)
    assert np.array_equal(read_cloud(tmp_path / "a.npz").xyz, CLOUD.xyz[1::2])
    assert read_cloud(tmp_path / "a.npz").left_out == 25


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_point_with_one_number_that_is_none_is_left_out(tmp_path: Path, bad: float) -> None:
    xyz = CLOUD.xyz.copy()
    xyz[1, 0], xyz[7, 2], xyz[8] = bad, bad, bad
    np.savez(tmp_path / "b.npz", xyz=xyz, rgb=CLOUD.rgb, label=np.arange(50))
    read = read_cloud(tmp_path / "b.npz")
    kept = np.delete(np.arange(50), [1, 7, 8])
    assert read.left_out == 3
    np.testing.assert_array_equal(read.xyz, CLOUD.xyz[kept])
    np.testing.assert_array_equal(read.label, kept)


@pytest.mark.parametrize(
    ("points", "what"), [(0, "the file holds no points"), (40, "all 40 points are NaN or infinite")]
)
def test_a_cloud_without_points_is_refused_with_what_to_do(tmp_path: Path, points: int, what: str) -> None:
    np.savez(tmp_path / "a.npz", xyz=np.full((points, 3), np.nan))
    with pytest.raises(BadFile) as error:
        read_cloud(tmp_path / "a.npz")
    assert str(error.value) == f"{tmp_path}/a.npz: {what}. Write the cloud again, or scan the object again."


def written(path: Path, rgb: np.ndarray, kind: str, names: tuple[str, ...] = ("red", "green", "blue")) -> Path:
    """Write CLOUD's points with other colours; `kind` is that of a PLY property."""
    if path.suffix == ".npz":
        np.savez(path, xyz=CLOUD.xyz, rgb=rgb)
        return path
    if path.suffix == ".ply":
        fields = [f"property double {axis}" for axis in "xyz"] + [f"property {kind} {name}" for name in names]
        head = "\n".join(["ply", "format ascii 1.0", "element vertex 50", *fields, "end_header\n"])
    else:
        head = (
            "VERSION 0.7\nFIELDS x y z r g b\nSIZE 8 8 8 4 4 4\nTYPE F F F F F F\nCOUNT 1 1 1 1 1 1\n"
            "WIDTH 50\nHEIGHT 1\nPOINTS 50\nDATA ascii\n"
        )
    rows = np.concatenate([CLOUD.xyz, rgb], axis=1).tolist()
    whole = [[*map(repr, row[:3]), *(f"{v:.9g}" for v in row[3:])] for row in rows]
    path.write_text(head + "\n".join(" ".join(row) for row in whole) + "\n")
    return path


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz"])
@pytest.mark.parametrize("scale", [1 / 255, (1 + 1e-6) / 255, 1.0], ids=["0..1", "rounded above 1", "0..255"])
def test_colours_as_floats_are_not_black(tmp_path: Path, suffix: str, scale: float) -> None:
    path = written(tmp_path / f"a{suffix}", scale * np.asarray(CLOUD.rgb, float), "float")
    assert np.array_equal(read_cloud(path).rgb, CLOUD.rgb)


@pytest.mark.parametrize("suffix", [".ply", ".npz"])
def test_colours_of_sixteen_bits_are_not_white(tmp_path: Path, suffix: str) -> None:
    path = written(tmp_path / f"a{suffix}", 257 * CLOUD.rgb.astype(np.uint16), "ushort")  # type: ignore[union-attr]
    assert np.array_equal(read_cloud(path).rgb, CLOUD.rgb)


@pytest.mark.parametrize("suffix", [".ply", ".pcd", ".npz"])
def test_colours_of_no_known_range_are_refused(tmp_path: Path, suffix: str) -> None:
    path = written(tmp_path / f"a{suffix}", np.asarray(CLOUD.rgb, float) / 127.5 - 1, "float")
    with pytest.raises(BadFile, match=r"a\....: colours must be numbers 0 to 255, or floats 0 to 1; they go from -"):
        read_cloud(path)


def test_colours_that_rounding_took_over_the_edge_are_clipped() -> None:
    seen = Cloud(np.eye(3), np.array([[255.3, 0, -0.2]] * 3)).rgb  # type: ignore[arg-type]
    assert seen is not None
    assert seen.tolist() == [[255, 0, 0]] * 3


def test_colours_by_the_names_of_other_programs(tmp_path: Path) -> None:
    assert CLOUD.rgb is not None
    names = ("diffuse_red", "diffuse_green", "diffuse_blue")
    assert np.array_equal(read_cloud(written(tmp_path / "a.ply", CLOUD.rgb, "uchar", names)).rgb, CLOUD.rgb)
    np.savez(tmp_path / "a.npz", xyz=CLOUD.xyz, colors=CLOUD.rgb / 255)
    assert np.array_equal(read_cloud(tmp_path / "a.npz").rgb, CLOUD.rgb)


def test_parts_are_told_where_they_belong(tmp_path: Path) -> None:
    np.savez(tmp_path / "parts.npz", tets=np.zeros((1, 4), int))
    with pytest.raises(BadFile, match="which --parts takes"):
        read_cloud(tmp_path / "parts.npz")


@pytest.mark.parametrize("name", ["readme.txt", "label", "xyz"])
def test_other_members_of_an_npz_are_passed_over(tmp_path: Path, name: str) -> None:
    path, points = tmp_path / "c.npz", np.arange(12.0).reshape(4, 3)
    np.savez(path, xyz=points)
    with zipfile.ZipFile(path, "a") as archive:
        archive.writestr(name, "read me")
    cloud = read_cloud(path)
    np.testing.assert_array_equal(cloud.xyz, points)
    assert cloud.label is None


def test_lists_behind_the_points_may_have_any_lengths(tmp_path: Path) -> None:
    """As the range grid of an organised cloud of the Point Cloud Library, which is no mesh."""
    write_cloud(CLOUD, tmp_path / "a.ply")
    head, _, body = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    grid = b"element range_grid 3\nproperty list uchar int vertex_indices\nend_header\n"
    cells = b"\0" + b"".join(b"\1" + struct.pack("<i", k) for k in range(2))
    (tmp_path / "a.ply").write_bytes(head + grid + body + cells)
    assert np.array_equal(read_cloud(tmp_path / "a.ply").xyz, CLOUD.xyz)


def test_a_mesh_of_mixed_faces_is_called_a_mesh(tmp_path: Path) -> None:
    write_cloud(CLOUD, tmp_path / "a.ply")
    head, _, body = (tmp_path / "a.ply").read_bytes().partition(b"end_header\n")
    faces = b"element face 2\nproperty list uchar int vertex_indices\nend_header\n"
    rows = b"\3" + struct.pack("<3i", 0, 1, 2) + b"\4" + struct.pack("<4i", 0, 1, 2, 3)
    (tmp_path / "a.ply").write_bytes(head + faces + body + rows)
    with pytest.raises(BadFile, match="this is a mesh of 2 faces"):
        read_cloud(tmp_path / "a.ply")


@pytest.mark.parametrize(
    ("points", "colours", "normals"),
    [("points", "colors", "normals"), ("positions", "colors", "normals"), ("xyz", "color", "normal")],
)
def test_other_names_of_arrays(tmp_path: Path, points: str, colours: str, normals: str) -> None:
    np.savez(tmp_path / "a.npz", **{normals: NORMALS, colours: CLOUD.rgb, points: CLOUD.xyz})  # type: ignore[arg-type]
    read = read_cloud(tmp_path / "a.npz")
    for name in ("xyz", "rgb", "normals"):
        assert np.array_equal(getattr(read, name), getattr(CLOUD, name))


@pytest.mark.parametrize("alpha", [0, 255])
@pytest.mark.parametrize("as_number", [False, True])
def test_colours_packed_in_floats(tmp_path: Path, alpha: int, as_number: bool) -> None:
    """As bits, which may be those of NaN, or as the number itself."""
    whole = (CLOUD.rgb.astype(np.uint32) @ np.array([65536, 256, 1], np.uint32)) | np.uint32(alpha << 24)  # type: ignore[union-attr]
    table = np.zeros(50, [(axis, "<f4") for axis in "xyz"] + [("rgb", "<f8" if as_number else "<f4")])
    table["rgb"] = whole if as_number else whole.view("<f4")
    size = table.dtype["rgb"].itemsize
    head = f"FIELDS x y z rgb\nSIZE 4 4 4 {size}\nTYPE F F F F\nPOINTS 50\nDATA binary\n"
    (tmp_path / "a.pcd").write_bytes(f"VERSION .7\n{head}".encode() + table.tobytes())
    assert np.array_equal(read_cloud(tmp_path / "a.pcd").rgb, CLOUD.rgb)


@pytest.mark.parametrize(("without", "left"), [(4, 46), (5, 50), (50, 50)])
@pytest.mark.parametrize("none", [np.nan, 0.0])
def test_few_points_without_a_normal_are_left_out(tmp_path: Path, without: int, left: int, none: float) -> None:
    normals = NORMALS.copy()
    normals[:without] = none
    holes = np.full((20, 3), np.nan)
    np.savez(tmp_path / "a.npz", xyz=np.vstack([CLOUD.xyz, holes]), normals=np.vstack([normals, holes]))
    read = read_cloud(tmp_path / "a.npz")
    assert (len(read), read.left_out, read.normals is None) == (left, 70 - left, left == 50)
