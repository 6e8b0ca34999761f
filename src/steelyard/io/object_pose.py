"""Where the object sits in the sensor: the one entry that shapes need, in a description or on its own."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from steelyard.errors import BadDescription, BadInput
from steelyard.io.documents import load_toml, parse_toml
from steelyard.io.entries import Entry
from steelyard.io.streams.entries import parse_pose
from steelyard.spatial import Pose

_EXAMPLE = '{ position = [0, 0, 0.12], unit = "m", rotation = [1,0,0, 0,1,0, 0,0,1], form = "matrix" }'

_STD = ("std_mm", "std_deg")


@dataclass(frozen=True, eq=False)
class ObjectPose:
    """Pose of the scan's frame O in the sensor frame S, and its spread.

    pose  X_SO
    std   (position [m], rotation [rad]), None where nothing says
    """

    pose: Pose
    std: tuple[float, float] | None = None


def parse_object_pose(entry: Entry) -> ObjectPose | None:
    """Return what `pose_in_sensor` of an [object] section says, None where it is not there; raises BadDescription."""
    entry.only("pose_in_sensor")
    if "pose_in_sensor" not in entry:
        return None
    table = entry.table("pose_in_sensor")
    rotation, position = parse_pose(table, *_STD)
    if rotation is None or position is None:
        raise table.error('give both "rotation" and "position".')
    return ObjectPose(Pose(rotation, position), _std(table))


def _std(table: Entry) -> tuple[float, float] | None:
    """Return the standard deviations [m], [rad], both zero where the pose is exact; None where nothing says."""
    given = [key for key in _STD if key in table]
    if not given:
        return None
    for key in _STD:
        if key not in table:
            raise table.error(
                f'"{key}" is missing beside "{given[0]}". Give both, 0 where the pose is exact, or neither.'
            )
    mm, deg = (table.spread(key) for key in _STD)
    return mm * 1e-3, float(np.radians(deg))


def read_object_pose(text: str) -> ObjectPose:
    """Return the pose that `text` gives: a TOML file with an [object] section, or the inline table itself.

    Raises BadDescription.
    """
    written = text.strip()
    try:
        if not written.startswith("{"):
            top = load_toml(Path(written))
        else:
            top = {"object": parse_toml(f"pose_in_sensor = {written}", "the table given")}
    except BadInput as error:
        raise BadDescription(f"pose in sensor: {error} Give a TOML file with [object], or {_EXAMPLE}") from None
    section = top.get("object", {})
    found = parse_object_pose(Entry(section if isinstance(section, dict) else {}, "pose in sensor, [object]"))
    if found is None:
        raise BadDescription(
            f"pose in sensor: {text} has no [object] pose_in_sensor. Write pose_in_sensor = {_EXAMPLE}"
        )
    return found
