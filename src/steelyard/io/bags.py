"""Bags of ROS 1 and ROS 2 (.bag, .mcap, .db3, folders): the one module that imports rosbags (extra `bags`).

Only the message types that rosbags brings along are read, the common ones: a bag's own definitions would be compiled.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from steelyard.errors import BadFile, MissingDependency, SteelyardError
from steelyard.io.contents import read_whole
from steelyard.io.entries import close_match

SUFFIXES = (".mcap", ".bag", ".db3")
TRANSFORMS = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
_METADATA = "metadata.yaml"
_MOST_LISTED = 60
_PACKED_WHOLE = re.compile(rb"compression_mode:\s*[\"']?file", re.IGNORECASE)


@dataclass(frozen=True)
class Topic:
    """One topic of a bag: its message type, as "geometry_msgs/msg/WrenchStamped", and how many messages it holds."""

    name: str
    kind: str
    count: int


@dataclass(frozen=True)
class Bag:
    """A bag that is open for reading."""

    path: Path
    topics: tuple[Topic, ...]
    reader: Any
    types: Any

    def topic(self, name: str) -> Topic:
        """Return a topic by name; raises BadFile listing all."""
        for topic in self.topics:
            if topic.name == name:
                return topic
        names = [topic.name for topic in self.topics]
        raise BadFile(f'{self.path}: there is no topic "{name}".{close_match(name, names)} {self.told()}')

    def told(self) -> str:
        """Return the topics for a message."""
        shown = ", ".join(f"{t.name} ({t.count} {t.kind.rpartition('/')[2]})" for t in self.topics[:_MOST_LISTED])
        return f"Topics here: {shown}{', ..' if len(self.topics) > _MOST_LISTED else '.'}"

    def messages(self, name: str) -> Iterator[tuple[int, Any]]:
        """Yield time of receipt [ns since 1970] and message of a topic, as recorded; raises BadFile."""
        topic = self.topic(name)
        if topic.kind not in self.types.fielddefs:
            raise BadFile(
                f'{self.path}: topic "{name}" holds {topic.kind}, a type of message that is not read. '
                "Export it to a CSV file with its stamps, and name that file in the description."
            )
        ros1 = self.path.suffix.lower() == ".bag"
        decode = self.types.deserialize_ros1 if ros1 else self.types.deserialize_cdr
        connections = [each for each in self.reader.connections if each.topic == name]
        for connection, received, raw in self.reader.messages(connections=connections):
            yield received, decode(raw, connection.msgtype)


def bag_in(folder: Path) -> Path | None:
    """Return a file of a bag in a folder that is none for want of its metadata, None where there is none."""
    return next((each for each in sorted(folder.iterdir()) if each.suffix.lower() in SUFFIXES), None)


def is_bag(path: Path) -> bool:
    """Return whether a path is a bag: a file of one of its kinds, or a folder that a recorder wrote."""
    return path.suffix.lower() in SUFFIXES or (path / _METADATA).exists()


@contextmanager
def open_bag(path: Path) -> Iterator[Bag]:
    """Open a bag; raises BadFile where it is none, or damaged, or MissingDependency."""
    rosbag1, rosbag2, typesys = _rosbags()
    _refuse_packed(path)
    ros1 = path.suffix.lower() == ".bag"
    try:
        types = typesys.get_typestore(typesys.Stores.ROS1_NOETIC if ros1 else typesys.Stores.LATEST)
        for kind in TRANSFORMS:  # those of ROS 1 are not among what rosbags brings along
            if kind not in types.fielddefs:
                types.register(typesys.get_types_from_msg("geometry_msgs/TransformStamped[] transforms", kind))
        with (rosbag1 if ros1 else rosbag2).Reader(path) as reader:
            topics = tuple(Topic(name, str(i.msgtype), int(i.msgcount)) for name, i in sorted(reader.topics.items()))
            yield Bag(path, topics, reader, types)
    except SteelyardError:
        raise
    except Exception as error:  # what a damaged bag raises is as manifold as its damage
        said = f"{type(error).__name__}: {error}" if str(error) else type(error).__name__
        raise BadFile(
            f"{path}: cannot be read as a bag ({said}). What a recorder that was killed leaves, `ros2 bag reindex`, "
            "`mcap recover` or `rosbag reindex` mend; where messages are packed, name the folder, not the file in it."
        ) from None


def _rosbags() -> tuple[Any, Any, Any]:
    try:
        import rosbags.rosbag1
        import rosbags.rosbag2
        import rosbags.typesys
    except ImportError:
        raise MissingDependency.of("rosbags", "bags", "Reading bags") from None
    return rosbags.rosbag1, rosbags.rosbag2, rosbags.typesys


def _refuse_packed(path: Path) -> None:
    """Raise BadFile where the files of a bag are packed as a whole: they would be unpacked elsewhere, at any size."""
    if path.is_dir() and _PACKED_WHOLE.search(read_whole(path / _METADATA)):
        raise BadFile(
            f"{path}: the files of this bag are packed as a whole. Unpack it first: "
            "ros2 bag convert, or zstd -d on the file, which can then be named itself."
        )
