"""Positions of an arm's joints become the pose of the sensor in the base."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadDescription, BadValue
from steelyard.io.entries import listed
from steelyard.io.stream_entries import QuantitySpec, StreamSpec
from steelyard.io.tables import Table, choose_columns
from steelyard.logs.recording import Stream
from steelyard.robots.serial import SerialArm

_TURNS = 4 * np.pi  # [rad] two turns: more than joints of an arm make, less than degrees of a log for identification
_IN_BRACKETS = re.compile(r"\[([^\]]+)\]$")


def posed(spec: StreamSpec, table: Table, stream: Stream, arm: SerialArm) -> Stream:
    """Return the stream with its joint positions (N, k) as `rotation` and `position` of the sensor in the base.

    Raises BadDescription where the columns are not those of the arm, BadValue where their unit is another.
    """
    quantity = next((q for q in spec.quantities if q.name == "joint_position"), None)
    if quantity is None:
        return stream
    positions = stream.channels["joint_position"][:, _places(quantity, table, arm)]
    _require_likely(quantity, positions, arm)
    pose = arm.pose(positions)
    kept = {name: values for name, values in stream.channels.items() if name != "joint_position"}
    found = {"rotation": pose.rotation.matrix, "position": pose.position}
    return replace(stream, channels=kept | {name: check.frozen(values) for name, values in found.items()})


def _places(spec: QuantitySpec, table: Table, arm: SerialArm) -> list[int]:
    """Return which of the columns holds each joint: by its name where all are named, else as they stand."""
    numbers = choose_columns(table.header, spec.columns, None, spec.where)
    names = [_joint_name(table.header.names[n]) for n in numbers] if table.header.names else []
    joints = [joint.name for joint in arm.moving]
    if set(joints) <= set(names):
        return [names.index(joint) for joint in joints]
    if len(numbers) != len(joints):
        raise BadDescription(
            f"{spec.where}: the arm has {len(joints)} joints from base to sensor ({listed(joints)}); {len(numbers)} "
            "columns are given. Give theirs in this order, or columns with their names."
        )
    return list(range(len(joints)))


def _joint_name(column: str) -> str:
    """Return the joint that a column is called by: "position[elbow]" and "elbow" are those of the elbow."""
    inside = _IN_BRACKETS.search(column)
    return inside.group(1) if inside else column


def _require_likely(spec: QuantitySpec, positions: Array, arm: SerialArm) -> None:
    turning = [k for k, joint in enumerate(arm.moving) if joint.kind == "revolute"]
    largest = float(np.abs(positions[:, turning]).max(initial=0.0))
    if largest > _TURNS:
        raise BadValue(
            f"{spec.where}: joints turn by up to {largest:.4g} rad, more than two turns. They are probably in degrees: "
            'set unit = "deg".'
        )
