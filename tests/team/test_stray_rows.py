"""Single rows of a robot that are wrong: spikes, lost messages, poses that leap; named, and left out."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.pipelines.shared_payload import identify_team
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene, case
from steelyard.team.stray_rows import without_strays

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.5, torque_white_Nm=0.02)
SCENE = TeamScene(
    NOISE, 3, sensing="poses", six_axis=frozenset(range(3)), kinds=("still", "motion"), motion_samples=2000
)
ROWS = np.array([100, 371, 372, 900, 901, 902, 1500])


def changed(log: TeamLog, channel: str, change: Callable[[Array], Array], kind: str = "motion") -> TeamLog:
    """Return the log in whose recordings of a kind the numbers of robot1 in a channel are changed."""

    def other(track: Track) -> Track:
        return replace(track, channels={**track.channels, channel: change(track.channels[channel].copy())})

    return log.with_recordings(
        *(r.changed(lambda t, _: other(t), {"robot1": None}) if r.kind == kind else r for r in log.recordings)
    )


def leaping(rows: Array, by: float, axis: int = 1) -> Callable[[Array], Array]:
    def change(values: Array) -> Array:
        values[rows, axis] += by
        return values

    return change


def nothing(values: Array) -> Array:
    values[ROWS] = 0.0
    return values


@pytest.mark.parametrize(
    ("channel", "change"),
    [
        ("force", leaping(ROWS, 80.0)),
        ("force", nothing),
        ("torque", leaping(ROWS, 5.0)),
        ("position", leaping(ROWS, 0.02)),
    ],
    ids=["spikes", "zeros", "torques", "poses"],
)
def test_rows_that_leap_are_named_and_left_out(channel: str, change: Callable[[Array], Array]) -> None:
    made = simulate_team(SCENE, 5)
    sound, found = identify_team(made.log), identify_team(changed(made.log, channel, change))
    assert found.codes() - sound.codes() == {"outliers"}
    assert f"'robot1' leaps away from the rows before and after in 7 of 2000 rows of 'motion-4' ({channel})" in (
        found.findings[0].message
    )
    std = np.sqrt(np.diag(sound.covariance))
    assert (np.abs(found.parameters.vector - sound.parameters.vector) < 0.5 * std).all()
    assert (np.sqrt(np.diag(found.covariance)) < 1.3 * std).all()


def test_the_first_and_last_rows_count() -> None:
    log = simulate_team(SCENE, 5).log
    found = without_strays(changed(log, "force", leaping(np.array([0, 1, -1]), 80.0)))[0].recordings[-1]
    lost = np.flatnonzero(~found.tracks["robot1"].valid["force"])
    assert lost.tolist() == [0, 1, 1999]
    assert found.tracks["robot1"].valid["torque"].tolist() == found.tracks["robot1"].valid["force"].tolist()


@pytest.mark.parametrize("quantum", [0.1, 1.0, 5.0])
def test_coarse_forces_do_not_leap(quantum: float) -> None:
    log = simulate_team(case("D"), 3).log
    for name in log.names:
        log = log.with_recordings(
            *(
                r.changed(
                    lambda t, q: replace(t, channels={**t.channels, "force": np.round(t.channels["force"] / q) * q}),
                    {name: quantum},
                )
                for r in log.recordings
            )
        )
    assert without_strays(log) == (log, ())


def test_a_slip_or_a_load_that_stays_is_no_leap() -> None:
    log = simulate_team(SCENE, 5).log
    after = np.arange(1000, 2000)
    for channel, by in (("position", 0.02), ("force", 30.0)):
        assert without_strays(changed(log, channel, leaping(after, by)))[1] == ()


def test_rows_that_leap_all_the_time_are_kept() -> None:
    log = changed(simulate_team(SCENE, 5).log, "force", leaping(np.arange(0, 2000, 4), 80.0))
    assert without_strays(log) == (log, ())
