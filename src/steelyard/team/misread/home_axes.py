"""Wrenches given in the axes of the robots' homes, as many controllers give them, not in those of their grasps.

Axes that turn against the grasp's are no reading that sums of products hold: a log whose wrenches fit no body, or only
in another unit or order of axes, is identified anew with the wrench of each robot, and of all, turned into its grasp.
It is taken so where what is left over then falls by far, clearly more than with any other robot, and nothing of the
wrenches is left to be explained.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np

from steelyard.check import FAILURES
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, about, quoted
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.estimate import TeamEstimate

# What says that wrenches fit no body, or one only when they are read otherwise.
ASKS = {"wrench-unexplained", "force-unit", "wrench-sign-flipped"}
# What is left of forces times what is left of torques must fall by the first factor, and be less than with the next
# best by the second.
FALLS, CLEAR = 4.0, 2.0
# Each costs a fit: of more robots than this only all together are tried.
_MOST = 8

Identify = Callable[[TeamLog], TeamEstimate]


def with_grasp_axes(log: TeamLog, identify: Identify) -> TeamEstimate:
    """Return the answer, with wrenches that are given in home axes turned into the grasps', and a finding that says so.

    Raises what `identify` raises of the log as given, where no other axes give an answer.
    """
    try:
        found = identify(log)
    except CannotAnswer:
        better = _best(log, identify, np.inf)
        if better is None:
            raise
        return better
    if not found.codes() & ASKS:
        return found
    return _best(log, identify, _misfit(found)) or found


def _best(log: TeamLog, identify: Identify, given: float) -> TeamEstimate | None:
    """Return the answer with other axes that leaves clearly less than `given` and all others; None where none does."""
    tried = []
    for names in _suspects(log):
        try:
            found = identify(_turned(log, names))
        except FAILURES:
            continue
        tried.append((_misfit(found), names, found))
    tried.sort(key=lambda one: one[0])
    if not tried or tried[0][2].codes() & ASKS:
        return None
    least, names, found = tried[0]
    rival = min((given / FALLS, *(other / CLEAR for other, _, _ in tried[1:])))
    return replace(found, findings=(_finding(names, given / least), *found.findings)) if least < rival else None


def _suspects(log: TeamLog) -> Iterator[tuple[str, ...]]:
    """Yield each robot, and all, whose wrenches can be turned into their grasps."""
    names = tuple(
        name
        for name in log.names
        if log.has_wrench(name) and all(t.has("rotation") for _, t in log.tracks_of(name) if t.has("force"))
    )
    if len(names) <= _MOST:
        yield from ((name,) for name in names)
    if len(names) > 1:
        yield names


def _turned(log: TeamLog, names: tuple[str, ...]) -> TeamLog:
    """Return the log with these robots' wrenches, given in home axes, in those of their grasps."""
    return log.with_recordings(*(r.changed(_in_grasp, dict.fromkeys(names, None)) for r in log.recordings))


def _in_grasp(track: Track, _: None) -> Track:
    back = track.rotation.inverse()
    turned = {name: back.apply(track.channels[name]) for name in ("force", "torque") if name in track.channels}
    seen = {name: track.valid[name] & track.mask("rotation") for name in turned}
    return replace(track, channels={**track.channels, **turned}, valid={**track.valid, **seen})


def _misfit(found: TeamEstimate) -> float:
    return found.evidence.residual_force_N * found.evidence.residual_torque_Nm


def _finding(names: tuple[str, ...], factor: float) -> Finding:
    whose = quoted(names, " and ")
    less = f": of forces times torques {about(factor)} times less is left over" if np.isfinite(factor) else ""
    return Finding(
        "gravity-frame",
        f"The wrenches of {whose} fit one body in the axes of the home, not in those of the grasp{less}. "
        "They were taken so.",
        f'Set frame = "W" in "force" (and "torque") of {whose}, or have the controller give them in the tool\'s axes.',
    )
