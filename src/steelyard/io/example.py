"""An example of a description, in words of the file where they are known."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

# Left open: a number that nobody looked up would be taken as exact, and the bars would not hold the place.
GRAVITY_LINE = (
    "# gravity = [0, 0, -9.81]    # that of your place, in the world frame W, m/s^2; else bars hold 0.15 % for it"
)

HEAD = f"""\
[log]
{GRAVITY_LINE}
wrench  = "on-sensor"        # or "on-object": what the robot applies to the object

[[stream]]
"""
_USUAL = {
    "time": '{ columns = ["t"], unit = "s" }',
    "force": '{ columns = ["fx", "fy", "fz"], unit = "N" }',
    "torque": '{ columns = ["tx", "ty", "tz"], unit = "N*m" }',
    "rotation": '{ columns = ["qw", "qx", "qy", "qz"], form = "quaternion-wxyz" }   # S to W',
}
_NUMBERED = {
    "time": '{ columns = [0], unit = "s" }   # columns are counted from 0',
    "force": '{ columns = [1, 2, 3], unit = "N" }',
    "torque": '{ columns = [4, 5, 6], unit = "N*m" }',
    "rotation": '{ columns = [7, 8, 9, 10], form = "quaternion-wxyz" }   # S to W',
}
_ELSE = {"time": ", or leave the line out", "rotation": "; those of another file in a [[stream]] of its own"}
_ATTITUDES = ("rotation", "gravity", "specific_force", "joint_position")
_FIRST_BEYOND = {"time": 1, "force": 4, "torque": 7, "rotation": 11}
_ROBOT = """
[robot]
urdf        = "arm.urdf"     # put the file of your arm here
sensor_link = "tool0"        # S: a link at the sensor's origin, along its axes
"""
_WIDTH = 8


def toml_string(text: str) -> str:
    """Return a text in quotes, as a TOML file in UTF-8 holds it."""
    # TOML knows no surrogate pairs, and takes no delete character as it is.
    return json.dumps(text, ensure_ascii=False).replace("\x7f", "\\u007F")


def lines_of(rows: Mapping[str, str]) -> str:
    """Return the lines of a section, key and value."""
    return "".join(f"{name:{_WIDTH}s} = {text}\n" for name, text in rows.items())


def columns_text(names: Sequence[str]) -> str:
    """Return the list of names as TOML writes it."""
    return f"[{', '.join(toml_string(name) for name in names)}]"


def example_of(path: str, lines: Mapping[str, str], count: int | None = None) -> str:
    """Return a description of the file `path`.

    lines  quantity -> its table; of those that are not known the usual one stands, marked as not the file's own
    count  of the columns where the file has no names: they are called by number
    """
    attitude = next((name for name in _ATTITUDES if name in lines), "rotation")
    rows = {"path": toml_string(path)}
    for name in ("kind" if "kind" in lines else "time", "force", "torque", attitude):
        mark = "put your columns here" + _ELSE.get(name, "")
        usual = f"{_USUAL.get(name)}   # {mark}"
        if count is not None:
            usual = _NUMBERED[name] if _FIRST_BEYOND[name] <= count and not lines else f"{_NUMBERED[name]}   # {mark}"
        rows[name] = lines.get(name, usual)
    rows |= {name: text for name, text in lines.items() if name == "position"}
    robot = _ROBOT if attitude == "joint_position" else ""
    return HEAD + lines_of(rows) + robot


EXAMPLE = example_of("data.csv", _USUAL)
