"""Forces that are late behind the motion of their own rows, as filters and drivers make them.

The wrench equation holds where every robot's forces are moved by how late they are. To first order that is a column per
robot, what its forces change in a second, beside the parameters and biases: what these columns explain of the residual
is how late the forces are. Forces are moved, the payload is fitted anew, and so on until no step is worth another.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, with_bar
from steelyard.inertia.regressor import motion_map
from steelyard.logs.conditioning import FILTERED, taken_by_filter
from steelyard.logs.curve import Curve
from steelyard.team.payload.body_rows import BodyRows, PayloadRows, Run
from steelyard.team.payload.doubt import moved_by_pushes
from steelyard.team.payload.fit import Fitted, PayloadFit, Weighing
from steelyard.team.payload.spectra import Spectra, band_edges, with_rates

# Forces are late from so much [s] and so many standard deviations, and no later than this: beyond, clocks are apart.
LATE_S, LATE_STD, LATEST_S = 1e-3, 5.0, 0.3
# How late forces are beforehand [s]: where pushes of all change alike, each is taken to be as late as the others.
USUAL_S = 0.05
# Forces are moved until a step is below this share of its standard deviation, at most so many times.
SETTLED, ROUNDS = 1.0, 12


@dataclass(frozen=True, eq=False)
class LateForces:
    """How late every robot's forces are behind the motion (N,) [s], with covariance (N, N).

    moved  (10, N) change of the parameters per second that forces are later
    """

    seconds: Array
    covariance: Array
    moved: Array

    @property
    def std(self) -> Array:
        """Standard deviations (N,) [s]."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def sure(self) -> bool:
        """Whether any is late, by all of them together: pushes that change alike tell only of their sum."""
        size = float(np.sqrt(self.seconds @ np.linalg.solve(self.covariance, self.seconds)))
        return bool(np.abs(self.seconds).max() > LATE_S and size > LATE_STD + np.sqrt(len(self.seconds) - 1))

    def timely(self, body: BodyRows) -> BodyRows:
        """Return the rows with forces moved to when they were: at rest, too, robots squeeze."""
        return replace(
            body, runs=tuple(run for each in body.runs if len((run := _moved(each, self.seconds)).pushed) > 3)
        )

    def unsure(self, fit: PayloadFit, D: Array) -> Array:
        """Return the covariance (10, 10) of delays, and of what filters that make forces so late may have taken.

        Filters of all robots may be alike, or each its own: half of either is held.
        """
        late, count = np.repeat(np.abs(self.seconds), 6), 6 * len(self.seconds)

        def lost(part: Spectra) -> Spectra:
            scatter, room = part.scatter.copy(), part.room.copy()
            share = taken_by_filter(part.hz[:, None, None], late)
            scatter[:, :, 12 : 12 + count] *= share
            room[:, :, 12 : 12 + count] *= share
            return replace(part, scatter=scatter, room=room)

        moved = moved_by_pushes(_in_motion(fit, lost), D)
        filters = 0.5 * FILTERED * (moved @ moved.T + np.outer(moved.sum(1), moved.sum(1)))
        return np.asarray(filters + self.moved @ self.covariance @ self.moved.T)

    def findings(self, names: Sequence[str]) -> tuple[Finding, ...]:
        """Return stream-delayed with everybody whose forces are late or early."""
        told = (np.abs(self.seconds) > LATE_S) & (np.abs(self.seconds) > LATE_STD * self.std)
        who = [i for i in range(len(names)) if told[i] or not told.any()]
        sizes = ", ".join(
            f"of '{names[i]}' {with_bar(1e3 * abs(self.seconds[i]), 1e3 * self.std[i])} ms "
            f"{'late' if self.seconds[i] > 0 else 'early'}"
            for i in who
        )
        return (
            Finding(
                "stream-delayed",
                f"Beside the motion of their own rows, forces are {sizes} (corrected here); error bars hold what "
                "a filter that does it may take of quick motion.",
                "Switch filters of the forces off, or log forces and poses as of one time.",
            ),
        )


def with_timely_forces(
    rows: PayloadRows, fit: Weighing, fitted: Fitted, highest_hz: float
) -> tuple[PayloadRows, Weighing, LateForces | None]:
    """Return rows and their fit with forces that are late moved to when they were; None where none are."""
    late = _asked(fit, rows, highest_hz)
    if late is None or not late.sure:
        return rows, fit, None
    for _ in range(ROUNDS):
        if np.abs(late.seconds).max() > LATEST_S:
            return rows, fit, None
        try:
            moved = [(late.timely(body), left) for body, left in rows]
            better = fitted(moved)
        except CannotAnswer:
            return rows, fit, None
        step = _asked(better, moved, highest_hz)
        if step is None:
            return rows, fit, None
        late = replace(step, seconds=late.seconds + step.seconds)
        if (np.abs(step.seconds) < SETTLED * step.std).all():
            return moved, better, late
    return rows, fit, None


def _asked(fit: Weighing, rows: PayloadRows, highest_hz: float) -> LateForces | None:
    """Return how late forces are beside those of these rows; None where nothing moves."""
    D, count = fit.given, fit.given.shape[1] // 6
    moving = [body for body, _ in rows if body.runs and not body.still]
    if not moving:
        return None
    edges = band_edges(moving, highest_hz)
    beside = iter(moving)
    payload = _in_motion(fit.payload, lambda part: with_rates(part, next(beside), edges, highest_hz))
    summed = np.moveaxis(D.reshape(6, count, 6), 1, 0)
    first, last = 12 + 6 * count, 12 + 12 * count
    body, W = motion_map(payload.parameters), payload.weights[0]
    H, g = np.zeros((count, count)), np.zeros(count)
    for part, bias in zip(payload.groups[0].parts, payload.biases, strict=True):
        left = np.concatenate([-body, D, np.zeros_like(D), -bias[:, None]], axis=1)
        changing = part.scatter[:, first:last].reshape(len(W), count, 6, -1).swapaxes(0, 1)
        seen = W @ (summed[:, None] @ changing)
        H += np.einsum("akibj,bij->ab", seen[..., first:last].reshape(*seen.shape[:3], count, 6), summed, optimize=True)
        g += np.einsum("akiz,iz->a", seen, left)
    moved = moved_by_pushes(payload, np.concatenate([np.zeros_like(D), D], axis=1))[:, count:]
    H = H - moved.T @ payload.information @ moved + np.eye(count) / USUAL_S**2
    covariance = np.asarray(np.linalg.inv(0.5 * (H + H.T)), np.float64)
    return LateForces(-covariance @ g, covariance, moved)


def _in_motion(fit: PayloadFit, changed: Callable[[Spectra], Spectra]) -> PayloadFit:
    """Return the fit of the recordings in motion alone, their spectra changed."""
    parts = tuple(changed(part) for part in fit.groups[-1].parts)
    group = replace(fit.groups[-1], parts=parts)
    return replace(
        fit, groups=(group,), weights=fit.weights[-1:], blind=fit.blind[-1:], biases=fit.biases[-len(parts) :]
    )


def _moved(run: Run, late: Array) -> Run:
    """Return the run with the pushes of every robot moved by `late` (N,) [s], without rows that then have none."""
    time = np.arange(len(run.pushed)) / run.rate
    begin, end = max(0.0, -late.min()), time[-1] - max(0.0, late.max())
    kept = slice(int(np.ceil(begin * run.rate)), int(np.floor(end * run.rate)) + 1)
    each = [
        Curve.through(time, own).at(time[kept] + late[i])
        for i, own in enumerate(np.split(run.pushed, len(late), axis=1))
    ]
    return replace(run.part(kept.start, kept.start + len(time[kept])), pushed=np.concatenate(each, axis=1))
