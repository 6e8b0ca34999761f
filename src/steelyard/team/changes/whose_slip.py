"""Whose grasp slipped, in a team of two: motion shows that one did, not which. The wrenches tell.

If the grasp of one slipped the payload stayed where the other held it, and its weight acts from there; the two
explanations put the centre of mass apart by the slip.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from steelyard.check import FAILURES
from steelyard.logs.team_log import TeamLog
from steelyard.team.estimate import TeamEstimate

# Residuals of forces times those of torques, beside the other explanation's, from which on the wrenches tell.
TOLD = 1.25
DOUBT = "It may have been the other robot's: of two, only wrenches tell, and not here."
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
    for number in range(_slips(found)):
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


def _slips(found: TeamEstimate) -> int:
    return sum(finding.code == "grasp-slipped" for finding in found.findings)


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
