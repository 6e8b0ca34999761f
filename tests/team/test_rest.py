"""Poses at rest count for what they tell: errors that last through a rest do not count anew in every row."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.poses.recurring import shares_at_rest
from steelyard.team.poses.team import PoseTeam


def rounded(log: TeamLog, step: float) -> TeamLog:
    """Return the log with positions in whole steps [m]."""
    return log.with_recordings(
        *(
            replace(
                r,
                tracks={
                    n: replace(t, channels={**t.channels, "position": step * np.round(t.channels["position"] / step)})
                    for n, t in r.tracks.items()
                },
            )
            for r in log.recordings
        )
    )


def off(made: TeamTrial, log: TeamLog) -> tuple[float, float]:
    """Return how far off grasps are (rms) [m], and in bars."""
    found = JointTeam().identify(log)
    error = np.array(
        [found.grasps[n].pose.position - made.truth.grasps.position[i] for i, n in enumerate(made.log.names) if i]
    )
    bars = np.array([found.grasps[n].std_m for n in made.log.names[1:]])
    return float(np.sqrt((error**2).mean())), float(np.sqrt(((error / bars) ** 2).mean()))


def test_rounded_positions_are_within_their_bars() -> None:
    off_by = []
    for seed in range(100, 108):
        made = simulate_team(TeamScene(NOISY, sensing="poses", still_samples=300, motion_samples=2000), seed)
        off_by.append(off(made, rounded(made.log, 1e-3))[1])
    assert float(np.sqrt(np.mean(np.square(off_by)))) < 1.5


def test_encoders_in_steps_cost_less_than_they_did(monkeypatch: pytest.MonkeyPatch) -> None:
    """Case A: 14 bits and hardly any noise, so that a rest is one reading."""
    made = [simulate_team(TeamScene(CASES["A"], motion_samples=2000), seed) for seed in range(100, 106)]
    now = np.array([off(one, one.log) for one in made])
    monkeypatch.setattr("steelyard.team.poses.team.shares_at_rest", lambda *_: None)
    before = np.array([off(one, one.log) for one in made])
    assert now[:, 0].mean() < 0.7 * before[:, 0].mean()
    assert np.sqrt((now[:, 1] ** 2).mean()) < 1.5


@pytest.mark.parametrize("sensing", ["joints", "poses"])
def test_rows_of_noise_all_count(sensing: str) -> None:
    noise = CASES["C"] if sensing == "joints" else NOISY
    log = simulate_team(TeamScene(noise, sensing=sensing, motion_samples=1500), 7).log  # type: ignore[arg-type]
    team = PoseTeam.of(log, True)
    assert shares_at_rest(team.parts, team.fit) is None
    assert team.fit.rows.data.share is None


def test_stills_alone_have_nothing_to_be_compared_with() -> None:
    log = simulate_team(TeamScene(CASES["A"], kinds=("still",), six_axis=frozenset({0, 1, 2})), 7).log
    team = PoseTeam.of(log, True)
    assert shares_at_rest(team.parts, team.fit) is None
