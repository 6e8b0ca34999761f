"""A grasp that slips: found as a step of one grasp against all others, timed, and told from every other robot's.

The residual of a robot against the motion that the others alone show is flat but for noise; a slip is a step in it.
Means over a second before and after are compared. How much they differ by noise alone is measured on the log itself,
along directions that err independently of each other: what turns the others' motion also moves a grasp that is far off.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numba
import numpy as np
from scipy.special import gammainccinv

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.middles import median
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Rotation
from steelyard.team.stacked import Stretch

# [s] on either side that are averaged, and left out between, where the slip itself may last. Twists that are added up
# wander ever farther: only what is near tells a step from that.
WINDOW_S, NEAR_S, GAP_S = 1.0, 0.1, 0.1
# How likely noise alone may be taken for a slip in one recording, and the size [m, rad] from which a step counts.
CHANCE, LEAST_M, LEAST_RAD = 1e-4, 1e-3, 2e-3
# Share of rows of a window that must have been measured.
FILLED = 0.5
# [s] around a slip in which nothing of its robot is used.
CLEAR_S = 0.2


@dataclass(frozen=True, eq=False)
class Slip:
    """A slip of robot `robot` in one recording at `time` [s].

    step   (6,) rotation vector and position of the grasp after it, in its own axes
    A time of -inf is before the recording, and after recording `since`; that is the one before unless it is given. It
    is timed before `until` [s].
    """

    robot: int
    recording: int
    time: float
    step: Array
    score: float
    since: int | None = None
    until: float = np.inf

    @property
    def distance(self) -> float:
        """How far the grasp moves [m]."""
        return float(np.linalg.norm(self.step[3:]))

    @property
    def angle(self) -> float:
        """How far it turns [rad]."""
        return float(np.linalg.norm(self.step[:3]))

    @property
    def large(self) -> bool:
        """Whether the step is one that counts."""
        return self.distance > LEAST_M or self.angle > LEAST_RAD

    @property
    def between(self) -> bool:
        """Whether the grasp slipped before the recording began."""
        return not np.isfinite(self.time)

    def renewed(self, part: Stretch, apart: Array, noise: Array, drifts: bool) -> Slip:
        """Return the slip from the residuals (T, 6) of its robot against the others' motion, as `find_slip`."""
        seen = part.seen[:, self.robot] & (part.time < self.until)
        row, score, step = _step(apart, seen, *_window(part.rate, drifts), noise)
        middle = part.time[row]
        after, before = seen & (part.time > middle + GAP_S), seen & (part.time < middle - GAP_S)
        full = step if drifts else apart[after].mean(0) - apart[before].mean(0)
        return replace(self, time=float(middle), step=full, score=score)

    def beside(self, slips: Sequence[Slip]) -> Slip:
        """Return the slip, to be timed before others of its robot in its recording: they are clear, and known."""
        own = (slip.time for slip in slips if (slip.recording, slip.robot) == (self.recording, self.robot))
        return replace(self, until=min(own, default=np.inf))

    def applied(self, parts: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
        """Return the recordings without the slipped grasp's poses from then on, its wrench moved to where it was."""
        out, robot = list(parts), self.robot
        for number in range(self.recording, len(parts)):
            part = parts[number]
            after, near = np.ones(len(part), np.bool_), np.zeros(len(part), np.bool_)
            if number == self.recording:
                # Every recording has its own clock, and may begin at zero.
                after, near = part.time > self.time, np.abs(part.time - self.time) < CLEAR_S
            seen, felt, wrench = part.seen.copy(), part.felt.copy(), part.wrench.copy()
            seen[after | near, robot] = False
            felt[near, robot] = False
            turn = Rotation.exp(self.step[:3])
            force, moment = (turn.apply(wrench[after, robot, k : k + 3]) for k in (3, 0))
            wrench[after, robot, 3:] = force
            wrench[after, robot, :3] = moment + np.cross(self.step[3:], force)
            out[number] = replace(part, seen=seen, felt=felt, wrench=wrench)
        return tuple(out)

    def finding(self, log: TeamLog) -> Finding:
        """Return the finding with robot, time and size."""
        name, record = log.names[self.robot], log.recordings[self.recording].name
        size = f"{1e3 * self.distance:.1f} mm and {np.rad2deg(self.angle):.2f} deg"
        if self.between:
            before = log.recordings[self.recording - 1 if self.since is None else self.since].name
            base = "" if log.robots[self.robot].base == "moving" else ", or its base was moved,"
            what = f"The grasp of '{name}' slipped by {size}{base} between '{before}' and '{record}'"
        else:
            what = f"The grasp of '{name}' slipped by {size} at {self.time:.2f} s of '{record}'"
        return Finding.of(
            "grasp-slipped",
            f"{what}; from there on its motion is left out and its forces act from where it then was.",
        )


def clearest(found: Iterable[Slip | None]) -> Slip | None:
    """Return the slip of the highest score, None where there is none."""
    return max((slip for slip in found if slip is not None), key=lambda slip: slip.score, default=None)


def alone(residual: Array, J: Array, W: Array) -> Array:
    """Return residuals (T, N, 6) against the motion that the other robots show, from those of the joint fit.

    J (N, 6, 6), W (N, 6) as in the fit, all robots present.
    """
    A = np.linalg.inv(np.einsum("nia,ni,nib->ab", J, W, J))
    out = np.empty_like(residual)
    for i in range(len(J)):
        held = J[i] @ A @ J[i].T * W[i]
        left, value, right = np.linalg.svd(np.eye(6) - held)
        # With two robots in all, what the joint fit shared between them is doubled; nothing is unseen.
        out[:, i] = residual[:, i] @ ((left / np.maximum(value, 1e-3)) @ right)
    return out


def noise_alone(J: Array, W: Array) -> Array:
    """Return the covariance (N, 6, 6) of one row of such residuals: the robot's own noise and the others' motion's."""
    each = np.einsum("nia,ni,nib->nab", J, W, J)
    out = J @ np.linalg.inv(each.sum(0) - each) @ np.swapaxes(J, 1, 2)
    out[:, range(6), range(6)] += 1 / W
    return np.asarray(out)


def find_slip(number: int, part: Stretch, apart: Array, noise: Array, drifts: bool = False) -> Slip | None:
    """Return the clearest slip of recording `number`, None where there is none.

    apart   (T, N, 6) rotation vector and position of each grasp against what the others say
    noise   (N, 6, 6) of a row of it, as far as its directions go
    drifts  whether rows far apart in time differ by more than a slip, as added up twists do
    """
    width, gap = _window(part.rate, drifts)
    rows, count = part.seen.shape
    if rows < 4 * (width + gap) or count < 2:
        return None
    found = list[Slip]()
    # One who is seen alone is where he says, exactly.
    seen = part.seen & (part.seen.sum(1, keepdims=True) > 1)
    # Every row of every robot is a look; a chi-square of six numbers.
    threshold = float(2 * gammainccinv(3.0, CHANCE / (rows * count)))
    for i in range(count):
        row, score, step = _step(apart[:, i], seen[:, i], width, gap, noise[i])
        found.append(Slip(i, number, float(part.time[row]), step, score))
    return clearest(slip for slip in found if slip.score > threshold and slip.large)


def _window(rate: float, drifts: bool) -> tuple[int, int]:
    """Return how many rows at `rate` [Hz] are averaged on either side of a slip, and how many next to it are not."""
    return max(2, round((NEAR_S if drifts else WINDOW_S) * rate)), max(1, round(GAP_S * rate / 2))


def _step(apart: Array, seen: Mask, width: int, gap: int, noise: Array) -> tuple[int, float, Array]:
    """Return the row with the clearest step, how clear that is, and the step (6,); noise (6, 6) of a row."""
    step, good = _means_apart(np.ascontiguousarray(apart), np.ascontiguousarray(seen), width, gap, FILLED * width)
    rows = np.flatnonzero(good)
    if not len(rows):
        return 0, 0.0, np.zeros(6)
    along = np.abs(np.linalg.inv(np.linalg.cholesky(noise)) @ (step if good.all() else step[:, good]))
    # The few windows of a recording tell the spread along one direction poorly: it is not taken below that of all.
    spread = np.maximum(median(along), median(along.ravel())) / 0.6745
    score = ((along / np.maximum(spread, 1e-300)[:, None]) ** 2).sum(0)
    best = int(np.argmax(score))
    return width + gap + int(rows[best]), float(score[best]), step[:, rows[best]]


@numba.njit(cache=True, error_model="numpy")
def _means_apart(apart: Array, seen: Mask, width: int, gap: int, least: float) -> tuple[Array, Mask]:
    """Return the means of `width` rows (T, 6) after each row less those before it (6, T - 2 width - 2 gap).

    The `gap` next to the row is left out, and so are the ends; also whether more than `least` rows were seen on both
    sides.
    """
    total = np.zeros((len(seen) + 1, 7))
    for t in range(len(seen)):
        for k in range(6):
            total[t + 1, k] = total[t, k] + (apart[t, k] if seen[t] else 0.0)
        total[t + 1, 6] = total[t, 6] + (1.0 if seen[t] else 0.0)
    inner = max(len(seen) - 2 * (width + gap), 0)
    step, good = np.empty((6, inner)), np.empty(inner, np.bool_)
    for t in range(inner):
        a, b, c, d = t, t + width, t + width + 2 * gap, t + 2 * width + 2 * gap
        before, after = total[b, 6] - total[a, 6], total[d, 6] - total[c, 6]
        good[t] = before > least and after > least
        for k in range(6):
            step[k, t] = (total[d, k] - total[c, k]) / max(after, 1.0) - (total[b, k] - total[a, k]) / max(before, 1.0)
    return step, good
