"""How one robot's wrench may have been read: a unit, times an order and signs of the axes; and what to say of it.

What wrenches were taken for, where that is not what the log says, is kept with the answer as maps (6, 6): each takes
moment and force as given, in a robot's grasp, to what they are.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.recording import INCH, POUND_FORCE, STANDARD_GRAVITY
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.spatial import signed_axes, signed_columns

# Units taken for newtons: force, and the torque that goes with it, in SI.
_UNITS = {"kgf": (STANDARD_GRAVITY, STANDARD_GRAVITY), "lbf": (POUND_FORCE, POUND_FORCE * INCH), "kN": (1e3, 1e3)}
# As given; what makes newtons of units taken for them; what undoes newtons taken for such units.
_NAMES = ("N", *_UNITS, *["N"] * len(_UNITS))
_SIZES = np.array([(1.0, 1.0), *_UNITS.values(), *((1 / f, 1 / t) for f, t in _UNITS.values())])
AXES = signed_axes()
# Every reading (R, 3, 3) of a force, as it is first, and how many times larger each makes it (R,).
FACTORS = np.repeat(_SIZES[:, 0], len(AXES))
READINGS = FACTORS[:, None, None] * np.tile(AXES, (len(_SIZES), 1, 1))
# The one that turns the sign.
SIGN = int(np.argmin(np.abs(READINGS + np.eye(3)).sum((1, 2))))


@dataclass(frozen=True, eq=False)
class WrenchReading:
    """Reading `number` of the force, and what makes torque of what is given (3, 3)."""

    number: int
    torque: Array

    @property
    def axes(self) -> Array:
        """Order and signs (3, 3) of the force's axes."""
        return np.asarray(AXES[self.number % len(AXES)])

    @property
    def unit(self) -> int:
        """Which unit, 0 for what is given."""
        return self.number // len(AXES)

    def wrench(self) -> Array:
        """Return (6, 6): from torque and force as given to what they are."""
        out = np.zeros((6, 6))
        out[:3, :3], out[3:, 3:] = self.torque, READINGS[self.number]
        return out

    def words(self) -> str:
        """Return what was done to the force."""
        said, size = [], float(_SIZES[self.unit, 0])
        if self.unit:
            unit = next(u for u, (f, _) in _UNITS.items() if np.isclose(max(size, 1 / size), f))
            also = " (or mN as N)" if unit == "kN" else ""
            said.append(f"{unit} read as N" if size > 1 else f"N read as {unit}{also}")
        if self.number % len(AXES):
            axes = zip(("Fx", "Fy", "Fz"), signed_columns(self.axes, "F"), strict=True)
            said.append(", ".join(f"{is_} = {given}" for is_, given in axes if is_ != given))
        return " and ".join(said)

    def remedy(self, name: str) -> str:
        """Return what to change in the description of robot `name`."""
        out, mixed = [], bool(self.number % len(AXES))
        size = abs(float(np.linalg.det(self.torque))) ** (1 / 3)
        turned = bool(np.allclose(self.torque, size * self.axes))
        if self.unit:
            also = "" if np.isclose(size, 1.0) else ', and that of its "torque"'
            out.append(
                f'Set the unit of the "force" of \'{name}\' to what its numbers are in, "{_NAMES[self.unit]}"{also}; '
                'of a robot that gives "joint_torque", that of this, in the same measure.'
            )
        if mixed and turned and np.linalg.det(self.axes) > 0:
            numbers = ", ".join(f"{v:.0f}" for v in self.axes.ravel() + 0.0)
            out.append(f"Give the wrench stream of '{name}' mount = {{ rotation = [{numbers}], form = \"matrix\" }}.")
        elif mixed:
            what = "force and torque" if turned else "force"
            order = ", ".join(signed_columns(self.axes))
            out.append(f"Give the columns of {what} of '{name}' in the order and with the signs {order}.")
        return " ".join(out)


def torques_beside(number: int) -> tuple[WrenchReading, ...]:
    """Return the readings of torque that may go with one of the force; that it is right as given is the first."""
    axes = AXES[number % len(AXES)]
    turned = [np.eye(3), axes, *([-axes] if np.linalg.det(axes) < 0 else [])]
    sizes = dict.fromkeys((1.0, float(_SIZES[number // len(AXES), 1])))
    turned = turned[: 1 if number % len(AXES) == 0 else None]
    return tuple(WrenchReading(number, size * X) for size in sizes for X in turned)


def as_taken(log: TeamLog, maps: Mapping[str, Array]) -> TeamLog:
    """Return the log with wrenches as they were taken."""
    return log.with_recordings(*(r.changed(_mapped, maps) for r in log.recordings))


def in_few_words(taken: Array) -> str:
    """Return what was done to a wrench by its map (6, 6)."""
    torque, force = _words(taken[:3, :3]), _words(taken[3:, 3:])
    if torque == force:
        said = [f"wrench {force}"] if force else []
    else:
        said = [f"{what} {done}" for what, done in (("force", force), ("torque", torque)) if done]
    lever = taken[:3, 3:] @ np.linalg.inv(taken[3:, 3:])
    if lever.any():
        place = ", ".join(f"{1e3 * x:.0f}" for x in (lever[2, 1], lever[0, 2], lever[1, 0]))
        said.append(f"torque from ({place}) mm")
    return ", ".join(said)


def _mapped(track: Track, taken: Array) -> Track:
    there = [(name, rows) for name, rows in (("torque", slice(3)), ("force", slice(3, 6))) if name in track.channels]
    more = {
        name: np.sum([track.channels[other] @ taken[rows, own].T for other, own in there], axis=0)
        for name, rows in there
    }
    return replace(track, channels={**track.channels, **more})


def _words(X: Array) -> str:
    """Return what was done to three axes by their map (3, 3); nothing where they were left."""
    size = abs(float(np.linalg.det(X))) ** (1 / 3)
    axes, said = X / size, []
    if not np.isclose(size, 1.0):
        said.append(f"times {size:.4g}")
    if np.allclose(axes, -np.eye(3)):
        said.append("with its sign turned")
    elif not np.allclose(axes, np.eye(3)):
        said.append(f"with axes ({', '.join(signed_columns(axes))})")
    return " ".join(said)
