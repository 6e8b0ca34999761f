"""Descriptions and data become streams in SI on their own clocks."""

from __future__ import annotations

import gzip
import json
import re
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io import read_recording
from steelyard.io.rotations import rotation_of
from steelyard.io.units import local_g
from steelyard.logs.recording import STANDARD_GRAVITY, Recording, Stream
from steelyard.spatial import Rotation

COLUMNS = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
FORCE, TORQUE = [1.0, 2.0, 3.0], [0.1, 0.2, 0.3]
ROWS = np.array([[t, *FORCE, *TORQUE, 1, 0, 0, 0] for t in range(4)], dtype=float)
WRENCH = """\
force    = { columns = ["fx", "fy", "fz"] }
torque   = { columns = ["tx", "ty", "tz"] }
"""
TURN = 'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n'
TIME = 'time = { columns = ["t"] }\n'
STREAM = '[[stream]]\npath = "a.csv"\n'


def table(names: list[str] | None, rows: np.ndarray, mark: str = ",", end: str = "\n") -> str:
    lines = [mark.join(names)] if names else []
    return end.join([*lines, *(mark.join(f"{value:.12g}" for value in row) for row in rows), ""])


def read(folder: Path, toml: str, **files: str | bytes) -> Recording:
    """Write the description and its files (a_csv -> a.csv) and read them."""
    for name, text in ({"a_csv": table(COLUMNS, ROWS)} | files).items():
        path = folder / name.replace("_", ".")
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / "log.toml").write_text(toml)
    return read_recording(folder / "log.toml")


def with_more() -> str:
    """The table with one more vector of the force's numbers: ux, uy, uz."""
    return table([*COLUMNS, "ux", "uy", "uz"], np.hstack([ROWS, [FORCE] * 4]))


def only(recording: Recording) -> Stream:
    (stream,) = recording.streams
    return stream


def test_defaults(tmp_path: Path) -> None:
    recording = read(tmp_path, STREAM + TIME + WRENCH + TURN)
    assert recording.gravity.tolist() == [0, 0, -STANDARD_GRAVITY]
    assert recording.notes == ("[log] gives no gravity: 9.80665 ± 0.015 m/s² along -z of W, a level base, was assumed",)
    assert recording.wrench_sign == 1
    assert recording.name == "log"
    assert not recording.noise
    assert recording.tool is None
    stream = only(recording)
    assert stream.name == "a.csv"
    assert stream.time is not None
    assert stream.time.tolist() == [0, 1, 2, 3]
    assert stream.delay is None
    assert stream.mount is None
    assert not stream.poses
    assert stream.channels["force"].tolist() == [FORCE] * 4
    assert stream.channels["torque"].tolist() == [TORQUE] * 4
    assert stream.channels["rotation"].shape == (4, 3, 3)
    assert not any(values.flags.writeable for values in stream.channels.values())


def test_everything_a_description_can_say(tmp_path: Path) -> None:
    tool = {"mass_kg": 0.5, "com_m": [0, 0, 0.1], "inertia_com_kgm2": np.eye(3).tolist(), "frame": "S"}
    toml = """
        [log]
        gravity = [0, 0, -9.82]
        wrench = "on-sensor"
        tool = "tool.json"
        [noise]
        force = 0.05
        angular_acceleration = 1
        [object]
        pose_in_sensor.position = [0, 0, 120]
        pose_in_sensor.unit = "mm"
        pose_in_sensor.rotation = [90, 0, 0]
        pose_in_sensor.form = "rpy"
        pose_in_sensor.angle_unit = "deg"
        pose_in_sensor.std_mm = 2
        pose_in_sensor.std_deg = 1
        [[stream]]
        path = "a.csv"
        time = { columns = ["t"], unit = "ms" }
        delay = { value = 7.5, unit = "ms" }
        mount = { rotation = [0,-1,0, 0,0,1, -1,0,0], form = "matrix", position = [0, 0, 5], unit = "mm" }
    """
    recording = read(tmp_path, toml + WRENCH + TURN, tool_json=json.dumps(tool))
    assert recording.wrench_sign == -1
    assert recording.gravity.tolist() == [0, 0, -9.82]
    assert recording.noise == {"force": 0.05, "angular_acceleration": 1.0}
    assert recording.tool == str(tmp_path / "tool.json")
    assert recording.object_pose is not None
    assert recording.object_pose.position.tolist() == [0, 0, 0.12]
    np.testing.assert_allclose(recording.object_pose.rotation.matrix, [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    assert recording.object_pose_std == pytest.approx((0.002, np.pi / 180))
    stream = only(recording)
    assert stream.delay == 0.0075
    assert stream.mount is not None
    assert stream.mount.rotation is not None
    assert stream.mount.rotation.matrix.tolist() == [[0, -1, 0], [0, 0, 1], [-1, 0, 0]]
    assert stream.mount.position is not None
    assert stream.mount.position.tolist() == [0, 0, 0.005]
    assert stream.time is not None
    np.testing.assert_allclose(stream.time, [0, 0.001, 0.002, 0.003])


@pytest.mark.parametrize(
    ("quantity", "unit", "factor"),
    [
        ("force", "N", 1), ("force", "kN", 1000), ("force", "kgf", 9.80665),
        ("force", "lbf", 4.4482216152605),
        ("torque", "N*m", 1), ("torque", "N*mm", 1e-3), ("torque", "kgf*m", 9.80665),
        ("torque", "lbf*in", 0.112984829),
        ("position", "m", 1), ("position", "mm", 1e-3), ("linear_velocity", "m/s", 1),
        ("angular_velocity", "rad/s", 1), ("angular_velocity", "deg/s", np.pi / 180),
        ("linear_acceleration", "m/s^2", 1), ("linear_acceleration", "g", 9.82),
        ("angular_acceleration", "rad/s^2", 1), ("specific_force", "m/s^2", 1), ("specific_force", "g", 9.82),
        ("gravity", "m/s^2", 1),
    ],
)  # fmt: skip
def test_units(tmp_path: Path, quantity: str, unit: str, factor: float) -> None:
    lines = {
        "force": 'force = { columns = ["fx", "fy", "fz"] }',
        "torque": 'torque = { columns = ["tx", "ty", "tz"] }',
    }
    lines[quantity] = f'{quantity} = {{ columns = ["ux", "uy", "uz"], unit = "{unit}" }}'
    toml = "[log]\ngravity = [0, 0, -9.82]\n" + STREAM + TIME + TURN + "\n".join(lines.values())
    np.testing.assert_allclose(
        only(read(tmp_path, toml, a_csv=with_more())).channels[quantity], np.multiply([FORCE] * 4, factor)
    )


def test_one_g_is_standard_gravity_where_the_log_is_not_on_earth(tmp_path: Path) -> None:
    toml = "[log]\ngravity = [0, 0, -1.62]\n" + STREAM + TIME + WRENCH
    stream = only(
        read(tmp_path, toml + 'specific_force = { columns = ["ux", "uy", "uz"], unit = "g" }', a_csv=with_more())
    )
    np.testing.assert_allclose(stream.channels["specific_force"][0], np.multiply(FORCE, STANDARD_GRAVITY))


@pytest.mark.parametrize(
    "form", ["matrix", "quaternion-wxyz", "quaternion-xyzw", "rpy", "rpy-deg", "rotation-vector", "rotation-vector-deg"]
)
def test_forms_of_rotation(tmp_path: Path, form: str) -> None:
    angles = np.random.default_rng(1).uniform(-1, 1, (4, 3))
    truth = Rotation.from_rpy(angles)
    wxyz = truth.quaternion_wxyz()
    values, unit = {
        "matrix": (
            truth.matrix.reshape(4, 9).round(4),
            "",
        ),  # rounded to four digits: the nearest rotation is taken
        "quaternion-wxyz": (wxyz, ""),
        "quaternion-xyzw": (np.roll(wxyz, -1, -1), ""),
        "rpy": (angles, ""),
        "rpy-deg": (np.degrees(angles), ', unit = "deg"'),
        "rotation-vector": (truth.log(), ""),
        "rotation-vector-deg": (np.degrees(truth.log()), ', unit = "deg"'),
    }[form]
    names = [f"r{i}" for i in range(values.shape[1])]
    csv = table([*COLUMNS[:7], *names], np.hstack([ROWS[:, :7], values]))
    toml = STREAM + TIME + WRENCH + f'rotation = {{ columns = {names}, form = "{form.removesuffix("-deg")}"{unit} }}'
    rotation = Rotation(only(read(tmp_path, toml, a_csv=csv)).channels["rotation"])
    assert float((truth.inverse() @ rotation).angle().max()) < (2e-4 if form == "matrix" else 1e-11)


def test_frames(tmp_path: Path) -> None:
    toml = STREAM + TIME + TURN + WRENCH.replace('"fz"] }', '"fz"], frame = "W" }')
    toml += 'position = { columns = ["ux", "uy", "uz"] }\n'
    assert dict(only(read(tmp_path, toml, a_csv=with_more())).frames) == {"force": "W", "position": "W"}


def test_zero_torque(tmp_path: Path) -> None:
    toml = STREAM + TIME + 'torque = "zero"\nforce = { columns = ["fx", "fy", "fz"] }\n' + TURN
    assert not only(read(tmp_path, toml)).channels["torque"].any()


# --- time --------------------


def test_large_stamps_keep_their_digits_and_share_one_origin(tmp_path: Path) -> None:
    micro = "t,fx,fy,fz,tx,ty,tz\n1708857503931759,1,2,3,4,5,6\n1708857503931760,1,2,3,4,5,6\n"
    nano = "t,qw,qx,qy,qz\n1708857503931759001,1,0,0,0\n1708857503931759004,1,0,0,0\n"
    toml = f"""
        [[stream]]
        path = "a.csv"
        time = {{ columns = ["t"], unit = "us" }}
        {WRENCH}
        [[stream]]
        path = "b.csv"
        time = {{ columns = ["t"], unit = "ns" }}
        {TURN}
    """
    first, second = read(tmp_path, toml, a_csv=micro, b_csv=nano).streams
    assert first.time is not None
    assert second.time is not None
    assert first.time.tolist() == [0.931759, 0.931760]
    assert second.time.tolist() == [0.931759001, 0.931759004]


def test_small_stamps_keep_their_origin(tmp_path: Path) -> None:
    csv = table(COLUMNS, ROWS + np.eye(1, 11) * 5000.25)
    time = only(read(tmp_path, STREAM + TIME + WRENCH + TURN, a_csv=csv)).time
    assert time is not None
    assert time.tolist() == [5000.25, 5001.25, 5002.25, 5003.25]


def test_integer_stamps_that_turn_into_decimals(tmp_path: Path) -> None:
    csv = table(COLUMNS, ROWS).replace("\n2,", "\n2.5,")
    time = only(read(tmp_path, STREAM + TIME + WRENCH + TURN, a_csv=csv)).time
    assert time is not None
    assert time.tolist() == [0, 1, 2.5, 3]


def test_rate_starts_with_the_earliest_clock(tmp_path: Path) -> None:
    toml = STREAM + TIME + WRENCH + '[[stream]]\npath = "b.csv"\ntime = { rate = 2, unit = "kHz" }\n' + TURN
    csv = table(COLUMNS, ROWS + np.eye(1, 11) * 7)
    _, second = read(tmp_path, toml, a_csv=csv, b_csv=table(COLUMNS, ROWS)).streams
    assert second.time is not None
    np.testing.assert_allclose(second.time, 7 + np.arange(4) / 2000)


def test_repeated_rows_pass(tmp_path: Path) -> None:
    csv = table(COLUMNS, ROWS[[0, 1, 1, 2, 2, 3]])
    assert len(only(read(tmp_path, STREAM + TIME + WRENCH + TURN, a_csv=csv))) == 6


def test_no_clock(tmp_path: Path) -> None:
    stream = only(read(tmp_path, STREAM + WRENCH + TURN))
    assert stream.time is None
    assert not stream.poses


def test_poses_are_matched_by_row(tmp_path: Path) -> None:
    kind = 'kind = "poses"\n'
    toml = STREAM + kind + WRENCH + '[[stream]]\npath = "b.csv"\n' + kind + TURN
    streams = read(tmp_path, toml, b_csv=table(COLUMNS, ROWS)).streams
    assert [stream.poses for stream in streams] == [True, True]
    assert [len(stream) for stream in streams] == [4, 4]


# --- files --------------------

BY_NUMBER = """
    time = { columns = [0] }
    force = { columns = [1, 2, 3] }
    torque = { columns = [4, 5, 6] }
    rotation = { columns = [7, 8, 9, 10], form = "quaternion-wxyz" }
"""
BY_NAME = TIME + WRENCH + TURN
PLAIN = table(COLUMNS, ROWS)


@pytest.mark.parametrize(
    ("text", "columns"),
    [
        (PLAIN, BY_NAME),
        (PLAIN, BY_NUMBER),
        (table(None, ROWS), BY_NUMBER),
        (table(COLUMNS, ROWS, "\t"), BY_NAME),
        (table(COLUMNS, ROWS, ";"), BY_NAME),
        (table(COLUMNS, ROWS, "  "), BY_NAME),
        (table(COLUMNS, ROWS, " , "), BY_NAME),
        (table(COLUMNS, ROWS, end="\r\n"), BY_NAME),
        (table(COLUMNS, ROWS, end="\r"), BY_NAME),
        ("\ufeff" + PLAIN, BY_NAME),
        ("# recorded on Monday\n\n" + PLAIN.replace("\n", "\n# pause\n\n", 3), BY_NAME),
        ("# " + PLAIN, BY_NAME),
        ("# " + " ".join(COLUMNS) + "\n" + table(None, ROWS), BY_NAME),
        (",".join(f'"{name}"' for name in COLUMNS) + "\n" + table(None, ROWS), BY_NAME),
        (PLAIN.replace("3,0.1", '"3","0.1"'), BY_NAME),
        (PLAIN.replace("\n", ",\n"), BY_NAME),
        (PLAIN.rstrip("\n"), BY_NAME),
    ],
    ids=[
        "plain", "by number", "no header", "tab", "semicolon", "blanks", "comma and blanks", "CRLF", "CR",
        "BOM",
        "comments", "header in a comment", "other header in a comment", "quoted names", "quoted cells",
        "comma at the end", "no last line end",
    ],
)  # fmt: skip
def test_text_tables(tmp_path: Path, text: str, columns: str) -> None:
    stream = only(read(tmp_path, STREAM + columns, a_csv=text))
    assert stream.time is not None
    assert stream.time.tolist() == [0, 1, 2, 3]
    assert stream.channels["force"].tolist() == [FORCE] * 4
    assert stream.channels["torque"].tolist() == [TORQUE] * 4


def test_columns_of_text_are_left_alone(tmp_path: Path) -> None:
    lines = PLAIN.splitlines()
    csv = "\n".join([lines[0] + ",note", *(line + ",fine" for line in lines[1:])])
    assert len(only(read(tmp_path, STREAM + BY_NAME, a_csv=csv))) == 4


def test_many_blocks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steelyard.io.tables.text_blocks._BLOCK", 64)
    rows = np.hstack([np.arange(50.0)[:, None], np.random.default_rng(0).normal(size=(50, 6)), np.eye(1, 4)[[0] * 50]])
    stream = only(read(tmp_path, STREAM + BY_NAME, a_csv=table(COLUMNS, rows)))
    np.testing.assert_allclose(stream.channels["force"], rows[:, 1:4], rtol=1e-11)


def test_error_in_a_later_block_names_its_line(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steelyard.io.tables.text_blocks._BLOCK", 64)
    lines = table(COLUMNS, ROWS[[0] * 50]).splitlines()
    lines[40] = lines[40].replace("0.2", "O.2")
    with pytest.raises(Exception, match=r'line 41, column "ty" holds "O.2", which is not a number'):
        read(tmp_path, STREAM + BY_NAME, a_csv="\n".join(lines))


def test_gzip(tmp_path: Path) -> None:
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress(PLAIN.encode()))
    assert len(only(read(tmp_path, STREAM.replace("a.csv", "a.csv.gz") + BY_NAME))) == 4


def test_npz(tmp_path: Path) -> None:
    turns = np.broadcast_to(np.eye(3), (4, 3, 3))
    stamps = np.array([1708857503931759, 1708857503931760, 1708857503931761, 1708857503931762])
    np.savez(tmp_path / "a.npz", t=stamps, w=ROWS[:, 1:7].astype(np.float32), R=turns, note=np.array("hello"))
    toml = """
        [[stream]]
        path = "a.npz"
        time = { columns = ["t"], unit = "us" }
        force = { columns = ["w[0]", "w[1]", "w[2]"] }
        torque = { columns = ["w[3]", "w[4]", "w[5]"] }
        rotation = { columns = ["R"], form = "matrix" }
    """
    stream = only(read(tmp_path, toml))
    assert stream.time is not None
    assert stream.time.tolist() == [0.931759, 0.931760, 0.931761, 0.931762]
    assert stream.channels["force"].tolist() == [FORCE] * 4
    assert stream.channels["force"].dtype == np.float64


def test_npz_holds_nanoseconds_since_1970_and_arrays_of_any_width(tmp_path: Path) -> None:
    turns, images = np.broadcast_to(np.eye(3), (4, 3, 3)), np.zeros((4, 300, 300), np.uint8)
    stamps = 1708857503931759123 + np.arange(4, dtype=np.uint64)
    np.savez(tmp_path / "a.npz", t=stamps, w=ROWS[:, 1:7], R=turns, images=images)
    toml = """
        [[stream]]
        path = "a.npz"
        time = { columns = ["t"], unit = "ns" }
        force = { columns = ["w[0]", "w[1]", "w[2]"] }
        torque = { columns = ["w[3]", "w[4]", "w[5]"] }
        rotation = { columns = ["R"], form = "matrix" }
    """
    time = only(read(tmp_path, toml)).time
    assert time is not None
    np.testing.assert_allclose(np.diff(time), 1e-9, rtol=1e-6)


def test_decimals_and_nulls_of_parquet(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    many = np.repeat(ROWS, 10, axis=0)
    columns = dict(zip(COLUMNS, many.T, strict=True))
    columns["t"] = arrow.array(np.arange(40), mask=np.arange(40) == 5)
    columns["fx"] = arrow.array(many[:, 1].astype(int)).cast(arrow.decimal128(25, 3))
    columns["fy"] = arrow.array(many[:, 2], mask=np.arange(40) == 7)
    parquet.write_table(arrow.table(columns), tmp_path / "a.parquet")
    recording = read(tmp_path, (STREAM + BY_NAME).replace("a.csv", "a.parquet").replace('["t"]', '["t"], unit = "ms"'))
    stream = only(recording)
    assert "2 of 40 rows of 'a.parquet' miss a number in force, time: rows 6, 8." in recording.findings[0].message
    assert stream.channels["force"].tolist() == [FORCE] * 38


def test_parquet(tmp_path: Path) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = dict(zip(COLUMNS, ROWS.T, strict=True))
    columns["t"] = np.array([1708857503931759 + i for i in range(4)])
    parquet.write_table(arrow.table(columns), tmp_path / "a.parquet")
    stream = only(
        read(tmp_path, (STREAM + BY_NAME).replace("a.csv", "a.parquet").replace('["t"]', '["t"], unit = "us"'))
    )
    assert stream.time is not None
    assert stream.time.tolist() == [0.931759, 0.931760, 0.931761, 0.931762]
    assert stream.channels["force"].tolist() == [FORCE] * 4


LISTS = """
    [[stream]]
    path = "a.parquet"
    time = { columns = ["t"] }
    force = { columns = ["wrench[0]", "wrench[1]", "wrench[2]"] }
    torque = { columns = ["wrench[3]", "wrench[4]", "wrench[5]"] }
    rotation = { columns = ["quat"], form = "quaternion-wxyz" }
"""


@pytest.mark.parametrize(
    ("force", "message"),
    [('["fx", "fy", "fz"]', 'the name "fx" stands over 2 columns'), ("[1, 3, 4]", 'several columns are called "fx"')],
)
def test_two_columns_of_one_name_in_parquet_are_refused(tmp_path: Path, force: str, message: str) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    names = ["t", "fx", *COLUMNS[1:]]
    columns = [arrow.array(column) for column in (ROWS[:, 0], *ROWS.T)]
    parquet.write_table(arrow.Table.from_arrays(columns, names=names), tmp_path / "a.parquet")
    text = (STREAM + BY_NAME).replace("a.csv", "a.parquet").replace('["fx", "fy", "fz"]', force)
    with pytest.raises((BadDescription, BadFile), match=message):
        read(tmp_path, text)


@pytest.mark.parametrize("kind", ["list_", "large_list", "fixed"])
def test_lists_of_parquet(tmp_path: Path, kind: str) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    wrench: list[list[float] | None] = [[*FORCE, 1, 2, 3] for _ in range(40)]
    wrench[0] = wrench[7] = None
    number = arrow.float32()
    columns = {
        "t": np.arange(40) / 100,
        "wrench": arrow.array(wrench, arrow.list_(number, 6) if kind == "fixed" else getattr(arrow, kind)(number)),
        "quat": [[1.0, 0.0, 0.0, 0.0]] * 40,
        "name": [["x", "y"]] * 40,
        "depth": [[0.0] * 5000] * 40,
    }
    parquet.write_table(arrow.table(columns), tmp_path / "a.parquet", row_group_size=13)
    recording = read(tmp_path, LISTS)
    assert "2 of 40 rows of 'a.parquet' miss a number in force, torque: rows 1, 8." in recording.findings[0].message
    stream = only(recording)
    assert stream.channels["force"].tolist() == [FORCE] * 38
    assert stream.channels["torque"].tolist() == [[1, 2, 3]] * 38
    with pytest.raises(BadDescription, match=r'torque   = { columns = \["wrench\[3\]", "wrench\[4\]", "wrench\[5\]"\]'):
        read_recording(tmp_path / "a.parquet")  # in which order a "quat" is, only a description says


@pytest.mark.parametrize(
    ("column", "values", "message"),
    [
        (
            "wrench",
            [[1.0, 2, 3, 4, 5, 6]] * 3 + [[1.0, 2]],
            'the lists of column "wrench" have 6 items, and 2 in row 4',
        ),
        ("wrench", [["a"] * 6] * 4, 'column "wrench" must hold numbers; it holds list<'),
    ],
)
def test_lists_of_parquet_that_are_no_vectors_are_refused(
    tmp_path: Path, column: str, values: list[object], message: str
) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = {"t": [0.0, 0.1, 0.2, 0.3], "wrench": [[1.0] * 6] * 4, "quat": [[1.0, 0.0, 0.0, 0.0]] * 4}
    parquet.write_table(arrow.table(columns | {column: values}), tmp_path / "a.parquet")
    with pytest.raises(BadFile, match=re.escape(message)):
        read(tmp_path, LISTS)


@pytest.mark.parametrize("unit", ["ms", "us", "ns"])
@pytest.mark.parametrize("said", ["", ', unit = "us"'])
def test_dates_of_parquet_need_no_unit(tmp_path: Path, unit: str, said: str) -> None:
    arrow = pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    parquet = pytest.importorskip("pyarrow.parquet")
    columns = dict(zip(COLUMNS, ROWS.T, strict=True))
    dates = np.datetime64("2026-01-01T12:00") + np.arange(4) * np.timedelta64(2, "ms")
    columns["t"] = arrow.array(dates.astype(f"M8[{unit}]"))
    parquet.write_table(arrow.table(columns), tmp_path / "a.parquet")
    text = (STREAM + BY_NAME).replace("a.csv", "a.parquet").replace('["t"]', f'["t"]{said}')
    stream = only(read(tmp_path, text))
    assert stream.time is not None
    np.testing.assert_allclose(np.diff(stream.time), 0.002)


def test_one_file_may_serve_two_streams_and_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    from steelyard.io.tables.text_table import TextTable

    reads = []
    original = TextTable.read
    monkeypatch.setattr(TextTable, "read", lambda *args: reads.append(args[0].path) or original(*args))
    recording = read(tmp_path, STREAM + TIME + WRENCH + STREAM + TIME + TURN)
    assert [stream.name for stream in recording.streams] == ["a.csv", "a.csv#2"]
    assert len(reads) == 1


def test_data_folder_then_environment_then_beside_the_description(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    for i, name in enumerate(("beside", "environment", "data")):
        (tmp_path / name).mkdir()
        rows = ROWS.copy()
        rows[:, 1] = i
        (tmp_path / name / "a.csv").write_text(table(COLUMNS, rows))
    path = tmp_path / "beside" / "log.toml"
    path.write_text(STREAM + BY_NAME)

    def found(data: Path | None) -> float:
        return float(only(read_recording(path, data)).channels["force"][0, 0])

    monkeypatch.delenv("STEELYARD_DATA", raising=False)
    assert found(None) == 0
    monkeypatch.setenv("STEELYARD_DATA", str(tmp_path / "environment"))
    assert found(None) == 1
    assert found(tmp_path / "data") == 2
    (tmp_path / "empty").mkdir()
    assert found(tmp_path / "empty") == 1


# --- limits of rotations and of one g --------------------


@pytest.mark.parametrize(("angle", "good"), [(12.5, True), (12.6, False)])
def test_angles_in_radians_may_reach_two_turns(angle: float, good: bool) -> None:
    if good:
        rotation_of(np.array([[0.0, 0.1, angle]]), "rpy")
    else:
        with pytest.raises(BadValue, match="it looks like degrees"):
            rotation_of(np.array([[0.0, 0.1, angle]]), "rpy")


@pytest.mark.parametrize(("length", "good"), [(0.96, True), (1.04, True), (0.94, False), (1.06, False)])
def test_quaternions_may_be_off_by_a_twentieth(length: float, good: bool) -> None:
    numbers = length * np.array([[0.5, 0.5, 0.5, 0.5]])
    if good:
        assert np.isclose(np.linalg.det(rotation_of(numbers, "quaternion-xyzw").matrix), 1)
    else:
        with pytest.raises(BadValue, match="the quaternion must have norm 1"):
            rotation_of(numbers, "quaternion-xyzw")


def test_a_matrix_of_three_digits_becomes_a_rotation() -> None:
    true = Rotation.exp(np.random.default_rng(0).normal(size=(50, 3)))
    found = rotation_of(true.matrix.round(3).reshape(-1, 9), "matrix").matrix
    assert np.abs(np.swapaxes(found, 1, 2) @ found - np.eye(3)).max() < 1e-14
    assert np.abs(found - true.matrix).max() < 1e-3


@pytest.mark.parametrize(("size", "g"), [(9.77, 9.77), (9.83, 9.83), (9.7, STANDARD_GRAVITY), (9.9, STANDARD_GRAVITY)])
def test_one_g_is_that_of_a_place_on_earth(size: float, g: float) -> None:
    assert local_g(np.array([0.0, 0.0, -size])) == g


def test_a_passive_wrist_is_told_where_its_force_is(tmp_path: Path) -> None:
    toml = STREAM + TIME + 'torque = "zero"\n' + TURN + STREAM + TIME + 'force = { columns = ["fx", "fy", "fz"] }\n'
    with pytest.raises(BadDescription, match='torque = "zero" belongs in the stream that holds "force"'):
        read(tmp_path, toml, a_csv=PLAIN)
