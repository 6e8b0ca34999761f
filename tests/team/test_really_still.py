"""A recording that is called still and holds moves is read as the motion that it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_log import TeamLog
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.team.misread.files import with_moves_as_motion

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=0.5)


def made(*kinds: str) -> TeamLog:
    return simulate_team(TeamScene(NOISE, 3, kinds=kinds, sensing="poses", motion_samples=2000), 3).log


def called_still(log: TeamLog) -> TeamLog:
    return log.with_recordings(*(replace(recording, kind="still") for recording in log.recordings))


def test_moves_in_a_still_recording_count_as_motion() -> None:
    moving = made("motion")
    mistaken, rightly = identify_team(called_still(moving)), identify_team(moving)
    np.testing.assert_allclose(mistaken.parameters.vector, rightly.parameters.vector, rtol=1e-12)
    assert "wrench-unexplained" not in mistaken.codes()
    assert mistaken.notes[0].startswith("'motion-0' is called still, but turns by ")


def test_what_is_held_stays_still() -> None:
    log = made("still", "motion")
    read, notes = with_moves_as_motion(log)
    assert not notes
    assert read is log


@pytest.mark.parametrize("other", [0, 1, 2])
def test_one_robot_that_stays_is_enough_for_rest(other: int) -> None:
    """Where one robot moves beside others that do not, it has let go or errs: the payload rests."""
    log = called_still(made("motion"))
    name = log.names[other]
    held = []
    for recording in log.recordings:
        track = recording.tracks[name]
        channels = {c: np.repeat(track.channels[c][:1], len(track), 0) for c in ("rotation", "position")}
        own = {name: replace(track, channels={**track.channels, **channels})}
        held.append(replace(recording, tracks={**recording.tracks, **own}))
    assert not with_moves_as_motion(log.with_recordings(*held))[1]
