"""PLY meshes: round trips, dialects, and each wrong file with the full text of its error."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io.ply_files import read_mesh, read_mesh_noting, read_ply, write_mesh
from steelyard.shape.mesh import TriangleMesh

RNG = np.random.default_rng(0)
MESH = TriangleMesh(
    RNG.normal(size=(6, 3)),
    [[0, 1, 2], [2, 3, 4], [3, 4, 5]],
    [0, 0, 7],
    [[1, 2, 3], [4, 5, 255], [0, 0, 9]],
)
ASCII = """\
ply
format ascii 1.0
comment made by hand
element vertex 3
property float x
property float y
property float z
element face 1
property list uchar int vertex_indices
end_header
0 0 0
1 0 0
0 1 0
3 0 1 2
"""


def in_words(binary: bytes) -> bytes:
    """Return what `write_mesh` wrote of MESH, its body as text."""
    head = binary.partition(b"end_header\n")[0].replace(b"binary_little_endian", b"ascii")
    corners = [" ".join(repr(float(x)) for x in row) for row in MESH.vertices]
    faces = zip(MESH.triangles.tolist(), MESH.rgb.tolist(), MESH.part.tolist(), strict=True)
    rows = [" ".join(map(str, [3, *corner, *colour, part])) for corner, colour, part in faces]
    return head + "\n".join(["end_header", *corners, *rows, ""]).encode()


@pytest.mark.parametrize("ascii", [True, False])
def test_a_mesh_comes_back_to_the_last_digit(tmp_path: Path, ascii: bool) -> None:
    write_mesh(MESH, tmp_path / "m.ply")
    if ascii:
        (tmp_path / "m.ply").write_bytes(in_words((tmp_path / "m.ply").read_bytes()))
    again = read_mesh(tmp_path / "m.ply")
    for name in ("vertices", "triangles", "part", "rgb"):
        np.testing.assert_array_equal(getattr(again, name), getattr(MESH, name))
    assert [path.name for path in tmp_path.iterdir()] == ["m.ply"]


@pytest.mark.parametrize("line_end", ["\n", "\r\n"])
def test_header_lines_may_end_in_either_way(tmp_path: Path, line_end: str) -> None:
    (tmp_path / "m.ply").write_bytes(ASCII.replace("\n", line_end).encode())
    mesh = read_mesh(tmp_path / "m.ply")
    assert (len(mesh.vertices), len(mesh), mesh.part.tolist(), mesh.rgb) == (3, 1, [0], None)


def test_a_binary_body_may_follow_a_header_with_crlf(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "m.ply")
    head, _, body = (tmp_path / "m.ply").read_bytes().partition(b"end_header\n")
    (tmp_path / "m.ply").write_bytes(head.replace(b"\n", b"\r\n") + b"end_header\r\n" + body)
    np.testing.assert_array_equal(read_mesh(tmp_path / "m.ply").vertices, MESH.vertices)


def test_big_endian_and_other_elements_are_read(tmp_path: Path) -> None:
    header = "ply\nformat binary_big_endian 1.0\nelement vertex 2\nproperty short x\nproperty double q\n"
    table = np.array([(1, 0.5), (-2, 1e9)], [("x", ">i2"), ("q", ">f8")])
    (tmp_path / "p.ply").write_bytes(f"{header}end_header\n".encode() + table.tobytes())
    vertex = read_ply(tmp_path / "p.ply")["vertex"]
    assert (vertex["x"].tolist(), vertex["q"].tolist()) == ([1, -2], [0.5, 1e9])


def swapped(old: str, new: str) -> Callable[[], bytes]:
    return lambda: ASCII.replace(old, new, 1).encode()


BAD: dict[str, tuple[Callable[[], bytes], str]] = {
    "another kind": (lambda: b"solid stl", 'F: expected a PLY file, which starts with "ply"; found something else.'),
    "no end": (swapped("end_header\n", ""), "F: the PLY header has no end_header line. Save the file again."),
    "no format": (
        swapped("ascii", "utf9"),
        "F: the PLY header names no format among ascii, binary_little_endian, binary_big_endian.",
    ),
    "odd line": (
        swapped("property float z", "property flot z"),
        'F: the PLY header has a line that means nothing: "property flot z".',
    ),
    "odd digit": (
        lambda: ASCII.replace("vertex 3", "vertex \u00b2").encode("latin-1"),
        'F: the PLY header has a line that means nothing: "element vertex \u00b2".',
    ),
    "too many": (
        swapped("vertex 3", "vertex " + "9" * 5000),
        f'F: the PLY header has a line that means nothing: "element vertex {"9" * 45}".',
    ),
    "length with a fraction": (
        swapped("list uchar", "list float"),
        'F: the lists "vertex_indices" count in float; lengths are whole numbers.',
    ),
    "twice": (swapped("property float z", "property float y"), 'F: element "vertex" has 2 properties "y".'),
    "negative length": (
        swapped("3 0 1 2", "-3 0 1 2"),
        'F: the lists "vertex_indices" differ in length. Save every face as a triangle.',
    ),
    "too short": (swapped("vertex 3", "vertex 300"), 'F: the file ends inside element "vertex" (300 announced).'),
    "a word": (swapped("1 0 0", "1 0 a"), 'F: element "vertex" holds a word that is no number.'),
    "nan in integers": (
        swapped("3 0 1 2", "3 0 nan 2"),
        'F: property "vertex_indices" of element "face" holds nan; expected integers from -2147483648 to 2147483647. '
        "Save the file again.",
    ),
    "too large an integer": (
        swapped("3 0 1 2", "3 0 1 4294967297"),
        'F: property "vertex_indices" of element "face" holds 4.29497e+09; expected integers from -2147483648 to '
        "2147483647. Save the file again.",
    ),
    "a fraction in integers": (
        swapped("3 0 1 2", "3 0 1.5 2"),
        'F: property "vertex_indices" of element "face" holds 1.5; expected integers from -2147483648 to 2147483647. '
        "Save the file again.",
    ),
    "a long word": (swapped("1 0 0", "1 0 0." + "0" * 500), 'F: element "vertex" holds a word that is no number.'),
    "many properties": (
        swapped("property float z\n", "property float z\n" + "".join(f"property char a{k}\n" for k in range(2000))),
        "F: the PLY header has more than 1000 elements and properties.",
    ),
    "quads": (
        swapped("3 0 1 2", "4 0 1 2 0"),
        "F: faces have 4 corners. Save every face as a triangle.",
    ),
    "mixed": (
        lambda: ASCII.replace("face 1", "face 2").encode() + b"4 0 1 2 0\n",
        'F: the lists "vertex_indices" differ in length. Save every face as a triangle.',
    ),
    "no faces": (
        swapped("vertex_indices", "corners"),
        "F: a mesh needs vertices with x, y, z and faces with vertex_indices; this PLY has not both. "
        "A cloud is given with --scan.",
    ),
    "far vertex": (swapped("3 0 1 2", "3 0 1 9"), "F: triangles must name vertices 0..2; got 0..9."),
    "nan": (
        swapped("1 0 0", "1 0 nan"),
        "F: mesh vertices must be finite; 1 entry is not, the first at index (1, 2).",
    ),
}


@pytest.mark.parametrize("case", BAD)
def test_each_wrong_file_has_one_clear_error(tmp_path: Path, case: str) -> None:
    make, text = BAD[case]
    path = tmp_path / "F.ply"
    path.write_bytes(make())
    with pytest.raises(BadFile) as caught:
        read_mesh(path)
    assert str(caught.value).replace(str(path), "F") == text


def test_a_truncated_binary_body_is_said(tmp_path: Path) -> None:
    write_mesh(MESH, tmp_path / "m.ply")
    (tmp_path / "m.ply").write_bytes((tmp_path / "m.ply").read_bytes()[:-5])
    with pytest.raises(BadFile, match=r'the file ends inside element "face" \(3 announced\)\.$'):
        read_mesh(tmp_path / "m.ply")


@pytest.mark.parametrize(
    ("kind", "first", "text"),
    [
        ("char", "ff", 'the lists "v" differ in length'),
        ("uint", "ffffffff", 'the file ends inside element "face"'),
        ("uchar", "ff", 'the file ends inside element "face"'),
    ],
)
def test_a_binary_list_of_no_possible_length_is_said(tmp_path: Path, kind: str, first: str, text: str) -> None:
    header = f"ply\nformat binary_little_endian 1.0\nelement face 1\nproperty list {kind} int v\nend_header\n"
    (tmp_path / "m.ply").write_bytes(header.encode() + bytes.fromhex(first) + bytes(20))
    with pytest.raises(BadFile, match=text):
        read_ply(tmp_path / "m.ply")


def test_elements_without_rows_or_properties_are_passed_over(tmp_path: Path) -> None:
    header = (
        "ply\nformat binary_little_endian 1.0\nelement camera 1\nelement face 0\nproperty list uint int v\n"
        "element vertex 2\nproperty float x\nend_header\n"
    )
    (tmp_path / "m.ply").write_bytes(header.encode() + np.array([1.5, -2.0], "<f4").tobytes())
    found = read_ply(tmp_path / "m.ply")
    assert found["face"]["v"].shape == (0, 0)
    assert found["vertex"]["x"].tolist() == [1.5, -2.0]


def test_a_missing_file_is_said(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match=r"m\.ply: cannot be read \(No such file or directory\)\.$"):
        read_mesh(tmp_path / "m.ply")


def test_faces_without_a_part_are_one_part_and_a_note_says_so(tmp_path: Path) -> None:
    (tmp_path / "m.ply").write_text(ASCII)
    write_mesh(MESH, tmp_path / "parts.ply")
    mesh, notes = read_mesh_noting(tmp_path / "m.ply")
    assert mesh.part.tolist() == [0]
    assert notes == ('m.ply: its faces have no "part": all of it was taken as one part of one density',)
    assert read_mesh_noting(tmp_path / "parts.ply")[1] == ()
