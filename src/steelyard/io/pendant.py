"""Poses and readings typed from a teach pendant become a Recording."""

from __future__ import annotations

import re
from collections.abc import Iterable

import numpy as np

from steelyard import check
from steelyard.errors import BadValue
from steelyard.io.recordings.description import ASSUMED, default_gravity
from steelyard.io.rotations import rotation_of
from steelyard.io.units import ANGLE
from steelyard.logs.recording import ASSUMED_GRAVITY_STD, Recording, Stream

PENDANT_COLUMNS = "roll pitch yaw (deg, S to W), fx fy fz (N), tx ty tz (N*m)"

_WITH_COMMA = re.compile(r"[+-]?(\d+|\d*,\d+)([eE][+-]?\d+)?")


def read_pendant(lines: Iterable[str]) -> Recording:
    """Return still poses typed one per line: roll pitch yaw [deg] of S in W, fx fy fz [N], tx ty tz [N m].

    Readings are the reaction on the sensor, as most are, and gravity is the standard one with z of W up.

    lines  nine numbers each, between blanks, commas or semicolons, decimals with a comma where none stands between;
           empty lines and # comments are skipped

    Raises BadValue naming the line.
    """
    rows = [row for number, line in enumerate(lines, 1) if (row := _row(line, number))]
    if not rows:
        raise BadValue(f"no pose was typed. Each line holds nine numbers: {PENDANT_COLUMNS}.")
    table = np.array(rows, dtype=np.float64)
    channels = {
        "rotation": rotation_of(table[:, :3], "rpy", ANGLE["deg"]).matrix,
        "force": check.frozen(table[:, 3:6]),
        "torque": check.frozen(table[:, 6:]),
    }
    stream = Stream("pendant", channels, poses=True)
    return Recording(
        (stream,),
        default_gravity(),
        -1,
        name="pendant",
        notes=(f"typed poses do not say gravity: {ASSUMED} along -z of the world was assumed",),
        described=False,
        gravity_std=ASSUMED_GRAVITY_STD,
    )


def _words(line: str) -> list[str]:
    """Return the numbers as written; nine between blanks or semicolons may have decimal commas."""
    words = re.split(r"[\s;]+", line.strip(" \t\r\n;"))
    if len(words) == 9 and "." not in line and all(map(_WITH_COMMA.fullmatch, words)):
        return [word.replace(",", ".") for word in words]
    return re.split(r"[\s,;]+", line.strip(" \t\r\n,;"))


def _row(line: str, number: int) -> list[float] | None:
    words = _words(line.split("#")[0])
    if words == [""]:
        return None
    try:
        row = [float(word) for word in words]
    except ValueError as error:
        raise BadValue(f"line {number}: {error}. Each line holds nine numbers: {PENDANT_COLUMNS}.") from None
    if len(row) != 9 or not np.isfinite(row).all():
        raise BadValue(
            f"line {number}: got {len(row)} numbers. Each line holds nine finite numbers: {PENDANT_COLUMNS}."
        )
    return row
