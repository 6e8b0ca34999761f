"""The pose of one frame in another, from the transforms of a bag (/tf and /tf_static), as a table.

Its columns are `stamp` [ns since 1970], "position" in three and "rotation" in four, a quaternion xyzw. Where several
transforms lie between the frames, rows are those of the one that comes most often; others are interpolated to it, but
for where one went on unseen. Where no transform of a topic has a stamp, its time of receipt is taken.
"""

from __future__ import annotations

from array import array
from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Integers, Mask
from steelyard.errors import BadDescription, BadFile, BadValue
from steelyard.io.bags import TRANSFORMS, Bag, open_bag
from steelyard.io.contents import require_bounded
from steelyard.io.entries import listed
from steelyard.io.rotations import NORM, rotation_of
from steelyard.io.streams.channels import MOST_MISSING
from steelyard.io.tables.bag_table import STAMP, stamps_of
from steelyard.io.tables.files import Columns, Header
from steelyard.logs.holes import unknown_motion
from steelyard.logs.intervals import inside
from steelyard.logs.recording import Stream
from steelyard.spatial import Pose, Rotation

_NAMES = (STAMP, *(f"position.{axis}" for axis in "xyz"), *(f"rotation.{part}" for part in "xyzw"))
_HEADER = Header(_NAMES, len(_NAMES), {"position": (1, 2, 3), "rotation": (4, 5, 6, 7)})


@dataclass(frozen=True, eq=False)
class Link:
    """The poses (N,) of a frame in its parent at its stamps (N,), one alone where it is fixed."""

    stamps: Integers
    poses: Pose
    fixed: bool

    def unseen(self, stamps: Integers) -> Mask:
        """Return which of stamps (N,) lie where the frame went on and no transform of it came for long."""
        if self.fixed:
            return np.zeros(len(stamps), np.bool_)
        places = {"rotation": self.poses.rotation.matrix, "position": self.poses.position}
        start = self.stamps[0]  # seconds since then are exact enough as floats
        return inside(1e-9 * (stamps - start), unknown_motion(Stream("", places, 1e-9 * (self.stamps - start))))

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
class Heard:
    """What a topic says of one frame in one parent, message by message: stamps and receipts, positions and turns."""

    times: array[int] = field(default_factory=lambda: array("q"))
    poses: array[float] = field(default_factory=lambda: array("d"))

    def add(self, each: Any, received: int) -> None:
        """Note one transform."""
        stamp, place, turn = each.header.stamp, each.transform.translation, each.transform.rotation
        self.times.extend((stamp.sec * 10**9 + stamp.nanosec, received))
        self.poses.extend((place.x, place.y, place.z, turn.x, turn.y, turn.z, turn.w))

    def link(self, fixed: bool) -> Link:
        """Return the link in the order of time: of transforms with one stamp the first, of fixed ones the last.

        Single transforms without a turn are left out, as tf2 does; where they are many, BadValue names one.
        """
        values = np.array(self.poses).reshape(-1, 7)
        times = np.array(self.times).reshape(-1, 2)
        sound = np.isfinite(values).all(1) & (np.abs(np.linalg.norm(values[:, 3:], axis=1) - 1) <= NORM)
        if sound.mean() >= 1 - MOST_MISSING:
            values, times = values[sound], times[sound]
        stamps, index = np.unique(stamps_of(times)[:, 0], return_index=True)
        values = values[-1:] if fixed else values[index]
        return Link(stamps, Pose(rotation_of(values[:, 3:], "quaternion-xyzw"), values[:, :3]), fixed)


# Frame -> parent -> what was heard of the frame in it, and whether it is fixed.
Transforms = Mapping[str, Mapping[str, tuple[Heard, bool]]]


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
            told = bag.topic(topic)
        if told.kind not in TRANSFORMS:
            raise BadDescription(f'{path}: "frames" belongs to transforms; topic "{topic}" holds {told.kind}.')
        if not told.count:
            raise BadFile(f'{path}: topic "{topic}" holds no messages. Record again.')
        return cls(path, topic, frames)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number; raises BadFile where no transforms lead from one frame to the other."""
        with open_bag(self.path) as bag:
            heard = _heard(bag, self.topic)
        down, up = self._ways(heard)
        links = {frame: self._link(heard, frame) for frame in (*down, *up)}
        stamps = self._stamps(list(links.values()))
        pose = _along(links, up, stamps).inverse() @ _along(links, down, stamps)
        quaternion = np.roll(pose.rotation.quaternion_wxyz(), -1, -1)
        out: Columns = {0: stamps if 0 in exact else stamps.astype(np.float64)}
        out |= dict(enumerate(np.concatenate([pose.position, quaternion], 1).T, 1))
        return {n: out[n] for n in columns}

    def _ways(self, heard: Transforms) -> tuple[list[str], list[str]]:
        """Return the frames whose links lead down to the second frame, and to the first, from what both hang on."""
        first, second = (_line(heard, frame) for frame in self.frames)
        shared = next((frame for frame in second if frame in first), None)
        if shared is None:
            for frame in (*second, *first):
                if len(parents := list(heard.get(frame, ()))) > 1:
                    raise BadFile(f'{self.path}: frame "{frame}" has two parents, "{parents[0]}" and "{parents[1]}".')
            known = sorted({*heard, *(parent for parents in heard.values() for parent in parents)})
            raise BadFile(
                f'{self.path}: no transforms lead from "{self.frames[0]}" to "{self.frames[1]}". '
                f"Frames here: {listed(known)}."
            )
        return second[: second.index(shared)][::-1], first[: first.index(shared)][::-1]

    def _link(self, heard: Transforms, frame: str) -> Link:
        ((parent, (told, fixed)),) = heard[frame].items()
        try:
            return told.link(fixed)
        except BadValue as error:
            raise BadFile(f'{self.path}: transforms of "{frame}" in "{parent}": {error}') from None

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
        seen = (stamps >= start) & (stamps <= end)
        shared: Integers = stamps[seen & ~np.logical_or.reduce([link.unseen(stamps) for link in moving])]
        if not len(shared):
            raise BadFile(
                f'{self.path}: transforms between "{self.frames[0]}" and "{self.frames[1]}" have no time in common.'
            )
        return shared


def _line(heard: Transforms, frame: str) -> list[str]:
    """Return a frame, its parent, the parent of that, and so on, up to one that has none or several."""
    line = [frame]
    while len(parents := list(heard.get(line[-1], ()))) == 1 and parents[0] not in line:
        line.append(parents[0])
    return line


def _along(links: Mapping[str, Link], frames: Sequence[str], stamps: Integers) -> Pose:
    """Return the pose (N,) of the last frame in the parent of the first."""
    return reduce(lambda pose, frame: pose @ links[frame].at(stamps), frames, Pose.identity(len(stamps)))


def _heard(bag: Bag, topic: str) -> Transforms:
    """Return what a topic of transforms says, and the one beside it of those that are fixed."""
    names = [each.name for each in bag.topics]
    beside = f"{topic}_static" if f"{topic}_static" in names else "/tf_static"
    out: dict[str, dict[str, tuple[Heard, bool]]] = {}
    for name in (beside, topic) if beside in names and beside != topic else (topic,):
        require_bounded(bag.path, 128 * bag.topic(name).count)
        own: defaultdict[tuple[str, str], Heard] = defaultdict(Heard)
        for received, message in bag.messages(name):
            for each in message.transforms:
                own[each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/")].add(each, received)
        for (child, parent), told in own.items():
            out.setdefault(child, {})[parent] = told, name.endswith("_static")
    return out
