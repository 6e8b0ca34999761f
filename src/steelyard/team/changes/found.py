"""Robots that let go for a while and grasps that slip: found on the way to a joint fit, and taken out of it.

First the rows in which a robot pushes with nothing are left out, then those stay out in which it is not where the
others say. Then slips, the clearest first, each judged anew by a fit without what follows it.
Whose grasp slipped, in a team of two, motion does not show: the wrenches tell. If the grasp of one slipped the payload
stayed where the other held it, and its weight acts from there; the two explanations put the centre of mass apart by the
slip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from steelyard.check import FAILURES, Mask
from steelyard.logs.team_log import TeamLog
from steelyard.team.changes.presence import LIGHT, SHARE, as_long, idle, let_go, presence_findings, strayers
from steelyard.team.changes.slips import Slip
from steelyard.team.clocks.errors import NOTHING
from steelyard.team.estimate import TeamEstimate
from steelyard.team.motion_fit import F
from steelyard.team.stacked import Stretch

MOST_SLIPS = 3
# Noise of a rough fit that stays so must fall by this factor on average where a slip between recordings is to explain
# it.
BETTER = 3.0

Edit = Callable[[tuple[Stretch, ...]], tuple[Stretch, ...]]
# Fewer seconds in which two robots surely hold the payload tell nothing of who goes ways of its own.
FEW_S = 2.0
# Residuals of forces times those of torques, beside the other explanation's, from which on the wrenches tell.
TOLD = 1.25
DOUBT = "It may have been the other robot's: of two, only wrenches tell, and not here."


def without_changes(
    log: TeamLog, clocks: bool, raw: tuple[Stretch, ...], fitted: Callable[[Edit], F], other: Sequence[bool] = ()
) -> F:
    """Return the fit without what robots that let go and grasps that slip say, and with findings that name them.

    raw     the recordings as they are, seen where the fit can use them
    fitted  makes the fit of recordings after an edit
    other   which slips of two robots, the clearest first, are taken for those of the robot that does not show them best
    """
    bare = idle(raw, SHARE)
    given = None if any(rows.any() for rows in bare) else fitted(_unchanged)
    # One who goes ways of its own makes a rough fit; else who pushes with little merely does.
    asked = None if given is not None and not given.rough else _asked(raw, idle(raw, LIGHT), fitted)
    if asked is None:
        given = fitted(_unchanged) if given is None else given
        return _without_slips(log, clocks, given, fitted, _unchanged, other)
    resting, team = asked
    off = team.off(log)
    strays = strayers(raw, resting, off)

    def edit(parts: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
        each = zip(parts, bare, resting, off, strict=True)
        return tuple(let_go(part, rows, light, apart, strays) for part, rows, light, apart in each)

    found = presence_findings(raw, edit(raw), log.names)
    team = _without_slips(log, clocks, fitted(edit), fitted, edit, other)
    return replace(team, findings=(*found, *team.findings))


def _asked(
    raw: Sequence[Stretch], light: Sequence[Mask], fitted: Callable[[Edit], F]
) -> tuple[Sequence[Mask], F] | None:
    """Return rows (T, N) in which robots that push with little may have let go, and the fit without those poses.

    All robots' rows; where too little is left without them, those of the robot without whom the others agree best, as
    where one bears more since another let go. None where nobody pushes with little.
    """
    if not any(rows.any() for rows in light):
        return None
    sure = (((p.seen & ~r).sum(1) > 1).sum() / p.rate for p, r in zip(raw, light, strict=True) if len(p) > 1)
    if sum(sure) >= FEW_S:
        with suppress(*FAILURES):
            return light, fitted(partial(_unseen, rows=light))
    best: tuple[Sequence[Mask], F] | None = None
    for robot in np.flatnonzero(np.any([rows.any(0) for rows in light], axis=0)):
        own = [rows & (np.arange(rows.shape[1]) == robot) for rows in light]
        try:
            team = fitted(partial(_unseen, rows=own))
        except FAILURES:
            continue
        if best is None or np.log(team.fit.noise).sum() < np.log(best[1].fit.noise).sum():
            best = own, team
    return best


def _without_slips(
    log: TeamLog, clocks: bool, given: F, fitted: Callable[[Edit], F], edit: Edit, other: Sequence[bool]
) -> F:
    """Return the fit with grasps that slip taken out from there on, their wrenches moved to where they were.

    Clocks are judged before: one that is set anew passes for slips.
    """
    team, slips = given, list[Slip]()
    left = given.clock_errors(log) if clocks else NOTHING
    for _ in range(MOST_SLIPS):
        found = team.slip(log)
        if found is None:
            break
        if any(other[len(slips) : len(slips) + 1]):
            found = replace(found, robot=1 - found.robot)
        # Once more without what follows the slip, which has bent the first fit.
        before = team
        try:
            team = fitted(edited(edit, [*slips, found]))
        except FAILURES:
            break
        # Recordings that differ for another reason than a slip, as a hinge, still do.
        fallen = float(np.log(before.fit.noise / team.fit.noise).mean())
        if before.rough and team.rough and found.between and fallen < np.log(BETTER):
            break
        slip = team.measured(log, found.beside(slips))
        if slip is None:
            break
        slips.append(slip)
    if not slips:
        return replace(given, clocks_left=left)
    team = fitted(edited(edit, slips))
    return replace(team, findings=tuple(slip.finding(log) for slip in slips), clocks_left=left)


def edited(edit: Edit, slips: Sequence[Slip]) -> Edit:
    """Return an edit of recordings after which slips are taken out too."""

    def both(parts: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
        parts = edit(parts)
        for slip in slips:
            parts = slip.applied(parts)
        return parts

    return both


def _unchanged(parts: tuple[Stretch, ...]) -> tuple[Stretch, ...]:
    return parts


def _unseen(parts: tuple[Stretch, ...], rows: Sequence[Mask]) -> tuple[Stretch, ...]:
    return tuple(replace(p, seen=p.seen & ~as_long(r, len(p))) for p, r in zip(parts, rows, strict=True))


Other = tuple[bool, ...]


def whose_slip(log: TeamLog, answer: Callable[[Other], TeamEstimate]) -> TeamEstimate:
    """Return the answer of a team with every slip taken for that of the robot with which the wrenches fit best.

    answer  makes it with some slips, of those that motion shows, the clearest first, taken for the other robot's
    """
    found = answer(())
    if len(log.names) != 2:
        return found
    chosen: Other = ()
    doubtful = []
    for number in range(sum(finding.code == "grasp-slipped" for finding in found.findings)):
        try:
            turned = answer((*chosen, True))
        except FAILURES:
            chosen = (*chosen, False)
            continue
        better = _misfit(found) / max(_misfit(turned), np.finfo(float).tiny)
        chosen = (*chosen, better > 1)
        found = turned if better > 1 else found
        if 1 / TOLD < better < TOLD:
            doubtful.append(number)
    return _doubted(found, doubtful)


def _misfit(found: TeamEstimate) -> float:
    return found.evidence.residual_force_N * found.evidence.residual_torque_Nm


def _doubted(found: TeamEstimate, doubtful: Sequence[int]) -> TeamEstimate:
    """Return the answer with a word at some of its slips, by number, that they may be the other robot's."""
    findings, number = [], 0
    for finding in found.findings:
        if finding.code == "grasp-slipped":
            if number in doubtful:
                finding = replace(finding, message=f"{finding.message} {DOUBT}")
            number += 1
        findings.append(finding)
    return replace(found, findings=tuple(findings))
