"""Files of a stranger that would fill the memory or never end: refused before they are unpacked, in one clear error."""

from __future__ import annotations

import gzip
import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.datasets.track import MOTION
from steelyard.errors import BadDescription, BadFile
from steelyard.io import contents
from steelyard.io.cloud_files import read_cloud
from steelyard.io.contents import load_json, parse_toml
from steelyard.io.moment_files import read_moments
from steelyard.io.object_folders import read_track
from steelyard.io.ply_files import read_mesh
from steelyard.io.recordings.stream_files import open_table
from steelyard.io.shapes.parts_files import read_parts
from steelyard.io.shapes.pcd_files import read_pcd

TOO_MUCH = "F: holds 3 MiB, more than the 1 MiB that are read. Give fewer rows, points or views at once."


def said(read: Callable[[Path], Any], path: Path) -> str:
    """Return the whole error, F in place of the path."""
    with pytest.raises(BadFile) as caught:
        read(path)
    return str(caught.value).replace(str(path), "F")


def read_all(path: Path) -> Any:
    table = open_table(path)
    return table.read(range(table.header.count))


def npy_header(shape: str, kind: str = "<f8") -> bytes:
    text = f"{{'descr': '{kind}', 'fortran_order': False, 'shape': {shape}, }}".encode()
    text += b" " * (-(len(text) + 11) % 64) + b"\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(text)) + text


def write_npz(path: Path, members: dict[str, bytes], packing: int = zipfile.ZIP_DEFLATED) -> Path:
    with zipfile.ZipFile(path, "w", packing) as archive:
        for name, content in members.items():
            archive.writestr(name, content)
    return path


@pytest.fixture
def one_mib(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(contents, "MOST_BYTES", 2**20)


@pytest.mark.usefixtures("one_mib")
@pytest.mark.parametrize("read", [read_all, read_cloud])
def test_an_npz_that_unpacks_to_much_is_not_unpacked(read: Callable[[Path], Any], tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, xyz=np.zeros((2**17, 3)))
    assert path.stat().st_size < 2**13
    assert said(read, path) == TOO_MUCH


@pytest.mark.usefixtures("one_mib")
def test_moments_and_motions_that_unpack_to_much_are_not_unpacked(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    names = ("scatter", "noise_class", "block", "still", "acceleration_variance", "wrench_variance")
    np.savez_compressed(path, **dict.fromkeys(names, np.zeros((2**16, 1))))
    assert said(read_moments, path) == TOO_MUCH
    np.savez_compressed(path, **dict.fromkeys(MOTION.values(), np.zeros((13107, 3))))
    assert said(read_track, path) == TOO_MUCH


@pytest.mark.usefixtures("one_mib")
def test_arrays_that_nobody_asks_for_do_not_count(tmp_path: Path) -> None:
    path = tmp_path / "a.npz"
    np.savez_compressed(path, xyz=np.ones((4, 3)), images=np.zeros((2**18, 3)))
    assert len(read_cloud(path)) == 4
    table = open_table(path)
    assert table.read([0])[0].tolist() == [1.0] * 4


@pytest.mark.parametrize("shape", ["(", "-" * 9000 + "1", "(True,)", "(-1,)", "(10**9,)", "(1000000000000,)"])
def test_a_header_that_is_none_is_refused(shape: str, tmp_path: Path) -> None:
    path = write_npz(tmp_path / "a.npz", {"a.npy": npy_header("(" * 4000 if shape == "(" else shape) + bytes(8)})
    assert '"a"' in said(read_all, path)


def test_texts_without_length_count(tmp_path: Path) -> None:
    path = write_npz(tmp_path / "a.npz", {"names.npy": npy_header("(1000000000,)", "<U0")})
    assert said(read_parts, path) == (
        'F: array "names" is damaged (shorter than its header says). Save the file again.'
    )


@pytest.mark.parametrize("packing", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_packings_that_numpy_does_not_write_are_refused(packing: int, tmp_path: Path) -> None:
    path = write_npz(tmp_path / "a.npz", {"a.npy": npy_header("(3,)") + bytes(24)}, packing)
    assert said(read_all, path) == 'F: array "a" is packed as numpy packs none. Save the file with numpy.savez.'


def test_columns_are_counted_before_they_are_named(tmp_path: Path) -> None:
    path = write_npz(tmp_path / "a.npz", {f"{k}.npy": npy_header("(0, 4096)") for k in range(17)})
    assert said(open_table, path) == "F: holds more than 65536 columns. Save the quantities of the log alone."


@pytest.mark.skipif(not Path("/dev/zero").is_char_device(), reason="there are no devices here")
@pytest.mark.parametrize("read", [read_mesh, read_pcd])
def test_a_link_to_a_device_is_refused(read: Callable[[Path], Any], tmp_path: Path) -> None:
    path = tmp_path / "a.ply"
    path.symlink_to("/dev/zero")
    assert said(read, path) == "F: this is a device, which has no end. Give a file."


@pytest.mark.usefixtures("one_mib")
def test_a_table_of_text_is_bounded_by_its_numbers(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,a\n" + "1,2\n" * 200_000)
    assert said(read_all, path) == TOO_MUCH


def test_a_packed_text_that_becomes_very_long_is_not_read_to_its_end(tmp_path: Path) -> None:
    path = tmp_path / "a.csv.gz"
    path.write_bytes(gzip.compress(b"t,a\n1,2\n" + (b"#" * 1023 + b"\n") * 2**17, 9))
    assert said(read_all, path) == ("F: unpacks to more than 100 times its size. Unpack it and look at it first.")


@pytest.mark.parametrize("cell", ["x" * 200_000, " " * 200_000 + "x", '"' + "x" * 200_000 + '"'])
@pytest.mark.parametrize("more", ["", ",3"])
def test_a_very_long_cell_is_named_at_once(cell: str, more: str, tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text(f"t,a,b\n1,2,3\n2,{cell}{more}\n")
    assert "line 3" in said(read_all, path)


def test_empty_cells_among_many_blanks_are_filled(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("t,a,b\n1,2,3\n2," + " " * 200_000 + ',3\n3, "" ,5\n')
    assert np.isnan(read_all(path)[1]).tolist() == [False, True, True]


def test_keys_of_very_many_dots_are_refused_at_once() -> None:
    with pytest.raises(BadDescription, match="a line has 500000 dots; no description has keys as deep"):
        parse_toml("a" + ".a" * 500_000 + " = 1", "log.toml")


@pytest.mark.skipif(not Path("/dev/zero").is_char_device(), reason="there are no devices here")
def test_a_document_is_read_no_further_than_it_may_be_long() -> None:
    assert said(lambda path: load_json(path, "a result", ""), Path("/dev/zero")) == (
        "F: a result is a small JSON text; this file has 64000001 bytes."
    )


def test_a_parquet_file_is_bounded_by_its_rows_and_texts_are_not_unpacked(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    arrow, parquet = pytest.importorskip("pyarrow"), pytest.importorskip("pyarrow.parquet")
    path = tmp_path / "a.parquet"
    parquet.write_table(arrow.table({"t": np.zeros(3 * 2**17), "name": ["x" * 1000] * (3 * 2**17)}), path)
    assert len(open_table(path).read([0])[0]) == 3 * 2**17
    monkeypatch.setattr(parquet, "read_table", None)
    assert said(read_all, path) == 'F: column "name" must hold numbers; it holds string.'
    monkeypatch.setattr(contents, "MOST_BYTES", 2**20)
    assert said(lambda path: open_table(path).read([0]), path) == TOO_MUCH
