"""Units of the log description, each with its factor to SI, and what the size of numbers tells of theirs.

The first unit of a kind is SI and the default.
"""

from __future__ import annotations

import re
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.logs.recording import INCH, POUND_FORCE, STANDARD_GRAVITY

TIME: dict[str, int] = {"s": 1, "ms": 1000, "us": 1_000_000, "ns": 1_000_000_000}  # per second, exact

LENGTH: dict[str, float] = {"m": 1.0, "mm": 1e-3}
ANGLE: dict[str, float] = {"rad": 1.0, "deg": float(np.pi / 180)}

# Quantity -> unit -> factor to SI. One "g" depends on the place: see `local_g`.
UNITS: dict[str, dict[str, float]] = {
    "force": {"N": 1.0, "kN": 1e3, "kgf": STANDARD_GRAVITY, "lbf": POUND_FORCE},
    "torque": {"N*m": 1.0, "N*mm": 1e-3, "kgf*m": STANDARD_GRAVITY, "lbf*in": POUND_FORCE * INCH},
    "position": LENGTH,
    "linear_velocity": {"m/s": 1.0},
    "angular_velocity": {"rad/s": 1.0, "deg/s": ANGLE["deg"]},
    "linear_acceleration": {"m/s^2": 1.0, "g": STANDARD_GRAVITY},
    "angular_acceleration": {"rad/s^2": 1.0},
    "specific_force": {"m/s^2": 1.0, "g": STANDARD_GRAVITY},
    "gravity": {"m/s^2": 1.0},
    "joint_position": ANGLE,
    "joint_torque": {"N*m": 1.0, "N*mm": 1e-3},
    "carrying": {"1": 1.0},
}

# Units that are not read: quantity -> letters of the unit -> what to multiply by, and the unit that is then declared.
_OTHERS: dict[str, dict[str, tuple[float, str]]] = {
    "force": {"mN": (1e-3, "N"), "daN": (10, "N"), "gf": (1e-3, "kgf"), "ozf": (1 / 16, "lbf"), "klbf": (1e3, "lbf")},
    "torque": {
        "Ncm": (0.01, "N*m"),
        "mNm": (1e-3, "N*m"),
        "cNm": (0.01, "N*m"),
        "kNm": (1e3, "N*m"),
        "kgfcm": (0.01, "kgf*m"),
        "kgfmm": (1e-3, "kgf*m"),
        "lbfft": (12, "lbf*in"),
        "ftlbf": (12, "lbf*in"),
        "ozfin": (1 / 16, "lbf*in"),
    },
    "position": {"cm": (0.01, "m"), "in": (INCH, "m"), "inch": (INCH, "m")},
    "linear_velocity": {"mm/s": (1e-3, "m/s"), "cm/s": (0.01, "m/s")},
}
# Pounds or kilograms that mean forces, and plurals.
_LOOSE = re.compile("[fs]")

_EARTH = (9.76, 9.84)
# A unit in brackets behind a name; a number there is an index.
_IN_BRACKETS = re.compile(r"[\[(]\s*(?!\d+\s*[\])])([^\])]*?)\s*[\])]\s*$")
_AXES = ("x", "y", "z", "roll", "pitch", "yaw")
# What stands behind an axis for a unit, the longest first: Fx_N, tau_z_Nm, tau_z_N_m, pos_x_mm, acc_y_m_s2, roll_deg.
_BEHIND_AXIS = {
    f"_{unit.replace('*', joint).replace('/', '_').replace('^', '')}": unit
    for unit in sorted({unit for units in UNITS.values() for unit in units} - {"1"}, key=len, reverse=True)
    for joint in ("_", "")
}
# What stands between the letters of a unit, or nothing: N*m, N m, N.m, N·m, Nm; m/s^2, m/s2.
_BETWEEN = re.compile(r"[\s*·⋅.^-]")

_EPOCH = (1e9, 1e10)  # [s] stamps since 1970 lie here from 2001 to 2286
SLOWEST = 10.0  # [s] longer steps than this are not seconds
_ONE_G = (0.8, 1.25)  # size of an accelerometer reading in g
_GRAVITY = (9.7, 9.9)
_SPECIFIC_FORCE = (8.0, 12.0)
_FURTHEST = 20.0  # [m] beyond this no arm reaches


def local_g(gravity: Array) -> float:
    """Return one g [m/s^2]: the length of `gravity` (3,) where that is found on Earth, else standard gravity.

    An accelerometer that reads 1 g at rest shows the gravity of its place, not 9.80665 m/s^2.
    """
    size = float(np.linalg.norm(gravity))
    return size if _EARTH[0] <= size <= _EARTH[1] else STANDARD_GRAVITY


def apart(name: str) -> tuple[str, str]:
    """Return the name of a column and the unit behind it, "" where there is none: "Fx [N]", "Fx_N"."""
    if found := _IN_BRACKETS.search(name):
        return name[: found.start()], found.group(1)
    for ending, unit in _BEHIND_AXIS.items():
        if name.endswith(ending) and name.removesuffix(ending).lower().endswith(_AXES):
            return name.removesuffix(ending), unit
    return name, ""


def spelled(quantity: str, unit: str) -> str:
    """Return the unit of a quantity as it is spelled here: "Nm", "N m" and "N·m" are "N*m". Unknown ones stay."""
    letters = _letters(unit)
    return next((known for known in UNITS.get(quantity, ()) if _letters(known) == letters), unit)


def instead(quantity: str, unit: str) -> str:
    """Return ' ..' on what to do about a unit that is not read, or nothing: no unit of another size is suggested."""
    how = converted(quantity, unit)
    if how:
        return f" {how[0].upper()}{how[1:]}."
    loose = _LOOSE.sub("", _letters(unit))
    near = (known for known in UNITS[quantity] if _LOOSE.sub("", _letters(known)).lower() == loose.lower())
    return next((f' Did you mean "{known}"?' for known in near), "")


def converted(quantity: str, unit: str) -> str:
    """Return how to write numbers of a unit that is not read in one that is; nothing for a unit that nobody uses."""
    loose = _LOOSE.sub("", _letters(unit))
    others = _OTHERS.get(quantity, {}).items()
    times, known = next((to for other, to in others if _LOOSE.sub("", other) == loose), (0.0, ""))
    return f'multiply its numbers by {times:g} and declare "{known}"' if known else ""


def _letters(unit: str) -> str:
    return _BETWEEN.sub("", unit.replace("²", "2"))


def factor(quantity: str, unit: str, gravity: Array) -> float:
    """Return the factor from `unit` to SI; `gravity` (3,) [m/s^2] says what one g is."""
    return local_g(gravity) if unit == "g" else UNITS[quantity][unit]


def unit_by_size(quantity: str, values: Array) -> str | None:
    """Return SI; an accelerometer shows whether it counts in g, and gravity that it is gravity."""
    size = median_size(values) if len(values) else 0.0
    if quantity == "specific_force" and _ONE_G[0] < size < _ONE_G[1]:
        return "g"
    low, high = {"specific_force": _SPECIFIC_FORCE, "gravity": _GRAVITY}.get(quantity, (-1.0, np.inf))
    return next(iter(UNITS[quantity])) if low < size < high or not np.isfinite(size) else None


def median_size(values: Array) -> float:
    """Return the median length of the rows of (N, 3) that hold numbers; NaN where none does."""
    sizes = np.linalg.norm(values[np.isfinite(values).all(-1)], axis=-1)
    return float(np.median(sizes)) if len(sizes) else float("nan")


def length_unit(values: Array | None) -> str:
    """Return mm for positions (N, 3) that no arm reaches in metres, else m."""
    return "mm" if values is not None and len(values) and median_size(values) > _FURTHEST else "m"


def angle_unit(values: Array | None) -> str | None:
    """Return deg for angles (N, 3) beyond a turn in rad, rad for others; None without any that is not zero.

    Degrees that never leave seven would hardly turn what is to be identified.
    """
    if values is None or not values.any():
        return None
    return "deg" if float(np.abs(values).max()) > 2 * np.pi else "rad"


def stamp_unit(stamps: np.ndarray[Any, np.dtype[Any]]) -> tuple[str | None, float]:
    """Return the unit of stamps (N,) since 1970, None of others; and their median step as they are."""
    known = stamps.astype(np.float64)
    known = known[np.isfinite(known)]
    step = float(np.median(np.diff(known))) if len(known) > 1 else 0.0
    since = [unit for unit, per_second in TIME.items() if len(known) and _EPOCH[0] < known[0] / per_second < _EPOCH[1]]
    return next(iter(since), None), step
