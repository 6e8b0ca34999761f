"""A payload that stands on something before it is lifted: what robots do not bear meanwhile is no one's mistake."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_teams import NOISY, NOISY_TWISTS

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamScene
from steelyard.team.joint import JointTeam


def stood(log: TeamLog, seconds: float, share: float, tared: bool = False) -> TeamLog:
    """The log with a stand that bears all but a share of what robots push at first; tared: sensors, at its end."""
    (recording,) = log.recordings
    tracks = {}
    for name, track in recording.tracks.items():
        lifted = np.clip((track.time - track.time[0] - seconds) / 0.3, 0.0, 1.0)[:, None]
        felt = {
            c: track.channels[c] * (share + (1 - share) * lifted) for c in {"force", "torque"} & set(track.channels)
        }
        if tared:
            felt = {c: values - values[np.argmax(lifted > 0) - 1] for c, values in felt.items()}
        tracks[name] = replace(track, channels={**track.channels, **felt})
    return log.with_recordings(replace(recording, tracks=tracks))


def made(seed: int, robots: int = 3, **scene: object) -> TeamTrial:
    noise = NOISY_TWISTS if "sensing" in scene else NOISY
    usual = {"sensing": "poses", "kinds": ("motion",), "motion_samples": 3000, "robots": robots}
    return simulate_team(TeamScene(noise, **(usual | {"six_axis": frozenset({0, 1})} | scene)), seed)


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("robots", [2, 4])
def test_a_payload_that_stands_at_first_is_weighed_by_the_rest(seed: int, robots: int) -> None:
    trial = made(seed, robots)
    for share, tared in ((0.1, False), (0.0, True), (0.3, False)):
        found = JointTeam().identify(stood(trial.log, 9.0, share, tared))
        (said,) = (f for f in found.findings)
        assert said.code == "contact"
        assert "as where it stands on something" in said.message
        assert float(said.message.split("For ")[1].split(" s of")[0]) == pytest.approx(9.5, abs=1.2)
        error = np.append(found.mass, found.com) - np.append(trial.truth.body.mass, trial.truth.body.com)
        assert float(np.abs(error / found.std[:4]).max()) < 4.5


def test_with_twists_as_well() -> None:
    trial = made(1, 3, sensing="twists")
    found = JointTeam().identify(stood(trial.log, 9.0, 0.1))
    assert found.codes() == {"contact"}
    assert abs(found.mass - trial.truth.body.mass) < 4 * found.std[0]


@pytest.mark.parametrize("seed", range(3))
def test_sensors_that_were_tared_under_load_are_not_on_a_stand(seed: int) -> None:
    trial = made(seed)
    (recording,) = trial.log.recordings
    tared = {}
    for name, track in recording.tracks.items():
        felt = {
            c: track.channels[c] - track.channels[c][:20].mean(0) for c in {"force", "torque"} & set(track.channels)
        }
        tared[name] = replace(track, channels={**track.channels, **felt})
    found = JointTeam().identify(trial.log.with_recordings(replace(recording, tracks=tared)))
    assert "contact" not in found.codes()
