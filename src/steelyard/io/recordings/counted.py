"""Columns that are counted, as those of an array are (`wrench[0]`, `tcp_pose_0`): what their number and numbers tell.

Three are x, y, z; six of a wrench are force, then torque; nine of a rotation are its rows; sixteen are a pose as a
4 x 4 matrix, row by row or column by column, which its own last row shows. Four may be a quaternion of either order,
six or seven a pose: those only a description can tell.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.io.rotations import matrix_order
from steelyard.io.streams.usual_names import WANTED, Names, matrix_parts
from steelyard.io.tables.files import Table

_COUNTED = re.compile(r"(.+)_(\d+)")
_WRENCHES = ("wrench", "ft", "force_torque", "ft_data", "ft_wrench", "forcetorque")
_MATRICES = {"r", "rot", "rotation", "rotmat", "orientation", "ori", "xmat", "mat", "matrix"}
_QUATERNIONS = {"q", "quat", "quats", "quaternion", "quaternions", "orientation", "rotation", "ori", "rot"}
_OTHERS = {"d", "c", "cam", "camera", "object", "obj", "marker", "tag"}  # what is commanded (Franka), or no sensor
_JOINTS = {"q", "joint", "joints", "qpos", "angles", "jointpositions"}
_JOINT_STEMS = ("q", "j", "joint", "joint_", "a")
_TORQUE_OF_JOINT = re.compile(r"(.*(?:tau|torques?|trq|efforts?).*?)_?(\d)")
_POSES = {"pose", "poses", "tcp", "ee", "eef", "position", "transform"}
# Words of what is neither a pose nor an angle, although tool or joints have it: `actual_TCP_force`, `tcp_speed`.
_NO_PLACE = {
    *("force", "forces", "torque", "torques", "moment", "moments", "wrench", "ft", "effort", "efforts", "output"),
    *("speed", "speeds", "vel", "velocity", "velocities", "twist", "acc", "accel", "acceleration", "accelerations"),
    *("current", "currents", "voltage", "voltages", "temperature", "temperatures", "mode", "offset", "error", "errors"),
}


def counted(plain: Mapping[str, int]) -> dict[str, tuple[int, ...]]:
    """Return name -> numbers of the columns called name_0, name_1 .. without a gap."""
    runs: dict[str, dict[int, int]] = {}
    for name, number in plain.items():
        if found := _COUNTED.fullmatch(name):
            runs.setdefault(found[1], {})[int(found[2])] = number
    return {
        name: tuple(run[k] for k in range(len(run))) for name, run in runs.items() if set(run) == set(range(len(run)))
    }


def part_names(table: Table, runs: Mapping[str, tuple[int, ...]]) -> dict[str, int]:
    """Return usual names for the parts of counted columns: force_0 -> force_x .., wrench_3 -> wrench_torque_x."""
    out: dict[str, int] = {}
    for name, run in runs.items():
        simple = name.removesuffix("_sensor")
        if "position" in simple:  # which is in W anyway; a force in the axes of W is none in those of S
            simple = simple.removesuffix("_world")
        if len(run) == 3:
            out |= dict(zip(_vector(simple), run, strict=True))
        elif len(run) == 6 and any(f"_{simple}".endswith(f"_{wrench}") for wrench in _WRENCHES):
            out |= dict(zip([*_vector(f"{simple}_force"), *_vector(f"{simple}_torque")], run, strict=True))
        elif len(run) == 9 and _MATRICES & set(simple.split("_")):
            out |= dict(zip(matrix_parts(simple), run, strict=True))
        elif len(run) == 16 and not (WANTED | _OTHERS) & set(name.split("_")):
            out |= _pose(simple, run, values(table, run))
    return out


def _vector(name: str) -> list[str]:
    return [f"{name}_{axis}" for axis in "xyz"]


def _pose(name: str, run: Sequence[int], found: Array | None) -> dict[str, int]:
    """Return the names of rotation and position in sixteen columns that hold poses (N, 16); else none."""
    order = None if found is None else matrix_order(found)
    if order is None:
        return {}
    turned = zip(matrix_parts(name), order[:3, :3].ravel(), strict=True)
    placed = zip(_vector(f"{name}_position"), order[:3, 3], strict=True)
    return {part: run[k] for part, k in (*turned, *placed)}


def open_quaternion(names: Names) -> tuple[tuple[int, ...], bool]:
    """Return four columns that are a quaternion by name, and whether its scalar likely stands first; none without.

    They leave the order open. Where they are called q0 .. q3 or q1 .. q4, w usually comes first; more are joints.
    """
    for name, run in names.counted.items():
        if len(run) == 4 and _QUATERNIONS & set(name.split("_")):
            return run, False
    for start in (0, 1):
        found = names.all_of([f"q{start + k}" for k in range(4)], True)
        if found and f"q{start + 4}" not in names.plain:
            return found, True
    return (), False


def joints(names: Names) -> tuple[int, ...]:
    """Return six or seven columns that are the angles of an arm's joints by name; nothing without."""
    for words, run in _six_or_seven(names):
        if _JOINTS & words:
            return run
    found = ([names.plain.get(f"{stem}{start + k}") for k in range(7)] for stem in _JOINT_STEMS for start in (0, 1))
    whole = (tuple(n for n in seven if n is not None) for seven in found if None not in seven[:6])
    return next(whole, ())


def joint_torques(plain: Mapping[str, int]) -> tuple[int, ...]:
    """Return six or seven columns that are torques of an arm's joints by name, counted from 0 or 1; else nothing."""
    runs: dict[str, list[int]] = {}
    for name, number in plain.items():
        if found := _TORQUE_OF_JOINT.fullmatch(name):
            runs.setdefault(found[1], []).append(number)
    return next((tuple(run) for run in runs.values() if len(run) in (6, 7)), ())


def open_pose(names: Names) -> tuple[int, ...]:
    """Return six or seven columns that are a pose by name: a position, then angles or a quaternion; else nothing."""
    return next((run for words, run in _six_or_seven(names) if _POSES & words and not _JOINTS & words), ())


def _six_or_seven(names: Names) -> Iterator[tuple[set[str], tuple[int, ...]]]:
    """Yield the words and numbers of counted columns that may be a pose, or joints, as it was measured."""
    for name, run in names.counted.items():
        words = set(name.split("_"))
        if len(run) in (6, 7) and not (WANTED | _NO_PLACE) & words:
            yield words, run


def values(table: Table, columns: Sequence[int]) -> Array | None:
    """Return the finite rows (N, k) of some columns, None where they are not all numbers of one length."""
    try:
        cells = table.read(sorted(set(map(int, columns))))
    except BadFile:
        return None
    if len({len(column) for column in cells.values()}) != 1:
        return None
    rows = np.stack([cells[int(n)].astype(np.float64) for n in columns], -1)
    return np.asarray(rows[np.isfinite(rows).all(1)])
