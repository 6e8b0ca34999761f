"""Each wrong input has one error with one full text."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import gzip
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from refused import message

from steelyard.errors import BadDescription, BadFile, BadInput, BadValue, MissingDependency
from steelyard.io import read_recording, read_team
from steelyard.io.example import EXAMPLE

HEADER = "t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz\n"
ROW = "{},1,2,3,0.1,0.2,0.3,1,0,0,0\n"
CSV = HEADER + "".join(ROW.format(t) for t in range(4))
TOML = """\
[log]
gravity = [0, 0, -9.81]
[[stream]]
path     = "a.csv"
time     = { columns = ["t"], unit = "s" }
force    = { columns = ["fx", "fy", "fz"], unit = "N" }
torque   = { columns = ["tx", "ty", "tz"], unit = "N*m" }
rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }
"""
STREAM = 'log.toml, [[stream]] 1 ("a.csv")'
MATRIX = '["r1","r2","r3","r4","r5","r6","r7","r8","r9"]'
TURN = ",".join(f"r{i}" for i in range(1, 10))


def write(folder: Path, toml: str = TOML, csv: str | bytes = CSV) -> Path:
    """Write a description and its data; return the description."""
    (folder / "a.csv").write_bytes(csv.encode() if isinstance(csv, str) else csv)
    (folder / "log.toml").write_text(toml)
    return folder / "log.toml"


def swap(text: str, old: str, new: str) -> str:
    if old not in text:
        pytest.fail(f"{old!r} is not in the text to edit")
    return text.replace(old, new, 1)


def with_matrix(rows: list[str]) -> tuple[str, str]:
    toml = swap(TOML, '["qw", "qx", "qy", "qz"], form = "quaternion-wxyz"', f'{MATRIX}, form = "matrix"')
    return toml, "t,fx,fy,fz,tx,ty,tz," + TURN + "\n" + "".join(f"{t},1,2,3,4,5,6,{r}\n" for t, r in enumerate(rows))


DESCRIPTIONS: list[tuple[str, str, str, str]] = [
    # what, old, new, message
    ("unknown section", "[log]", "[logs]", 'log.toml: unknown key "logs". Did you mean "log"? Keys here: log, noise, object, stream, robot.'),
    ("unknown key", "gravity =", "gravty =", 'log.toml, [log]: unknown key "gravty". Did you mean "gravity"? Keys here: gravity, wrench, tool.'),
    ("stream key in [log]", "[log]", '[log]\nkind = "poses"', 'log.toml, [log]: unknown key "kind". It stands in [[stream]]. Keys here: gravity, wrench, tool.'),
    ("key of [log] above it", "[log]", 'wrench = "on-sensor"\n[log]', 'log.toml: unknown key "wrench". It stands in [log]. Keys here: log, noise, object, stream, robot.'),
    ("unknown stream key", "torque  ", "torqe   ", 'log.toml, [[stream]] 1: unknown key "torqe". Did you mean "torque"? Keys here: path, topic, frames, kind, time, delay, mount, force, torque, rotation, position, linear_velocity, angular_velocity, linear_acceleration, angular_acceleration, specific_force, gravity, joint_position, joint_torque.'),
    ("unknown wrench", "[log]", '[log]\nwrench = "sensor"', 'log.toml, [log]: unknown wrench "sensor". Did you mean "on-sensor"? Possible here: on-sensor, on-object.'),
    ("gravity of two", "[0, 0, -9.81]", "[0, -9.81]", 'log.toml, [log]: "gravity" must be a list of 3 finite numbers; got [0, -9.81].'),
    ("gravity zero", "[0, 0, -9.81]", "[0, 0, 0]", 'log.toml, [log]: "gravity" must not be zero; on a level base it is [0, 0, -9.81].'),
    ("noise negative", "[log]", "[noise]\nforce = -1\n[log]", 'log.toml, [noise]: "force" must be above zero; got -1.'),
    ("noise text", "[log]", "[noise]\nforce = 'x'\n[log]", "log.toml, [noise]: \"force\" must be a finite number; got 'x'."),
    ("unit of another size", '"N*m"', '"N*cm"', f'{STREAM}, torque: unknown unit "N*cm". Multiply its numbers by 0.01 and declare "N*m". Possible here: N*m, N*mm, kgf*m, lbf*in.'),
    ("pound-feet", '"N*m"', '"ft-lb"', f'{STREAM}, torque: unknown unit "ft-lb". Multiply its numbers by 12 and declare "lbf*in". Possible here: N*m, N*mm, kgf*m, lbf*in.'),
    ("unit that nobody uses", '"N*m"', '"daN*km"', f'{STREAM}, torque: unknown unit "daN*km". Possible here: N*m, N*mm, kgf*m, lbf*in.'),
    ("unknown unit", '"N"', '"lb"', f'{STREAM}, force: unknown unit "lb". Did you mean "lbf"? Possible here: N, kN, kgf, lbf.'),
    ("unknown time unit", '"s"', '"minutes"', f'{STREAM}, time: unknown unit "minutes". Possible here: s, ms, us, ns.'),
    ("unknown form", '"quaternion-wxyz"', '"quaternion"', f'{STREAM}, rotation: unknown form "quaternion". Did you mean "quaternion-xyzw"? Possible here: matrix, quaternion-wxyz, quaternion-xyzw, rpy, rotation-vector, zyz.'),
    ("no form", ', form = "quaternion-wxyz"', "", f'{STREAM}, rotation: "form" is missing. Example: form = "matrix"; one of matrix, quaternion-wxyz, quaternion-xyzw, rpy, rotation-vector, zyz'),
    ("unit of matrix", 'form = "quaternion-wxyz"', 'form = "matrix", unit = "deg"', f'{STREAM}, rotation: "unit" belongs to form = "rpy", "rotation-vector" and "zyz"; a matrix has none.'),
    ("two columns", '["fx", "fy", "fz"]', '["fx", "fy"]', f"{STREAM}, force: \"columns\" must have 3 entries; got 2: ['fx', 'fy']."),
    ("column twice", '["fx", "fy", "fz"]', '["fx", "fy", "fy"]', f"{STREAM}, force: \"columns\" names a column twice: ['fx', 'fy', 'fy']."),
    ("column of wrong kind", '["fx", "fy", "fz"]', "[-1, 1, 2]", f'{STREAM}, force: "columns" must be a list of names or of numbers from 0; got [-1, 1, 2].'),
    ("quantity as text", 'torque   = { columns = ["tx", "ty", "tz"], unit = "N*m" }', 'torque = "none"', f"{STREAM}: \"torque\" must be a table such as torque = {{ .. }}; got 'none'."),
    ("missing column", '"fx"', '"f_x"', f'{STREAM}, force: there is no column "f_x". Did you mean "fx"? Columns here: t, fx, fy, fz, tx, ty, tz, qw, qx, qy, qz.'),
    ("missing number", '"fx"', "11", f"{STREAM}, force: there is no column 11; the file has 11, 0 to 10."),
    ("array name for CSV", '["fx", "fy", "fz"]', '["fx"]', f"{STREAM}, force: 3 columns are needed; ['fx'] gives 1."),
    ("no path", 'path     = "a.csv"', "", 'log.toml, [[stream]] 1: "path" is missing. Example: path = "log.csv"'),
    ("unknown kind", 'path     = "a.csv"', 'path = "a.csv"\nkind = "pose"', f'{STREAM}: unknown kind "pose". Leave it out, or write kind = "poses" for a table of still poses.'),
    ("poses with time", 'path     = "a.csv"', 'path = "a.csv"\nkind = "poses"', f'{STREAM}: kind = "poses" is a table of still poses without time; leave out "time" or "kind".'),
    ("mount mirrored", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [1,0,0,0,1,0,0,0,-1] }', f"{STREAM}, mount: the rotation is a mirror image (determinant -1). Check the order and the signs of the nine numbers."),
    ("mount askew", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [2,0,0,0,1,0,0,0,1], form = "matrix" }', f"{STREAM}, mount: the rotation is not orthonormal: R^T R is off by 3 (allowed 0.005). Check the order and the number of digits of the nine numbers."),
    ("mount of zeros", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [0,0,0,0], form = "quaternion-wxyz" }', f"{STREAM}, mount: the quaternion has norm zero. No rotation has four zeros."),
    ("mount too long", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [1,1,0,0], form = "quaternion-wxyz" }', f"{STREAM}, mount: the quaternion must have norm 1: norm 1.414. Check the four numbers."),
    ("unit of no position", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [0,0,90], form = "rpy", unit = "deg" }', f'{STREAM}, mount: "unit" belongs to "position", which is left out; angles have "angle_unit".'),
    ("form of no rotation", 'path     = "a.csv"', 'path = "a.csv"\nmount = { position = [0,0,1], form = "rpy" }', f'{STREAM}, mount: "form" belongs to "rotation", which is left out.'),
    ("angle unit of a matrix", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [1,0,0,0,1,0,0,0,1], form = "matrix", angle_unit = "deg" }', f'{STREAM}, mount: "angle_unit" belongs to a rotation of form = "rpy", "rotation-vector" or "zyz".'),
    ("mount in degrees", 'path     = "a.csv"', 'path = "a.csv"\nmount = { rotation = [0,0,90], form = "rpy" }', f'{STREAM}, mount: roll, pitch or yaw reaches 90 rad, which is 14.3 turns: it looks like degrees. Set angle_unit = "deg".'),
    ("mount of poses", "rotation =", '[[stream]]\npath = "a.csv"\ntime = { columns = ["t"], unit = "s" }\nmount = { position = [0,0,0.1], unit = "m" }\nrotation =', 'log.toml, [[stream]] 2 ("a.csv"), mount: of use beside force, torque or specific_force only; this stream has none of them. If its poses are those of another frame, call that frame S: then the mount of the wrench\'s stream is the sensor\'s pose in it.'),
    ("empty mount", 'path     = "a.csv"', 'path = "a.csv"\nmount = { }', f'{STREAM}, mount: give "rotation", "position" or both.'),
    ("delay as number", 'path     = "a.csv"', 'path = "a.csv"\ndelay = 0.1', f'{STREAM}: "delay" must be a table such as delay = {{ .. }}; got 0.1.'),
    ("joints", 'path     = "a.csv"', 'path = "a.csv"\njoint_position = { columns = ["q1"], unit = "rad" }', f'{STREAM}: "joint_position" needs the arm. Add [robot] with urdf = "arm.urdf" and sensor_link = ".."; or give the orientation of the sensor, as rotation = {{ columns = [..], form = .. }}.'),
    ("robot", "[log]", '[robot]\nmodel = "omnid"\n[log]', 'log.toml, [robot]: "model" is for teams. Give an arm\'s urdf = "arm.urdf" and sensor_link = "..".'),
    ("team", "[log]", "[team]\n[log]", "log.toml: [team] makes this a team description. Use it with: steelyard team"),
    ("topic", 'path     = "a.csv"', 'path = "a.csv"\ntopic = "/ft"', 'DIR/a.csv: "topic" belongs to a bag (.mcap, .bag, .db3, or the folder of one).'),
    ("no torque", 'torque   = { columns = ["tx", "ty", "tz"], unit = "N*m" }\n', "", 'log.toml: no torque is given, only force, rotation. An answer needs the wrench: force and torque (torque = "zero" for a passive gimbal).'),
    ("no wrench", 'force    = { columns = ["fx", "fy", "fz"], unit = "N" }\ntorque   = { columns = ["tx", "ty", "tz"], unit = "N*m" }\n', "", 'log.toml: no force and no torque is given, only rotation. An answer needs the wrench: force and torque (torque = "zero" for a passive gimbal).'),
    ("no gravity", 'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n', "", "log.toml: nothing says where gravity points in the sensor frame; given are force, torque. Add rotation (S to W), joint_position with a URDF, gravity (in S) or specific_force (an accelerometer)."),
    ("force twice", "[[stream]]", '[[stream]]\npath = "a.csv"\nforce = { columns = ["fx", "fy", "fz"] }\n[[stream]]', 'log.toml: "force" is given by 2 streams. Give it in one.'),
    ("time in one stream only", "[[stream]]", '[[stream]]\npath = "a.csv"\ngravity = { columns = ["fx", "fy", "fz"] }\n[[stream]]', 'log.toml: stream "a.csv" has no time and "a.csv#2" has one, so their rows cannot be matched. Give time to all streams or to none.'),
    ("object without position", "[log]", "[object]\npose_in_sensor = { rotation = [1,0,0,0,1,0,0,0,1] }\n[log]", 'log.toml, [object], pose_in_sensor: give both "rotation" and "position".'),
]  # fmt: skip


@pytest.mark.parametrize(("old", "new", "text"), [d[1:] for d in DESCRIPTIONS], ids=[d[0] for d in DESCRIPTIONS])
def test_description(tmp_path: Path, old: str, new: str, text: str) -> None:
    assert message(write(tmp_path, swap(TOML, old, new))) == text


def third(row: str) -> str:
    """Return the table with its third row (line 4) replaced."""
    return swap(CSV, ROW.format(2), row)


TABLES: list[tuple[str, str | bytes, type[BadInput], str]] = [
    ("no rows", HEADER, BadFile, "DIR/a.csv: the file has a header but no rows. Record again, or correct the path."),
    ("nothing", "", BadFile, "DIR/a.csv: the file is empty (0 bytes). Record again, or correct the path."),
    ("blank lines", "\n\n\n", BadFile, "DIR/a.csv: the file has no rows, only blank lines or comments."),
    ("binary", b"\x00\x01" * 99, BadFile, "DIR/a.csv: expected a text table; found binary data. Readable are text tables, .npz and .parquet."),
    ("UTF-16", "t,fx\n1,2\n".encode("utf-16"), BadFile, "DIR/a.csv: the text is in UTF-16. Save it in UTF-8."),
    ("one line", "a" * 70_000, BadFile, "DIR/a.csv: expected a table with one row per line; found no line end in the first 64 kB."),
    ("text in a cell", third("2,1,abc,3,1,1,1,1,0,0,0\n"), BadFile, 'DIR/a.csv: line 4, column "fy" holds "abc", which is not a number. Correct or delete that line.'),
    ("empty cell", third("2,1,,3,1,1,1,1,0,0,0\n"), BadValue, f"{STREAM}, force: 1 of 4 rows are NaN, infinite or empty: row 3. Record again, or delete those rows if they are missing by chance."),
    ("decimal comma", CSV.replace(",", ";").replace("0.1", "0,1"), BadFile, 'DIR/a.csv: line 2, column "tx" holds "0,1", which is not a number. Write decimals with a point.'),
    ("short row", third("2,1,2,3\n"), BadFile, "DIR/a.csv: line 4 has 4 cells, the rows before it have 11. Complete or delete that line."),
    ("long row", third("2,1,2,3,1,1,1,1,0,0,0,0\n"), BadFile, "DIR/a.csv: line 4 has 12 cells, the rows before it have 11. Complete or delete that line."),
    ("UTF-16 without its mark", CSV.encode("utf-16-le"), BadFile, "DIR/a.csv: the text is in UTF-16. Save it in UTF-8."),
    ("UTF-16, large end first, without its mark", CSV.encode("utf-16-be"), BadFile, "DIR/a.csv: the text is in UTF-16. Save it in UTF-8."),
    ("decimal commas between commas", HEADER + ",".join(["0,5"] * 10) + ",1\n", BadFile, "DIR/a.csv: the header has 11 names, but its rows have 21 cells. If its decimals have commas (0,5), save it with points, or with semicolons between cells. Write one name per column, or a description with column numbers and no header."),
    ("short header", swap(CSV, ",qz", ""), BadFile, "DIR/a.csv: the header has 10 names, but its rows have 11 cells. Write one name per column, or a description with column numbers and no header."),
    ("no header", CSV.removeprefix(HEADER), BadDescription, f'{STREAM}, time: there is no column "t", because the file has no header. Give column numbers from 0 to 10.'),
    ("name twice", swap(CSV, "fy", "fx"), BadDescription, f'{STREAM}, force: the name "fx" stands over 2 columns. Rename all but one, or give column numbers.'),
    ("NaN", third("2,1,nan,3,1,1,1,1,0,0,0\n"), BadValue, f"{STREAM}, force: 1 of 4 rows are NaN, infinite or empty: row 3. Record again, or delete those rows if they are missing by chance."),
    ("many NaN", HEADER + "0,nan,inf,0,1,1,1,1,0,0,0\n" * 9, BadValue, f"{STREAM}, force: all 9 rows are NaN, infinite or empty: there are no data. Check the driver and the columns, or record again."),
    ("NaN time", third(ROW.format("nan")), BadValue, f"{STREAM}, time: 1 of 4 rows are NaN, infinite or empty: row 3. Record again, or delete those rows if they are missing by chance."),
    ("time goes back", third(ROW.format(0)), BadValue, f"{STREAM}, time: time must not go back; it does once, from 1 in row 2 to 0 in row 3. If the rows are out of order, sort them; if the clock was set back, add that to the times from there on, or leave out the rows that overlap."),
    ("time goes back often", CSV + CSV.removeprefix(HEADER) * 2, BadValue, f"{STREAM}, time: time must not go back; it does 2 times, first from 3 in row 4 to 0 in row 5. If the rows are out of order, sort them; if the clock was set back, add that to the times from there on, or leave out the rows that overlap."),
    ("time stands still", HEADER + ROW.format(7) * 3, BadValue, f"{STREAM}, time: time stands still at 7 in all 3 rows. Name the column of the clock, or give time = {{ rate = .. }}."),
    ("quaternion zero", third("2,1,2,3,1,1,1,0,0,0,0\n"), BadValue, f"{STREAM}, rotation: the quaternion has norm zero: 1 of 4 rows, first row 3. Delete the rows where the pose was not known."),
    ("quaternion long", third("2,1,2,3,1,1,1,1,1,0,0\n"), BadValue, f"{STREAM}, rotation: the quaternion must have norm 1: 1 of 4 rows are off, the worst is row 3 with norm 1.414. Check the four columns."),
]  # fmt: skip


@pytest.mark.parametrize(("csv", "error", "text"), [t[1:] for t in TABLES], ids=[t[0] for t in TABLES])
def test_table(tmp_path: Path, csv: str | bytes, error: type[BadInput], text: str) -> None:
    path = write(tmp_path, csv=csv)
    before = sorted(tmp_path.iterdir())
    assert message(path, error) == text
    assert sorted(tmp_path.iterdir()) == before


def test_rotation_that_is_not_orthonormal(tmp_path: Path) -> None:
    path = write(tmp_path, *with_matrix(["1,0,0,0,1,0,0,0,1", "1,0,0,0,1,0,0,0,1.1", "2,0,0,0,1,0,0,0,1"]))
    assert message(path, BadValue) == (
        f"{STREAM}, rotation: the rotation is not orthonormal: 2 of 3 rows, the worst is row 3, where R^T R is off by 3 "
        "(allowed 0.005). Check the order and the number of digits of the nine columns."
    )


def test_rotation_that_is_a_mirror_image(tmp_path: Path) -> None:
    path = write(tmp_path, *with_matrix(["1,0,0,0,1,0,0,0,1", "1,0,0,0,1,0,0,0,-1"]))
    assert message(path, BadValue) == (
        f"{STREAM}, rotation: the rotation is a mirror image (determinant -1): 1 of 2 rows, first row 2. "
        "Check the order and the signs of the nine columns."
    )


def test_missing_data_file_names_the_searched_folders(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("STEELYARD_DATA", str(tmp_path / "env"))
    (tmp_path / "data").mkdir()
    path = write(tmp_path, swap(TOML, '"a.csv"', '"b.csv"'))
    assert message(path, BadFile, tmp_path / "data") == (
        'log.toml, [[stream]] 1 ("b.csv"): "b.csv" was not found. Searched: DIR/data, DIR/env, DIR. '
        "Correct the path, or give the folder of the data with --data DIR or STEELYARD_DATA."
    )


@pytest.mark.parametrize("read", [read_recording, read_team])
def test_a_folder_of_data_that_is_not_there_is_named(tmp_path: Path, read: Callable[..., object]) -> None:
    (tmp_path / "file").touch()
    (tmp_path / "log.toml").write_text(EXAMPLE)
    for wrong in (tmp_path / "none", tmp_path / "file"):
        with pytest.raises(BadFile) as caught:
            read(tmp_path / "log.toml", wrong)
        assert str(caught.value) == f"--data (in Python data): {wrong}: no such folder. Correct it, or leave it out."


def test_missing_tool_names_the_line_that_asks_for_it(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("STEELYARD_DATA", raising=False)
    path = write(tmp_path, swap(TOML, "[log]", '[log]\ntool = "grip.json"'))
    assert message(path, BadFile).startswith('log.toml, [log], tool: "grip.json" was not found. Searched: DIR')


COLUMNS = "columns in a.csv: t, fx, fy, fz, tx, ty, tz, qw, qx, qy, qz."


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('["tx", "ty"', '["tx", "fy"', 'column "fy" is given for force and torque.'),
        ('["fx", "fy"', '["fx", 1', 'column "fx" is given for two axes of force.'),
        ('["t"]', '["fx"]', 'column "fx" is given for time and force.'),
    ],
)
def test_one_column_for_two_things(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = write(tmp_path, swap(TOML, old, new))
    assert message(path, BadDescription) == f"{STREAM}: {said} Each needs columns of its own; {COLUMNS}"


def test_missing_description(tmp_path: Path) -> None:
    assert message(tmp_path / "no.toml", BadFile) == "DIR/no.toml: no such file."


def test_not_toml(tmp_path: Path) -> None:
    path = write(tmp_path, "[log]\ngravity = [0, 0 -9.81]\n")
    assert message(path, BadDescription) == "DIR/log.toml: not valid TOML: Unclosed array (at line 2, column 17)."


def test_binary_description(tmp_path: Path) -> None:
    path = write(tmp_path)
    path.write_bytes(b"\xff\xfe\x80")
    assert message(path, BadFile) == "DIR/log.toml: expected a TOML text in UTF-8; found a binary file."


def test_folder_called_toml(tmp_path: Path) -> None:
    (tmp_path / "log.toml").mkdir()
    assert message(tmp_path / "log.toml", BadFile) == "DIR/log.toml: cannot be read (Is a directory)."


def test_no_stream(tmp_path: Path) -> None:
    path = write(tmp_path, "[log]\n")
    assert message(path, BadDescription) == (
        f"log.toml: no [[stream]] is given, so there are no data. A complete description:\n{EXAMPLE}"
    )


def test_unknown_kind_of_file_and_folder(tmp_path: Path) -> None:
    (tmp_path / "a.xlsx").write_bytes(b"x")
    (tmp_path / "folder").mkdir()
    assert message(tmp_path / "a.xlsx", BadFile) == (
        'DIR/a.xlsx: unknown kind of data file ".xlsx". Readable are .csv, .tsv, .txt (also .gz), .npz, .parquet, and bags: .mcap, .db3, .bag.'
    )
    assert message(tmp_path / "folder", BadFile) == (
        "DIR/folder: this is a folder, not a file of data. Name the file in it."
    )


def test_poses_of_different_length(tmp_path: Path) -> None:
    (tmp_path / "b.csv").write_text(CSV + ROW.format(4))
    path = write(
        tmp_path,
        '[[stream]]\npath = "a.csv"\nkind = "poses"\n'
        'force = { columns = ["fx", "fy", "fz"] }\ntorque = { columns = ["tx", "ty", "tz"] }\n'
        '[[stream]]\npath = "b.csv"\nkind = "poses"\n'
        'rotation = { columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }\n',
    )
    assert message(path, BadValue) == (
        'log.toml: streams without time are matched by row, but their lengths differ: "a.csv" 4, "b.csv" 5 rows.'
    )


# --- NPZ --------------------

NPZ = """\
[[stream]]
path     = "a.npz"
time     = { columns = ["t"] }
force    = { columns = ["force"] }
torque   = { columns = ["torque"] }
rotation = { columns = ["R"], form = "matrix" }
"""
ARRAYS = {
    "t": np.arange(5.0),
    "force": np.ones((5, 3)),
    "torque": np.ones((5, 3)),
    "R": np.broadcast_to(np.eye(3), (5, 3, 3)),
}


class Trap:
    """Leaves a file behind when it is unpickled."""

    def __init__(self, path: Path) -> None:
        self.path = path

    def __reduce__(self) -> tuple[Callable[..., object], tuple[object, ...]]:
        return (Path.touch, (self.path,))


def npz(folder: Path, **changes: object) -> Path:
    np.savez(folder / "a.npz", **{**ARRAYS, **changes})  # type: ignore[arg-type]
    return write(folder, NPZ)


def test_pickle_inside_an_npz_is_never_opened(tmp_path: Path) -> None:
    path = npz(tmp_path, force=np.array([Trap(tmp_path / "hit")] * 5, dtype=object))
    assert message(path, BadFile) == (
        'DIR/a.npz: array "force" holds pickled Python objects, which can run code when opened; it was not opened. '
        "Save it as plain numbers (float64)."
    )
    assert not (tmp_path / "hit").exists()


def test_bare_pickle_called_npz(tmp_path: Path) -> None:
    path = npz(tmp_path)
    (tmp_path / "a.npz").write_bytes(pickle.dumps(Trap(tmp_path / "hit")))
    assert message(path, BadFile) == (
        "DIR/a.npz: expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez."
    )
    assert not (tmp_path / "hit").exists()


def test_arrays_of_different_length(tmp_path: Path) -> None:
    where = 'log.toml, [[stream]] 1 ("a.npz")'
    assert message(npz(tmp_path, torque=np.ones((4, 3))), BadValue) == (
        f"{where}: the lengths differ: force 5, torque 4, rotation 5, time 5 rows. "
        "Each quantity of a stream must have one row per sample."
    )
    (tmp_path / "b").mkdir()
    assert message(npz(tmp_path / "b", t=np.arange(4.0)), BadValue) == (
        f"{where}: the lengths differ: force 5, torque 5, rotation 5, time 4 rows. "
        "Each quantity of a stream must have one row per sample."
    )


def test_wrong_arrays(tmp_path: Path) -> None:
    assert message(npz(tmp_path, force=np.ones((5, 3), complex)), BadFile) == (
        'DIR/a.npz: array "force" must hold real numbers; it holds complex128.'
    )
    assert message(npz(tmp_path, force=np.ones((5, 2))), BadDescription) == (
        "log.toml, [[stream]] 1 (\"a.npz\"), force: 3 columns are needed; ['force'] gives 2."
    )
    empty = {key: value[:0] for key, value in ARRAYS.items()}
    assert message(npz(tmp_path, **empty), BadValue) == (
        'log.toml, [[stream]] 1 ("a.npz"): the log is empty: it has no rows. Record again, or correct the path.'
    )
    npz(tmp_path)
    assert message(write(tmp_path, swap(NPZ, '["force"]', '["forces"]')), BadDescription) == (
        'log.toml, [[stream]] 1 ("a.npz"), force: there is no column "forces". Did you mean "force"? '
        "Columns here: force[0..2], torque[0..2], R[0..8], t."
    )


def test_truncated_npz(tmp_path: Path) -> None:
    path = npz(tmp_path)
    blob = (tmp_path / "a.npz").read_bytes()
    (tmp_path / "a.npz").write_bytes(blob[: len(blob) // 2])
    assert message(path, BadFile).startswith("DIR/a.npz: expected an NPZ file")


# --- large garbage --------------------

TWO_GIGABYTES = 2_000_000_000


def garbage(path: Path, head: bytes) -> Path:
    with path.open("wb") as stream:
        stream.write(head)
        stream.truncate(TWO_GIGABYTES)
    return path


@pytest.mark.parametrize("name", ["a.csv", "a.txt", "a.npz", "a.csv.gz", "a.toml"])
@pytest.mark.parametrize("kind", ["zeros", "random", "letters"])
def test_two_gigabytes_of_garbage(tmp_path: Path, name: str, kind: str) -> None:
    head = {"zeros": b"", "random": np.random.default_rng(0).bytes(1 << 17), "letters": b"a" * (1 << 17)}[kind]
    text = message(garbage(tmp_path / name, head), BadFile)
    binary = "expected a text table; found binary data. Readable are text tables, .npz and .parquet."
    letters = "expected a table with one row per line; found no line end in the first 64 kB."
    wanted = {
        "a.csv": letters if kind == "letters" else binary,
        "a.txt": letters if kind == "letters" else binary,
        "a.npz": "expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez.",
        "a.toml": f"a log description is a small TOML text; this file has {TWO_GIGABYTES} bytes.",
        "a.csv.gz": "cannot be read (",
    }[name]
    assert text.startswith(f"DIR/{name}: {wanted}")


def test_garbage_behind_a_good_head(tmp_path: Path) -> None:
    path = write(tmp_path)
    garbage(tmp_path / "a.csv", CSV.encode() * 2000)
    assert message(path, BadFile) == (
        "DIR/a.csv: expected a text table; found binary data. Readable are text tables, .npz and .parquet."
    )


def test_truncated_gzip(tmp_path: Path) -> None:
    path = write(tmp_path, swap(TOML, "a.csv", "a.csv.gz"))
    rows = "".join(ROW.format(t) for t in range(20_000))
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress((HEADER + rows).encode())[:-2000])
    assert message(path, BadFile) == (
        "DIR/a.csv.gz: cannot be read (Compressed file ended before the end-of-stream marker was reached)."
    )


def test_parquet_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "pyarrow", None)
    (tmp_path / "a.parquet").write_bytes(b"PAR1")
    with pytest.raises(MissingDependency) as caught:
        read_recording(tmp_path / "a.parquet")
    assert str(caught.value) == (
        "Reading .parquet files needs the package 'pyarrow'. Install it with: pip install 'steelyard[parquet]'"
    )


def test_all_mistakes_of_a_description_are_told_at_once(tmp_path: Path) -> None:
    text = swap(swap(TOML, "[0, 0, -9.81]", '[0, 0, -9.81]\nwrench = "sensor"'), '"N*m"', '"N*cm"')
    text = swap(text, "quaternion-wxyz", "wxyz")
    assert message(write(tmp_path, text), BadDescription).splitlines() == [
        'log.toml, [log]: unknown wrench "sensor". Did you mean "on-sensor"? Possible here: on-sensor, on-object.',
        f'{STREAM}, torque: unknown unit "N*cm". Multiply its numbers by 0.01 and declare "N*m". Possible here: N*m, '
        "N*mm, kgf*m, lbf*in.",
        f'{STREAM}, rotation: unknown form "wxyz". Possible here: matrix, quaternion-wxyz, quaternion-xyzw, rpy, '
        "rotation-vector, zyz.",
    ]
