"""Units of the log description, each with its factor to SI. The first of a kind is SI and the default."""

from __future__ import annotations

import re

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

_EARTH = (9.76, 9.84)
# What stands between the letters of a unit, or nothing: N*m, N m, N.m, N·m, Nm; m/s^2, m/s2.
_BETWEEN = re.compile(r"[\s*·⋅.^-]")


def local_g(gravity: Array) -> float:
    """Return one g [m/s^2]: the length of `gravity` (3,) where that is found on Earth, else standard gravity.

    An accelerometer that reads 1 g at rest shows the gravity of its place, not 9.80665 m/s^2.
    """
    size = float(np.linalg.norm(gravity))
    return size if _EARTH[0] <= size <= _EARTH[1] else STANDARD_GRAVITY


def spelled(quantity: str, unit: str) -> str:
    """Return the unit of a quantity as it is spelled here: "Nm", "N m" and "N·m" are "N*m". Unknown ones stay."""
    letters = _letters(unit)
    return next((known for known in UNITS[quantity] if _letters(known) == letters), unit)


def _letters(unit: str) -> str:
    return _BETWEEN.sub("", unit.replace("²", "2"))


def factor(quantity: str, unit: str, gravity: Array) -> float:
    """Return the factor from `unit` to SI; `gravity` (3,) [m/s^2] says what one g is."""
    return local_g(gravity) if unit == "g" else UNITS[quantity][unit]
