"""A team whose bases move: grasps and clocks from twists, and the rows that its payload is weighed by."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import ClassVar

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.changes.found import Edit, without_changes
from steelyard.team.changes.slips import Slip
from steelyard.team.changes.slips_between import slip_between_twists
from steelyard.team.clocks.errors import ClockErrors
from steelyard.team.clocks.unsteady import clock_errors
from steelyard.team.motion_fit import CLOCK_ROUNDS, DOUBTED, LEVEL, PUNCTUAL, MotionFit, Tilted, later, tilted
from steelyard.team.payload.body_rows import PayloadRows, balance_frame, from_twists
from steelyard.team.split import Split, smoothed, split_of
from steelyard.team.stacked import Stretch
from steelyard.team.twists.fit import TwistFit, fit_twists, fused_twist
from steelyard.team.twists.rows import TwistStretch, twist_stretches
from steelyard.team.twists.statistic import TwistScatter, rates_of_change

# Clocks that were moved are moved until the last step is below this share of what is moved for.
SETTLED = 0.05
# Noise above this share of the motion: robots disagree.
LOUD = 0.1


@dataclass(frozen=True, eq=False)
class TwistTeam(MotionFit):
    """The joint fit of twists; `reference` is the number of the robot in whose grasp the answer is given."""

    ORDER: ClassVar[int] = 1

    parts: tuple[TwistStretch, ...]
    fit: TwistFit
    reference: int = 0

    @classmethod
    def of(cls, log: TeamLog, clocks: bool, other: Sequence[bool] = ()) -> TwistTeam:
        """Return the joint fit; raises CannotAnswer where twists or rows in common are missing.

        Robots that let go for a while and grasps that slip are found on the way; `other` as in `without_changes`.
        """
        raw = tuple(part.used for part in twist_stretches(log, {}))
        return without_changes(log, clocks, raw, lambda edit: cls._fitted(log, clocks, edit), other)

    @classmethod
    def _fitted(cls, log: TeamLog, clocks: bool, edit: Edit) -> TwistTeam:
        """Return the fit of recordings after an edit."""
        late = dict.fromkeys(log.names, 0.0)
        for left in reversed(range(CLOCK_ROUNDS)):
            raw = twist_stretches(log, late)
            edited = edit(tuple(part.used for part in raw))
            parts = tuple(part.changed(used) for part, used in zip(raw, edited, strict=True))
            fit = _joint_fit(parts, log)
            share = SETTLED if any(late.values()) else 1.0
            # What is told of clocks is what the rows and the fit were made with.
            if not (clocks and left) or fit.punctual(share * PUNCTUAL, share * DOUBTED):
                break
            late = later(late, fit.delays)
        return cls(parts, fit, late, reference=log.names.index(log.reference))

    def clock_errors(self, log: TeamLog) -> ClockErrors:
        """Return what clocks seem to be off by in single recordings."""
        slopes = [-rates_of_change(part) for part in self.parts]
        late = [slope * self.fit.delays[:, None] for slope in slopes]
        left = [(part, apart - more) for (part, apart), more in zip(self._left(), late, strict=True)]
        return clock_errors(log, left, slopes, self.J, self.W)

    def _left(self) -> list[tuple[Stretch, Array]]:
        return [(part.used, self._apart(part)[0]) for part in self.parts]

    def _left_of_all(self, log: TeamLog) -> list[tuple[Stretch, Array]]:
        every = zip(twist_stretches(log, self.late), self.parts, strict=True)
        return [(raw.used, self._apart(raw, now)[0]) for raw, now in every]

    def slip(self, log: TeamLog) -> Slip | None:
        """Return the clearest slip, within a recording or else between two; none where a hinge is the cause."""
        return None if self.split is not None and self.split.sure else super().slip(log)

    def _slip_between(self, log: TeamLog, parts: Sequence[Stretch], apart: Sequence[Array]) -> Slip | None:
        return slip_between_twists(self.parts, self.reference, lambda some: _joint_fit(some, log))

    @cached_property
    def split(self) -> Split | None:
        """How grasps fall apart where they do not move as on one rigid body, the reference's group first."""
        if not self.rough:
            return None
        part = max((p for p in self.parts if p.rows.kind != "still"), key=lambda p: len(p.rows), default=self.parts[0])
        return split_of(*smoothed(part.twist, np.asarray(part.seen.all(1)), part.rows.rate), self.reference)

    @property
    def rough(self) -> bool:
        """Whether twists err by a good part of what they are."""
        square, rows = self._squares
        return bool((self.fit.noise > LOUD * np.sqrt(square.sum(0) / (3 * rows.sum()))).any())

    @property
    def share(self) -> Array:
        """Noise (N, 2) as a share of each robot's twists (rms), turning and moving; all of what does not move."""
        square, rows = self._squares
        size = np.sqrt(square / (3 * np.maximum(rows, 1))[:, None])
        return np.asarray(np.divide(self.fit.noise, size, out=np.ones_like(size), where=size > 0))

    @cached_property
    def _squares(self) -> tuple[Array, Integers]:
        """Sums of the squares (N, 2) of each robot's twists, turning and moving, and of how many rows (N,)."""
        seen = [(part.twist**2 * part.seen[..., None]).sum(0).reshape(-1, 2, 3).sum(2) for part in self.parts]
        return np.sum(seen, axis=0), np.sum([part.seen.sum(0) for part in self.parts], axis=0)

    def down(self) -> Array | None:
        """Return the mean direction of gravity (3,) in R, None where nobody can tell it."""
        told = [(_down(part, self.fit.grasps)) for part in self.parts]
        rows = np.concatenate([down[level] for down, level in told])
        if not len(rows):
            return None
        mean = rows.mean(0)
        return np.asarray(mean / max(float(np.linalg.norm(mean)), 1e-300))

    def tilt(self, names: tuple[str, ...]) -> Tilted | None:
        """Return who disagrees on where gravity points, in rows in which all say so who ever do; None if nobody."""
        told = np.any([part.level.any(0) for part in self.parts], axis=0)
        every = [part.down[part.level[:, told].all(1)].sum(0) for part in self.parts]
        down = np.einsum("nij,nj->ni", self.fit.grasps.rotation.matrix, np.sum(every, axis=0))
        return tilted(names, np.where(told[:, None], down, 0.0), self.fit.spread)

    def without_level(self, robot: int) -> TwistTeam:
        """Return the same without what one robot calls down."""
        others = np.arange(len(self.fit.noise)) != robot
        return replace(self, parts=tuple(replace(part, level=part.level & others) for part in self.parts))

    def level(self, reference: int) -> Array:
        """Return the line of gravity over how well it is known (N, 3), as in `Spread`."""
        pairs = _level_pairs(self.parts, reference)
        seen = np.linalg.svd(pairs[reference])[0][:, 0] @ pairs
        size = np.linalg.norm(pairs, axis=(1, 2))
        # Of unit vectors, half the squared distance is one less their product.
        apart = 1 - np.einsum("nab,nab->n", self.fit.grasps.rotation.matrix, pairs) / np.maximum(size, 1e-300)
        known = np.hypot(LEVEL, np.sqrt(2 * np.maximum(apart, 0)))
        return np.asarray(seen / np.maximum(np.linalg.norm(seen, axis=1) * known, 1e-300)[:, None])

    def _apart(self, part: TwistStretch, now: TwistStretch | None = None) -> tuple[Array, Array, Array]:
        """Return the residuals (T, N, 6) of a recording's twists, the fused twist (T, 6) and its covariance (6, 6).

        now  what is left of the recording, where it tells the motion from which `part`, as it was, differs
        """
        now = part if now is None else now
        fused, covariance = fused_twist(now.twist, now.seen, self.fit.grasps, self.fit.noise)
        moved = np.einsum("nij,tj->tni", self.J, fused)
        told = part.seen & now.seen.any(1, keepdims=True)
        return (part.twist - moved) * told[..., None], fused, covariance

    def rows(self, highest_hz: float) -> tuple[PayloadRows, Array]:
        """Return the rows of every recording beside the residuals (T, N, 6) of their twists, and a row's covariance.

        The covariance (6, 6) is that of the fused twist, in the balance frame's axes.
        """
        grasps = self.fit.grasps
        frame = balance_frame(grasps)
        into = adjoint_inverse(frame)
        out = []
        for part in self.parts:
            left, fused, covariance = self._apart(part)
            down, level = _down(part, frame.inverse() @ grasps)
            known = level & (part.seen.any(1) | (part.rows.kind == "still"))
            out.append((from_twists(part.rows, fused @ into.T, -down, known, highest_hz), left))
        if not any(_down(part, grasps)[1].any() for part in self.parts):
            raise CannotAnswer(
                "somebody must know where gravity points: give a gravity channel of a robot whose base moves, or "
                "[team] gravity for a level base that stands. An accelerometer (specific_force) is not taken for it."
            )
        return out, into @ covariance @ into.T


def _joint_fit(parts: Sequence[TwistStretch], log: TeamLog) -> TwistFit:
    """Return the joint fit of recordings."""
    reference = log.names.index(log.reference)
    return fit_twists(TwistScatter.of(tuple(parts)), reference, log.names, _level_pairs(parts, reference))


def _level_pairs(parts: Sequence[TwistStretch], reference: int) -> Array:
    """Return sums (N, 3, 3) of the direction of gravity in the reference grasp times that in each."""
    out = np.zeros((parts[0].level.shape[1], 3, 3))
    for part in parts:
        size = np.linalg.norm(part.down, axis=2, keepdims=True)
        unit = np.divide(part.down, size, out=np.zeros_like(part.down), where=(size > 0) & part.level[..., None])
        out += np.einsum("ta,tnb->nab", unit[:, reference], unit)
    return out


def _down(part: TwistStretch, X_BG: Pose) -> tuple[Array, Mask]:
    """Return gravity (T, 3) in B as the robots that can tell it say on average, and in which rows (T,) one can."""
    each = np.einsum("nij,tnj->tni", X_BG.rotation.matrix, part.down) * part.level[..., None]
    count = part.level.sum(1)
    return each.sum(1) / np.maximum(count, 1)[:, None], np.asarray(count > 0)
