"""The pose of one frame in another, from the transforms of a bag (/tf and /tf_static), as a table.

Its columns are `stamp` [ns since 1970], "position" in three and "rotation" in four, a quaternion xyzw. Where several
transforms lie between the frames, rows are those of the one that comes most often; others are interpolated to it.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io.bag_table import STAMP, TRANSFORMS
from steelyard.io.bags import Bag, open_bag
from steelyard.io.entries import listed
from steelyard.io.rotations import rotation_of
from steelyard.io.table_header import Columns, Header
from steelyard.spatial import Pose, Rotation

_NAMES = (STAMP, *(f"position.{axis}" for axis in "xyz"), *(f"rotation.{part}" for part in "xyzw"))
_HEADER = Header(_NAMES, len(_NAMES), {"position": (1, 2, 3), "rotation": (4, 5, 6, 7)})


@dataclass(frozen=True, eq=False)
class Link:
    """The poses (N,) of a frame in its parent at its stamps (N,), one alone where it is fixed."""

    parent: str
    stamps: Integers
    poses: Pose
    fixed: bool

    def at(self, stamps: Integers) -> Pose:
        """Return the poses at stamps within its own; between two of them it turns and moves evenly."""
        if self.fixed or np.array_equal(stamps, self.stamps):
            return self.poses
        late = np.clip(np.searchsorted(self.stamps, stamps), 1, len(self.stamps) - 1)
        before, after = self.poses[late - 1], self.poses[late]
        share = ((stamps - self.stamps[late - 1]) / (self.stamps[late] - self.stamps[late - 1]))[:, None]
        turn = before.rotation @ Rotation.exp(share * (before.rotation.inverse() @ after.rotation).log())
        return Pose(turn, before.position + share * (after.position - before.position))


@dataclass(frozen=True, eq=False)
class TransformTable:
    """The pose of the second of two `frames` in the first, from a topic of transforms."""

    path: Path
    topic: str
    frames: tuple[str, str]
    header: Header = _HEADER

    @classmethod
    def open(cls, path: Path, topic: str, frames: tuple[str, str]) -> TransformTable:
        """Look for the topic; raises BadFile, BadDescription or MissingDependency."""
        with open_bag(path) as bag:
            kind = bag.topic(topic).kind
        if kind != TRANSFORMS:
            raise BadDescription(f'{path}: "frames" belongs to transforms; topic "{topic}" holds {kind}.')
        return cls(path, topic, frames)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile where no transforms lead from one frame to the other."""
        with open_bag(self.path) as bag:
            links = _links(bag, self.topic)
        down, up = self._ways(links)
        stamps = self._stamps([links[frame] for frame in (*down, *up)])
        pose = _along(links, up, stamps).inverse() @ _along(links, down, stamps)
        quaternion = np.roll(pose.rotation.quaternion_wxyz(), -1, -1)
        out: Columns = {0: stamps if 0 in exact else stamps.astype(np.float64)}
        out |= dict(enumerate(np.concatenate([pose.position, quaternion], 1).T, 1))
        return {n: out[n] for n in columns}

    def _ways(self, links: Mapping[str, Link]) -> tuple[list[str], list[str]]:
        """Return the frames whose links lead down to the second frame, and to the first, from what both hang on."""
        first, second = (_line(links, frame) for frame in self.frames)
        shared = next((frame for frame in second if frame in first), None)
        if shared is None:
            known = sorted({*links, *(link.parent for link in links.values())})
            raise BadFile(
                f'{self.path}: no transforms lead from "{self.frames[0]}" to "{self.frames[1]}". '
                f"Frames here: {listed(known)}."
            )
        return second[: second.index(shared)][::-1], first[: first.index(shared)][::-1]

    def _stamps(self, links: Sequence[Link]) -> Integers:
        """Return the stamps (N,) at which all links along the way are known."""
        moving = [link for link in links if not link.fixed]
        if not moving:
            raise BadFile(
                f'{self.path}: "{self.frames[1]}" does not move in "{self.frames[0]}": all transforms between them are '
                "fixed. Name the base and the frame of the sensor."
            )
        stamps = max((link.stamps for link in moving), key=len)
        start, end = max(link.stamps[0] for link in moving), min(link.stamps[-1] for link in moving)
        inside: Integers = stamps[(stamps >= start) & (stamps <= end)]
        if not len(inside):
            raise BadFile(
                f'{self.path}: transforms between "{self.frames[0]}" and "{self.frames[1]}" have no time in common.'
            )
        return inside


def _line(links: Mapping[str, Link], frame: str) -> list[str]:
    """Return a frame, its parent, the parent of that, and so on."""
    line = [frame]
    while line[-1] in links and links[line[-1]].parent not in line:
        line.append(links[line[-1]].parent)
    return line


def _along(links: Mapping[str, Link], frames: Sequence[str], stamps: Integers) -> Pose:
    """Return the pose (N,) of the last frame in the parent of the first."""
    return reduce(lambda pose, frame: pose @ links[frame].at(stamps), frames, Pose.identity(len(stamps)))


def _links(bag: Bag, topic: str) -> dict[str, Link]:
    """Return frame -> its link, from a topic of transforms and the one beside it for those that are fixed."""
    names = [each.name for each in bag.topics]
    beside = f"{topic}_static" if f"{topic}_static" in names else "/tf_static"
    links = _links_of(bag, topic, fixed=topic.endswith("_static"))
    return links | _links_of(bag, beside, fixed=True) if beside in names and beside != topic else links


def _links_of(bag: Bag, topic: str, fixed: bool) -> dict[str, Link]:
    rows: defaultdict[tuple[str, str], list[tuple[float, ...]]] = defaultdict(list)
    stamps: defaultdict[tuple[str, str], list[int]] = defaultdict(list)
    for _, message in bag.messages(topic):
        for each in message.transforms:
            frames = each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/")
            place, turn = each.transform.translation, each.transform.rotation
            stamps[frames].append(each.header.stamp.sec * 10**9 + each.header.stamp.nanosec)
            rows[frames].append((place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w))
    children = [child for child, _ in rows]
    if twice := [child for child in children if children.count(child) > 1]:
        raise BadFile(f'{bag.path}: frame "{twice[0]}" has two parents in topic "{topic}". Record one of them.')
    return {
        child: _link(bag, child, parent, stamps[child, parent], rows[child, parent], fixed) for child, parent in rows
    }


def _link(bag: Bag, child: str, parent: str, stamps: Sequence[int], rows: Sequence[Any], fixed: bool) -> Link:
    """Return a link in the order of time; of transforms with one stamp the first counts, of fixed ones the last."""
    values: Array = np.array(rows, np.float64)
    kept, index = np.unique(np.array(stamps, np.int64), return_index=True)
    values = values[-1:] if fixed else values[index]
    try:
        return Link(parent, kept, Pose(rotation_of(values[:, 3:], "quaternion-xyzw"), values[:, :3]), fixed)
    except BadValue as error:
        raise BadFile(f'{bag.path}: transforms of "{child}" in "{parent}": {error}') from None
