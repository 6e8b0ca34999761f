"""Bare files with usual names, and poses typed from a pendant."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadDescription, BadFile, BadValue, NoDescription
from steelyard.io import read_pendant, read_recording
from steelyard.io.log_files import describe_file
from steelyard.logs.recording import STANDARD_GRAVITY, Stream
from steelyard.spatial import Rotation

W = [1.0, 2.0, 3.0, 0.1, 0.2, 0.3]
Q = [0.5, 0.5, 0.5, 0.5]


def bare(folder: Path, names: list[str], *rows: list[float]) -> Stream:
    text = "\n".join([",".join(names), *(",".join(f"{v:.20g}" for v in row) for row in rows)])
    (folder / "data.csv").write_text(text)
    (stream,) = read_recording(folder / "data.csv").streams
    return stream


@pytest.mark.parametrize(
    "wrench",
    [
        "fx fy fz tx ty tz", "Fx Fy Fz Tx Ty Tz", "force_x force_y force_z torque_x torque_y torque_z",
        "wrench.force.x wrench.force.y wrench.force.z wrench.torque.x wrench.torque.y wrench.torque.z",
        "/ft/force/x /ft/force/y /ft/force/z /ft/torque/x /ft/torque/y /ft/torque/z",
        "Fx [N];Fy [N];Fz [N];Mx [N*m];My [N*m];Mz [N*m]",
    ],
)  # fmt: skip
@pytest.mark.parametrize("turn", ["qw qx qy qz", "orientation.w orientation.x orientation.y orientation.z"])
def test_usual_names(tmp_path: Path, wrench: str, turn: str) -> None:
    names = ["time", *(wrench.split(";") if ";" in wrench else wrench.split()), *turn.split()]
    stream = bare(tmp_path, names, [0, *W, *Q], [0.01, *W, *Q])
    assert stream.channels["force"].tolist() == [W[:3]] * 2
    assert stream.channels["torque"].tolist() == [W[3:]] * 2
    np.testing.assert_allclose(stream.channels["rotation"][0], Rotation.from_quaternion_wxyz(Q).matrix, atol=1e-15)
    assert stream.time is not None
    assert stream.time.tolist() == [0, 0.01]
    assert stream.name == "data.csv"


def test_units_in_names(tmp_path: Path) -> None:
    stream = bare(
        tmp_path,
        ["t_ms", "fx (kN)", "fy (kN)", "fz (kN)", "tx", "ty", "tz", "qw", "qx", "qy", "qz"],
        [0, *W, *Q],
        [4, *W, *Q],
    )
    assert stream.channels["force"][0].tolist() == [1000, 2000, 3000]
    assert stream.time is not None
    assert stream.time.tolist() == [0, 0.004]


@pytest.mark.parametrize("force", ["fx [kN],fy,fz", "fx,fy [kN],fz", "fx [kN],fy [kN],fz [kN]"])
def test_a_unit_over_one_column_is_that_of_the_vector(tmp_path: Path, force: str) -> None:
    names = ["t", *force.split(","), "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
    stream = bare(tmp_path, names, [0, *W, *Q], [0.01, *W, *Q])
    assert stream.channels["force"][0].tolist() == [1000, 2000, 3000]


@pytest.mark.parametrize(
    ("unit", "size"), [("Nm", 1.0), ("N m", 1.0), ("N.m", 1.0), ("N·m", 1.0), ("Nmm", 1e-3), ("N.mm", 1e-3)]
)
def test_a_torque_has_many_spellings(tmp_path: Path, unit: str, size: float) -> None:
    names = ["t", "fx", "fy", "fz", *(f"Torque.{a} [{unit}]" for a in "xyz"), "qw", "qx", "qy", "qz"]
    stream = bare(tmp_path, names, [0, *W, *Q], [0.01, *W, *Q])
    np.testing.assert_allclose(stream.channels["torque"][0], np.multiply(W[3:], size))


@pytest.mark.parametrize("units", ["s,kN,kN,kN", "s,kN,kN,kN,,,,,,,,", "s,kN,kN,kN,Nm,Nm,Nm,-,-,-,-,,"])
def test_a_row_of_units_may_be_shorter_than_its_table_or_end_in_delimiters(tmp_path: Path, units: str) -> None:
    names = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
    rows = [",".join(map(str, [t, *W, *Q])) for t in (0, 0.01)]
    (tmp_path / "data.csv").write_text("\n".join([",".join(names), units, *rows]))
    (stream,) = read_recording(tmp_path / "data.csv").streams
    np.testing.assert_allclose(stream.channels["force"][0], np.multiply(W[:3], 1e3))


def test_a_unit_behind_an_axis_is_read(tmp_path: Path) -> None:
    names = ["t", "Fx_kN", "Fy_kN", "Fz_kN", "tau_x_N_mm", "tau_y_N_mm", "tau_z_N_mm", "qw", "qx", "qy", "qz"]
    names += ["pos_x_mm", "pos_y_mm", "pos_z_mm", "acc_x_m_s2", "acc_y_m_s2", "acc_z_m_s2"]
    row = [*W, *Q, 100, 200, 300, 0, 0, 9.81]
    channels = bare(tmp_path, names, [0, *row], [0.01, *row]).channels
    np.testing.assert_allclose(channels["force"][0], np.multiply(W[:3], 1e3))
    np.testing.assert_allclose(channels["torque"][0], np.multiply(W[3:], 1e-3))
    np.testing.assert_allclose(channels["position"][0], [0.1, 0.2, 0.3])
    np.testing.assert_allclose(channels["specific_force"][0], [0, 0, 9.81])


def test_letters_behind_an_axis_that_are_no_unit_of_it_are_refused(tmp_path: Path) -> None:
    names = ["t", "fx_m", "fy_m", "fz_m", "tx_m", "ty_m", "tz_m", "qw", "qx", "qy", "qz"]  # as measured, perhaps
    with pytest.raises(BadDescription, match='unknown unit "m" of force'):
        bare(tmp_path, names, [0, *W, *Q], [0.01, *W, *Q])


@pytest.mark.parametrize("where", ["base", "world", "ft_base_link"])
def test_a_wrench_by_the_name_of_a_base_wants_a_description(tmp_path: Path, where: str) -> None:
    wrench = [f"{where}_{vector}_{axis}" for vector in ("force", "torque") for axis in "xyz"]
    row = [0, *W, *Q]
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, ["t", *wrench, "qw", "qx", "qy", "qz"], row, row)
    lines = stream_lines(str(caught.value))
    assert lines.count(', frame = "W" }   # if in the base\'s axes; else without frame') == 2
    # A wrench of the sensor beside it is taken.
    names = ["t", *wrench, "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]
    rows = [[t, *np.zeros(6), *W, *Q] for t in (0, 0.01)]
    np.testing.assert_array_equal(bare(tmp_path, names, *rows).channels["force"][0], W[:3])


def test_the_example_of_a_description_has_the_position(tmp_path: Path) -> None:
    names = ["time", "fx", "fy", "fz", "tx", "ty", "tz", "x [mm]", "y [mm]", "z [mm]", "rx", "ry", "rz"]
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, names, [0, *W, 1, 2, 3, 0, 0, 1], [0.01, *W, 1, 2, 3, 0, 0, 1])
    assert stream_lines(str(caught.value)).splitlines()[-1] == (
        'position = { columns = ["x [mm]", "y [mm]", "z [mm]"], unit = "mm" }   # of S in W; check the unit'
    )
    (tmp_path / "log.toml").write_text("[log]\n[[stream]]\n" + stream_lines(str(caught.value)))
    assert read_recording(tmp_path / "log.toml").streams[0].channels["position"][0].tolist() == [0.001, 0.002, 0.003]


@pytest.mark.parametrize(("stamp", "step"), [(1708857503, 1), (1708857503931, 1e-3), (1708857503931759, 1e-6)])
def test_unix_stamps(tmp_path: Path, stamp: int, step: float) -> None:
    names = ["timestamp", *["fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]]
    time = bare(tmp_path, names, [stamp, *W, *Q], [stamp + 1, *W, *Q]).time
    assert time is not None
    assert time[1] - time[0] == pytest.approx(step, rel=1e-9)


def test_size_tells_accelerometer_gravity_and_gyro_apart(tmp_path: Path) -> None:
    names = [
        "t",
        *[
            "fx",
            "fy",
            "fz",
            "tx",
            "ty",
            "tz",
            "ax",
            "ay",
            "az",
            "gx",
            "gy",
            "gz",
            "wx",
            "wy",
            "wz",
            "x",
            "y",
            "z",
        ],
    ]
    stream = bare(
        tmp_path,
        names,
        [0, *W, 0, 0, 1.01, 0.1, 0.2, 0.3, 1, 2, 3, 4, 5, 6],
        [1, *W, 0, 0, 1, 0.1, 0.2, 0.3, 1, 2, 3, 4, 5, 6],
    )
    assert set(stream.channels) == {"force", "torque", "specific_force", "angular_velocity", "position"}
    np.testing.assert_allclose(stream.channels["specific_force"][1], [0, 0, STANDARD_GRAVITY])
    stream = bare(tmp_path, names[:13], [0, *W, 0, 0, 9.8, 0, 0, -9.82][:13], [1, *W, 0, 0, 9.8, 0, 0, -9.82][:13])
    assert set(stream.channels) == {"force", "torque", "specific_force", "gravity"}
    assert stream.channels["specific_force"][1].tolist() == [0, 0, 9.8]


def test_rows_that_turn_far_without_a_clock_are_poses(tmp_path: Path) -> None:
    names = ["fx", "fy", "fz", "tx", "ty", "tz", "gx", "gy", "gz"]
    turned = [[*W, 0, 0, -9.8], [*W, 0, -9.8, 0], [*W, 9.8, 0, 0]]
    assert bare(tmp_path, names, *turned).poses
    smooth = [[*W, 9.8 * np.sin(a), 0, -9.8 * np.cos(a)] for a in np.linspace(0, 1, 100)]
    assert not bare(tmp_path, names, *smooth).poses


def test_length_of_gravity_is_taken_from_the_file(tmp_path: Path) -> None:
    bare(tmp_path, ["fx", "fy", "fz", "tx", "ty", "tz", "gx", "gy", "gz"], [*W, 0, 0, -9.82], [*W, 0, -9.82, 0])
    assert read_recording(tmp_path / "data.csv").gravity.tolist() == [0, 0, -9.82]


def test_npz_with_usual_arrays(tmp_path: Path) -> None:
    arrays = {
        "force_sensor": [W[:3]] * 9,
        "torque_sensor": [W[3:]] * 9,
        "gravity_sensor": [[0, 0, -9.81]] * 9,
    }
    turns = np.broadcast_to(np.eye(3), (9, 3, 3))
    np.savez(tmp_path / "m.npz", time=np.arange(9) / 100, rotation_world_from_sensor=turns, **arrays)  # type: ignore[arg-type]
    (stream,) = read_recording(tmp_path / "m.npz").streams
    assert set(stream.channels) == {"force", "torque", "gravity", "rotation"}


@pytest.mark.parametrize(
    ("names", "reason"),
    [
        ("a b c", "no force and no torque was recognised. Columns here: a, b, c."),
        ("fx fy fz tx ty tz", "nothing says where gravity points in the sensor frame. Columns here: fx, fy, fz, tx, ty, tz."),
        (
            "tau1 tau2 tau3 tau4 tau5 tau6 tau7",
            'no force and no torque was recognised, and torques of joints ("tau1" .. "tau7") are not read: log the '
            "wrench of a sensor, or the one that the controller estimates from them. Columns here: tau1, tau2, tau3, tau4, tau5, tau6, tau7.",
        ),
        ("fx fy fz qw qx qy qz", "no torque was recognised. Columns here: fx, fy, fz, qw, qx, qy, qz."),
        ("fx FX", 'two columns are called "fx". Columns here: fx, FX.'),
        ("1 2", "the file has no header. It has 2 columns."),
        ("fx[lb] fy fz tx ty tz qw qx qy qz", 'unknown unit "lb" of force; possible are N, kN, kgf, lbf. Columns here: fx[lb], fy, fz, tx, ty, tz, qw, qx, qy, qz.'),
        ("fx[N] fy[kN] fz tx ty tz qw qx qy qz", "the columns of force have different units, N and kN; write them in one. Columns here: fx[N], fy[kN], fz, tx, ty, tz, qw, qx, qy, qz."),
        ("fx fy fz tx[Ncm] ty tz qw qx qy qz", 'unknown unit "Ncm" of torque; possible are N*m, N*mm, kgf*m, lbf*in; multiply its numbers by 0.01 and declare "N*m". Columns here: fx, fy, fz, tx[Ncm], ty, tz, qw, qx, qy, qz.'),
        ("fx fy fz tx[Nm] ty[N*m] tz[N*mm] qw qx qy qz", "the columns of torque have different units, N*m and N*mm; write them in one. Columns here: fx, fy, fz, tx[Nm], ty[N*m], tz[N*mm], qw, qx, qy, qz."),
        ("fx fy fz tx ty tz gx gy gz", "nothing says where gravity points in the sensor frame. Columns here: fx, fy, fz, tx, ty, tz, gx, gy, gz."),
        ("t fx fy fz tx ty tz qw qx qy qz", "time rises by 2000 per row, which can hardly be seconds. Columns here: t, fx, fy, fz, tx, ty, tz, qw, qx, qy, qz."),
    ],
)  # fmt: skip
def test_names_that_do_not_tell(tmp_path: Path, names: str, reason: str) -> None:
    words = names.split()
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, words, [0.0] * len(words), [2000.0] * len(words))
    assert str(caught.value).startswith(
        f"{tmp_path / 'data.csv'}: cannot tell what the columns are: {reason} "
        "Write a description that says it, for example:\n[log]\n"
    )


def stream_lines(text: str) -> str:
    """The lines of the example below [[stream]]."""
    return text.split("[[stream]]\n")[1]


def test_the_example_of_a_description_is_in_the_words_of_the_file(tmp_path: Path) -> None:
    names = ["stamp_ms", "F1", "F2", "F3", "Mx [N*mm]", "My [N*mm]", "Mz [N*mm]", *("ax", "ay", "az")]
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, names, [0.0, *W, 0, 0, 9.8], [1.0, *W, 0, 0, 9.8])
    assert stream_lines(str(caught.value)) == (
        'path     = "data.csv"\n'
        'time     = { columns = ["stamp_ms"], unit = "ms" }\n'
        'force    = { columns = ["fx", "fy", "fz"], unit = "N" }   # put your columns here\n'
        'torque   = { columns = ["Mx [N*mm]", "My [N*mm]", "Mz [N*mm]"], unit = "N*mm" }\n'
        'specific_force = { columns = ["ax", "ay", "az"], unit = "m/s^2" }\n'
    )


def test_the_example_for_an_array_file_names_its_arrays(tmp_path: Path) -> None:
    np.savez(tmp_path / "m.npz", time=np.arange(3.0), force_sensor=[W[:3]] * 3, gravity_sensor=[[0, 0, -9.81]] * 3)
    with pytest.raises(BadDescription) as caught:
        read_recording(tmp_path / "m.npz")
    assert 'path     = "m.npz"\n' in str(caught.value)
    assert 'force    = { columns = ["force_sensor"], unit = "N" }\n' in str(caught.value)


def numbered(pattern: str, count: int) -> list[str]:
    return [pattern.format(k) for k in range(count)]


CONTROLLERS = {
    "UR": (
        ["timestamp", *numbered("actual_TCP_pose_{}", 6), *numbered("actual_TCP_force_{}", 6)],
        [0.5, -0.2, 0.3, 0.1, -0.4, 0.2, *W],
        Rotation.exp([0.1, -0.4, 0.2]),
        "W",
    ),
    "Franka": (
        ["time", *numbered("O_T_EE[{}]", 16), *numbered("K_F_ext_hat_K[{}]", 6)],
        [0, 1, 0, 0, -1, 0, 0, 0, 0, 0, 1, 0, 0.5, -0.2, 0.3, 1, *W],
        Rotation.exp([0, 0, np.pi / 2]),
        "S",
    ),
}


@pytest.mark.parametrize(("names", "row", "turn", "frame"), CONTROLLERS.values(), ids=CONTROLLERS.keys())
def test_the_example_for_a_controller_says_what_its_columns_are(
    tmp_path: Path, names: list[str], row: list[float], turn: Rotation, frame: str
) -> None:
    """What is told can be written as it stands, and reads as the controller means it."""
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, names, [0.0, *row], [0.002, *row])
    (tmp_path / "log.toml").write_text("[log]\n[[stream]]\n" + stream_lines(str(caught.value)))
    (stream,) = read_recording(tmp_path / "log.toml").streams
    np.testing.assert_allclose(stream.channels["rotation"][0], turn.matrix, atol=1e-12)
    assert stream.channels["position"][0].tolist() == [0.5, -0.2, 0.3]
    assert [*stream.channels["force"][0], *stream.channels["torque"][0]] == W
    assert {stream.frames.get(part, "S") for part in ("force", "torque")} == {frame}
    assert "\n# the payload that is set in the controller is taken away from this wrench" in str(caught.value)


def test_a_controllers_columns_are_not_said_to_be_unknown(tmp_path: Path) -> None:
    """The words say what is the matter, without a list of columns that the description below them has in it."""
    names, row = CONTROLLERS["UR"][:2]
    with pytest.raises(NoDescription) as caught:
        bare(tmp_path, names, [0.0, *row], [0.002, *row])
    assert caught.value.words == (
        f"{tmp_path / 'data.csv'}: needs a description: force and torque are a controller's, whose axes, units and "
        "settings only you can confirm. Check this one, made of its names:"
    )
    assert caught.value.example.startswith("[log]\n")
    assert "\n# the TCP that is set in the controller must be S" in caught.value.example
    assert str(caught.value) == f"{caught.value.words}\n{caught.value.example}"


def test_the_example_for_a_file_without_header_counts_columns(tmp_path: Path) -> None:
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, ["0", *map(str, [*W, *Q])], [0.01, *W, *Q])
    assert "force    = { columns = [1, 2, 3]," in str(caught.value)
    (tmp_path / "log.toml").write_text("[log]\n[[stream]]\n" + stream_lines(str(caught.value)))
    assert read_recording(tmp_path / "log.toml").streams[0].channels["force"].tolist() == [W[:3]] * 2


@pytest.mark.parametrize(("name", "mark"), [("stamp", "   # check the unit: s, ms, us or ns"), ("t_us", "")])
def test_the_example_says_where_a_name_leaves_the_unit_of_time_open(tmp_path: Path, name: str, mark: str) -> None:
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, [name, "fx", "fy", "fz", "tx", "ty", "tz"], [1.7e15, *W], [1.7e15 + 1e4, *W])
    assert f'time     = {{ columns = ["{name}"], unit = "us" }}{mark}\n' in str(caught.value)


def test_a_file_that_does_not_say_gravity_has_a_note_of_what_was_assumed(tmp_path: Path) -> None:
    wrench = ["t", "fx", "fy", "fz", "tx", "ty", "tz"]
    bare(tmp_path, [*wrench, "qw", "qx", "qy", "qz"], [0, *W, *Q], [0.01, *W, *Q])
    assert read_recording(tmp_path / "data.csv").notes == (
        "the file does not say gravity: 9.80665 ± 0.015 m/s² along -z of the world was assumed, the spread from equator to pole, which the bar of the mass holds (that of your place narrows it, in [log] gravity of a description, which `steelyard identify FILE --describe` writes)",
    )
    bare(tmp_path, [*wrench, "gx", "gy", "gz"], [0, *W, 0, 0, -9.82], [0.01, *W, 0, 0, -9.82])
    assert read_recording(tmp_path / "data.csv").notes == ()


# --- pendant --------------------


def test_pendant(tmp_path: Path) -> None:
    recording = read_pendant(
        [
            "# three poses",
            "0 0 0  1 2 3  4 5 6",
            "",
            "90, 0, 0, 1, 2, 3, 4, 5, 6",
            "0;90;0;1;2;3;4;5;6 # last",
        ]
    )
    (stream,) = recording.streams
    assert stream.poses
    assert len(stream) == 3
    assert recording.wrench_sign == -1
    np.testing.assert_allclose(stream.channels["rotation"][1], [[1, 0, 0], [0, 0, -1], [0, 1, 0]], atol=1e-15)
    assert stream.channels["force"].tolist() == [[1, 2, 3]] * 3
    assert stream.channels["torque"].tolist() == [[4, 5, 6]] * 3


NINE = "Each line holds nine {}numbers: roll pitch yaw (deg, S to W), fx fy fz (N), tx ty tz (N*m)."


@pytest.mark.parametrize(
    ("line", "text"),
    [
        ("", f"no pose was typed. {NINE.format('')}"),
        ("1 2 3", f"line 1: got 3 numbers. {NINE.format('finite ')}"),
        ("a 2 3", f"line 1: could not convert string to float: 'a'. {NINE.format('')}"),
    ],
)
def test_pendant_lines_that_are_wrong(line: str, text: str) -> None:
    with pytest.raises(BadValue) as caught:
        read_pendant([line])
    assert str(caught.value) == text


@pytest.mark.parametrize(
    ("names", "form"),
    [
        (["roll", "pitch", "yaw"], 'form = "rpy", unit = "deg"'),
        (["Roll [deg]", "Pitch [deg]", "Yaw [deg]"], 'form = "rpy", unit = "deg"'),
        (["roll_deg", "pitch_deg", "yaw_deg"], 'form = "rpy", unit = "deg"'),
        (["roll_rad", "pitch_rad", "yaw_rad"], 'form = "rpy", unit = "rad"'),
        (["pose.roll", "pose.pitch", "pose.yaw"], 'form = "rpy", unit = "deg"'),
        (["rx", "ry", "rz"], 'form = "rotation-vector", unit = "rad"'),
        (["Rx", "Ry", "Rz"], 'form = "rotation-vector", unit = "rad"'),
    ],
)
def test_angles_need_a_description_whose_line_is_shown(tmp_path: Path, names: list[str], form: str) -> None:
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, ["t", "fx", "fy", "fz", "tx", "ty", "tz", *names], [0, *W, 0, 0, 0], [0.01, *W, 0, 0, 0])
    text = str(caught.value)
    assert "turn the sensor, but only a description can say in which form (rpy or rotation-vector) and unit" in text
    columns = ", ".join(f'"{name}"' for name in names)
    line = f"rotation = {{ columns = [{columns}], {form} }}"
    assert line in text
    assert "quaternion" not in text
    (tmp_path / "log.toml").write_text(text[text.index("[log]") :])
    assert read_recording(tmp_path / "log.toml").streams[0].channels["rotation"].shape == (2, 3, 3)


def test_the_description_of_a_table_of_poses_says_so(tmp_path: Path) -> None:
    names = ["fx", "fy", "fz", "tx", "ty", "tz", "roll", "pitch", "yaw"]
    forces = 5 * np.random.default_rng(0).normal(size=(6, 3))
    with pytest.raises(BadDescription) as caught:
        bare(tmp_path, names, *([*force, 0.1, 0, 0, 20 * n, 0, 0] for n, force in enumerate(forces)))
    text = str(caught.value)
    assert 'kind     = "poses"   # each row is a still pose: check\nforce ' in text
    (tmp_path / "log.toml").write_text(text[text.index("[log]") :])
    assert read_recording(tmp_path / "log.toml").streams[0].poses


def test_a_rotation_that_is_read_is_not_asked_for_in_angles(tmp_path: Path) -> None:
    names = ["fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz", "roll", "pitch", "yaw"]
    stream = bare(tmp_path, names, [*W, *Q, 1, 2, 3])
    assert "rotation" in stream.channels


@pytest.mark.parametrize("name", ["", "Zeit", "Unnamed: 0"])
def test_the_only_column_of_dates_is_the_clock(tmp_path: Path, name: str) -> None:
    names = [name, "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz", "mode"]
    numbers = ",".join(f"{value:g}" for value in [*W, *Q])
    rows = [f"2026-01-01 12:00:00.{k:02d},{numbers},auto" for k in (0, 1)]
    (tmp_path / "data.csv").write_text("\n".join([",".join(names), *rows]))
    (stream,) = read_recording(tmp_path / "data.csv").streams
    assert stream.time is not None
    assert np.diff(stream.time) == pytest.approx(0.01)


def test_an_index_in_brackets_is_no_unit(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text("time,O_T_EE[0],O_T_EE[1]\n0,1,2\n")
    with pytest.raises(BadDescription, match="no force and no torque was recognised"):
        read_recording(tmp_path / "data.csv")


JOINED = "__time,/ft/force/x,/ft/force/y,/ft/force/z,/ft/torque/x,/ft/torque/y,/ft/torque/z,"
JOINED += ",".join(f"/tf/base/tool0/{name}" for name in ("translation/x", "translation/y", "translation/z"))
JOINED += "," + ",".join(f"/tf/base/tool0/rotation/{name}" for name in "xyzw")


def joined_rows() -> str:
    wrench, pose = ",".join(f"{v:g}" for v in W), ",".join(f"{v:g}" for v in [1, 2, 3, *Q])
    rows = [f"{k},{wrench},,,,,,," if k % 2 else f"{k},,,,,,,{pose}" for k in range(20)]
    return "\n".join([JOINED, *rows])


def test_topics_that_plotjuggler_joined_are_streams_of_their_own(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(joined_rows())
    wrench, pose = read_recording(tmp_path / "data.csv").streams
    assert set(wrench.channels) == {"force", "torque"}
    assert set(pose.channels) == {"position", "rotation"}
    assert len(wrench) == len(pose) == 10
    assert wrench.channels["force"].tolist() == [W[:3]] * 10


def test_a_description_of_a_bare_file_reads_as_the_file_does(tmp_path: Path) -> None:
    wrench, turn = "fx,fy,fz,tx,ty,tz", "qw,qx,qy,qz"
    turned = [Rotation.exp([0.2 * k, 0.0, 0.1]).quaternion_wxyz() for k in range(20)]
    said = [",".join(f"{v:g}" for v in [*W, *q]) for q in turned]
    tables = {
        "joined": joined_rows().splitlines(),
        "clocked": [f"t_ms,{wrench},{turn}", *(f"{10 * k},{row}" for k, row in enumerate(said))],
        "two stamps": [f"sec,nanosec,{wrench},{turn}", *(f"1700000000,{k}0000000,{row}" for k, row in enumerate(said))],
        "still poses": [f"{wrench},{turn}", *said],
        "own gravity": [f"t,{wrench},gravity_x,gravity_y,gravity_z"]
        + [f"{k / 100},{','.join(map(str, W))},0,0,-9.82" for k in range(20)],
    }
    for name, rows in tables.items():
        path = tmp_path / f"{name}.csv"
        path.write_text("\n".join(rows))
        (tmp_path / "log.toml").write_text(describe_file(path))
        read, told = read_recording(path), read_recording(tmp_path / "log.toml")
        assert told.described
        np.testing.assert_array_equal(read.gravity, told.gravity)
        assert read.gravity_std == told.gravity_std
        for one, other in zip(read.streams, told.streams, strict=True):
            assert (one.poses, one.time is None) == (other.poses, other.time is None)
            if one.time is not None:
                np.testing.assert_array_equal(one.time, other.time)
            assert set(one.channels) == set(other.channels)
            for quantity in one.channels:
                np.testing.assert_array_equal(one.channels[quantity], other.channels[quantity])


def test_a_table_that_needs_a_description_is_described_by_its_example(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text("a,b,c\n1,2,3\n")
    with pytest.raises(NoDescription) as caught:
        read_recording(tmp_path / "data.csv")
    assert describe_file(tmp_path / "data.csv") == caught.value.example
    with pytest.raises(BadFile, match="unknown kind of data file"):
        describe_file(Path(tmp_path / "data.csv").rename(tmp_path / "log.toml"))


def test_joined_topics_said_to_be_one_stream_are_told_apart(tmp_path: Path) -> None:
    (tmp_path / "data.csv").write_text(joined_rows())
    names = JOINED.split(",")
    (tmp_path / "log.toml").write_text(
        f"""[[stream]]
path     = "data.csv"
time     = {{ columns = ["__time"] }}
force    = {{ columns = {names[1:4]} }}
torque   = {{ columns = {names[4:7]} }}
rotation = {{ columns = {names[10:]}, form = "quaternion-xyzw" }}
"""
    )
    with pytest.raises(BadValue) as caught:
        read_recording(tmp_path / "log.toml")
    assert str(caught.value) == (
        'log.toml, [[stream]] 1 ("data.csv"): force and rotation stand in different rows, as where topics are joined by time. '
        "Describe each topic as a [[stream]] of its own, with the same path."
    )
