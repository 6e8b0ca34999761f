"""Text tables as vendors' software writes them: decimal commas, rows of units, dates, cut lines, Latin-1."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile, BadInput, BadValue
from steelyard.io import read_pendant, read_recording
from steelyard.logs.recording import Recording, Stream

NAMES = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
TOML = """\
[[stream]]
path     = "{}"
time     = {{ columns = ["{}"] }}
force    = {{ columns = ["fx", "fy", "fz"] }}
torque   = {{ columns = ["tx", "ty", "tz"] }}
rotation = {{ columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }}
"""
TABLE = np.column_stack(
    [np.arange(30) / 100, np.random.default_rng(0).normal(size=(30, 6)).round(6), np.tile([1, 0, 0, 0], (30, 1))]
)


def lines(mark: str = ",", names: list[str] = NAMES, table: np.ndarray = TABLE) -> list[str]:
    return [mark.join(names), *(mark.join(f"{value:.9g}" for value in row) for row in table)]


def read(folder: Path, text: str | bytes, time: str = "t", name: str = "a.csv") -> Recording:
    (folder / name).write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / "log.toml").write_text(TOML.format(name, time))
    return read_recording(folder / "log.toml")


def only(recording: Recording) -> Stream:
    (stream,) = recording.streams
    return stream


def same(stream: Stream, table: np.ndarray = TABLE) -> None:
    assert stream.time is not None
    np.testing.assert_allclose(stream.time - stream.time[0], table[:, 0] - table[0, 0], atol=1e-12)
    np.testing.assert_array_equal(stream.channels["force"], table[:, 1:4])
    np.testing.assert_array_equal(stream.channels["torque"], table[:, 4:7])


# --- decimal commas --------------------


@pytest.mark.parametrize(("mark", "quoted"), [(";", False), (";", True), ("\t", False), ("\t", True), (" ; ", False)])
def test_decimal_commas(tmp_path: Path, mark: str, quoted: bool) -> None:
    rows = [row.replace(".", ",") for row in lines(";")]
    if quoted:
        rows[1:] = [";".join(f'"{cell}"' for cell in row.split(";")) for row in rows[1:]]
    same(only(read(tmp_path, "\n".join(rows).replace(";", mark))))


def test_decimal_commas_with_exponents_without_a_header_and_gzipped(tmp_path: Path) -> None:
    rows = [";".join(f"{value:.8e}" for value in row).replace(".", ",") for row in TABLE]
    text = TOML.format("a.csv.gz", "t")
    for n, name in enumerate(NAMES):
        text = text.replace(f'"{name}"', str(n))
    (tmp_path / "a.csv.gz").write_bytes(gzip.compress("\n".join(rows).encode()))
    (tmp_path / "log.toml").write_text(text)
    same(only(read_recording(tmp_path / "log.toml")))


@pytest.mark.parametrize("cell", ["1.234", "1.234,5", ".5", "5.", "1,2,3"])
def test_a_point_among_decimal_commas_is_refused(tmp_path: Path, cell: str) -> None:
    rows = [row.replace(".", ",") for row in lines(";", table=np.vstack([TABLE] * 60))]
    for i in range(1, len(rows)):
        rows[i] = f"{i / 100:.9g}".replace(".", ",") + rows[i][rows[i].index(";") :]
    rows[1500] = ";".join([*rows[1500].split(";")[:2], cell, *rows[1500].split(";")[3:]])
    with pytest.raises(BadFile, match=r'line 1501, column "fy" holds "') as caught:
        read(tmp_path, "\n".join(rows))
    assert f'"{cell}"' in str(caught.value)


def test_points_and_commas_in_the_head_are_refused(tmp_path: Path) -> None:
    rows = lines(";")
    rows[3] = rows[3].replace(".", ",")
    with pytest.raises(BadFile, match=r"line 4, .* Write decimals with a point\."):
        read(tmp_path, "\n".join(rows))


def test_commas_in_a_column_that_is_not_used_change_nothing(tmp_path: Path) -> None:
    rows = [f"{row};1,5" for row in lines(";")]
    same(only(read(tmp_path, "\n".join(rows))))


@pytest.mark.parametrize(
    "line",
    [
        "10,5 -20 30,25 1,5 2 -3 0,1 ,2 0",
        "10,5; -20; 30,25; 1,5; 2; -3; 0,1; 0,2; 0",
        "10.5, -20,30.25 1.5 2;-3 .1 .2 0",
    ],
)
def test_pendant(line: str) -> None:
    (stream,) = read_pendant([line]).streams
    np.testing.assert_allclose(stream.channels["force"], [[1.5, 2, -3]])
    np.testing.assert_allclose(stream.channels["torque"], [[0.1, 0.2, 0]])


@pytest.mark.parametrize(
    ("line", "says"),
    [
        ("0 0 0 1,5 2 -3 0.1 0 0", "line 1: got 10 numbers"),
        ("0 0 0 1,5 2 -3 0,1 0", "line 1: got 10 numbers"),
        ("0;0;0;1.000,5;2;-3;0,1;0;0", "line 1: got 11 numbers"),
    ],
)
def test_pendant_lines_that_are_ambiguous_are_refused(line: str, says: str) -> None:
    with pytest.raises(BadValue, match=says):
        read_pendant([line])


# --- a cut last line, holes --------------------


@pytest.mark.parametrize(
    "left", ["0.3,1,2,3,0.1,0.2", "0.3,1,2,3,0.1,", "0.3,1,", "0.3,", "0.", "0.3,1,2,3,1,1,1,1,0,0,-"]
)
@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_a_cut_last_line_is_left_out(tmp_path: Path, left: str, mark: str) -> None:
    recording = read(tmp_path, "\n".join([*lines(mark), left.replace(",", mark)]))
    (finding,) = recording.findings
    assert finding.code == "rows-missing"
    assert "row 31 (the last). It was left out." in finding.message
    same(only(recording))


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
@pytest.mark.parametrize("word", ["NA", "<NA>", "N/A", "#N/A", "null", "NULL", "None", "-nan(ind)", '"NA"'])
def test_words_for_missing_numbers(tmp_path: Path, mark: str, word: str) -> None:
    rows = lines(mark)
    rows[8] = mark.join([*rows[8].split(mark)[:2], word, *rows[8].split(mark)[3:]])
    log = read(tmp_path, "\n".join(rows))
    same(only(log), np.delete(TABLE, 7, axis=0))
    assert "1 of 30 rows of 'a.csv' miss a number in force: row 8." in log.findings[0].message


def test_words_that_begin_like_missing_numbers_are_none(tmp_path: Path) -> None:
    rows = lines()
    rows[8] = rows[8].replace(",", ",NAN2,", 1).rsplit(",", 1)[0]
    with pytest.raises(BadFile, match=r'line 9, column "fx" holds "NAN2", which is not a number'):
        read(tmp_path, "\n".join(rows))


@pytest.mark.parametrize("end", ["   ", "\t", " # the end", "\n# the end", "\n  "])
@pytest.mark.parametrize("mark", [",", " "])
def test_a_last_line_without_its_end_that_is_whole_is_kept(tmp_path: Path, end: str, mark: str) -> None:
    recording = read(tmp_path, "\n".join(lines(mark)) + end)
    assert not recording.findings
    same(only(recording))


@pytest.mark.parametrize("mark", [",", ";", "\t", " "])
def test_lines_of_blanks_are_no_rows(tmp_path: Path, mark: str) -> None:
    recording = read(tmp_path, "\n   \n".join(lines(mark)))
    assert not recording.findings
    same(only(recording))


def test_a_cut_last_line_below_a_preamble(tmp_path: Path) -> None:
    same(only(read(tmp_path, "\n".join(["Rate: 100 Hz", *lines(), "0.3,1,2"]))))


def test_a_cut_line_elsewhere_is_refused(tmp_path: Path) -> None:
    rows = lines()
    for text in ("\n".join([*rows[:9], "0.3,1,2", *rows[9:]]), "\n".join([*rows, "0.3,1,2", ""])):
        with pytest.raises(BadFile, match="has 3 cells, the rows before it have 11"):
            read(tmp_path, text)


@pytest.mark.parametrize("hole", ["", " ", '""'])
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_empty_cells(tmp_path: Path, hole: str, mark: str) -> None:
    rows = [row.split(mark) for row in lines(mark)]
    rows[3][1], rows[9][10], rows[20][0] = hole, hole, hole
    recording = read(tmp_path, "\r\n".join(mark.join(row) for row in rows))
    (finding,) = recording.findings
    assert finding.message.startswith("3 of 30 rows of 'a.csv' miss a number in force, rotation, time: rows 3, 9, 20.")
    same(only(recording), np.delete(TABLE, [2, 8, 19], axis=0))


def test_integer_stamps_stay_exact_beside_empty_cells(tmp_path: Path) -> None:
    rows = [row.split(",") for row in lines()]
    for i, row in enumerate(rows[1:]):
        row[0] = str(1708857503931759001 + 1_000_001 * i)
    rows[5][2] = ""
    (tmp_path / "a.csv").write_text("\n".join(",".join(row) for row in rows))
    (tmp_path / "log.toml").write_text(TOML.format("a.csv", "t").replace('["t"] }', '["t"], unit = "ns" }'))
    time = only(read_recording(tmp_path / "log.toml")).time
    assert time is not None
    np.testing.assert_allclose(np.diff(time)[:3], 1.000001e-3, rtol=1e-9)


# --- dates --------------------


def with_stamps(stamps: list[str], mark: str = ",") -> str:
    return "\n".join(
        [lines(mark)[0], *(f"{s}{row[row.index(mark) :]}" for s, row in zip(stamps, lines(mark)[1:], strict=True))]
    )


@pytest.mark.parametrize("between", ["T", " "])
@pytest.mark.parametrize("zone", ["", "Z", "+02:00", "-0530"])
@pytest.mark.parametrize("unit", ["", ', unit = "ms"'])
def test_dates(tmp_path: Path, between: str, zone: str, unit: str) -> None:
    stamps = [f"2024-05-01{between}23:59:59.{990 + i:03d}{zone}" for i in range(10)]
    stamps += [f"2024-05-02{between}00:00:00{f'.{i:03d}' if i else ''}{zone}" for i in range(20)]
    (tmp_path / "a.csv").write_text(with_stamps(stamps))
    (tmp_path / "log.toml").write_text(TOML.format("a.csv", "t").replace('["t"]', '["t"]' + unit))
    time = only(read_recording(tmp_path / "log.toml")).time
    assert time is not None
    np.testing.assert_allclose(time - time[0], np.arange(30) / 1000, atol=1e-9)


def test_dates_with_decimal_commas_and_a_hole(tmp_path: Path) -> None:
    stamps = [f"2024-05-01 12:00:00,{10 * i:03d}" for i in range(30)]
    stamps[7] = ""
    recording = read(tmp_path, with_stamps(stamps, ";").replace(".", ","))
    same(only(recording), np.delete(TABLE, 7, axis=0))
    assert "miss a number in time: row 8." in recording.findings[0].message


def test_dates_of_two_zones_are_one_clock(tmp_path: Path) -> None:
    stamps = [f"2024-10-27T02:59:59.{970 + 10 * i}+02:00" for i in range(3)]
    stamps += [f"2024-10-27T02:00:00.{10 * i:03d}+01:00" for i in range(27)]
    same(only(read(tmp_path, with_stamps(stamps))))


def test_dates_share_an_origin_with_other_clocks(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(with_stamps([f"2024-05-01T12:00:00.{10 * i:03d}Z" for i in range(30)]))
    unix = ["t,ax,ay,az", *(f"{1714564800 + i / 100:.2f},0,0,9.8" for i in range(30))]
    (tmp_path / "b.csv").write_text("\n".join(unix))
    (tmp_path / "log.toml").write_text(
        TOML.format("a.csv", "t")
        + '[[stream]]\npath = "b.csv"\ntime = { columns = ["t"] }\nspecific_force = { columns = ["ax", "ay", "az"] }\n'
    )
    first, second = read_recording(tmp_path / "log.toml").streams
    assert first.time is not None
    assert second.time is not None
    np.testing.assert_allclose(first.time, second.time, atol=1e-6)


def test_of_two_columns_of_dates_none_is_the_clock(tmp_path: Path) -> None:
    rows = with_stamps([f"2024-05-01T12:00:00.{10 * i:03d}Z" for i in range(30)]).split("\n")
    text = "\n".join([f"{rows[0][2:]},begun,ended", *(f"{r[r.index(',') + 1 :]},{r[:24]},{r[:24]}" for r in rows[1:])])
    (tmp_path / "a.csv").write_text(text)
    assert only(read_recording(tmp_path / "a.csv")).time is None


@pytest.mark.parametrize("mark", [",", ";"])
def test_times_of_day(tmp_path: Path, mark: str) -> None:
    stamps = [f"09:59:59.{900 + 10 * i}" for i in range(10)] + [f"10:00:00.{10 * i:03d}" for i in range(20)]
    text = with_stamps(stamps, mark)
    (tmp_path / "bare.csv").write_text(text)
    for log in (read_recording(tmp_path / "bare.csv"), read(tmp_path, text if mark == "," else text.replace(".", ","))):
        same(only(log))


def test_a_log_over_midnight_without_a_date_is_refused(tmp_path: Path) -> None:
    stamps = [f"23:59:59.{970 + 10 * i}" for i in range(3)] + [f"00:00:00.{10 * i:03d}" for i in range(27)]
    with pytest.raises(BadValue, match="time must not go back; it does once, from"):
        read(tmp_path, with_stamps(stamps))


def test_dates_in_a_bare_table(tmp_path: Path) -> None:
    stamps = [f"2024-05-01T12:00:00.{10 * i:03d}Z" for i in range(30)]
    (tmp_path / "a.csv").write_text(with_stamps(stamps))
    same(only(read_recording(tmp_path / "a.csv")))


@pytest.mark.parametrize(
    "stamp", ["now", "today", "2024-05", "2024-05-01", "NaT", "12:00:00.5", "01.05.2024 12:00", "2024-13-01T00:00:00"]
)
def test_other_dates_are_refused(tmp_path: Path, stamp: str) -> None:
    good = [f"2024-05-01T12:00:00.{10 * i:03d}" for i in range(30)]
    with pytest.raises(BadInput) as caught:
        read(tmp_path, with_stamps([*good[:4], stamp, *good[5:]]))
    assert "\n" not in str(caught.value)
    with pytest.raises(BadInput):
        read(tmp_path, with_stamps([stamp] * 30))


@pytest.mark.parametrize("step", [0.001, 0.01, 0.1, 1.0])
def test_days_of_excel_are_refused_with_the_way_out(tmp_path: Path, step: float) -> None:
    table = TABLE.copy()
    table[:, 0] = 45413.5 + np.arange(30) * step / 86400
    text = "\n".join([",".join(NAMES), *(",".join(f"{value:.15g}" for value in row) for row in table)])
    with pytest.raises(BadValue, match=r"time: these look like Excel's dates, counted in days: 45413\.5 to .* 86400"):
        read(tmp_path, text)
    table[:, 0] = 45413.5 + np.arange(30) / 1000
    same(only(read(tmp_path, "\n".join(lines(table=table)))), table)


# --- units and names --------------------


@pytest.mark.parametrize("units", ["s;N;N;N;Nm;Nm;Nm;-;-;-;-", "s;N;N;N;;;;;;;", "[s];[N];[N];[N];[N.m];a;b;c;d;e;f"])
@pytest.mark.parametrize("blank", [[], [""], ["# made by a logger"]])
def test_a_row_of_units_is_skipped(tmp_path: Path, units: str, blank: list[str]) -> None:
    head, *body = lines(";")
    same(only(read(tmp_path, "\n".join([head, units, *blank, *body]))))
    same(only(read(tmp_path, "\n".join([head, units, *blank, *body]).replace(".", ",").replace("N,m", "Nm"))))


def test_two_rows_of_words_are_refused(tmp_path: Path) -> None:
    head, *body = lines(";")
    units = "s;N;N;N;Nm;Nm;Nm;-;-;-;-"
    with pytest.raises(BadFile, match=r'line 2, column "t" holds "s", which is not a number'):
        read(tmp_path, "\n".join([head, units, units, *body]))
    with pytest.raises(BadFile, match=r'line 2, column "fx" holds "N"'):
        read(tmp_path, "\n".join([head, units.replace("s", "1", 1), *body]))
    with pytest.raises(BadFile, match="the header has 11 names, but its rows have 12 cells"):
        read(tmp_path, "\n".join([head, units, *(f"{row};1" for row in body)]))


@pytest.mark.parametrize(
    ("name", "over", "said"),
    [
        ("t", "ms", "time: over column 0 the file says ms, and the description s. Write unit = "),
        ("fy", "kN", "force: over column 2 the file says kN, and the description N. Write unit = "),
        ("tz", "N·mm", "torque: over column 6 the file says N*mm, and the description N*m. Write unit = "),
    ],
)
def test_a_unit_of_the_file_that_the_description_contradicts_is_refused(
    tmp_path: Path, name: str, over: str, said: str
) -> None:
    head, *body = lines(";")
    units = ";".join(over if each == name else "-" for each in NAMES)
    called = f"{name} [{over}]"
    for rows, toml in (
        ([head, units, *body], TOML),
        ([head.replace(name, called, 1), *body], TOML.replace(f'"{name}"', f'"{called}"')),
    ):
        (tmp_path / "a.csv").write_text("\n".join(rows))
        (tmp_path / "log.toml").write_text(toml.format("a.csv", called if name == "t" and rows[1] != units else "t"))
        with pytest.raises(BadInput, match=re.escape(said)):
            read_recording(tmp_path / "log.toml")


def test_units_of_the_file_that_the_description_repeats_or_nobody_knows_are_passed_over(tmp_path: Path) -> None:
    head, *body = lines(";")
    toml = TOML.format("a.csv", "t").replace('"tz"]', '"tz"], unit = "N*mm"')
    (tmp_path / "a.csv").write_text("\n".join([head, "s;N;kp;?;Nmm;N.mm;N mm;1/s;-;-;-", *body]))
    (tmp_path / "log.toml").write_text(toml)
    np.testing.assert_allclose(only(read_recording(tmp_path / "log.toml")).channels["torque"], TABLE[:, 4:7] / 1e3)


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "cp1252", "latin-1"])
def test_names_beyond_ascii(tmp_path: Path, code: str) -> None:
    rows = lines(";", names=["Zeit [µs]", *NAMES[1:]])
    same(only(read(tmp_path, "\n".join(rows).encode(code), time="Zeit [µs]")))


def test_a_head_that_ends_within_a_character(tmp_path: Path) -> None:
    head = lines(names=["Größe", *NAMES[1:]])
    for blanks in range(2):
        comment = "# " + " " * blanks + "ä" * 40_000
        same(only(read(tmp_path, "\n".join([*head, comment]), time="Größe")))


# --- common arms --------------------


def about(axis: int, angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    i, j = [(1, 2), (2, 0), (0, 1)][axis]
    out = np.eye(3)
    out[i, i], out[j, j], out[i, j], out[j, i] = c, c, -s, s
    return out


DOCUMENTED = (Path(__file__).parents[2] / "docs" / "formats.md").read_text()


@pytest.mark.parametrize("arm", ["UR", "KUKA", "UFACTORY", "Franka", "Kinova"])
def test_the_documentation_names_the_columns_of_common_arms(tmp_path: Path, arm: str) -> None:
    row = next(line for line in DOCUMENTED.splitlines() if line.startswith(f"| {arm}"))
    position, rotation = (cell.strip(" `") for cell in row.split("|")[2:4])
    a, b, c = np.radians([20.0, -35.0, 130.0])
    turn, place = about(2, a) @ about(1, b) @ about(0, c), np.array([0.3, -0.2, 0.5])
    angle = np.arccos((np.trace(turn) - 1) / 2)
    axis = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]]) / (2 * np.sin(angle))
    pose = np.eye(4)
    pose[:3, :3], pose[:3, 3] = turn, place
    six = {
        "UR": [*place, *angle * axis],
        "KUKA": [*1000 * place, 20, -35, 130],
        "UFACTORY": [*1000 * place, 130, -35, 20],
        "Franka": [*pose.T.ravel()],
        "Kinova": [*place, 130, -35, 20],
    }[arm]
    names = {
        "UR": "x y z rx ry rz",
        "KUKA": "X Y Z A B C",
        "UFACTORY": "x y z roll pitch yaw",
        "Franka": " ".join(f"T{k}" for k in range(16)),
        "Kinova": "tool_pose_x tool_pose_y tool_pose_z tool_pose_theta_x tool_pose_theta_y tool_pose_theta_z",
    }[arm]
    header = f"{names} fx fy fz tx ty tz".replace(" ", ",")
    (tmp_path / "a.csv").write_text("\n".join([header, *[",".join(f"{v:.15g}" for v in [*six, 1, 2, 3, 4, 5, 6])] * 3]))
    (tmp_path / "log.toml").write_text(
        f'[[stream]]\npath = "a.csv"\nkind = "poses"\nposition = {{ {position} }}\nrotation = {{ {rotation} }}\n'
        'force = { columns = ["fx", "fy", "fz"] }\ntorque = { columns = ["tx", "ty", "tz"] }\n'
    )
    stream = only(read_recording(tmp_path / "log.toml"))
    np.testing.assert_allclose(stream.channels["rotation"][0], turn, atol=1e-12)
    np.testing.assert_allclose(stream.channels["position"][0], place, atol=1e-12)


# --- lines above the table --------------------


ABOVE = [
    'Start Time: 8/1/18 2:34 PM\nRDT Sample Rate: 100\n"NOTE: a, b, c"\nForce Units: N\n',
    "Recorded by LabVIEW\nOperator,Bob\nDate,2026-01-01\n\n",
]


@pytest.mark.parametrize("above", ABOVE)
@pytest.mark.parametrize("mark", [",", ";", "\t"])
def test_lines_of_another_shape_above_the_header_are_passed_over(tmp_path: Path, above: str, mark: str) -> None:
    same(only(read(tmp_path, above + "\n".join(lines(mark)) + "\n")))


def test_columns_of_words_do_not_make_a_header_of_the_first_row(tmp_path: Path) -> None:
    rows = [",".join(f"{value:.9g}" for value in row) for row in TABLE]
    text = TOML.format("a.csv", "t")
    for n, name in enumerate(NAMES):
        text = text.replace(f'"{name}"', str(n))
    (tmp_path / "a.csv").write_text("\n".join(f"{row},base_link" for row in rows))
    (tmp_path / "log.toml").write_text(text)
    same(only(read_recording(tmp_path / "log.toml")))


# --- lists in cells --------------------


def listed(value: np.ndarray) -> str:
    return str(value.tolist())


@pytest.mark.parametrize("inner", [", ", " ", ","])
@pytest.mark.parametrize("mark", [",", ";"])
def test_lists_in_cells_are_columns(tmp_path: Path, mark: str, inner: str) -> None:
    rows = [
        mark.join([f"{row[0]:.9g}", *(f'"{listed(v)}"' for v in (row[1:7], row[7:].reshape(2, 2)))]).replace(
            ", ", inner
        )
        for row in TABLE
    ]
    force, torque = (", ".join(f'"wrench[{i}]"' for i in three) for three in ((0, 1, 2), (3, 4, 5)))
    (tmp_path / "a.csv").write_text("\n".join([mark.join(["t", "wrench", "q"]), *rows]))
    (tmp_path / "log.toml").write_text(
        f"""[[stream]]
path     = "a.csv"
time     = {{ columns = ["t"] }}
force    = {{ columns = [{force}] }}
torque   = {{ columns = [{torque}] }}
rotation = {{ columns = ["q"], form = "quaternion-wxyz" }}
"""
    )
    same(only(read_recording(tmp_path / "log.toml")))


def test_a_list_of_another_length_is_a_row_of_another_length(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(
        "t,f,m,q\n" + '0.01,"[1, 2, 3]","[1, 2, 3]","[1, 0, 0, 0]"\n' + '0.02,"[1, 2]","[1, 2, 3]","[1, 0, 0, 0]"\n'
    )
    (tmp_path / "log.toml").write_text(
        """[[stream]]
path     = "a.csv"
time     = { columns = ["t"] }
force    = { columns = ["f"] }
torque   = { columns = ["m"] }
rotation = { columns = ["q"], form = "quaternion-wxyz" }
"""
    )
    with pytest.raises(BadFile, match="line 3 has 10 cells, the rows before it have 11"):
        read_recording(tmp_path / "log.toml")


# --- headers --------------------

NUMBERED = TOML
for name in reversed(NAMES):
    NUMBERED = NUMBERED.replace(f'"{name}"', str(NAMES.index(name))).replace('"{}"] }}', "0] }}")


def numbered(folder: Path, text: str | bytes) -> Stream:
    """Return what is read of a table without usual names, its columns told by number."""
    (folder / "a.csv").write_bytes(text if isinstance(text, bytes) else text.encode())
    (folder / "log.toml").write_text(NUMBERED.format("a.csv"))
    return only(read_recording(folder / "log.toml"))


def test_columns_that_pandas_counts_in_the_header_are_no_row(tmp_path: Path) -> None:
    same(numbered(tmp_path, "\n".join(lines(names=[str(k) for k in range(11)]))))


def test_the_mark_of_windows_editors_in_front_of_numbers(tmp_path: Path) -> None:
    same(numbered(tmp_path, b"\xef\xbb\xbf" + "\n".join(lines()[1:]).encode()))


def test_a_row_that_is_commented_out_is_no_header(tmp_path: Path) -> None:
    head, first, *body = lines()
    same(only(read(tmp_path, "\n".join([f"# {head}", f"# {first}", *body]))), TABLE[1:])


def test_rows_that_end_in_a_delimiter_their_header_does_not_have(tmp_path: Path) -> None:
    head, *body = lines()
    same(only(read(tmp_path, "\n".join([head, *(f"{row}," for row in body)]))))


def test_quoted_names_behind_blanks(tmp_path: Path) -> None:
    head, *body = lines()
    same(only(read(tmp_path, "\n".join([", ".join(f'"{name}"' for name in NAMES), *body]))))
    assert head


def test_semicolons_within_quoted_lists_are_no_delimiter(tmp_path: Path) -> None:
    rows = [
        f'{r[0]:.9g},"[{";".join(f"{v:.9g}" for v in r[1:4])}]",' + ",".join(f"{v:.9g}" for v in r[4:]) for r in TABLE
    ]
    toml = TOML.format("a.csv", "t").replace('"fx", "fy", "fz"', '"force"')
    (tmp_path / "a.csv").write_text("\n".join(["Rate: 100 Hz", "t,force,tx,ty,tz,qw,qx,qy,qz", *rows]))
    (tmp_path / "log.toml").write_text(toml)
    same(only(read_recording(tmp_path / "log.toml")))


def test_a_number_with_underscores_is_named(tmp_path: Path) -> None:
    rows = lines()
    rows[3] = re.sub(",[^,]*,", ",1_000,", rows[3], count=1)
    with pytest.raises(BadFile, match='line 4, column "fx" holds "1_000'):
        read(tmp_path, "\n".join(rows))


def test_a_small_file_may_unpack_to_many_times_its_size(tmp_path: Path) -> None:
    rows = [f"{k},1,2,3,4,5,6,1,0,0,0".ljust(1000) for k in range(3000)]
    packed = gzip.compress("\n".join([",".join(NAMES), *rows]).encode())
    assert 1000 * len(rows) > 100 * len(packed)
    assert len(only(read(tmp_path, packed, name="a.csv.gz"))) == len(rows)


def test_binary_data_without_zeros_is_no_text(tmp_path: Path) -> None:
    with pytest.raises(BadFile, match="expected a text table; found binary data"):
        read(tmp_path, bytes(range(1, 32)) * 99)
