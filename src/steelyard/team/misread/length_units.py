"""Whether positions are in the unit that was said: in all recordings of a robot, and of a team that has some size."""

from __future__ import annotations

import numpy as np

from steelyard.errors import BadValue
from steelyard.findings import about
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose

# Positions this many times as far from home, and as far spread, are millimetres beside metres.
MANY = 100.0
# A rest is away from home where it is farther out than so many times its spread.
NOISE = 3.0
# Nobody carries a payload by grasps so far apart [m].
FARTHEST = 50.0


def require_one_length_unit(log: TeamLog) -> None:
    """Raise BadValue where the positions of a robot are hundreds of times larger in one recording than in another."""
    for name in log.names:
        told = {r: _size(r.tracks[name]) for r in log.recordings if name in r.tracks}
        # A rest where home is says nothing of the unit: it is as far out as its noise spreads.
        sizes = {
            r.name: size for r, size in told.items() if size[1] > 0 and (r.kind != "still" or size[0] > NOISE * size[1])
        }
        if len(sizes) < 2:
            continue
        small, large = (choose(sizes, key=lambda where: sizes[where][0]) for choose in (min, max))
        far, spread = (sizes[large][k] / sizes[small][k] for k in (0, 1))
        if min(far, spread) > MANY:
            raise BadValue(
                f"positions of '{name}' are {about(far)} times as large in '{large}' as in '{small}', and spread "
                f"{about(spread)} times as far: one of them is not in the unit that was said. Set the unit "
                '("m" or "mm") that its "position" has there.'
            )


def require_metres(names: tuple[str, ...], grasps: Pose) -> None:
    """Raise BadValue where grasps (N,) lie farther apart than a payload is long; names the one that is far from all."""
    apart = np.linalg.norm(grasps.position[:, None] - grasps.position, axis=2)
    first, far = (int(i) for i in np.unravel_index(apart.argmax(), apart.shape))
    if apart[first, far] < FARTHEST:
        return
    odd = int(np.median(apart, axis=1).argmax())
    others = np.delete(np.delete(apart, odd, 0), odd, 1)
    if len(names) > 2 and others.max() < FARTHEST:
        who, whose = f"the grasp of '{names[odd]}' comes out {apart[odd].max():.3g} m from the others", "its"
    else:
        who = f"the grasps of '{names[first]}' and '{names[far]}' come out {apart[first, far]:.3g} m apart"
        whose = "each robot's"
    raise BadValue(
        f"{who}: lengths are not in the unit that was said. Set the unit "
        f'("mm" or "mm/s", say) that {whose} "position" or velocity has.'
    )


def _size(track: Track) -> tuple[float, float]:
    """Return how far from home positions are, and how far spread; zero where there are none."""
    if "position" not in track.channels:
        return 0.0, 0.0
    where = track.channels["position"][track.valid["position"]]
    if not len(where):
        return 0.0, 0.0
    return float(np.median(np.linalg.norm(where, axis=1))), float(np.linalg.norm(where.std(0)))
