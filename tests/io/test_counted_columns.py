"""Files as loggers write them: counted columns, arrays by their shape, clocks by their unit, poses left open."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadDescription
from steelyard.io import read_recording
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, Recording, Stream
from steelyard.spatial import Rotation

ROWS = 40
TIME = np.arange(ROWS) / 100
FORCE = np.random.default_rng(1).normal(size=(ROWS, 3))
TORQUE = np.random.default_rng(2).normal(size=(ROWS, 3))
TURN = Rotation.exp(np.outer(TIME, [2.0, -1.0, 3.0]))
WXYZ = TURN.quaternion_wxyz()
XYZW = np.roll(WXYZ, -1, 1)
PLACE = np.random.default_rng(3).normal(size=(ROWS, 3))
POSE = np.tile(np.eye(4), (ROWS, 1, 1))
POSE[:, :3, :3], POSE[:, :3, 3] = TURN.matrix, PLACE
WRENCH = np.hstack([FORCE, TORQUE])


def arrays(folder: Path, **named: np.ndarray) -> Recording:
    np.savez(folder / "a.npz", **named)  # type: ignore[arg-type]
    return read_recording(folder / "a.npz")


def table(folder: Path, header: str, *columns: np.ndarray, mark: str = ",") -> Recording:
    rows = np.hstack([c.reshape(ROWS, -1) for c in columns])
    lines = [mark.join(f"{v:.17g}" for v in row) for row in rows]
    (folder / "a.csv").write_text("\n".join([header, *lines]) + "\n")
    return read_recording(folder / "a.csv")


def same(recording: Recording, *more: str) -> Stream:
    (stream,) = recording.streams
    assert set(stream.channels) == {"force", "torque", "rotation", *more}
    np.testing.assert_allclose(stream.channels["force"], FORCE, atol=1e-12)
    np.testing.assert_allclose(stream.channels["torque"], TORQUE, atol=1e-12)
    np.testing.assert_allclose(stream.channels["rotation"], TURN.matrix, atol=1e-9)
    if "position" in more:
        np.testing.assert_allclose(stream.channels["position"], PLACE, atol=1e-12)
    assert stream.time is not None
    np.testing.assert_allclose(stream.time - stream.time[0], TIME, atol=1e-6)
    return stream


def followed(folder: Path, error: BadDescription) -> Recording:
    """The recording that the example of a description in the error reads, as it stands."""
    text = str(error)
    (folder / "log.toml").write_text(text[text.index("[log]") :])
    return read_recording(folder / "log.toml")


# --- read at once --------------------


@pytest.mark.parametrize("name", ["wrench", "ft", "observation.wrench", "ft_sensor_wrench"])
def test_six_of_a_wrench_are_force_then_torque_and_a_note_says_so(tmp_path: Path, name: str) -> None:
    recording = arrays(tmp_path, t=TIME, R=TURN.matrix, **{name: WRENCH})
    same(recording)
    assert f"the six numbers of '{name}' were taken as force, then torque" in recording.notes


def test_counted_columns_of_a_text(tmp_path: Path) -> None:
    header = "t,ft_force_0,ft_force_1,ft_force_2,ft_torque_0,ft_torque_1,ft_torque_2,qw,qx,qy,qz"
    same(table(tmp_path, header, TIME, WRENCH, WXYZ))
    same(table(tmp_path, "t," + ",".join(f"wrench_{k}" for k in range(6)) + ",qw,qx,qy,qz", TIME, WRENCH, WXYZ))
    same(table(tmp_path, "t,ft_fx,ft_fy,ft_fz,ft_tx,ft_ty,ft_tz,ori_w,ori_x,ori_y,ori_z", TIME, WRENCH, WXYZ))


@pytest.mark.parametrize("pose", [POSE, POSE.reshape(ROWS, 16), np.swapaxes(POSE, 1, 2).reshape(ROWS, 16)])
@pytest.mark.parametrize("name", ["T", "ee_pose", "O_T_EE"])
def test_a_pose_as_a_matrix_shows_itself_how_it_is_written(tmp_path: Path, name: str, pose: np.ndarray) -> None:
    recording = arrays(tmp_path, t=TIME, force=FORCE, torque=TORQUE, O_T_EE_d=pose[::-1], T_camera=pose, **{name: pose})
    same(recording, "position")
    assert f"the 4 x 4 matrices of '{name}' were taken as poses of S in W" in recording.notes


def test_sixteen_numbers_that_are_no_pose_are_none(tmp_path: Path) -> None:
    with pytest.raises(BadDescription, match="nothing says where gravity points"):
        arrays(tmp_path, t=TIME, force=FORCE, torque=TORQUE, T=2 * POSE)


def test_what_was_wanted_is_not_what_was_measured(tmp_path: Path) -> None:
    names = [f"{kind}_quat_{part}" for kind in ("desired", "actual") for part in "wxyz"]
    header = ",".join(["t", "fx", "fy", "fz", "tx", "ty", "tz", *names])
    same(table(tmp_path, header, TIME, WRENCH, WXYZ[::-1], WXYZ))


@pytest.mark.parametrize("clock", ["Zeit [s]", "Zeit", "temps (s)", "header.stamp", "ZeitInSec,ZeitInNanoSec"])
def test_clocks_by_other_names(tmp_path: Path, clock: str) -> None:
    stamps = np.stack([1_700_000_000 + 0 * TIME, np.round(1e9 * TIME)], 1) if "," in clock else TIME
    same(table(tmp_path, f"{clock},fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", stamps, WRENCH, WXYZ))


def test_a_duration_is_no_clock(tmp_path: Path) -> None:
    turned = Rotation.exp(np.outer(np.arange(ROWS), [0.5, 0.3, 0.0])).quaternion_wxyz()
    (stream,) = table(tmp_path, "settled [s],fx,fy,fz,tx,ty,tz,qw,qx,qy,qz", 1 + 0 * TIME, WRENCH, turned).streams
    assert stream.time is None
    assert stream.poses


def test_stamps_of_another_form_give_way_to_others(tmp_path: Path) -> None:
    header = "time,secs,nsecs,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz"
    rows = [
        f"2024/02/25/11:38:{t:09.6f},1700000000,{1e9 * t:.0f}," + ",".join(f"{v:.17g}" for v in [*w, *q])
        for t, w, q in zip(TIME, WRENCH, WXYZ, strict=True)
    ]
    (tmp_path / "a.csv").write_text("\n".join([header, *rows]))
    same(read_recording(tmp_path / "a.csv"))


def test_comments_longer_than_the_head(tmp_path: Path) -> None:
    header = "# a line of a logger's settings\n" * 4000 + "\n" + "t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz"
    same(table(tmp_path, header, TIME, WRENCH, WXYZ))


# --- left open: the description to start from --------------------


def test_four_numbers_leave_their_order_open_and_both_are_said(tmp_path: Path) -> None:
    with pytest.raises(
        BadDescription, match=r'"quaternion-wxyz": the file does not tell which of the four is w'
    ) as caught:
        arrays(tmp_path, t=TIME, force=FORCE, torque=TORQUE, quat=XYZW, ee_pos=PLACE)
    same(followed(tmp_path, caught.value), "position")


@pytest.mark.parametrize("first", [0, 1])
def test_numbers_called_q_have_w_first(tmp_path: Path, first: int) -> None:
    names = ",".join(f"q{first + k}" for k in range(4))
    with pytest.raises(BadDescription, match=r'or "quaternion-xyzw"') as caught:
        table(tmp_path, f"t,fx,fy,fz,tx,ty,tz,{names}", TIME, WRENCH, WXYZ)
    same(followed(tmp_path, caught.value))


def test_an_orientation_that_is_left_out_beside_an_accelerometer_is_noted(tmp_path: Path) -> None:
    felt = TURN.inverse().apply(np.tile([0.0, 0.0, 9.8], (ROWS, 1)))
    recording = arrays(tmp_path, t=TIME, force=FORCE, torque=TORQUE, orientation=XYZW, acc=felt)
    assert set(recording.streams[0].channels) == {"force", "torque", "specific_force"}
    (note,) = [note for note in recording.notes if "an orientation was left out" in note]
    assert 'rotation = { columns = ["orientation"], form = "quaternion-xyzw" }' in note


@pytest.mark.parametrize(
    ("pose", "lines"),
    [
        (np.hstack([PLACE, XYZW]), ('unit = "m"', 'form = "quaternion-xyzw"')),
        (np.hstack([1000 * PLACE, np.degrees(TURN.rpy())]), ('unit = "mm"', 'form = "rpy", unit = "deg"')),
        (np.hstack([PLACE, TURN.log()]), ('unit = "m"', 'form = "rotation-vector", unit = "rad"')),
    ],
)
@pytest.mark.parametrize("name", ["tcp_pose", "ee_pose", "position"])
def test_poses_in_one_array(tmp_path: Path, name: str, pose: np.ndarray, lines: tuple[str, str]) -> None:
    with pytest.raises(BadDescription, match="how the columns of the orientation turn the sensor") as caught:
        arrays(tmp_path, t=TIME, wrench=WRENCH, **{name: pose})
    assert all(line in str(caught.value) for line in lines)
    same(followed(tmp_path, caught.value), "position")


def counted(pattern: str, count: int) -> list[str]:
    return [pattern.format(k) for k in range(count)]


MADE = {
    "Sunrise": (
        "ZeitInSec,ZeitInNanoSec,cartForce1_X,cartForce1_Y,cartForce1_Z,cartTorque1_TauX,cartTorque1_TauY,"
        "cartTorque1_TauZ,cartPosMsr1_X,cartPosMsr1_Y,cartPosMsr1_Z,cartPosMsr1_A,cartPosMsr1_B,cartPosMsr1_C",
        [1.7e9 + 0 * TIME, np.round(1e9 * TIME), WRENCH, 1000 * PLACE, TURN.rpy()[:, ::-1]],
    ),
    "RSI": (
        "IPOC,RIst_X,RIst_Y,RIst_Z,RIst_A,RIst_B,RIst_C,Fx,Fy,Fz,Mx,My,Mz",
        [4208163634 + np.round(1000 * TIME), 1000 * PLACE, np.degrees(TURN.rpy()[:, ::-1]), WRENCH],
    ),
    "FANUC": ("t,fx,fy,fz,tx,ty,tz,X,Y,Z,W,P,R", [TIME, WRENCH, 1000 * PLACE, np.degrees(TURN.rpy())]),
    "xArm": (
        "t," + ",".join(f"ft_raw_force_{k}" for k in range(6)) + ",x,y,z,roll,pitch,yaw",
        [TIME, WRENCH, 1000 * PLACE, np.degrees(TURN.rpy())],
    ),
    "radians": ("t,fx,fy,fz,tx,ty,tz,x,y,z,roll,pitch,yaw", [TIME, WRENCH, PLACE, TURN.rpy()]),
    "TCP": (
        "t,TCP_x,TCP_y,TCP_z,TCP_rx,TCP_ry,TCP_rz,TCP_force_x,TCP_force_y,TCP_force_z,TCP_torque_x,TCP_torque_y,"
        "TCP_torque_z",
        [TIME, PLACE, TURN.log(), WRENCH],
    ),
    "libfranka": (
        ",".join(["duration", "success rate", *counted("O_T_EE[{}]", 16), *counted("K_F_ext_hat_K[{}]", 6)]),
        [1000 * TIME, 1 + 0 * TIME, np.swapaxes(POSE, 1, 2).reshape(ROWS, 16), WRENCH],
    ),
}  # fmt: skip


@pytest.mark.parametrize(("header", "columns"), MADE.values(), ids=MADE.keys())
def test_what_is_told_of_a_maker_reads_as_it_stands(tmp_path: Path, header: str, columns: list[np.ndarray]) -> None:
    with pytest.raises(BadDescription) as caught:
        table(tmp_path, header, *columns)
    same(followed(tmp_path, caught.value), *(() if "position" not in str(caught.value) else ("position",)))


def test_two_wrenches_are_both_said(tmp_path: Path) -> None:
    names = [f"/{topic}/{kind}/{axis}" for topic in ("ft", "ft_comp") for kind in ("force", "torque") for axis in "xyz"]
    with pytest.raises(BadDescription, match="several columns may be the force and the torque") as caught:
        table(tmp_path, ",".join(["t", *names, "qw", "qx", "qy", "qz"]), TIME, WRENCH, 0 * WRENCH, WXYZ)
    assert '# or ["/ft_comp/force/x", "/ft_comp/force/y", "/ft_comp/force/z"]' in str(caught.value)
    same(followed(tmp_path, caught.value))


def test_arrays_that_lie_on_their_side(tmp_path: Path) -> None:
    with pytest.raises(BadDescription, match=r'"data" has 40 columns: save data\.T\.'):
        arrays(tmp_path, sample_times=TIME, data=np.hstack([WRENCH, WXYZ]).T)


def test_joints_are_told_with_the_arm_that_they_need(tmp_path: Path) -> None:
    names = ",".join(f"q{k}" for k in range(6))
    with pytest.raises(BadDescription) as caught:
        table(tmp_path, f"t,fx,fy,fz,tx,ty,tz,{names}", TIME, WRENCH, WRENCH)
    assert 'joint_position = { columns = ["q0", "q1", "q2", "q3", "q4", "q5"], unit = "rad" }' in str(caught.value)
    assert "[robot]\nurdf " in str(caught.value)


def test_a_wrench_that_ros_2_echoed(tmp_path: Path) -> None:
    rows = [f"1700000000,{1e9 * t:.0f},ft," + ",".join(map(str, w)) for t, w in zip(TIME, WRENCH, strict=True)]
    (tmp_path / "a.csv").write_text("\n".join(rows))
    with pytest.raises(BadDescription) as caught:
        read_recording(tmp_path / "a.csv")
    for line in ('[0, 1], unit = ["s", "ns"]', "force    = { columns = [3, 4, 5]", "torque   = { columns = [6, 7, 8]"):
        assert line in str(caught.value)


# --- arrays of one column, axes in names, dates, blank names, rows of units --------------------


def test_an_array_of_one_column_is_that_column(tmp_path: Path) -> None:
    same(arrays(tmp_path, time=TIME[:, None], force=FORCE, torque=TORQUE, rotation=TURN.matrix))


def test_a_wrench_in_the_axes_of_the_world_is_not_read_as_one_of_the_sensor(tmp_path: Path) -> None:
    with pytest.raises(BadDescription, match="no force and no torque was recognised"):
        arrays(tmp_path, time=TIME, force_world=FORCE, torque_world=TORQUE, rotation=TURN.matrix)


@pytest.mark.parametrize("unit", ["ns", "us", "ms"])
def test_dates_of_arrays_need_no_unit(tmp_path: Path, unit: str) -> None:
    dates = np.datetime64("2026-01-01T12:00", "ns") + np.rint(TIME * 1e9).astype("m8[ns]")
    same(arrays(tmp_path, time=dates.astype(f"M8[{unit}]"), force=FORCE, torque=TORQUE, rotation=TURN.matrix))


HEADER = ["t", "fx", "fy", "fz", "tx", "ty", "tz", "qw", "qx", "qy", "qz"]


def test_blank_names_are_no_name_that_is_given_twice(tmp_path: Path) -> None:
    blank = np.zeros(ROWS)
    same(table(tmp_path, ",".join(["", *HEADER, ""]), blank, TIME, FORCE, TORQUE, WXYZ, blank))


@pytest.mark.parametrize("brackets", ["{}", "[{}]", "({})"])
def test_a_row_of_units_under_usual_names_is_read(tmp_path: Path, brackets: str) -> None:
    words = ["ms", *["kN"] * 3, *["N*mm"] * 3, "-", "-", "-"]
    units = [*map(brackets.format, words), ""]
    header = "\n".join([",".join(HEADER), ",".join(units)])
    same(table(tmp_path, header, TIME * 1e3, FORCE / 1e3, TORQUE * 1e3, WXYZ))


def test_a_unit_in_a_row_of_units_may_be_unknown(tmp_path: Path) -> None:
    header = "\n".join([",".join(HEADER), "s,kp,kp,kp,,,,,,,"])
    with pytest.raises(BadDescription, match='unknown unit "kp" of force'):
        table(tmp_path, header, TIME, FORCE, TORQUE, WXYZ)


def test_of_two_columns_with_a_unit_of_time_none_is_the_clock(tmp_path: Path) -> None:
    header = ",".join(["Beginn [s]", "Ende [s]", *HEADER[1:]])
    (stream,) = table(tmp_path, header, TIME, TIME + 1, FORCE, TORQUE, WXYZ).streams
    assert stream.time is None


# --- what is not taken --------------------


def test_columns_counted_from_one_or_with_a_gap_are_no_array(tmp_path: Path) -> None:
    header = ",".join(["t", *counted("force_{}", 4)[1:], *counted("torque_{}", 4)[:2], "torque_3", *HEADER[7:]])
    with pytest.raises(BadDescription, match="no force and no torque was recognised"):
        table(tmp_path, header, TIME, FORCE, TORQUE, WXYZ)


@pytest.mark.parametrize("made", ["scaled", "in one place"])
def test_sixteen_numbers_that_do_not_show_to_be_a_pose_are_none(tmp_path: Path, made: str) -> None:
    pose = POSE.copy()
    if made == "scaled":
        pose[:, :3, :3] *= 1.1
    else:  # row by row and column by column look alike
        pose[:, :3, 3] = 0
    with pytest.raises(BadDescription, match="nothing says where gravity points"):
        arrays(tmp_path, time=TIME, force=FORCE, torque=TORQUE, pose=pose)


def test_joints_that_were_measured_are_suggested_not_those_that_were_wanted(tmp_path: Path) -> None:
    header = ",".join(["t", *counted("target_q_{}", 6), *counted("actual_q_{}", 6), *HEADER[1:7]])
    six = np.tile(TIME[:, None], 6)
    with pytest.raises(BadDescription) as caught:
        table(tmp_path, header, TIME, six, six, FORCE, TORQUE)
    assert 'joint_position = { columns = ["actual_q_0", "actual_q_1", ' in str(caught.value)


RTDE = [f"actual_TCP_force_{k}" for k in range(6)]
BARE_WRENCH = [f"ft_raw_wrench_{k}" for k in range(6)]


@pytest.mark.parametrize("wrench", [RTDE, BARE_WRENCH])
@pytest.mark.parametrize("joints", [[f"actual_q_{k}" for k in range(6)], [f"q{k}" for k in range(6)]])
@pytest.mark.parametrize("more", ["", "target_q", "actual_qd", "actual_TCP_speed", "joint_torques", "x"])
def test_of_what_tool_and_joints_have_only_places_are_suggested(
    tmp_path: Path, wrench: list[str], joints: list[str], more: str
) -> None:
    extra = ["x", "y", "z"] if more == "x" else [f"{more}_{k}" for k in range(6)] if more else []
    header = ["timestamp", *extra, *wrench, *joints]
    with pytest.raises(BadDescription, match="Check this one, made of its names") as caught:
        table(tmp_path, ",".join(header), TIME, np.tile(WRENCH, 3)[:, : len(header) - 1])
    lines = str(caught.value).splitlines()
    assert any(line.startswith("joint_position") and f'["{joints[0]}"' in line for line in lines)
    assert [line.split(" ")[0] for line in lines if "columns = " in line] == [
        *("time", "force", "torque", "joint_position")
    ]  # and so no column for two of them


@pytest.mark.parametrize("more", [[], ["actual_qd"], ["actual_TCP_speed"], ["target_TCP_pose"]])
def test_a_wrench_of_the_tool_is_no_pose_of_it(tmp_path: Path, more: list[str]) -> None:
    header = ["timestamp", *RTDE, *(f"{name}_{k}" for name in more for k in range(6))]
    with pytest.raises(BadDescription, match="put your columns here; those of another file") as caught:
        table(tmp_path, ",".join(header), TIME, np.tile(WRENCH, 2)[:, : len(header) - 1])
    assert "position " not in str(caught.value)


def test_gravity_that_a_bare_file_does_not_say_is_as_sure_as_the_earth_is_round(tmp_path: Path) -> None:
    assumed = arrays(tmp_path, time=TIME, force=FORCE, torque=TORQUE, rotation=TURN.matrix)
    down = TURN.inverse().apply(np.tile([0, 0, -9.81], (ROWS, 1)))
    told = arrays(tmp_path, time=TIME, force=FORCE, torque=TORQUE, rotation=TURN.matrix, gravity=down)
    assert (assumed.gravity_std, told.gravity_std) == (ASSUMED_GRAVITY_STD, 0.0)
