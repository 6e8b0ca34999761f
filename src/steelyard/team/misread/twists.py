"""One robot whose linear velocities are in another unit: its twists fit the others' once they are scaled."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from steelyard.check import FAILURES
from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.twists.team import TwistTeam

# What velocities may be in, read as m/s [m/s].
UNITS = {"mm/s": 1e-3, "cm/s": 1e-2, "inches/s": 0.0254}
# So read, noise is below this share of the twists, and these shares fall by this factor (rms).
FITS, CLOSES = 0.3, 4.0
# Scales within this factor of the best are as good.
AS_GOOD = 1.5


def require_one_velocity_unit(log: TeamLog, team: TwistTeam) -> None:
    """Raise BadValue where twists fit far better once one robot's linear velocities are read in another unit."""
    given = float(np.sqrt((team.share**2).mean()))
    found = sorted(_tried(log), key=lambda one: one[0])
    if not found or found[0][0] > given / CLOSES or found[0][1] > FITS:
        return
    said = [f"of '{name}' are in {unit}" for left, _, name, unit in found if left < AS_GOOD * found[0][0]]
    raise BadValue(
        f"the robots' twists do not fit one payload, and do so if the linear velocities {' or '.join(said)}: "
        f"{100 * found[0][0]:.2g} % of them is then noise, as given {100 * given:.2g} %. Convert them to m/s."
    )


def _tried(log: TeamLog) -> Iterator[tuple[float, float, str, str]]:
    """Yield the shares of noise (rms and largest) when a robot's velocities are in a unit, its name, and the unit."""
    for name in log.names:
        if not any(track.has("linear_velocity") for _, track in log.tracks_of(name)):
            continue
        for unit, size in UNITS.items():
            try:
                share = TwistTeam.of(
                    log.with_recordings(*(r.changed(_times, {name: size}) for r in log.recordings)), False
                ).share
            except FAILURES:
                continue
            yield float(np.sqrt((share**2).mean())), float(share.max()), name, unit


def _times(track: Track, size: float) -> Track:
    if not track.has("linear_velocity"):
        return track
    return replace(track, channels={**track.channels, "linear_velocity": size * track.channels["linear_velocity"]})
