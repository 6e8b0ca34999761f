"""Axes and directions as findings tell them, and the mount that puts a turned wrench right as a description has it."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import percent
from steelyard.logs.recording import Stream
from steelyard.spatial import Rotation


def axis_words(axis: Array) -> str:
    """Return an axis (3,), which points either way, with its largest component positive."""
    return _listed(axis * np.sign(axis[np.abs(axis).argmax()]), 2)


def direction_words(vector: Array) -> str:
    """Return where a vector (3,) points."""
    return _listed(vector / np.linalg.norm(vector), 3)


def shortly(vector: Array) -> str:
    """Return numbers (N,) with two figures each."""
    return ", ".join(f"{v:.2g}" for v in vector)


def unexplained(left: float, before: float, of: str = "their") -> str:
    """Say what share of the variance `of` something another reading leaves, beside what is left as given."""
    return f"{percent(left)} of {of} variance is left unexplained instead of {percent(before)}"


def _listed(vector: Array, places: int) -> str:
    # Adding zero turns a minus zero, which rounding leaves, into a plain one.
    return ", ".join(f"{v:.{places}f}" for v in np.round(vector, places) + 0.0)


def _mount(stream: Stream, turn: Rotation) -> str:
    """Return the rotation vector of a stream's frame in S; its wrench is turned by `turn` against what S would feel."""
    mount = turn.inverse() if stream.turn is None else turn.inverse() @ stream.turn
    return ", ".join(f"{v:.4f}" for v in mount.log() + 0.0)


def mount_remedy(stream: Stream, turn: Rotation) -> str:
    """Return what to write into the description."""
    beside = ""
    if stream.arm is not None:
        beside = f", position = [{', '.join(f'{v:.6g}' for v in stream.arm)}], unit = 'm'"
    rotation = f"rotation = [{_mount(stream, turn)}], form = 'rotation-vector'"
    return f"Set mount = {{ {rotation}{beside} }} for '{stream.name}', or correct the poses."


def mounted(stream: Stream, turn: Rotation) -> str:
    """Say how the frame of a stream seems to lie in S, by its rotation vector."""
    return f"'{stream.name}' looks mounted by the rotation vector ({_mount(stream, turn)}) rad in S"
