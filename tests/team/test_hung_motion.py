"""A robot whose driver repeats its last pose: named, and left out until it goes on."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog, TeamRecording, TeamRobot
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene, case
from steelyard.spatial import Rotation
from steelyard.team.hung_motion import without_hung

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5, torque_white_Nm=0.02)
SCENE = TeamScene(
    NOISE, 3, sensing="poses", six_axis=frozenset(range(3)), kinds=("still", "motion"), motion_samples=2000
)


def hanging(log: TeamLog, name: str, *rows: slice) -> TeamLog:
    """Return the log in whose motions a robot says the first pose of these rows in all of them."""

    def held(values: Array) -> Array:
        out = values.copy()
        for some in rows:
            out[some] = values[some][0]
        return out

    def hung(track: Track) -> Track:
        poses = {q: held(track.channels[q]) for q in ("rotation", "position")}
        return replace(track, channels={**track.channels, **poses})

    return log.with_recordings(
        *(
            replace(r, tracks={n: hung(t) if n == name and r.kind == "motion" else t for n, t in r.tracks.items()})
            for r in log.recordings
        )
    )


@pytest.mark.parametrize(
    "rows",
    [
        (slice(700, 1200),),
        (slice(0, 300),),
        (slice(1500, None),),
        tuple(slice(k, k + 100) for k in range(200, 1800, 300)),
    ],
    ids=["once", "at first", "to the end", "often"],
)
@pytest.mark.parametrize("name", ["robot0", "robot1"])
def test_a_pose_that_is_repeated_is_named_and_left_out(name: str, rows: tuple[slice, ...]) -> None:
    trial = simulate_team(SCENE, 3)
    found = identify_team(hanging(trial.log, name, *rows))
    told = [one.message for one in found.findings if one.code == "channel-stuck"]
    assert len(told) == 1
    assert f"The motion of '{name}' stands still in " in told[0]
    assert "left out" in told[0]
    assert not {"clock-unsteady", "grasp-slipped", "robot-excluded", "rows-missing", "wrench-unexplained"} & set(
        found.codes()
    )
    truth = trial.truth.body
    assert abs(found.mass - truth.mass) < 3.5 * found.std[0]
    assert (np.abs(found.com - truth.com) < 3.5 * found.std[1:4]).all()


def test_more_than_can_be_spared_is_named_only() -> None:
    log = hanging(simulate_team(SCENE, 0).log, "robot1", slice(100, 1900))
    kept, found = without_hung(log)
    assert "used as they are" in found[0].message
    assert kept is log


@pytest.mark.parametrize("name", CASES)
def test_sound_logs_are_left_as_they_are(name: str) -> None:
    log = simulate_team(case(name), 0).log
    assert without_hung(log) == (log, ())


def test_rests_that_repeat_exactly_and_numbers_that_are_missing_do_not_hang() -> None:
    time = np.arange(0, 12, 0.01)
    angle = np.floor(time / 3) + np.clip(time / 3 % 1 * 2 - 1, 0, 1) ** 2  # rests at first, then turns for as long
    angle = np.minimum(angle, 3.0)[:, None]
    poses = Rotation.exp(0.1 * angle * [1.0, 0.5, 0.2])
    missing = 0.1 * angle * [1.0, 2.0, 3.0]
    missing[230:260] = np.nan
    tracks = {
        "a": Track.of(time, rotation=poses, position=0.1 * angle * [1.0, 2.0, 3.0]),
        "b": Track.of(time, rotation=poses, position=missing),
    }
    robots = tuple(TeamRobot(name, np.array([0, 0, -9.81])) for name in tracks)
    log = TeamLog(robots, (TeamRecording("motion", tracks, "run"),), "a")
    assert without_hung(log) == (log, ())
