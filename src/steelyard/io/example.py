"""An example of a description, in the file's own words where they are known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from steelyard.io.toml_string import toml_string

HEAD = """\
[log]
gravity = [0, 0, -9.81]      # in the world frame W, m/s^2
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
_ATTITUDES = ("rotation", "gravity", "specific_force")
_WIDTH = 8


def columns_text(names: Sequence[str]) -> str:
    """Return the list of names as TOML writes it."""
    return f"[{', '.join(toml_string(name) for name in names)}]"


def example_of(path: str, lines: Mapping[str, str], numbered: bool = False) -> str:
    """Return a description of the file `path`.

    lines     quantity -> its table; of those that are not known the usual one stands, marked as not the file's own
    numbered  the file has no names: its columns are counted
    """
    attitude = next((name for name in _ATTITUDES if name in lines), "rotation")
    rows = [("path", toml_string(path))]
    for name in ("time", "force", "torque", attitude):
        mark = "put your columns here" + (", or leave the line out" if name == "time" else "")
        usual = _NUMBERED[name] if numbered else f"{_USUAL.get(name)}   # {mark}"
        rows.append((name, lines.get(name, usual)))
    if "position" in lines:
        rows.append(("position", lines["position"]))
    return HEAD + "".join(f"{name:{_WIDTH}s} = {text}\n" for name, text in rows)


EXAMPLE = example_of("data.csv", _USUAL)
