"""One robot whose forces are too large, too small or turned: named, taken out, and sound teams left as they are."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_teams import trial

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial
from steelyard.simulate.team_cases import TeamNoise
from steelyard.spatial import Rotation
from steelyard.team import weighed
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.payload import own_errors
from steelyard.team.payload.wrench_columns import equations, evidence_of_each

QUIET = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.3, torque_white_Nm=0.03)
WRONG = {"common-gain-unseen", "sensor-turned", "wrench-unexplained"}


def team(seed: int, **scene: Any) -> TeamTrial:
    """Return four robots with passive gimbals that push little against one another, unless `scene` says otherwise."""
    return trial(**{"noise": QUIET, "seed": seed, "robots": 4, "kinds": ("motion",), "squeeze_N": 2.0} | scene)


def with_forces(log: TeamLog, robot: int, changed: Callable[[Array], Array]) -> TeamLog:
    """Return the log with the wrench of one robot `changed`, forces and torques alike."""
    name, recordings = log.names[robot], []
    for one in log.recordings:
        track = one.tracks[name]
        channels = {c: changed(v) if c in {"force", "torque"} else v for c, v in track.channels.items()}
        recordings.append(replace(one, tracks={**one.tracks, name: replace(track, channels=channels)}))
    return replace(log, recordings=tuple(recordings))


def bars_off(found: TeamEstimate, made: TeamTrial) -> Array:
    """Return by how many bars mass and centre of mass are off (4,)."""
    return np.abs(found.parameters.people - made.truth.body.people)[:4] / found.std[:4]


@pytest.mark.parametrize("factor", [0.9, 0.95, 1.15])
@pytest.mark.parametrize("scene", [{}, {"six_axis": frozenset({0, 2}), "robots": 3}])
def test_one_robot_with_a_gain_of_its_own_is_named_and_taken_out(factor: float, scene: dict[str, Any]) -> None:
    made = team(11, **scene)
    found = JointTeam().identify(with_forces(made.log, 1, lambda each: factor * each))
    said = next(one.message for one in found.findings if one.code == "common-gain-unseen")
    assert "'robot1'" in said
    assert ("too much" in said) == (factor > 1)
    assert bars_off(found, made).max() < 3.0
    assert found.std[0] < 0.03 * found.mass


def test_a_turned_sensor_is_named_and_turned_back() -> None:
    made, turn = team(12), Rotation.exp(np.deg2rad([4.0, -2.0, 4.0]))
    found = JointTeam().identify(with_forces(made.log, 2, turn.apply))
    assert any(one.code == "sensor-turned" and "'robot2'" in one.message for one in found.findings)
    assert bars_off(found, made).max() < 3.0
    assert np.allclose(found.wrench_maps["robot2"][3:, 3:], turn.inverse().matrix, atol=0.02)


def test_of_two_robots_either_may_err() -> None:
    made = trial(QUIET, 13, robots=2, six_axis=frozenset({0, 1}), kinds=("motion",))
    found = JointTeam().identify(with_forces(made.log, 0, lambda each: 1.1 * each))
    assert "common-gain-unseen" in found.codes()
    assert bars_off(found, made).max() < 3.0
    assert found.std[0] > 0.02 * found.mass


@pytest.mark.parametrize("seed", range(6))
def test_sound_teams_are_left_as_they_are(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    made = team(20 + seed, robots=3 + seed % 3, kinds=("still", "motion"), squeeze_N=2.0 * seed)
    found = JointTeam().identify(made.log)
    assert not WRONG & set(found.codes())
    monkeypatch.setattr("steelyard.team.weighed.with_own_errors", lambda groups, fit, *_: (groups, fit, None))
    before = JointTeam().identify(made.log)
    assert np.array_equal(found.parameters.vector, before.parameters.vector)
    assert np.array_equal(found.covariance, before.covariance)


def test_evidence_of_all_at_once_is_that_of_each_by_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    given: list[Any] = []

    def seen(groups: Any, fit: Any, fitted: Any, D: Array, C: Array) -> Any:
        given.append((fit, D, C))
        return groups, fit, None

    monkeypatch.setattr(weighed, "with_own_errors", seen)
    made = team(14, kinds=("still", "motion"))
    JointTeam().identify(with_forces(made.log, 3, lambda force: 1.03 * force))
    fit, D, C = given[-1]
    nothing = np.zeros((4, own_errors.COLUMNS))
    expected = own_errors._tried(fit, D, C, own_errors._ways(4), nothing)[0]
    wide = equations(fit, D, own_errors._levers(D, 3))[1]
    columns = np.arange(nothing.size).reshape(nothing.shape)
    found = [evidence_of_each(wide, C, fit.scale, some, own_errors.USUAL) for some in (columns[:, :1], columns[:, 1:])]
    against = np.log(len(nothing) * own_errors.NOTHING)
    # But for the ridge that `Models.of` adds against rounding.
    np.testing.assert_allclose(np.concatenate(found) - against, expected[:-1], atol=1e-3)
    assert own_errors._most(fit, D, C, own_errors._ways(4)) == pytest.approx(expected.max(), abs=1e-3)
