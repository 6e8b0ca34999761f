"""Of two robots motion does not show whose grasp slipped; wrenches do, and where they do not, that is said."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, Slip, TeamScene
from steelyard.team.changes.found import DOUBT, whose_slip
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam


@cache
def made(robot: int, seed: int, start: float) -> TeamTrial:
    slip = Slip(robot, np.array([0.0, -0.012, 0.01]), start)
    return simulate_team(
        TeamScene(CASES["C"], 2, sensing="poses", slip=slip, six_axis=(0, 1), motion_samples=2000), seed
    )


@cache
def answer(robot: int, seed: int, start: float) -> TeamEstimate:
    return JointTeam().identify(made(robot, seed, start).log)


@pytest.mark.parametrize(("robot", "seed", "start"), [(0, 0, -1.0), (1, 1, -1.0), (0, 2, 9.0), (1, 0, 9.0)])
def test_the_wrenches_tell_whose_grasp_slipped(robot: int, seed: int, start: float) -> None:
    trial, found = made(robot, seed, start), answer(robot, seed, start)
    said = [f.message for f in found.findings if f.code == "grasp-slipped"]
    assert len(said) == 1
    assert said[0].startswith(f"The grasp of 'robot{robot}' slipped by ")
    off = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
    assert np.abs(off / found.std[:4]).max() < 4


def test_wrenches_that_do_not_tell_are_said(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steelyard.team.changes.found.TOLD", np.inf)
    found = JointTeam().identify(made(1, 0, 9.0).log)
    (said,) = (f.message for f in found.findings if f.code == "grasp-slipped")
    assert said.endswith(DOUBT)


def test_doubt_about_one_slip_outlives_the_next() -> None:
    whole = answer(1, 0, 9.0)
    (slip,) = (f for f in whole.findings if f.code == "grasp-slipped")

    def with_two(other: tuple[bool, ...]) -> TeamEstimate:
        """Return an answer with two slips: the first might be either's, the second is the other robot's."""
        torque = 0.1 if other[1:2] == (True,) else 1.0
        evidence = replace(whole.evidence, residual_force_N=1.0, residual_torque_Nm=torque)
        return replace(whole, findings=(slip, slip), evidence=evidence)

    first, second = whose_slip(made(1, 0, 9.0).log, with_two).findings
    assert first.message.endswith(DOUBT)
    assert second.message == slip.message


def test_a_caller_may_say_whose_it_was() -> None:
    trial = made(1, 0, 9.0)
    said = set()
    for slipped in ((), (True,)):
        found = JointTeam(slipped=slipped).identify(trial.log)
        (message,) = (f.message for f in found.findings if f.code == "grasp-slipped")
        said.add(message.split("'")[1])
    assert said == {"robot0", "robot1"}
