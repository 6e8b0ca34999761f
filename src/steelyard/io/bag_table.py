"""A topic of a bag as a table: one row per message, one column per number in it.

`stamp` is the stamp of the message's header, the time of receipt where it has none; `received` the time of receipt;
both in ns since 1970. The others are called as the fields of the message: "wrench.force.x", and "wrench.force" for the
three. Numbers of a list are called by number, "position[0]", or by the names that the message gives them,
"position[elbow]".
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadDescription, BadFile
from steelyard.io.bag_example import bag_example, first_wrench
from steelyard.io.bags import Bag, open_bag
from steelyard.io.bounds import require_bounded
from steelyard.io.table_header import Columns, Header

STAMP, RECEIVED = "stamp", "received"
TRANSFORMS = "tf2_msgs/msg/TFMessage"


@dataclass(frozen=True)
class Field:
    """A field of a message: its dotted name, and how many numbers it lists; 0 where it is one number."""

    name: str
    width: int = 0

    def getter(self) -> Callable[[int, Any], Any]:
        """Return what takes the field from the time of receipt and the message."""
        if self.name == RECEIVED:
            return lambda received, message: received
        if self.name == STAMP:
            return lambda received, message: stamp_of(message) or received
        get = attrgetter(self.name)
        return lambda received, message: get(message)


@dataclass(frozen=True, eq=False)
class BagTable:
    """One topic of a bag.

    fields  those that hold numbers
    labels  what the message calls the numbers of its lists; none where it does not
    """

    path: Path
    topic: str
    fields: tuple[Field, ...]
    labels: tuple[str, ...]

    @classmethod
    def open(cls, path: Path, topic: str | None) -> BagTable:
        """Look at the first message of a topic; raises BadFile, BadDescription or MissingDependency."""
        with open_bag(path) as bag:
            if topic is None:
                raise _which_topic(bag)
            if bag.topic(topic).kind == TRANSFORMS:
                raise BadDescription(
                    f'{path}: topic "{topic}" holds transforms. Say which pose is meant, that of the second frame '
                    'in the first: frames = ["base_link", "tool0"]'
                )
            first = next(bag.messages(topic), None)
        if first is None:
            raise BadFile(f'{path}: topic "{topic}" holds no messages. Record again.')
        return cls(path, topic, (Field(STAMP), Field(RECEIVED), *_fields(first[1])), _labels(first[1]))

    @property
    def header(self) -> Header:
        """Its columns: every number of every field, and groups for vectors, quaternions and lists."""
        names: list[str] = []
        groups: dict[str, tuple[int, ...]] = {}
        for field in self.fields:
            vector = field.name.rpartition(".")[0]
            start = len(names)
            names += [f"{field.name}[{label}]" for label in self._labels_of(field)] if field.width else [field.name]
            if field.width:
                groups[field.name] = tuple(range(start, len(names)))
            elif vector:
                groups[vector] = (*groups.get(vector, ()), start)
        return Header(tuple(names), len(names), groups)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number, float64; those in `exact` stay int64. Raises BadFile where messages differ."""
        places = [(field, inner) for field in self.fields for inner in range(max(field.width, 1))]
        wanted = list(dict.fromkeys(places[n][0] for n in columns))
        with open_bag(self.path) as bag:
            require_bounded(self.path, 8 * sum(max(f.width, 1) for f in wanted) * bag.topic(self.topic).count)
            arrays = self._arrays(bag, wanted)
        out: Columns = {}
        for n in columns:
            column = arrays[places[n][0]][:, places[n][1]]
            out[n] = column.astype(np.int64 if n in exact and column.dtype.kind in "iu" else np.float64)
        return out

    def _arrays(self, bag: Bag, wanted: Sequence[Field]) -> dict[Field, np.ndarray[Any, np.dtype[Any]]]:
        """Return the values (N, width) of fields, one row per message."""
        getters = [field.getter() for field in wanted]
        listed_too = any(field.width for field in wanted)
        rows: list[list[Any]] = [[] for _ in wanted]
        for number, (received, message) in enumerate(bag.messages(self.topic)):
            if listed_too and _labels(message) != self.labels:
                raise self._unlike(number)
            for row, get in zip(rows, getters, strict=True):
                row.append(get(received, message))
        for field, row in zip(wanted, rows, strict=True):
            if field.width and (other := [n for n, value in enumerate(row) if len(value) != field.width]):
                raise self._unlike(other[0])
        return {f: np.array(row).reshape(len(row), max(f.width, 1)) for f, row in zip(wanted, rows, strict=True)}

    def _labels_of(self, field: Field) -> Sequence[object]:
        return self.labels if len(self.labels) == field.width else range(field.width)

    def _unlike(self, number: int) -> BadFile:
        return BadFile(
            f'{self.path}: message {number} of topic "{self.topic}" does not list what the first does. '
            "Record one publisher alone, or export the topic to CSV."
        )


def stamp_of(message: Any) -> int:
    """Return the stamp of a message's header [ns since 1970], 0 where it has none."""
    header = getattr(message, "header", None)
    return 0 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _fields(message: Any, before: str = "") -> Iterator[Field]:
    """Yield the fields of a message that hold numbers, those of messages within it included; headers left out."""
    for each in fields(message):
        value, name = getattr(message, each.name), before + each.name
        if each.name == "header":
            continue
        if is_dataclass(value):
            yield from _fields(value, f"{name}.")
        elif isinstance(value, np.ndarray) and value.ndim == 1 and len(value):
            yield Field(name, len(value))
        elif isinstance(value, int | float):
            yield Field(name)


def _labels(message: Any) -> tuple[str, ...]:
    """Return what a message calls the numbers of its lists, as the state of joints does."""
    names = getattr(message, "name", None)
    return tuple(map(str, names)) if isinstance(names, list) else ()


def _which_topic(bag: Bag) -> BadDescription:
    wrench = first_wrench(bag.topics)
    felt = next(bag.messages(wrench.name), None) if wrench else None
    sensor = getattr(getattr(felt and felt[1], "header", None), "frame_id", "") or "tool0"
    return BadDescription(
        f"{bag.path}: a bag needs a description that says which topic is what. {bag.told()} "
        f"For example:\n{bag_example(bag.path.name, bag.topics, sensor)}"
    )
