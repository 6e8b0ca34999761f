"""Which frames of a bag are the base and the sensor, from its transforms and the headers of its messages."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice
from typing import Any

from steelyard.io.bags import TRANSFORMS, Bag

_BASE, _SENSOR = "base_link", "tool0"  # where the bag tells none
_POSED = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")
_LOOKED_AT = 500  # messages of a topic: publishers of transforms take turns


@dataclass(frozen=True)
class Frames:
    """The frames of the base and of the sensor, and whether the wrench is in the base's axes."""

    base: str
    sensor: str
    felt_in_base: bool


def frames_of(bag: Bag, wrench: str | None) -> Frames:
    """Return the frames beside those of the topic `wrench`.

    The base is the frame that carries the sensor's, "base_link" where that is on the way up. A wrench whose frame is
    the one that poses are told in, and hangs on nothing, is in the base's axes, as some controllers give it.
    """
    felt = next((_frame(message) for _, message in bag.messages(wrench)), "") if wrench else ""
    parent = _parents(bag)
    told = {frame for topic in bag.topics if topic.kind in _POSED for frame in _frames(bag, topic.name)}
    if felt and felt not in parent and felt in {*parent.values(), *told}:
        return Frames(felt, _SENSOR, True)
    line = [felt or _SENSOR]
    while line[-1] in parent and parent[line[-1]] not in line:
        line.append(parent[line[-1]])
    return Frames(_BASE if _BASE in line or len(line) == 1 else line[-1], line[0], False)


def _parents(bag: Bag) -> dict[str, str]:
    """Return the first parent that transforms name of each frame."""
    out: dict[str, str] = {}
    for topic in bag.topics:
        if topic.kind in TRANSFORMS:
            for _, message in islice(bag.messages(topic.name), _LOOKED_AT):
                for each in message.transforms:
                    out.setdefault(each.child_frame_id.lstrip("/"), _frame(each))
    return out


def _frames(bag: Bag, topic: str) -> set[str]:
    return {_frame(message) for _, message in islice(bag.messages(topic), 1)}


def _frame(message: Any) -> str:
    """Return the frame that a message's header names, "" where it has none."""
    return str(getattr(getattr(message, "header", None), "frame_id", "")).lstrip("/")
