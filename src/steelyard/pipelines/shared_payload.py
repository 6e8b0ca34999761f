"""One payload, many robots: the log of a team becomes a TeamEstimate.

    poses and twists -> where everybody holds the payload, and when -> the payload's motion and the sum of wrenches
    -> mass, centre of mass, inertia

Two ways through the same rooms: the paper's, step after step, and one joint estimate.
Source: "Cooperative Payload Estimation by a Team of Mocobots".
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Literal, get_args

from steelyard.errors import BadValue
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.team import PublishedTeam, TeamEstimate
from steelyard.team.joint import JointTeam

Method = Literal["joint", "paper"]
METHODS: tuple[Method, ...] = get_args(Method)

# joint  every grasp, home and clock at once, then one fit of the ten parameters to still and moving rows together
# paper  grasps from twists (eq. 1-8), loops closed, mass and centre of mass at rest (9-16), inertia in motion (17-33)
ESTIMATORS: Mapping[Method, JointTeam | PublishedTeam] = MappingProxyType(
    {"joint": JointTeam(), "paper": PublishedTeam()}
)


def identify_team(log: TeamLog, method: Method = "joint") -> TeamEstimate:
    """Return every grasp, mass, centre of mass and inertia, in the grasp frame of the reference robot.

    Raises CannotAnswer where the data do not determine them, BadInput where they make no sense.
    """
    if method not in METHODS:
        raise BadValue(f"method must be one of {', '.join(METHODS)}; got {method!r}.")
    found = ESTIMATORS[method].identify(log)
    return replace(found, findings=(*_missing_rows(log), *found.findings))


def _missing_rows(log: TeamLog) -> Iterator[Finding]:
    """Yield a finding for every robot that misses numbers in some rows of a recording."""
    for recording in log.recordings:
        for name, track in recording.tracks.items():
            lost = {channel: int((~good).sum()) for channel, good in track.valid.items() if not good.all()}
            if lost:
                most = max(lost.values())
                shown = ", ".join(lost)
                yield Finding.of(
                    "rows-missing",
                    f"'{name}' has no number in {most} of {len(track)} rows of '{recording.name}' ({shown}).",
                )
