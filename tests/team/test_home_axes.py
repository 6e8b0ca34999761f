"""Wrenches in the axes of homes, of one robot or all, are turned into those of the grasps and named; others stay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import trial

from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import TeamTrial
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.misread.home_axes import with_grasp_axes


def at_home(log: TeamLog, *names: str) -> TeamLog:
    """Return the log with the wrenches of these robots in the axes of their homes."""

    def turned(track: Track, _: None) -> Track:
        both = {n: track.rotation.apply(track.channels[n]) for n in ("force", "torque") if n in track.channels}
        return replace(track, channels={**track.channels, **both})

    return log.with_recordings(*(r.changed(turned, dict.fromkeys(names, None)) for r in log.recordings))


def alike(found: TeamEstimate, made: TeamTrial) -> None:
    right = identify_team(made.log)
    np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-6, atol=1e-6)
    assert [f.code for f in found.findings if f.code != "gravity-frame"] == [f.code for f in right.findings]


@pytest.mark.parametrize("names", [("robot1",), ("robot0", "robot1", "robot2")])
@pytest.mark.parametrize("six_axis", [frozenset(), frozenset({0, 1, 2})])
def test_they_are_turned_into_the_grasps(names: tuple[str, ...], six_axis: frozenset[int]) -> None:
    made = trial(six_axis=six_axis)
    found = identify_team(at_home(made.log, *names))
    (said,) = (finding for finding in found.findings if finding.code == "gravity-frame")
    assert f"wrenches of {' and '.join(repr(name) for name in names)} fit" in said.message
    assert 'frame = "W"' in said.remedy
    alike(found, made)


def test_one_of_two_arms() -> None:
    made = trial(robots=2, six_axis=frozenset({0, 1}))
    alike(identify_team(at_home(made.log, "robot1")), made)


def test_where_other_axes_do_not_help_the_answer_stays() -> None:
    made = trial()
    given = JointTeam().identify(made.log)
    asked = replace(given, findings=(Finding.of("wrench-unexplained", "It fits no body."),))
    tried = []

    def identify(log: TeamLog) -> TeamEstimate:
        tried.append(log)
        if len(tried) == 1:
            return asked
        raise CannotAnswer("with other axes nothing fits.")

    assert with_grasp_axes(made.log, identify) is asked
    assert len(tried) == 5


def test_a_refusal_stays_where_other_axes_are_refused_too() -> None:
    def identify(log: TeamLog) -> TeamEstimate:
        raise CannotAnswer("nothing fits.")

    with pytest.raises(CannotAnswer, match="nothing fits"):
        with_grasp_axes(trial().log, identify)
