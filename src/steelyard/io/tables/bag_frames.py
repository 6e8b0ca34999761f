"""Which frame of a bag is the base: what the sensor's hangs on in the end."""

from __future__ import annotations

from itertools import islice

from steelyard.io.bags import TRANSFORMS, Bag

_USUAL = "base_link"
_LOOKED_AT = 500  # messages of a topic: publishers of transforms take turns


def base_of(bag: Bag, sensor: str) -> str:
    """Return the frame that carries `sensor`, "base_link" where that is on the way up or transforms tell of none."""
    parent: dict[str, str] = {}
    for topic in bag.topics:
        if topic.kind in TRANSFORMS:
            for _, message in islice(bag.messages(topic.name), _LOOKED_AT):
                for each in message.transforms:
                    parent.setdefault(each.child_frame_id.lstrip("/"), each.header.frame_id.lstrip("/"))
    line = [sensor.lstrip("/")]
    while line[-1] in parent and parent[line[-1]] not in line:
        line.append(parent[line[-1]])
    return _USUAL if _USUAL in line or len(line) == 1 else line[-1]
