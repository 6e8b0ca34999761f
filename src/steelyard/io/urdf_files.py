"""Arms out of URDF files: the joints from the base to the link of the sensor."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from xml.etree import ElementTree

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadFile
from steelyard.io.documents import small_text
from steelyard.io.entries import close_match, listed
from steelyard.robots.serial import Joint, Kind, SerialArm
from steelyard.spatial import Pose, Rotation

_LARGEST = 64_000_000
_KINDS: dict[str, Kind] = {
    "revolute": "revolute", "continuous": "revolute", "prismatic": "prismatic", "fixed": "fixed",
}  # fmt: skip


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
