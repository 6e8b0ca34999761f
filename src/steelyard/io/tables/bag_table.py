"""A topic of a bag as a table: one row per message, one column per number in it.

`stamp` is the stamp of the message's header, the time of receipt in topics that have none; `received` the time of
receipt; both in ns since 1970. The others are called as the fields of the message: "wrench.force.x", and "wrench.force"
for the three. Numbers of a list are called by number, "position[0]", or, where the message names them as the state of
joints does, by name, "position[elbow]": then messages of several publishers may hold some of them each.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields, is_dataclass
from itertools import islice
from operator import attrgetter
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription, BadFile, NoDescription
from steelyard.io.bag_example import bag_example
from steelyard.io.bags import TRANSFORMS, Bag, open_bag
from steelyard.io.contents import require_bounded
from steelyard.io.tables.files import Columns, Header

STAMP, RECEIVED = "stamp", "received"
_LOOKED_AT = 500  # messages from the first on that tell what a topic holds: its publishers take turns

Values = np.ndarray[Any, np.dtype[Any]]


@dataclass(frozen=True)
class Field:
    """A field of numbers in a message: its dotted name, and what its numbers are called; nothing where it is one."""

    name: str
    labels: tuple[str, ...] = ()
    named: bool = False

    @property
    def columns(self) -> tuple[str, ...]:
        """The columns that hold it."""
        return tuple(f"{self.name}[{label}]" for label in self.labels) or (self.name,)


@dataclass(frozen=True, eq=False)
class BagTable:
    """One topic of a bag, with the fields that hold numbers."""

    path: Path
    topic: str
    fields: tuple[Field, ...]

    @classmethod
    def open(cls, path: Path, topic: str | None) -> BagTable:
        """Look at the first messages of a topic; raises BadFile, BadDescription or MissingDependency."""
        with open_bag(path) as bag:
            if topic is None:
                raise _which_topic(bag)
            if bag.topic(topic).kind in TRANSFORMS:
                raise BadDescription(
                    f'{path}: topic "{topic}" holds transforms. Say which pose is meant, that of the second frame '
                    'in the first: frames = ["base_link", "tool0"]'
                )
            first = [message for _, message in islice(bag.messages(topic), _LOOKED_AT)]
        if not first:
            raise BadFile(f'{path}: topic "{topic}" holds no messages. Record again.')
        return cls(path, topic, (Field(STAMP), Field(RECEIVED), *_fields_of(first)))

    @property
    def header(self) -> Header:
        """Its columns: every number of every field, and groups for vectors, quaternions and lists."""
        names: list[str] = []
        groups: dict[str, tuple[int, ...]] = {}
        for field in self.fields:
            start, vector = len(names), field.name.rpartition(".")[0]
            names += field.columns
            if field.labels:
                groups[field.name] = tuple(range(start, len(names)))
            elif vector:
                groups[vector] = (*groups.get(vector, ()), start)
        return Header(tuple(names), len(names), groups)

    def read(self, columns: Sequence[int], exact: Sequence[int] = ()) -> Columns:
        """Return columns by number, float64; those in `exact` stay int64. Raises BadFile where messages differ.

        Messages that name none of the numbers asked for are left out; numbers that others do not name are NaN.
        """
        places = [(field, inner) for field in self.fields for inner in range(len(field.columns))]
        wanted = list(dict.fromkeys(places[n][0] for n in columns))
        with open_bag(self.path) as bag:
            require_bounded(self.path, 8 * sum(len(f.columns) for f in wanted) * bag.topic(self.topic).count)
            values = self._values(bag, wanted)
        out = {n: values[places[n][0]][:, places[n][1]] for n in columns}
        named = [np.isnan(out[n]) for n in columns if places[n][0].named]
        kept = ~np.logical_and.reduce(named) if named else slice(None)
        return {
            n: column[kept].astype(np.int64 if n in exact and column.dtype.kind in "iu" else np.float64)
            for n, column in out.items()
        }

    def _values(self, bag: Bag, wanted: Sequence[Field]) -> dict[Field, Values]:
        """Return the numbers (N, k) of each field, one row per message."""
        rows: list[list[Any]] = [[] for _ in wanted]
        takers = [(row, _taker(field)) for row, field in zip(rows, wanted, strict=True)]
        for received, message in bag.messages(self.topic):
            for row, take in takers:
                row.append(take(received, message))
        return {field: self._numbers(field, row) for field, row in zip(wanted, rows, strict=True)}

    def _numbers(self, field: Field, rows: Sequence[Any]) -> Values:
        if field.name == STAMP:
            return stamps_of(np.array(rows, np.int64))
        if field.named:
            return _by_name(rows, field.labels)
        if field.labels and (other := [n for n, row in enumerate(rows, 1) if len(row) != len(field.labels)]):
            raise BadFile(
                f'{self.path}: message {other[0]} of topic "{self.topic}" lists {len(rows[other[0] - 1])} numbers in '
                f'"{field.name}", others {len(field.labels)}. Record one publisher alone, or export the topic to CSV.'
            )
        return np.array(rows).reshape(len(rows), len(field.columns))


def _taker(field: Field) -> Callable[[int, Any], Any]:
    """Return what takes a field from the time of receipt and the message."""
    if field.name == RECEIVED:
        return lambda received, message: received
    if field.name == STAMP:
        return lambda received, message: (stamp_of(message), received)
    get = attrgetter(field.name)
    return (lambda received, message: (_labels(message), get(message))) if field.named else lambda _, m: get(m)


def stamps_of(both: Values) -> Values:
    """Return stamps (N, 1) from those of headers and receipts (N, 2): the latter where no header has one."""
    return both[:, :1] if both[:, 0].any() else both[:, 1:]


def stamp_of(message: Any) -> int:
    """Return the stamp of a message's header [ns since 1970], 0 where it has none."""
    header = getattr(message, "header", None)
    return 0 if header is None else int(header.stamp.sec) * 10**9 + int(header.stamp.nanosec)


def _by_name(rows: Sequence[tuple[tuple[str, ...], Any]], labels: Sequence[str]) -> Array:
    """Return numbers (N, k) in the order of `labels`, from what each message calls its own; NaN where it has none."""
    out = np.full((len(rows), len(labels)), np.nan)
    place = {label: k for k, label in enumerate(labels)}
    known: dict[tuple[str, ...], tuple[list[int], list[int]]] = {}
    for n, (names, values) in enumerate(rows):
        if len(values) != len(names):
            continue
        if names not in known:
            own = [k for k, name in enumerate(names) if name in place]
            known[names] = own, [place[names[k]] for k in own]
        own, theirs = known[names]
        out[n, theirs] = np.asarray(values)[own]
    return out


def _fields_of(messages: Sequence[Any]) -> list[Field]:
    """Return the fields of numbers that messages hold, with all names that any of them gives."""
    names = tuple(dict.fromkeys(name for message in messages for name in _labels(message)))
    found: dict[str, Field] = {}
    for message in messages:
        own = _labels(message)
        for name, width in _numbers_in(message):
            named = bool(own) and width == len(own)
            labels = names if named else tuple(map(str, range(width)))
            found.setdefault(name, Field(name, labels, named))
    return list(found.values())


def _numbers_in(message: Any, before: str = "") -> Iterator[tuple[str, int]]:
    """Yield dotted names of the fields that hold numbers, and how many they list (0: one number); headers left out."""
    for each in fields(message):
        value, name = getattr(message, each.name), before + each.name
        if each.name == "header":
            continue
        if is_dataclass(value):
            yield from _numbers_in(value, f"{name}.")
        elif isinstance(value, np.ndarray) and value.ndim == 1 and len(value):
            yield name, len(value)
        elif isinstance(value, int | float):
            yield name, 0


def _labels(message: Any) -> tuple[str, ...]:
    """Return what a message calls the numbers of its lists, as the state of joints does."""
    names = getattr(message, "name", None)
    return tuple(map(str, names)) if isinstance(names, list) else ()


def _which_topic(bag: Bag) -> NoDescription:
    return NoDescription(
        f"{bag.path}: a bag needs a description that says which topic is what. {bag.told()} "
        "Write one beside the bag, for example:",
        bag_example(bag),
    )
