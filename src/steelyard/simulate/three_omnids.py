"""The team of the demo: three Omnids carry one payload, with the noise of case C."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTruth, simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.simulate.team_recording import JointRecord
from steelyard.spatial import Pose

NAMES = ("left", "right", "rear")
LATE_S = {1: 0.013}  # the clock of the second robot runs behind, as on the paper's hardware


@dataclass(frozen=True, eq=False)
class ThreeOmnids:
    """The log, what every robot writes down by recording and name, and the truth."""

    log: TeamLog
    joints: tuple[Mapping[str, JointRecord], ...]
    truth: TeamTruth

    @property
    def grasps(self) -> dict[str, Pose]:
        """True poses X_RG by name."""
        return {name: self.truth.grasps[k] for k, name in enumerate(self.log.names)}

    @property
    def late_s(self) -> dict[str, float]:
        """True clock offsets against the reference by name [s]."""
        late = self.truth.late_s - self.truth.late_s[self.log.names.index(self.log.reference)]
        return dict(zip(self.log.names, np.asarray(late).tolist(), strict=True))


def told(made: ThreeOmnids, seed: int) -> str:
    """Return what a description of the session says first, with the truth."""
    body = made.truth.body
    com = ", ".join(f"{x:.4f}" for x in body.com)
    moments = ", ".join(f"{x:.3f}" for x in made.truth.moments)
    return (
        f"Three Omnids carry one payload: simulated joint angles and spring torques at 100 Hz, seed {seed}.\n"
        "10 s of free motion, four still poses, 52 s of motion; the clock of 'right' is 13 ms late.\n"
        f"The truth: {float(body.mass):g} kg, centre of mass ({com}) m, principal moments {moments} kg m^2."
    )


def three_omnids(seed: int) -> ThreeOmnids:
    """Return one session: 10 s of free motion, four still poses, 52 s of motion; "left" is the reference."""
    made = simulate_team(TeamScene(CASES["C"], late_s=LATE_S), seed)
    names = dict(zip(made.log.names, NAMES, strict=True))
    joints = tuple({names[name]: record for name, record in each.items()} for each in made.joints)
    return ThreeOmnids(made.log.renamed(names), joints, made.truth)
