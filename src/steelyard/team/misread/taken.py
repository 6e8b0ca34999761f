"""What robots' wrenches were taken for where that is not what the log says: kept with the answer, said in a few words.

A map (6, 6) takes moment and force as given, in a robot's grasp, to what they are. It is a factor times a signed
permutation of the axes of each.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.spatial import signed_columns


def maps_of(names: Sequence[str], D: Array, taken: Array, reading: tuple[int, Array] | None) -> dict[str, Array]:
    """Return the maps (6, 6), by robot, of those whose wrench was taken for another.

    D        (6, 6 N) from moment and force of every robot to the sum, as grasps are
    taken    (6, 6 N) the same with signs turned
    reading  robot and map (6, 6) that went before
    """
    signs = np.where((D * taken).sum(0) < 0, -1.0, 1.0).reshape(-1, 6)
    maps = {k: np.diag(s) for k, s in enumerate(signs)}
    if reading is not None:
        maps[reading[0]] = maps[reading[0]] @ reading[1]
    return {names[k]: M for k, M in maps.items() if not np.array_equal(M, np.eye(6))}


def as_taken(log: TeamLog, maps: Mapping[str, Array]) -> TeamLog:
    """Return the log with wrenches as they were taken."""
    return log.with_recordings(*(r.changed(_mapped, maps) for r in log.recordings))


def in_few_words(taken: Array) -> str:
    """Return what was done to a wrench by its map (6, 6)."""
    torque, force = _words(taken[:3, :3]), _words(taken[3:, 3:])
    if torque == force:
        return f"wrench {force}"
    return ", ".join(f"{what} {said}" for what, said in (("force", force), ("torque", torque)) if said)


def _mapped(track: Track, taken: Array) -> Track:
    blocks = {"torque": taken[:3, :3], "force": taken[3:, 3:]}
    more = {name: track.channels[name] @ X.T for name, X in blocks.items() if name in track.channels}
    return replace(track, channels={**track.channels, **more})


def _words(X: Array) -> str:
    """Return what was done to three axes by their map (3, 3); nothing where they were left."""
    size = abs(float(np.linalg.det(X))) ** (1 / 3)
    axes, said = X / size, []
    if not np.isclose(size, 1.0):
        said.append(f"times {size:.4g}")
    if np.allclose(axes, -np.eye(3)):
        said.append("with its sign turned")
    elif not np.allclose(axes, np.eye(3)):
        said.append(f"with axes ({', '.join(signed_columns(axes))})")
    return " ".join(said)
