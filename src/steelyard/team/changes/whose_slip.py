"""Whose grasp slipped, in a team of two: motion shows that one did, not which. The wrenches tell.

If the grasp of one slipped the payload stayed where the other held it, and its weight acts from there; the two
explanations put the centre of mass apart by the slip.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from steelyard.check import BREAKDOWNS
from steelyard.errors import BadValue, CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.team.estimate import TeamEstimate

# Residuals of forces times those of torques, beside the other explanation's, from which on the wrenches tell.
TOLD = 1.25
Other = tuple[bool, ...]


def whose_slip(log: TeamLog, answer: Callable[[Other], TeamEstimate]) -> TeamEstimate:
    """Return the answer of a team with every slip taken for that of the robot with which the wrenches fit best.

    answer  makes it with some slips, of those that motion shows, the clearest first, taken for the other robot's
    """
    found = answer(())
    if len(log.names) != 2:
        return found
    chosen: Other = ()
    for number in range(_slips(found)):
        try:
            turned = answer((*chosen, True))
        except (BadValue, CannotAnswer, *BREAKDOWNS):
            chosen = (*chosen, False)
            continue
        better = _misfit(found) / max(_misfit(turned), np.finfo(float).tiny)
        chosen = (*chosen, better > 1)
        found = turned if better > 1 else found
        if 1 / TOLD < better < TOLD:
            found = _doubted(found, number)
    return found


def _slips(found: TeamEstimate) -> int:
    return sum(finding.code == "grasp-slipped" for finding in found.findings)


def _misfit(found: TeamEstimate) -> float:
    return found.evidence.residual_force_N * found.evidence.residual_torque_Nm


def _doubted(found: TeamEstimate, number: int) -> TeamEstimate:
    """Return the answer with a word at one of its slips that it may be the other robot's."""
    places = [place for place, finding in enumerate(found.findings) if finding.code == "grasp-slipped"]
    findings = list(found.findings)
    for place in places[number : number + 1]:
        message = (
            f"{findings[place].message} It may have been the other robot's: of two, only wrenches tell, and not here."
        )
        findings[place] = replace(findings[place], message=message)
    return replace(found, findings=tuple(findings))
