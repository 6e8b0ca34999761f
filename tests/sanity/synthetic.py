"""A made robot log as three devices would write it: CSV files and a description, with a mistake where asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from steelyard.logs.log import MotionLog
from steelyard.simulate import scenarios
from steelyard.simulate.motions import Kinematics, Step, StopAndGo
from steelyard.spatial import Rotation

GRAVITY = 9.81
DURATION = 14.0
KEYS_DEG = [[0, 0, 0], [70, 0, 30], [-60, 40, 60], [20, -75, 0], [120, 20, -60], [-100, -30, 20], [0, 80, 90]]
MOVES = ((0.3, (0.0, 0.0, 0.2)), (4.2, (0.25, 0.1, 0.0)), (8.1, (-0.2, 0.15, -0.1)), (11.6, (0.0, -0.2, 0.1)))
FORMS = {True: "quaternion-wxyz", False: "quaternion-xyzw"}
DEVICES = ("pose", "wrench", "imu")


@dataclass(frozen=True)
class Kind:
    """One made log: which object and noise, how it is turned, and the mistakes made in describing it."""

    object: str = "hammer"
    noise: float = 1.0
    seed: int = 0
    imu_turned: bool = False
    imu_late: float = 0.0
    with_position: bool = True
    sign_flipped: bool = False
    transposed: bool = False
    quaternion_swapped: bool = False
    accelerometer_in_g: bool = False
    gravity: Sequence[float] = (0.0, 0.0, -GRAVITY)
    position_scale: float = 1.0
    torque_scale: float = 1.0
    tilt_deg: tuple[float, float] = (0.0, 0.0)
    repeated: str = ""  # "same" or "new" stamps
    stuck: bool = False
    clipped: bool = False
    drift: float = 0.0
    declared_force: float | None = None


def motion(seed: int) -> StopAndGo:
    """Return seven poses in 14 s with stops, a little different for every seed."""
    rng = np.random.default_rng([7, seed])
    keys = np.radians(np.array(KEYS_DEG, float) + rng.uniform(-10, 10, (len(KEYS_DEG), 3)))
    moves = tuple(Step(start, 1.1, np.array(change)) for start, change in MOVES)
    return StopAndGo(keys, interval=DURATION / len(keys), duration=1.1, moves=moves)


def write(folder: Path, kind: Kind) -> Path:
    """Write the files of one log and return its description."""
    folder.mkdir(parents=True, exist_ok=True)
    rng = np.random.default_rng([kind.seed, 11])
    clocks = {n: _clock(rng, rate) for n, rate in zip(DEVICES, (125.0, 500.0, 200.0), strict=True)}
    true_gravity = Rotation.from_rpy(np.radians([*kind.tilt_deg, 0.0])).apply(np.array([0, 0, -GRAVITY]))
    at = {n: motion(kind.seed).at(t) for n, t in clocks.items()}
    tables = {
        "pose": _pose(rng, at["pose"], kind),
        "wrench": _wrench(rng, at["wrench"], true_gravity, kind),
        "imu": _imu(rng, at["imu"], true_gravity, kind),
    }
    stamps = {**clocks, "imu": clocks["imu"] + kind.imu_late}
    for name in DEVICES:
        table = np.column_stack([stamps[name], tables[name]])
        _save(folder / f"{name}.csv", _with_repeats(rng, table, kind.repeated) if kind.repeated else table)
    path = folder / "log.toml"
    path.write_text(_description(kind))
    return path


def imu_mount(kind: Kind) -> Rotation:
    """Return how the accelerometer sits on S."""
    return Rotation.from_rpy(np.radians([90.0, 0.0, -90.0])) if kind.imu_turned else Rotation.identity()


def _clock(rng: np.random.Generator, rate: float) -> np.ndarray:
    even = np.arange(rng.uniform(0, 0.004), DURATION, 1 / rate)
    return even + rng.uniform(-0.02, 0.02, len(even)) / rate


def _pose(rng: np.random.Generator, at: Kinematics, kind: Kind) -> np.ndarray:
    noisy = at.rotation @ Rotation.exp(rng.normal(0, 1e-5 * kind.noise, (len(at.time), 3)))
    noisy = noisy.inverse() if kind.transposed else noisy
    where = (
        at.position + np.array([0.5, 0.1, 0.4]) + rng.normal(0, 5e-6 * kind.noise, (len(at.time), 3))
    ) * kind.position_scale
    return np.column_stack([noisy.quaternion_wxyz(), where])


def _log(at: Kinematics, gravity: np.ndarray) -> MotionLog:
    zero = np.zeros((len(at.time), 6))
    seen = at.rotation.inverse().apply(gravity)
    return MotionLog(zero, seen, at.acceleration, at.angular_velocity, at.angular_acceleration)


def _wrench(rng: np.random.Generator, at: Kinematics, gravity: np.ndarray, kind: Kind) -> np.ndarray:
    exact = _log(at, gravity).predicted(scenarios.body(kind.object).parameters().vector)
    noise = rng.normal(size=exact.shape) * np.repeat([0.003, 0.06], 3) * kind.noise
    bias = np.array([0.4, -0.7, 0.1, 9.0, -1.0, 5.0])
    values = -(exact + bias * (1 + kind.drift * at.time[:, None] / DURATION) + noise)
    values[:, :3] *= kind.torque_scale
    if kind.stuck:
        rows = (at.time > 5) & (at.time < 7)
        values[rows, 4] = values[rows, 4][0]
    if kind.clipped:
        values[:, 5] = np.minimum(values[:, 5], np.quantile(values[:, 5], 0.93))
    return values[:, [3, 4, 5, 0, 1, 2]]


def _imu(rng: np.random.Generator, at: Kinematics, gravity: np.ndarray, kind: Kind) -> np.ndarray:
    arm = np.array([0.03, -0.02, 0.05])
    omega, alpha = at.angular_velocity, at.angular_acceleration
    felt = at.acceleration + np.cross(alpha, arm) + np.cross(omega, np.cross(omega, arm))
    felt = felt - at.rotation.inverse().apply(gravity)
    noise = rng.normal(0, 0.02 * kind.noise, felt.shape)
    own = imu_mount(kind).inverse().apply(felt) + np.array([0.05, -0.1, 0.2]) + noise
    return np.round(own / GRAVITY / 0.000244) * 0.000244


def _with_repeats(rng: np.random.Generator, table: np.ndarray, stamps: str) -> np.ndarray:
    rows = len(table)
    index = np.sort(np.concatenate([np.arange(rows), rng.choice(rows, int(0.43 * rows), replace=False)]))
    out = table[index]
    if stamps == "new":
        out[np.diff(index, prepend=-1) == 0, 0] += 0.4 * np.median(np.diff(table[:, 0]))
    return out


def _save(path: Path, table: np.ndarray) -> None:
    names = ",".join(["t", *(f"c{i}" for i in range(table.shape[1] - 1))])
    row = ",".join(["%.9g"] * table.shape[1]) + "\n"
    path.write_text(f"{names}\n" + row * len(table) % tuple(table.ravel().tolist()))  # savetxt takes twice as long


def _description(kind: Kind) -> str:
    mount = (
        ""
        if kind.imu_turned
        else (
            'mount = { rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix", position = [0.03, -0.02, 0.05], unit = "m" }'
        )
    )
    position = 'position = { columns = ["c4", "c5", "c6"], unit = "m" }' if kind.with_position else ""
    declared = "" if kind.declared_force is None else f"[noise]\nforce = {kind.declared_force}\n"
    return f"""
[log]
gravity = {list(map(float, kind.gravity))}
wrench = "{"on-object" if kind.sign_flipped else "on-sensor"}"
{declared}
[[stream]]
path = "wrench.csv"
time = {{ columns = ["t"], unit = "s" }}
force = {{ columns = ["c0", "c1", "c2"], unit = "N" }}
torque = {{ columns = ["c3", "c4", "c5"], unit = "N*m" }}

[[stream]]
path = "pose.csv"
time = {{ columns = ["t"], unit = "s" }}
rotation = {{ columns = ["c0", "c1", "c2", "c3"], form = "{FORMS[not kind.quaternion_swapped]}" }}
{position}

[[stream]]
path = "imu.csv"
time = {{ columns = ["t"], unit = "s" }}
specific_force = {{ columns = ["c0", "c1", "c2"], unit = "{"m/s^2" if kind.accelerometer_in_g else "g"}" }}
{mount}
"""
