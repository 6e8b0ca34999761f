"""The log description (TOML) as checked values; no data file is opened here."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.io.documents import load_toml
from steelyard.io.entries import Entry
from steelyard.io.example import EXAMPLE
from steelyard.io.object_pose import ObjectPose, parse_object_pose
from steelyard.io.stream_entries import StreamSpec, parse_stream
from steelyard.logs.recording import STANDARD_GRAVITY

# [m/s^2] gravity on anything with robots; and noise of no sensor, in SI.
_WEAKEST, _STRONGEST = 0.1, 100.0
_LOUDEST = 1e6
NOISE = ("force", "torque", "acceleration", "angular_acceleration")  # whose standard deviation can be told
_SECTIONS = ("log", "noise", "object", "stream", "robot")

LEVEL_BASE = f"[log] gives no gravity: {STANDARD_GRAVITY} m/s² along -z of W, a level base, was assumed"


def default_gravity() -> Array:
    """Return standard gravity in W, z up (3,) [m/s^2]: what holds where a description does not say."""
    return np.array([0.0, 0.0, -STANDARD_GRAVITY])


@dataclass(frozen=True, eq=False)
class Description:
    """What a description says.

    gravity      (3,) [m/s^2] in W
    wrench_sign  +1 on-object, -1 on-sensor
    noise        standard deviations, SI
    tool         path of a result, as written
    placed       pose of O in S, None where nothing says
    notes        what was left to be assumed
    """

    streams: tuple[StreamSpec, ...]
    gravity: Array = field(default_factory=default_gravity)
    wrench_sign: int = 1
    noise: Mapping[str, float] = field(default_factory=dict)
    tool: str | None = None
    placed: ObjectPose | None = None
    notes: tuple[str, ...] = ()


def read_description(path: Path) -> Description:
    """Read and check the TOML description at `path`; raises BadFile or BadDescription."""
    return parse_description(load_toml(path), path.name)


def parse_description(values: Mapping[str, Any], name: str) -> Description:
    """Check the parsed TOML `values`; `name` stands in messages. Raises BadDescription."""
    top = Entry(values, name)
    if "team" in top:
        raise top.error("[team] makes this a team description. Use it with: steelyard team")
    top.only(*_SECTIONS)
    if "robot" in top:
        raise top.error(
            "[robot] is not supported yet: forward kinematics come later. "
            "Give the orientation of the sensor instead, as rotation = { columns = [..], form = .. }."
        )
    log = top.section("log")
    log.only("gravity", "wrench", "tool")
    gravity = parse_gravity(log) if "gravity" in log else default_gravity()
    placed = parse_object_pose(top.section("object"))
    streams = _streams(top)
    told = "gravity" in log or any(quantity.name == "gravity" for spec in streams for quantity in spec.quantities)
    return Description(
        streams=streams,
        gravity=gravity,
        wrench_sign=-1 if log.choice("wrench", ("on-sensor", "on-object"), "on-object") == "on-sensor" else 1,
        noise=_noise(top.section("noise")),
        tool=log.text("tool"),
        placed=placed,
        notes=() if told else (LEVEL_BASE,),
    )


def parse_gravity(entry: Entry) -> Array:
    """Return `gravity` (3,) [m/s^2]; raises BadDescription where nothing on Earth is as heavy or as light."""
    gravity = entry.numbers("gravity", 3)
    if not gravity.any():
        raise entry.error('"gravity" must not be zero; on a level base it is [0, 0, -9.81].')
    if not _WEAKEST <= np.abs(gravity).max() <= _STRONGEST:
        raise entry.error(f'"gravity" must be in m/s^2, [0, 0, -9.81] on a level base; got {_short(gravity)}.')
    return gravity


def _short(values: Array) -> str:
    return f"[{', '.join(f'{v:g}' for v in values)}]"


def _noise(entry: Entry) -> dict[str, float]:
    entry.only(*NOISE)
    return {key: entry.positive(key, _LOUDEST) for key in NOISE if key in entry}


def _streams(top: Entry) -> tuple[StreamSpec, ...]:
    value = top.values.get("stream", [])
    if not isinstance(value, list) or not all(isinstance(item, Mapping) for item in value):
        raise top.error("streams are written as sections that start with [[stream]].")
    if not value:
        raise top.error(f"no [[stream]] is given, so there are no data. A complete description:\n{EXAMPLE}")
    streams = [parse_stream(Entry(item, f"{top.where}, [[stream]] {i}")) for i, item in enumerate(value, 1)]
    return tuple(streams)
