"""What the payload does and what the robots push, in one frame fixed to the payload: rows of one recording.

B is the balance frame at the middle of the grasps: there the noise of the summed force and moment is uncorrelated. The
motion comes from poses of the whole team, which place the payload far better than one gimbal encoder: rotation then
comes from positions over a baseline of a metre. PayloadRows are cut into runs without gaps.
Whether those who carry a payload at rest can hold it at all shows here too.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.fft import prev_fast_len
from scipy.ndimage import uniform_filter1d

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.logs.conditioning import lowpass
from steelyard.logs.middles import mean
from steelyard.logs.runs import runs
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose, Rotation, classical_acceleration, cross_matrix, unit_vectors
from steelyard.team.adjoint import turned_by, turns_between
from steelyard.team.stacked import Stretch

# The path is smoothed at so many times the highest frequency that is used, which leaves that band as it is.
PATH_FILTER = 2.0
# Cycles of the highest frequency that a run must last, so that rows between bursts of lost ones count, and that are
# left out at its ends.
LEAST_CYCLES, END_CYCLES = 4.0, 1.0
# Share of the grasps' own axes in those of the balance frame.
ALIKE = 1e-3
# [rad] about the line of two grasps, over which a payload that hangs from them cannot rest.
HANGS = 0.05


@dataclass(frozen=True, eq=False)
class Run:
    """PayloadRows of one recording without a gap, all in B's axes.

    motion   (T, 12) angular acceleration, acceleration less gravity, omega omega^T (xx xy xz yy yz zz)
    pushed   (T, 6 N) moment and force of every robot in its own grasp axes, zero where it holds nothing
    room     (T, 9) what stands still in the room: the axes x, y, z of H, or (T, 3) up alone where bases move
    rows     which rows of the recording these are
    """

    motion: Array
    pushed: Array
    room: Array
    rows: slice
    rate: float

    def part(self, first: int, stop: int) -> Run:
        """Return the rows from `first` to before `stop` of the run."""
        motion, pushed, room = (x[first:stop] for x in (self.motion, self.pushed, self.room))
        return Run(motion, pushed, room, slice(self.rows.start + first, self.rows.start + stop), self.rate)


@dataclass(frozen=True, eq=False)
class BodyRows:
    """Runs of one recording; `still` where the payload rests."""

    name: str
    still: bool
    runs: tuple[Run, ...]

    def without(self, gone: Sequence[Mask], highest_hz: float) -> BodyRows:
        """Return the recording without rows `gone` (T,) of each run, in runs that last long enough for the band."""
        kept = []
        for run, rows in zip(self.runs, gone, strict=True):
            least = LEAST_CYCLES * run.rate / highest_hz
            kept += [run.part(a, b) for a, b in runs(~rows) if b - a >= least]
        return replace(self, runs=tuple(kept))

    def seconds(self, rows: Sequence[Mask]) -> float:
        """Return how long rows (T,) of each run last in all [s]."""
        return sum(float(some.sum()) / run.rate for some, run in zip(rows, self.runs, strict=True))


# Of every recording, beside the residuals (T, N, 6) of its poses or twists.
PayloadRows = list[tuple[BodyRows, Array]]


def balance_frame(grasps: Pose) -> Pose:
    """Return X_RB: at the middle of the grasps (N,), along the axes in which they spread.

    Where they spread alike, as two do across their line, the grasps' own axes decide, so that neither their order nor
    the reference does.
    """
    centre = grasps.position.mean(0)
    off = grasps.position - centre
    spread = off.T @ off
    turn = grasps.rotation.matrix
    own = np.einsum("nij,j,nkj->ik", turn, [0.0, 1.0, 2.0], turn)
    _, axes = np.linalg.eigh(spread + ALIKE * np.trace(spread) / len(turn) * own)
    axes[:, 2] *= np.sign(np.linalg.det(axes))
    return Pose(Rotation(axes), centre)


def reach(grasps: Pose) -> float:
    """Return the rms distance of the grasps from their middle [m]: the size of the team."""
    off = grasps.position - grasps.position.mean(0)
    return float(max(np.sqrt((off**2).sum(-1).mean()), 1e-3))


def summing(X_BG: Pose) -> Array:
    """Return (6, 6 N): from moment and force of every robot in its grasp to the team's at B."""
    turn = X_BG.rotation.matrix
    out = np.zeros((6, len(turn), 6))
    out[:3, :, :3] = out[3:, :, 3:] = np.moveaxis(turn, 0, 1)
    out[:3, :, 3:] = np.moveaxis(cross_matrix(X_BG.position) @ turn, 0, 1)
    return out.reshape(6, -1)


def from_poses(part: Stretch, path: Pose, known: Mask, gravity: Array, highest_hz: float) -> BodyRows:
    """Return the rows of one recording from the payload's path X_HB (T,), where it is `known` (T,).

    gravity  (3,) [m/s^2] in H     highest_hz  of the band that is used
    """

    def made(rows: slice) -> tuple[Array, Array]:
        place, turn = path.position[rows], path.rotation[rows]
        room = turn.matrix.reshape(-1, 9)
        if part.kind == "still":
            return _resting(-turn.inverse().apply(gravity)), room
        return _moving(turn, place, gravity, part.rate, PATH_FILTER * highest_hz), room

    return _made(part, known, highest_hz, made)


def from_twists(part: Stretch, twist: Array, supported: Array, known: Mask, highest_hz: float) -> BodyRows:
    """Return the rows from twists (T, 6) in B and acceleration less gravity (T, 3) of a robot whose base moves.

    `supported` is NaN where nobody can tell gravity; the derivative of the velocity is added here.
    """

    def made(rows: slice) -> tuple[Array, Array]:
        lifted, smooth = supported[rows], twist[rows]
        if part.kind == "still":
            return _resting(lifted), unit_vectors(lifted)
        if PATH_FILTER * highest_hz < 0.45 * part.rate:
            smooth = lowpass(smooth, PATH_FILTER * highest_hz, part.rate)
        rise = slope(smooth, part.rate)
        motion = features(smooth[:, :3], rise[:, :3], classical_acceleration(rise, smooth) + lifted)
        return motion, unit_vectors(lifted)

    return _made(part, known, highest_hz, made)


def _made(part: Stretch, known: Mask, highest_hz: float, made: Callable[[slice], tuple[Array, Array]]) -> BodyRows:
    """Return the runs of a recording where the payload is `known` (T,), with motion and room `made` of their rows."""
    still, runs = part.kind == "still", []
    pushed = (part.wrench * part.carries[..., None]).reshape(len(part), -1)
    for rows in _runs(part.complete & known, part, still, highest_hz):
        motion, room = made(rows)
        inside = rows if still else _inside(rows, part.rate, highest_hz)
        kept = slice(inside.start - rows.start, inside.stop - rows.start)
        runs.append(Run(motion[kept], pushed[inside], room[kept], inside, part.rate))
    return BodyRows(part.name, still, tuple(runs))


def _runs(good: Mask, part: Stretch, still: bool, highest_hz: float) -> list[slice]:
    """Return the stretches of good rows seen by one set of robots: where it changes, the path jumps by its noise."""
    change = np.zeros(len(good), np.bool_)
    if not still:
        change[1:] = (part.seen[1:] != part.seen[:-1]).any(1)
    least = max(3.0, (0.0 if still else LEAST_CYCLES) * part.rate / highest_hz)
    out = []
    for start, stop in runs(good):
        inner = [start, *(start + np.flatnonzero(change[start + 1 : stop]) + 1), stop]
        out += [slice(int(a), int(b)) for a, b in pairwise(inner) if b - a >= least]
    return out


def _inside(rows: slice, rate: float, highest_hz: float) -> slice:
    """Return the rows without the ends, where the filter has only one side: as many as transform quickly."""
    cut = int(np.ceil(END_CYCLES * rate / highest_hz / PATH_FILTER)) + 4
    length = prev_fast_len(rows.stop - rows.start - 2 * cut, real=True)
    return slice(rows.start + cut, rows.start + cut + length)


def _resting(supported: Array) -> Array:
    """Return the motion (T, 12) at rest of an acceleration less gravity (T, 3)."""
    out = np.zeros((len(supported), 12))
    out[:, 3:6] = supported
    return out


def _moving(turn: Rotation, place: Array, gravity: Array, rate: float, cutoff_hz: float) -> Array:
    """Return the motion (T, 12) of a path that is smoothed, then differentiated."""
    middle = Rotation.nearest(mean(turn.matrix))
    path = np.concatenate([turns_between(middle, turn), place], axis=1)
    if cutoff_hz < 0.45 * rate:
        path = lowpass(path, cutoff_hz, rate)
    turn, place = turned_by(middle, path[:, :3])[:, 0], path[:, 3:]
    omega = np.zeros((len(place), 3))
    near, far = turns_between(turn[1:-3], turn[3:-1]), turns_between(turn[:-4], turn[4:])
    omega[2:-2] = (8 * near - far) * (rate / 12)
    second = np.zeros_like(place)
    inner = 16 * (place[1:-3] + place[3:-1]) - 30 * place[2:-2] - place[:-4] - place[4:]
    second[2:-2] = inner * (rate**2 / 12)
    lifted = (second - gravity)[:, None]
    return features(omega, slope(omega, rate), (lifted @ turn.matrix)[:, 0])


def slope(values: Array, rate: float) -> Array:
    """Return the derivative (T, D) by fourth-order central differences, zero at the ends."""
    out = np.zeros_like(values)
    out[2:-2] = (8 * (values[3:-1] - values[1:-3]) - (values[4:] - values[:-4])) * (rate / 12)
    return out


def features(omega: Array, alpha: Array, supported: Array) -> Array:
    """Return (T, 12) of angular velocity, its derivative and acceleration less gravity (T, 3) each."""
    x, y, z = omega.T
    return np.concatenate([alpha, supported, np.stack([x * x, x * y, x * z, y * y, y * z, z * z], 1)], axis=1)


def averaged(values: Array, seconds: float, rate: float) -> Array:
    """Return values (T, ...) averaged over so long about each row; rate in Hz."""
    return np.asarray(uniform_filter1d(values, max(1, round(seconds * rate)), axis=0, mode="nearest"))


def require_runs(kinds: Sequence[object]) -> None:
    """Raise CannotAnswer where no kind of recording has rows to weigh the payload by."""
    if not kinds:
        raise CannotAnswer(
            "no recording has rows in which every robot that carries measured a wrench, for long enough. Give "
            "the force of every robot; if all are there, record longer or faster, or correct the unit of time."
        )


def require_balance(log: TeamLog, recordings: Sequence[BodyRows], X_BG: Pose) -> None:
    """Raise CannotAnswer where two force-only robots are said to hold the payload still at different turns about the
    line of their grasps.

    Nothing that they push turns the payload about that line, so that it would swing to where it hangs: somebody else
    carries, and the sum of forces is short. recordings in the order of the log; X_BG (N,) in the axes of their motion.
    """
    seen: dict[tuple[str, ...], list[tuple[str, Array]]] = {}
    for recording, body in zip(log.recordings, recordings, strict=True):
        carriers = tuple(name for name in log.names if name not in recording.away)
        if not body.still or not body.runs or len(carriers) != 2 or not all(map(log.force_only, carriers)):
            continue
        up = np.concatenate([run.motion[:, 3:6] for run in body.runs]).mean(0)
        seen.setdefault(carriers, []).append((recording.name, up))
    for carriers, poses in seen.items():
        one, two = (X_BG.position[log.names.index(name)] for name in carriers)
        line = (two - one) / max(float(np.linalg.norm(two - one)), 1e-12)
        first, *others = ((name, up - (up @ line) * line) for name, up in poses)
        for name, up in others:
            turned = float(np.arctan2(abs(line @ np.cross(first[1], up)), first[1] @ up))
            if turned > HANGS:
                apart = f"turns {np.rad2deg(turned):.0f} deg apart about the line of their grasps"
                raise CannotAnswer(
                    f"two robots with passive gimbals, '{carriers[0]}' and '{carriers[1]}', cannot hold a payload "
                    f"still at {apart}, as in '{first[0]}' and '{name}': somebody else carries it. Add the forces "
                    "of that robot, or leave the still recordings out."
                )
