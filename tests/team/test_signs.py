"""Forces of the wrong sign: of one robot they are put right, of all they are refused."""

from __future__ import annotations

import contextlib
from dataclasses import replace

import numpy as np
import pytest
from made_teams import ALL_KINDS, HINGE, NOISY, trial

from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamScene
from steelyard.team.joint import JointTeam
from steelyard.team.mass_and_com import require_lift
from steelyard.team.published import PublishedTeam
from steelyard.team.weighed import _require_one_clock


def turned(log: TeamLog, *names: str, of: tuple[str, ...] = ("force", "torque")) -> TeamLog:
    """Return the log with what these robots push, or but their forces or torques, of the other sign."""
    made = []
    for recording in log.recordings:
        tracks = dict(recording.tracks)
        for name in names:
            track = tracks[name]
            pushed = {key: -value for key, value in track.channels.items() if key in of}
            tracks[name] = replace(track, channels={**track.channels, **pushed})
        made.append(replace(recording, tracks=tracks))
    return log.with_recordings(*made)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
@pytest.mark.parametrize("robots", [2, 3, 6])
def test_one_wrong_sign_is_put_right_and_named(robots: int, sensing: str) -> None:
    made = trial(robots=robots, sensing=sensing)  # with twists, bases stand and positions are not measured
    right = JointTeam().identify(made.log)
    assert "wrench-sign-flipped" not in right.codes()
    for name in made.log.names:
        found = JointTeam().identify(turned(made.log, name))
        assert "wrench-sign-flipped" in found.codes()
        assert f"'{name}'" in next(f.message for f in found.findings if f.code == "wrench-sign-flipped")
        assert found.mass == pytest.approx(right.mass, rel=1e-9)


@pytest.mark.parametrize("wrong", ["force", "torque"])
@pytest.mark.parametrize("robots", [2, 3])
def test_a_sign_of_forces_or_torques_alone_is_put_right(robots: int, wrong: str) -> None:
    """Torques that went along with the forces' sign had made an inertia of 0.35 kg m^2 one of 0.01 +- 0.03."""
    made = trial(robots=robots, six_axis=frozenset(range(robots)))
    right = JointTeam().identify(made.log)
    for name in made.log.names:
        found = JointTeam().identify(turned(made.log, name, of=(wrong,)))
        (said,) = (f for f in found.findings if f.code == "wrench-sign-flipped")
        assert f"the sign of its {wrong}s was turned" in said.message
        assert f"the {wrong} columns of '{name}'" in said.remedy
        np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(found.std, right.std, rtol=1e-4)
    assert "wrench-sign-flipped" not in right.codes()


def tared(log: TeamLog) -> TeamLog:
    """Return the log with every sensor set to zero under the load of the first row."""
    made, first = [], log.recordings[0].tracks
    for recording in log.recordings:
        tracks = dict(recording.tracks)
        for name, track in tracks.items():
            read = {k: v - first[name].channels[k][0] for k, v in track.channels.items() if k in ("force", "torque")}
            tracks[name] = replace(track, channels={**track.channels, **read})
        made.append(replace(recording, tracks=tracks))
    return log.with_recordings(*made)


@pytest.mark.parametrize("robots", [2, 3])
@pytest.mark.parametrize("seed", [100, 102, 104])
def test_sensors_tared_under_load_still_weigh(robots: int, seed: int) -> None:
    """Their raw sums say a mass of about zero, of either sign; what varies with tilt says 12 kg."""
    found = JointTeam().identify(tared(trial(robots=robots, seed=seed).log))
    assert abs(found.mass - 12) < 4 * found.std[0] < 2
    assert not found.codes() & {"wrench-sign-flipped", "robot-left", "robot-joined"}


def test_all_signs_wrong_are_refused_after_taring_under_load() -> None:
    with pytest.raises(CannotAnswer, match="the forces must hold the payload up; they add up to a mass of -1"):
        JointTeam().identify(turned(tared(trial().log), "robot0", "robot1", "robot2"))


def test_a_level_payload_that_was_tared_under_load_has_no_wrong_sign() -> None:
    """Whatever sign the mass then has by chance, it is open, and no sign is to be blamed."""
    level = replace(NOISY, force_bias_N=0.0)
    for seed in range(100, 104):
        scene = TeamScene(level, 3, sensing="poses", kinds=("still", "grasp"), still_turns=((0.0, 0.0, 0.0),) * 3)
        log = tared(simulate_team(scene, seed).log)
        with contextlib.suppress(CannotAnswer):
            found = JointTeam().identify(log)
            assert abs(found.mass - 12) < 4 * found.std[0]
            continue
        with pytest.raises(CannotAnswer, match="do not show the mass"):
            JointTeam().identify(log)


def test_all_signs_wrong_are_refused() -> None:
    made = trial()
    with pytest.raises(CannotAnswer, match="a mass of -12 kg"):
        JointTeam().identify(turned(made.log, *made.log.names))


def test_both_methods_refuse_in_the_same_words() -> None:
    wrong, said = turned(trial().log, "robot0", "robot1", "robot2"), []
    for method, forces in ((JointTeam(), "the forces"), (PublishedTeam(), "the still forces")):
        with pytest.raises(CannotAnswer) as refused:
            method.identify(wrong)
        said.append(str(refused.value).removeprefix(forces))
    assert said[0] == said[1]
    with pytest.raises(CannotAnswer, match="the springs must hold the payload up; they add up to a mass of nan kg"):
        require_lift(float("nan"), "the springs")
    require_lift(1e-3, "the springs")


def hinged() -> TeamTrial:
    return trial(robots=4, hinge=HINGE)


def test_a_wrong_sign_is_put_right_beside_a_hinge() -> None:
    made = hinged()
    right = JointTeam().identify(made.log)
    assert right.codes() == {"payload-jointed"}
    for name in ("robot0", "robot3"):
        found = JointTeam().identify(turned(made.log, name))
        assert found.codes() == {"payload-jointed", "wrench-sign-flipped"}
        assert f"'{name}'" in next(f.message for f in found.findings if f.code == "wrench-sign-flipped")
        np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-9, atol=1e-9)


def test_all_signs_wrong_are_refused_beside_a_hinge() -> None:
    made = hinged()
    with pytest.raises(CannotAnswer, match="the forces must hold the payload up; they add up to a mass of -1"):
        JointTeam().identify(turned(made.log, *made.log.names))


@pytest.mark.parametrize("seed", range(100, 106))
def test_right_signs_are_left_alone(seed: int) -> None:
    found = JointTeam().identify(trial(seed=seed).log)
    assert "wrench-sign-flipped" not in found.codes()


def test_a_moment_of_motion_turns_no_sign() -> None:
    """What so few rows leave beside the motion is noise, and falls to a quarter by chance."""
    rows = {"grasp_samples": 100, "still_samples": 20, "motion_samples": 150}
    found = JointTeam().identify(trial(seed=1008, robots=5, kinds=ALL_KINDS, **rows).log)
    assert "wrench-sign-flipped" not in found.codes()
    assert abs(found.mass - 12) < 4 * found.std[0]


def test_a_motion_that_is_no_measurement_is_refused() -> None:
    with pytest.raises(CannotAnswer, match="units of time and rates"):
        _require_one_clock(-9.0)
    for chi2 in (0.0, 1.0, 50.0, float(np.nan)):
        _require_one_clock(chi2)
