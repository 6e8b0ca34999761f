"""Files of a stranger that would fill the memory or never end: refused before they are unpacked, in one clear error."""

from __future__ import annotations

import struct
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadFile
from steelyard.io import bounds
from steelyard.io.cloud_files import read_cloud
from steelyard.io.moment_files import read_moments
from steelyard.io.object_folders import read_track
from steelyard.io.parts_files import read_parts
from steelyard.io.pcd_files import read_pcd
from steelyard.io.ply_files import read_mesh
from steelyard.io.tables import open_table
from steelyard.parts.known import MOTION

TOO_MUCH = "F: holds 3 MiB, more than the 1 MiB that are read. Give fewer rows or points at once."


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
    monkeypatch.setattr(bounds, "MOST_BYTES", 2**20)


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
