"""Where a scan lies as a whole, once its cameras were moved until they agreed.

Their views fit each other wherever all of them are put together. What they were moved by says where that is, and how
surely: errors of the arm average out over the views, one of the camera's pose at the wrist does not, and is told from
them by how it turns with the camera.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.shape.scans.pose_errors import Shared
from steelyard.spatial import Pose, Rotation

_ROUNDS = 50  # of the variances
_BENT = 0.03  # of an error at the wrist: moves are put together as vectors, which they are not quite
_FEW = 12  # views that can tell such an error from a wrong lens, and how theirs hang together
_LEAST = 1e-12  # share of the moves that is no variance
_SHOWN = 0.01  # mean square along normals of a move of 1 rms of the surface: of less only noise is seen
_HARDLY = 1e-3  # of what a turn that shows nothing moves a camera by: of a ball's, so little is chance, and no move
_BLOCKS = 10  # of views one after the other, whose errors may hang together


@dataclass(frozen=True, eq=False)
class Placement:
    """What cameras that had to be moved say of where the scan lies.

    common          motion that the moves of all cameras have in common: all are to be moved back by it
    std_m, std_rad  standard deviations of the place that this leaves, per axis [m], [rad]
    at_wrist        shift [m] and turn [rad] of the camera at the wrist that explain most of the moves, or None
    """

    common: Pose
    std_m: float
    std_rad: float
    at_wrist: tuple[float, float] | None


def moved_m(given: Pose, found: Pose, xyz: Array, normal: Array) -> float:
    """Return how far cameras (V,) were moved, rms [m], along what the surface (N, 3) with normals (N, 3) shows.

    Moves that leave the surface on itself, such as turns of a bottle about its axis, are chance: they are left out.
    """
    middle = xyz.mean(0)
    size = float(np.sqrt(((xyz - middle) ** 2).sum(1).mean()))
    rows = np.concatenate([np.cross((xyz - middle) / size, normal), normal], axis=1)
    shares, axes = np.linalg.eigh(rows.T @ rows / len(rows))
    free = axes[:, shares < _SHOWN].T
    arm = (given.position - middle)[:, None]
    by_free = np.swapaxes(np.cross(free[:, :3] / size, arm) + free[:, 3:], 1, 2)
    moves = (found.position - given.position)[..., None]
    left = moves - by_free @ (np.linalg.pinv(by_free, rcond=_HARDLY) @ moves)
    return float(np.sqrt((left**2).sum((1, 2)).mean()))


def placement(given: Pose, found: Pose, middle: Array) -> Placement:
    """Return what cameras (V,), given where they were reported and found elsewhere, say of a scan about `middle` (3,).

    All in one frame. The moves are judged by what they do to the object: shift it and turn it about its middle.
    """
    move, R = found @ given.inverse(), given.rotation.matrix
    shift, turn = _Moves.of(move.apply(middle) - middle, R), _Moves.of(move.rotation.log(), R)
    back = Rotation.exp(turn.common)
    common = Pose(back, middle - back.apply(middle) + shift.common)
    at_wrist = None
    if len(R) >= _FEW and _explains(shift, turn):
        seen = given.inverse().apply(middle).mean(0)
        at_wrist = float(np.linalg.norm(shift.own - np.cross(turn.own, seen))), float(np.linalg.norm(turn.own))
    return Placement(common, shift.std, turn.std, at_wrist)


def _explains(shift: _Moves, turn: _Moves) -> bool:
    """Return whether an error at the wrist leaves less than half of what the moves differ by, rms."""
    return min(shift.left, turn.left) < 0.5 and max(shift.left, turn.left) < 0.8


@dataclass(frozen=True, eq=False)
class _Moves:
    """Moves m_k (3,) of views as g + R_k h + e_k: what is common to all, the camera's own, and each view's alone.

    common  g (3,)    std   of it, per axis     own  h (3,)
    left    e over what m differ by, rms
    """

    common: Array
    std: float
    own: Array
    left: float

    @classmethod
    def of(cls, moves: Array, R: Array) -> _Moves:
        """Return the parts of moves (V, 3) of cameras with axes R (V, 3, 3).

        Those of an arm go with its posture: its errors hang together from view to view, and what is common is then
        less sure than if each view had its own. By how much it would be other without a tenth of the way says so.
        """
        found = cls._if_each_its_own(moves, R)
        if len(R) < _FEW:
            return found
        block = np.arange(len(R)) * _BLOCKS // len(R)
        others = [cls._if_each_its_own(moves[block != b], R[block != b]).common for b in range(_BLOCKS)]
        std = np.sqrt((1 - 1 / _BLOCKS) * np.square(np.asarray(others) - found.common).sum(0).mean())
        return replace(found, std=max(found.std, float(std)))

    @classmethod
    def _if_each_its_own(cls, moves: Array, R: Array) -> _Moves:
        """Return the parts of moves (V, 3) of cameras with axes R (V, 3, 3) whose errors have nothing in common."""
        square = float((moves**2).mean())
        least = _LEAST * square + 1e-30
        found = Shared.unknown(square + least)
        for _ in range(_ROUNDS):
            found = found.of(moves, R, 0.0, least)
        rest, apart = moves - found.mean(R), moves - moves.mean(0)
        left = np.sqrt(float((rest**2).sum()) / max(float((apart**2).sum()), least))
        std = np.sqrt((np.trace(found.covariance[3:, 3:]) + _BENT**2 * (found.own @ found.own)) / 3)
        return cls(found.common, float(std), found.own, float(left))
