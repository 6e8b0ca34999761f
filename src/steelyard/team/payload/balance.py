"""Whether those who carry a payload at rest can hold it at all: two passive gimbals leave it free to turn."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.spatial import Pose
from steelyard.team.payload.body_rows import BodyRows

# [rad] about the line of two grasps, over which a payload that hangs from them cannot rest.
HANGS = 0.05


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
