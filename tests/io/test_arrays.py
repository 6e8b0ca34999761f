"""A recording of arrays is the one that a file with the same numbers gives, and its errors say what would be right."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

import steelyard as sy
from steelyard.io import read_recording
from steelyard.logs.recording import Mount, Recording, Stream

N = 40
RNG = np.random.default_rng(0)
TURN = sy.Rotation.exp(RNG.normal(size=(N, 3)))
ARRAYS = {
    "time": np.arange(N) / 100,
    "force": RNG.normal(size=(N, 3)),
    "torque": RNG.normal(size=(N, 3)),
    "rotation": TURN.matrix,
    "position": RNG.normal(size=(N, 3)),
}
GRAVITY = [0, 0, -9.81]
TOML = """
[log]
gravity = [0, 0, -9.81]
wrench = "on-sensor"
[noise]
force = 0.1
[[stream]]
path = "log.npz"
time = { columns = ["time"] }
force = { columns = ["force"], frame = "W" }
torque = { columns = ["torque"] }
rotation = { columns = ["rotation"], form = "matrix" }
position = { columns = ["position"] }
delay = { value = 0.01 }
mount = { position = [0, 0, 0.1], rotation = [1, 0, 0, 0], form = "quaternion-wxyz" }
"""


def of_file(folder: Path, **arrays: Any) -> Recording:
    np.savez(folder / "log.npz", **(ARRAYS | arrays))
    (folder / "log.toml").write_text(TOML)
    return read_recording(folder / "log.toml")


def of_arrays(**arrays: Any) -> Recording:
    return sy.recording(
        **(ARRAYS | arrays), frame={"force": "W"}, delay=0.01, mount=sy.Pose(sy.Rotation.identity(), [0, 0, 0.1]),
        gravity=GRAVITY, wrench="on-sensor", noise={"force": 0.1},
    )  # fmt: skip


def require_same(one: Recording, other: Recording) -> None:
    assert np.array_equal(one.gravity, other.gravity)
    assert (one.wrench_sign, one.noise, one.gravity_std) == (other.wrench_sign, other.noise, other.gravity_std)
    assert (one.described, len(one.streams)) == (other.described, len(other.streams))
    for a, b in zip(one.streams, other.streams, strict=True):
        assert np.array_equal(a.time, b.time)
        assert (dict(a.frames), a.delay, a.poses, list(a.channels)) == (
            dict(b.frames), b.delay, b.poses, list(b.channels),
        )  # fmt: skip
        assert all(np.array_equal(a.channels[q], b.channels[q]) for q in a.channels)


def test_arrays_give_the_recording_of_a_file(tmp_path: Path) -> None:
    mine, read = of_arrays(), of_file(tmp_path)
    require_same(mine, read)
    assert mine.streams[0].mount is not None
    assert read.streams[0].mount is not None
    assert np.array_equal(mine.streams[0].arm, read.streams[0].arm)
    assert np.array_equal(mine.streams[0].turn.matrix, read.streams[0].turn.matrix)


def test_rows_with_nan_are_left_out_as_of_files(tmp_path: Path) -> None:
    force = ARRAYS["force"].copy()
    force[3, 1], force[-1] = np.nan, np.inf
    mine, read = of_arrays(force=force), of_file(tmp_path, force=force)
    require_same(mine, read)
    assert [f.code for f in mine.findings] == ["rows-missing"]
    assert mine.findings[0].message == read.findings[0].message.replace("log.npz", "recording")
    hidden = np.ma.masked_invalid(force)
    require_same(of_arrays(force=hidden), read)


@pytest.mark.parametrize(
    ("rotation", "form"),
    [
        (TURN, None),
        (TURN.matrix.reshape(N, 9), None),
        (TURN.matrix.tolist(), "matrix"),
        (ScipyRotation.from_matrix(np.array(TURN.matrix)), None),
        (TURN.quaternion_wxyz(), "quaternion-wxyz"),
        (np.roll(TURN.quaternion_wxyz(), -1, axis=1), "quaternion-xyzw"),
        (TURN.rpy(), "rpy"),
        (TURN.log(), "rotation-vector"),
        (ScipyRotation.from_matrix(np.array(TURN.matrix)).as_euler("ZYZ"), "zyz"),
    ],
)
def test_every_form_of_rotation_is_the_same_rotation(rotation: Any, form: str | None) -> None:
    made = sy.recording(**(ARRAYS | {"rotation": rotation}), form=form, gravity=GRAVITY)
    assert made.streams[0].channels["rotation"] == pytest.approx(TURN.matrix, abs=1e-12)


def test_lists_are_arrays() -> None:
    lists = {name: values.tolist() for name, values in ARRAYS.items()}
    require_same(of_arrays(**lists), of_arrays())


def test_what_is_given_is_neither_frozen_nor_held() -> None:
    force = ARRAYS["force"].copy()
    made = of_arrays(force=force)
    force[:] = 7
    assert not (made.streams[0].channels["force"] == 7).any()


def test_each_dict_is_a_clock_of_its_own() -> None:
    wrench = {name: ARRAYS[name] for name in ("time", "force", "torque")}
    pose = {"time": ARRAYS["time"][::2] + 0.1, "rotation": TURN[::2], "delay": 0.1, "name": "arm"}
    made = sy.recording(wrench, pose, gravity=GRAVITY)
    assert [stream.name for stream in made.streams] == ["stream 1", "arm"]
    assert [len(stream) for stream in made.streams] == [N, N // 2]
    assert (made.streams[0].delay, made.streams[1].delay) == (None, 0.1)


def test_clocks_of_arrays_are_those_of_files() -> None:
    timeless = {name: values for name, values in ARRAYS.items() if name != "time"}
    assert sy.recording(**timeless, rate=np.int64(100), gravity=GRAVITY).streams[0].time == pytest.approx(
        ARRAYS["time"]
    )
    assert sy.recording(**timeless, poses=True, gravity=GRAVITY).streams[0].poses
    dates = np.datetime64("2024-05-01T12:00:00") + np.arange(N) * np.timedelta64(10, "ms")
    assert sy.recording(**timeless, time=dates, gravity=GRAVITY).streams[0].time == pytest.approx(ARRAYS["time"])


def test_gravity_that_nobody_gives_is_assumed_and_noted() -> None:
    made = sy.recording(**ARRAYS)
    assert made.gravity_std > 0
    assert made.notes == (
        "no gravity was given: 9.80665 ± 0.015 m/s² along -z of W, a level base, was assumed",
    )  # fmt: skip
    measured = np.tile([0, 0, -9.81], (N, 1))
    assert sy.recording(**ARRAYS, gravity_sensor=measured).notes == ()


WRONG: list[tuple[dict[str, Any], str]] = [
    (
        {"rotation": TURN.quaternion_wxyz()},
        "recording, rotation: shape (40, 4) does not say what the numbers are. "
        'Say form="quaternion-wxyz" or "quaternion-xyzw"; it turns S into W.',
    ),
    (
        {"rotation": TURN.log()},
        "recording, rotation: shape (40, 3) does not say what the numbers are. "
        'Say form="rpy" or "rotation-vector" or "zyz"; it turns S into W.',
    ),
    (
        {"rotation": TURN.matrix, "form": "rpy"},
        'recording, rotation: shape (40, 3, 3) form="rpy" does not fit. Say form="matrix"; it turns S into W.',
    ),
    (
        {"rotation": np.full((N, 3), 90.0), "form": "rpy"},
        "recording, rotation: angles are in rad, and these reach 90, which looks like degrees. "
        "Give np.radians(..) of them.",
    ),
    (
        {"rotation": np.zeros((N, 5))},
        "recording, rotation: expected a Rotation, matrices (N, 3, 3) or (N, 9), quaternions (N, 4) or angles (N, 3), "
        "one per row; found shape (40, 5).",
    ),
    (
        {"rotation": sy.Rotation.identity()},
        "recording, rotation: expected one rotation per row, batch (N,); found batch ().",
    ),
    (
        {"rotation": TURN.matrix[:-1]},
        "recording: the lengths differ: force 40, torque 40, rotation 39, position 40, time 40 rows. "
        "Each quantity of a stream must have one row per sample.",
    ),
    (
        {"force": ARRAYS["force"][0]},
        "recording, force: expected one row per sample, shape (N, 3); found shape (3,).",
    ),
    (
        {"force": ARRAYS["force"].T},
        "recording, force: expected one row per sample, shape (N, 3); found shape (3, 40). Transpose it (.T).",
    ),
    (
        {"force": "force"},
        "recording, force: expected numbers, one row per sample; got str (could not convert string to float: 'force').",
    ),
    (
        {"force": np.full((N, 3), np.nan)},
        "recording, force: all 40 rows are NaN, infinite or empty: there are no data. Check the driver and the "
        "columns, or record again.",
    ),
    (
        {"time": ARRAYS["time"][:, None]},
        "recording, time: expected one stamp per row, shape (N,) [s]; found shape (40, 1).",
    ),
    (
        {"time": ARRAYS["time"] * 1e9},
        "recording, time: rows are 1e+07 s apart, which no force-torque log is. Correct the unit of time (s, ms, us, "
        "ns; arrays are in s: of nanoseconds give (ns - first) * 1e-9, one `first` for all), the column or the rate.",
    ),
    (
        {"force": ARRAYS["force"] + 0j},
        "recording, force: expected real numbers, one row per sample; these are complex.",
    ),
    ({"rate": 100}, "recording: time and rate are given; a stream has one of time, rate and poses=True."),
    (
        {"frame": "base"},
        'recording, frame: expected "S" (axes of the sensor) or "W" (of the world, the base); got \'base\'.',
    ),
    (
        {"frame": {"force": "base"}},
        'recording, frame: expected "S" (axes of the sensor) or "W" (of the world, the base); got \'base\'.',
    ),
    ({"frame": {"position": "W"}}, "recording: frame is of force, torque here; got 'position'."),
    (
        {"gravity": np.tile(GRAVITY, (N, 1))},
        "recording, gravity: expected one vector (3,) [m/s^2] in the world frame W, such as [0, 0, -9.81]; found shape "
        "(40, 3). What was measured in the sensor frame, row by row, is gravity_sensor.",
    ),
    (
        {"gravity": [0, 0, -9810]},
        'recording: "gravity" must be in m/s^2, [0, 0, -9.81] on a level base; got [0, 0, -9810].',
    ),
    ({"wrench": "sensor"}, 'recording: wrench must be "on-object" or "on-sensor"; got \'sensor\'.'),
    (
        {"wrench": np.zeros((N, 6))},
        'recording: wrench must be "on-object" or "on-sensor"; got ndarray (numbers are force= and torque=).',
    ),
    ({"noise": 0.1}, 'recording: noise must be a dict, such as {"force": 0.05}; got 0.1.'),
    (
        {"noise": {"forces": 0.1}},
        'recording, noise: unknown key "forces". Did you mean "force"? Keys here: force, torque, acceleration, '
        "angular_acceleration.",
    ),
    (
        {"mount": np.eye(3)},
        "recording: mount must be one sy.Pose, or one sy.Rotation; got ndarray. 4 x 4 matrices become one with "
        "sy.Pose.from_matrix(T).",
    ),
    (
        {"rotation": np.tile(np.eye(4), (N, 1, 1))},
        "recording, rotation: expected a Rotation, matrices (N, 3, 3) or (N, 9), quaternions (N, 4) or angles (N, 3), "
        "one per row; found shape (40, 4, 4). Of poses T give rotation=T[:, :3, :3], position=T[:, :3, 3].",
    ),
    (
        {"torque": None},
        "recording: no torque is given, only force, rotation, position. An answer needs the wrench: force and torque "
        '(torque = "zero" for a passive gimbal).',
    ),
    (
        {"forces": 1},
        'recording: unknown key "forces". Did you mean "force"? Keys here: time, rate, poses, force, torque, rotation, '
        "form, position, linear_velocity, angular_velocity, linear_acceleration, angular_acceleration, specific_force, "
        "gravity_sensor, frame, delay, mount, name.",
    ),
]


@pytest.mark.parametrize(("changed", "text"), WRONG)
def test_a_mistake_has_one_clear_error(changed: dict[str, Any], text: str) -> None:
    with pytest.raises(sy.BadInput) as caught:
        sy.recording(**({**ARRAYS, "gravity": GRAVITY} | changed))
    assert str(caught.value) == text


@pytest.mark.parametrize("given", [(), (np.zeros((N, 3)),), (Stream("s", {"force": ARRAYS["force"]}),)])
def test_other_things_than_arrays_are_refused(given: tuple[Any, ...]) -> None:
    with pytest.raises(sy.BadInput, match="dict"):
        sy.recording(*given)


def test_identify_says_how_arrays_come_in() -> None:
    with pytest.raises(sy.BadInput) as caught:
        sy.identify(ARRAYS)  # type: ignore[arg-type]
    assert str(caught.value) == (
        "log must be a path, a Recording or a MotionLog; got dict. Arrays become one with "
        "sy.recording(time=.., force=.., torque=.., rotation=.., ..)."
    )


def test_durations_and_dates_are_seconds() -> None:
    steps = (np.arange(N) * 10_000_000).astype("m8[ns]")
    for stamps in (steps, steps.astype("m8[ms]"), np.datetime64("2024-05-01T12:00:00") + steps):
        made = sy.recording(**(ARRAYS | {"time": stamps}), gravity=GRAVITY).streams[0].time
        assert made is not None
        assert made - made[0] == pytest.approx(ARRAYS["time"], abs=1e-9)


def test_a_mount_without_its_place() -> None:
    made = sy.recording(**ARRAYS, mount=sy.Rotation.identity(), gravity=GRAVITY)
    assert isinstance(made.streams[0].mount, Mount)
    assert made.streams[0].arm is None
