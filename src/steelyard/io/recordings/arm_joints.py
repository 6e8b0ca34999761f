"""An arm out of a URDF file, whose joints' positions become the pose of the sensor in the base."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io.contents import small_text
from steelyard.io.entries import close_match, listed
from steelyard.io.recordings.description import ArmSpec
from steelyard.io.rotations import TURNS
from steelyard.io.streams.entries import QuantitySpec, StreamSpec
from steelyard.io.tables.files import Table, choose_columns, find_file
from steelyard.io.units import ANGLE
from steelyard.logs.recording import Stream
from steelyard.robots.serial import Joint, Kind, SerialArm
from steelyard.spatial import Pose, Rotation

# From so many turning joints on, an arm at work holds one of them beyond 6.3 degrees.
_ARM = 3
_IN_BRACKETS = re.compile(r"\[([^\]]+)\]$")

_LARGEST = 64_000_000
_KINDS: dict[str, Kind] = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed",
}  # fmt: skip


def arm_of(said: ArmSpec, path: Path, data: Path | None) -> SerialArm:
    """Return the arm that the description at `path` names, its URDF sought as data files are; raises BadFile."""
    return read_arm(find_file(said.urdf, path.parent, data, f"{said.where}, urdf"), said.sensor_link, said.base_link)


def with_joints_in_order(spec: StreamSpec, table: Table, arm: SerialArm) -> StreamSpec:
    """Return the stream with one column per joint of the arm, from base to sensor; raises BadDescription."""
    quantities = tuple(
        replace(q, columns=_columns(q, table, arm)) if q.name == "joint_position" else q for q in spec.quantities
    )
    return replace(spec, quantities=quantities)


def posed(spec: StreamSpec, stream: Stream, arm: SerialArm) -> Stream:
    """Return the stream with the positions (N, n) of the arm's joints as `rotation` and `position` of the sensor in W.

    Rows that hold no number hold none afterwards. Raises BadValue where the unit of angles is another.
    """
    quantity = next((q for q in spec.quantities if q.name == "joint_position"), None)
    if quantity is None:
        return stream
    sliding = np.array([joint.kind == "prismatic" for joint in arm.moving])
    positions = stream.channels["joint_position"] / np.where(sliding, ANGLE[quantity.unit], 1.0)
    good: Mask = np.asarray(np.isfinite(positions).all(1))
    turning = [joint.name for joint in arm.moving if joint.kind != "prismatic"]
    _require_likely(quantity, positions[good][:, ~sliding], turning)
    kept = {name: values for name, values in stream.channels.items() if name != "joint_position"}
    return replace(stream, channels=kept | pose_channels(arm.pose(positions[good]), good))


def pose_channels(pose: Pose, good: Mask) -> dict[str, Array]:
    """Return `rotation` (N, 3, 3) and `position` (N, 3) of poses (M,) in the `good` rows (N,), NaN in the others."""
    rotation, position = np.full((len(good), 3, 3), np.nan), np.full((len(good), 3), np.nan)
    rotation[good], position[good] = pose.rotation.matrix, pose.position
    return {"rotation": check.frozen(rotation), "position": check.frozen(position)}


def _columns(spec: QuantitySpec, table: Table, arm: SerialArm) -> tuple[int, ...]:
    """Return the column of each joint: by its name where columns have names of joints, else as they stand."""
    numbers = choose_columns(table.header, spec.columns, None, spec.where)
    names = table.header.names
    labels = [_label(names[n]) for n in numbers] if names else []
    joints = [joint.name for joint in arm.moving]
    found = [_places(joint, labels) for joint in joints]
    if all(len(places) == 1 for places in found) and len({places[0] for places in found}) == len(joints):
        return tuple(numbers[places[0]] for places in found)
    if any(found) or (names and any(label != names[n] for label, n in zip(labels, numbers, strict=True))):
        raise BadDescription(
            f"{spec.where}: columns are named after joints, but not one after each of the arm's: {listed(joints)}. "
            f"Named are {listed(labels)}."
        )
    if len(numbers) != len(joints):
        raise BadDescription(
            f"{spec.where}: the arm has {len(joints)} joints from base to sensor ({listed(joints)}); {len(numbers)} "
            "columns are given. Give theirs in this order, or columns with their names."
        )
    return numbers


def _label(column: str) -> str:
    """Return what a column is called by: "position[elbow]" by "elbow", "q[0]" as it stands."""
    inside = _IN_BRACKETS.search(column)
    return inside.group(1) if inside and not inside.group(1).isdigit() else column


def _places(joint: str, labels: Sequence[str]) -> list[int]:
    """Return which labels are a joint's name; if none is, which hold it beside a prefix or within a path."""
    exact = [k for k, label in enumerate(labels) if label == joint]
    return exact or [k for k, label in enumerate(labels) if joint in label]


def _require_likely(spec: QuantitySpec, angles: Array, joints: Sequence[str]) -> None:
    """Raise BadValue where angles (N, n) [rad] of the turning joints look like another unit."""
    each = np.abs(angles).max(0, initial=0.0)
    largest, beyond = float(each.max(initial=0.0)), each > TURNS
    if beyond.any():
        few = ", ".join(joint for joint, out in zip(joints, beyond, strict=True) if out)
        do = "does" if beyond.sum() == 1 else "do"
        rest = f" Only {few} {do}: where the others are in rad, convert {few} in the file."
        raise BadValue(
            f"{spec.where}: joints turn by up to {largest:.4g} rad, more than two turns. They are probably in degrees: "
            f'set unit = "deg".{"" if beyond.all() else rest}'
        )
    if spec.unit == "deg" and len(angles) and angles.shape[1] >= _ARM and largest <= np.radians(2 * np.pi):
        raise BadValue(
            f"{spec.where}: no joint is ever beyond {np.degrees(largest):.4g} deg. They are probably in radians: "
            'set unit = "rad".'
        )


def read_arm(path: Path, sensor: str, base: str | None = None) -> SerialArm:
    """Return the arm from the link `base`, the root where left out, to the link `sensor`; raises BadFile."""
    before = _before(path)
    links = {*before, *(_link(path, joint, "parent") for joint in before.values())}
    for name in (sensor, base):
        if name is not None and name not in links:
            raise BadFile(f'{path}: there is no link "{name}".{close_match(name, sorted(links))} {_told(links)}')
    chain: list[Joint] = []
    link = sensor
    while link in before and link != base:
        chain.insert(0, _joint(path, before[link]))
        link = _link(path, before[link], "parent")
        if len(chain) > len(before):
            raise BadFile(f'{path}: the joints before link "{sensor}" go round in a circle.')
    if base not in (None, link):
        raise BadFile(f'{path}: link "{sensor}" does not hang on link "{base}", but on "{link}". {_told(links)}')
    if not any(joint.kind != "fixed" for joint in chain):
        raise BadFile(f'{path}: no joint moves link "{sensor}" against "{link}". Name the link of the sensor.')
    return SerialArm(tuple(chain))


def _told(links: set[str]) -> str:
    return f"Links here: {listed(sorted(links))}."


def _before(path: Path) -> Mapping[str, ElementTree.Element]:
    """Return link -> the joint that carries it."""
    try:
        text = small_text(path, "a URDF", "XML", _LARGEST)
    except UnicodeDecodeError:
        raise BadFile(f"{path}: expected a URDF, a text in UTF-8; found a binary file.") from None
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        raise BadFile(f"{path}: defines entities, which no URDF needs and which may unpack to any size. Remove them.")
    if "<xacro:" in text:
        raise BadFile(f"{path}: this is a xacro, not a URDF yet. Write it out first: xacro {path.name} > arm.urdf")
    try:
        root = ElementTree.fromstring(text)
    except ElementTree.ParseError as error:
        raise BadFile(f"{path}: expected a URDF; this is not valid XML ({error}).") from None
    if root.tag != "robot":
        raise BadFile(f"{path}: expected a URDF, whose root is <robot>; found <{root.tag}>.")
    out: dict[str, ElementTree.Element] = {}
    for joint in root.findall("joint"):
        child = _link(path, joint, "child")
        if child in out:
            raise BadFile(f'{path}: joints "{out[child].get("name")}" and "{joint.get("name")}" both carry "{child}".')
        out[child] = joint
    return out


def _link(path: Path, joint: ElementTree.Element, side: str) -> str:
    found = joint.find(side)
    name = None if found is None else found.get("link")
    if name is None:
        raise BadFile(f'{path}: joint "{joint.get("name")}" names no {side} link.')
    return name


def _joint(path: Path, joint: ElementTree.Element) -> Joint:
    name, kind = joint.get("name", ""), joint.get("type", "")
    if kind not in _KINDS:
        raise BadFile(
            f'{path}: joint "{name}" is of type "{kind}". Read are {listed(list(_KINDS))}; name a base_link behind it.'
        )
    if joint.find("mimic") is not None:
        raise BadFile(f'{path}: joint "{name}" mimics another. Name a link before it as the sensor\'s.')
    origin = joint.find("origin")
    placed = Pose(
        Rotation.from_rpy(_three(path, name, origin, "rpy", "0 0 0")), _three(path, name, origin, "xyz", "0 0 0")
    )
    axis = _three(path, name, joint.find("axis"), "xyz", "1 0 0")
    length = float(np.linalg.norm(axis))
    if kind != "fixed" and length == 0:
        raise BadFile(f'{path}: joint "{name}" has an axis of length zero.')
    return Joint(name, _KINDS[kind], placed, axis / (length or 1.0))


def _three(path: Path, joint: str, element: ElementTree.Element | None, key: str, default: str) -> Array:
    said = default if element is None else element.get(key, default)
    try:
        values = np.array([float(word) for word in said.split()])
    except ValueError:
        values = np.zeros(0)
    if values.shape != (3,) or not np.isfinite(values).all():
        raise BadFile(f'{path}: joint "{joint}" needs three numbers as {key}; got "{said}".')
    return values
