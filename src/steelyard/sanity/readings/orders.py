"""Orders: columns of the force, or of the torque, in another order or with other signs than was said.

A turn of S turns both, and makes no left hand of a right one. Mistakes in a description, and drivers, do so: one axis
reversed, two exchanged. A cycle of the force's columns, or two reversed, is a turn: there the torques tell, which have
not taken part. The orders are tried in the axes in which the columns were given. Of a torque at rest either sign fits
as well: then motion tells, or else the order with the fewest changes is taken.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from steelyard.check import Array, frozen
from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.static_fit import columns, solve
from steelyard.sanity.words import unexplained
from steelyard.spatial import signed_axes, signed_columns

Part = Literal["torque", "force"]
_PLACE: dict[Part, slice] = {"torque": slice(0, 3), "force": slice(3, 6)}

# The 24 (24, 3, 3) that turn a right hand into a left one; each is one of the 24 turns with the sign of all reversed.
REFLECTIONS = np.stack([X for X in signed_axes() if np.linalg.det(X) < 0])
TURNS = -REFLECTIONS

# An order is beyond doubt where it leaves less than the first share of the variance, and less than the second of what
# any other order would leave.
WELL, BESIDE = 0.05, 0.5
# Torques that have not taken part in a turn leave less than this share of what they would leave, turned back with it.
ALONE = 0.1
# First moments of mass nearer than this share of one are the same.
SAME = 0.05
# A mass has the right sign beyond so many standard deviations.
SURE = 5.0


@dataclass(frozen=True, eq=False)
class Order:
    """A way to read three columns.

    part           whose columns they are
    axes           (3, 3) signed axes X: what is meant is the columns (N, 3) as they are read times X
    solution, std  (k,) of the body that fits them best, as `static_fit.columns` has it, and standard deviations
    left           share of the variance that it leaves
    sure           whether it is beyond doubt
    """

    part: Part
    axes: Array
    solution: Array
    std: Array
    left: float
    sure: bool = False

    def same(self, other: Order) -> bool:
        """Tell whether another order is this one, or a torque's of the same body: an axis through S feels none."""
        moment = self.solution[:3]
        off = float(np.linalg.norm(other.solution[:3] - moment))
        return other is self or (self.part == "torque" and off < SAME * float(np.linalg.norm(moment)))

    def times(self, sign: float) -> Order:
        """Return the same order with all signs turned where `sign` is negative."""
        return replace(self, axes=sign * self.axes, solution=sign * self.solution)

    def put_right(self, recording: Recording) -> Recording:
        """Return the recording with the columns as they were meant."""
        return recording.changed(self._meant)

    def _meant(self, stream: Stream) -> Stream:
        read = stream.channels.get(self.part)
        return stream if read is None else stream.with_channels(**{self.part: frozen(read @ self.axes)})

    def finding(self, before: float, doubt: str = "") -> Finding:
        """Return what is said of it where the columns as given leave the share `before`."""
        text = (
            f"The {self.part}s fit one body if they are read as {self._words}: so, {unexplained(self.left, before)}; "
            f"the answer {'assumes' if self.sure else 'does not assume'} this{doubt}."
        )
        return Finding("force-unit", text, self._remedy, left_in=not self.sure)

    @property
    def _letter(self) -> str:
        return self.part[0].upper()

    @property
    def _read(self) -> list[str]:
        """Say which column, with its sign, each axis is to be read from."""
        return signed_columns(self.axes.T, self._letter)

    @property
    def _words(self) -> str:
        return ", ".join(f"{self._letter}{name} = {read}" for name, read in zip("xyz", self._read, strict=True))

    @property
    def _remedy(self) -> str:
        """Say what to put right in the description, and what where the columns are logged."""
        order = [read.lstrip("-") for read in self._read]
        turned = sorted(read[1:] for read in self._read if read.startswith("-"))
        if not turned:
            return f"Give the {self.part} columns in the order {', '.join(order)}."
        ordered = f", and give these in the order {', '.join(order)}" if order != sorted(order) else ""
        return f"Turn the sign of {' and '.join(turned)} round where the {self.part} columns are logged{ordered}."


def orders(
    recording: Recording, view: Glance, part: Part, gravity: Array, rotation: Array | None, ways: Array = REFLECTIONS
) -> list[Order]:
    """Return ways to read columns of a part, that which leaves least first; the other sign of all leaves as much.

    gravity, rotation  (3,) [m/s^2] in W, and S to W (N, 3, 3)
    ways               (K, 3, 3) signed axes to try
    """
    stream = recording.stream_of(part)
    turn = np.eye(3) if stream is None or stream.turn is None or part in view.world else stream.turn.matrix
    seen = view.seen(gravity, rotation)
    body = columns(seen)[_PLACE[part].start // 3]
    found = []
    for X in ways:
        wrench = view.wrench[:, _PLACE[part]] @ turn @ X @ turn.T
        found.append(Order(part, X, *solve(body, view.smooth(view.in_sensor(part, wrench, rotation)), view.block)))
    return sorted(found, key=lambda order: order.left)


def order_of_forces(recording: Recording, view: Glance, gravity: Array, rotation: Array | None) -> Order | None:
    """Return how the columns of the force are read best as those of a left hand, by a mass of the right sign.

    All three reversed are a wrench of the other sign, and left to that.
    """
    if rotation is None or any(view.dead[3:]):
        return None

    def told(axes: Array) -> list[Order]:
        views = (orders(recording, v, "force", gravity, rotation, axes) for v in (view, view.still))
        ways = min(views, key=lambda found: found[0].left)
        return [o for o in ways if o.solution[0] > SURE * o.std[0] and abs(o.axes.trace()) < 3]

    mirrored, turned = told(REFLECTIONS), [o for o in told(TURNS) if o.left < WELL]
    turned = [o for o in turned if _alone(recording, view, o.axes, gravity, rotation)]
    weighed = sorted(mirrored + turned, key=lambda order: order.left)
    return likeliest(weighed) if weighed else None


def _alone(recording: Recording, view: Glance, axes: Array, gravity: Array, rotation: Array) -> bool:
    """Tell whether the torques, as given, have not taken part in a turn of the force's columns."""
    if any(view.dead):
        return False
    ways = orders(recording, view, "torque", gravity, rotation, np.stack([np.eye(3), axes]))
    return ways[0].axes.trace() == 3 and ways[0].left < ALONE * ways[1].left


def likeliest(found: list[Order]) -> Order:
    """Return the order that leaves least; of some that leave as little that which changes least.

    found  one order or more, that which leaves least first
    """
    alike = [order for order in found if BESIDE * order.left < found[0].left]
    likely = max(alike, key=lambda order: float(order.axes.sum() + order.axes.trace()))
    return replace(likely, sure=likely.left < WELL and all(map(likely.same, alike)))
