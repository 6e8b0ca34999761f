"""A robot that lets go bears its gripper still, so that it does not push with nothing."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from steelyard.inertia import InertialParameters
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import GRAVITY, Presence, Slip, TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.team.changes.found import Edit, _asked
from steelyard.team.changes.presence import EDGE_S, let_go, strayers
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.stacked import Stretch, stretches

NOISE = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.3, torque_white_Nm=0.03)
GRIPPER, LEAVES, WHO = 0.8, 8.0, 2


def with_gripper(trial: TeamTrial, kg: float, who: int = WHO) -> tuple[TeamLog, InertialParameters]:
    """The log with a point mass at one grasp, beyond its sensor, and all that is held before it lets go."""
    name, recordings = f"robot{who}", []
    for recording in trial.log.recordings:
        track = recording.tracks[name]
        # Noise of positions is far below what the gripper weighs, once it is smoothed.
        place = track.channels["position"]
        rows = np.arange(len(place))
        smooth = np.stack([np.convolve(place[:, k], np.ones(21) / 21, "same") for k in range(3)], 1)
        rise = np.gradient(np.gradient(smooth, track.time, axis=0), track.time, axis=0)
        rise[(rows < 25) | (rows >= len(rows) - 25)] = 0.0
        pull = kg * np.einsum("tji,tj->ti", track.channels["rotation"], rise + np.array([0.0, 0.0, GRAVITY]))
        held = replace(track, channels={**track.channels, "force": track.channels["force"] + pull})
        recordings.append(replace(recording, tracks={**recording.tracks, name: held}))
    point = InertialParameters.from_point_masses(np.array([kg]), trial.truth.grasps.position[who][None])
    return trial.log.with_recordings(*recordings), trial.truth.body + point


def told(found: TeamEstimate, code: str) -> list[str]:
    return [finding.message for finding in found.findings if finding.code == code]


@pytest.mark.parametrize("six_axis", [frozenset[int](), frozenset({0, 1, 2, 3})], ids=["gimbals", "wrists"])
def test_it_is_told_by_its_way_and_no_wrench_is_used_from_then_on(six_axis: frozenset[int]) -> None:
    scene = TeamScene(
        NOISE, 4, sensing="poses", six_axis=six_axis, motion_samples=2000, presence=(Presence(WHO, leaves=LEAVES),)
    )
    log, body = with_gripper(simulate_team(scene, 0), GRIPPER)
    found = JointTeam().identify(log)
    (said,) = told(found, "robot-left")
    assert said.startswith(f"'robot{WHO}' let go of the payload at ")
    assert said.endswith(" N, as of its gripper's weight; nobody's wrench is used meanwhile.")
    assert not told(found, "grasp-slipped")
    error = np.append(found.mass, found.com) - np.append(body.mass, body.com)
    assert np.abs(error / found.std[:4]).max() < 4


@pytest.mark.parametrize("kg", [0.0, GRIPPER])
def test_of_two_robots_the_one_that_stays_bears_more_and_has_not_let_go_before(kg: float) -> None:
    """Without the rows in which either pushes with less than usual the two have none in common."""
    two = TeamScene(NOISE, 2, sensing="poses", six_axis=frozenset({0, 1}), kinds=("motion",), motion_samples=1500)
    trial = simulate_team(replace(two, presence=(Presence(1, leaves=6.0),)), 0)
    log, body = with_gripper(trial, kg, 1)
    found = JointTeam().identify(log)
    assert [finding.code for finding in found.findings] == ["robot-left"]
    error = np.append(found.mass, found.com) - np.append(body.mass, body.com)
    assert np.abs(error / found.std[:4]).max() < 4


def test_a_light_gripper_lets_go_once() -> None:
    """0.4 kg are now less than a tenth of what the robot bore, now more."""
    every = frozenset({0, 1, 2, 3})
    scene = TeamScene(
        NOISE, 4, sensing="poses", six_axis=every, motion_samples=2000, presence=(Presence(WHO, leaves=LEAVES),)
    )
    found = JointTeam().identify(with_gripper(simulate_team(scene, 2), 0.4)[0])
    assert [finding.code for finding in found.findings] == ["robot-left"]


def test_around_a_change_nobodys_wrench_is_used_nor_the_poses_of_the_one_who_changes() -> None:
    (part,) = stretches(
        simulate_team(TeamScene(NOISE, sensing="poses", kinds=("motion",), motion_samples=1500), 0).log, {}
    )
    bare, nobody = np.zeros(part.seen.shape, np.bool_), np.zeros(3, np.bool_)
    bare[600:1000, 1] = True
    edge = int(np.ceil(EDGE_S * part.rate))
    out = let_go(part, bare, bare, np.where(bare, 50.0, 1.0), nobody)
    near = np.zeros(len(part), np.bool_)
    near[600 - edge : 600 + edge] = near[1000 - edge : 1000 + edge] = True
    assert (out.felt == part.felt & ~near[:, None]).all()
    assert (out.carries[:, 1] == ~bare[:, 1]).all()
    away = np.zeros(len(part), np.bool_)
    away[600 - edge : 1000 + edge] = True
    assert (out.seen[:, 1] == part.seen[:, 1] & ~away).all()
    assert (out.seen[:, [0, 2]] == part.seen[:, [0, 2]]).all()


def test_who_pushes_with_next_to_nothing_nearly_all_the_time_bears_no_gripper() -> None:
    (part,) = stretches(
        simulate_team(TeamScene(NOISE, sensing="poses", kinds=("motion",), motion_samples=1500), 0).log, {}
    )
    light, strays = np.zeros(part.seen.shape, np.bool_), np.array([False, True, False])
    light[600:1000, 1] = True
    edge = int(np.ceil(EDGE_S * part.rate))
    middle = slice(600 + edge, 1000 - edge)
    for few, gripper in ((20, False), (80, True)):
        bare = light.copy()
        bare[990 - few : 990, 1] = False  # as where it brushes the payload
        out = let_go(part, bare, light, np.where(light, 50.0, 1.0), strays)
        # The sum of wrenches is no payload's where one bears its gripper alone.
        assert out.felt[middle, 1].any() != gripper
        assert out.carries[middle, 1].all() == gripper


def test_a_robot_that_bears_little_has_not_let_go_where_its_grasp_slipped() -> None:
    slip = Slip(WHO, np.array([0.008, 0.0, 0.006]), LEAVES)
    scene = TeamScene(NOISE, 4, sensing="poses", motion_samples=2000, slip=slip, squeeze_N=30.0)
    found = JointTeam().identify(simulate_team(scene, 3).log)
    assert not told(found, "robot-left")
    assert len(told(found, "grasp-slipped")) == 1


def test_two_slips_of_one_grasp_are_two() -> None:
    scene = TeamScene(NOISE, 4, sensing="poses", motion_samples=3000, slip=Slip(WHO, np.array([0.006, 0.005, 0]), 8.0))
    first = simulate_team(scene, 0)
    later = simulate_team(replace(scene, slip=Slip(WHO, np.array([0.012, 0.0, 0.0]), 18.0)), 0)
    name = f"robot{WHO}"
    was, now = first.log.recordings[-1], later.log.recordings[-1]
    after = was.tracks[name].time - was.tracks[name].time[0] > 17.5
    channels = {
        k: np.where(after.reshape(-1, *[1] * (v.ndim - 1)), now.tracks[name].channels[k], v)
        for k, v in was.tracks[name].channels.items()
    }
    tracks = {**was.tracks, name: replace(was.tracks[name], channels=channels)}
    # The second begins where the first grasp was: both are steps.
    found = JointTeam().identify(first.log.with_recordings(*first.log.recordings[:-1], replace(was, tracks=tracks)))
    times = sorted(float(said.split(" at ")[1].split(" s of")[0]) for said in told(found, "grasp-slipped"))
    start = float(was.tracks[name].time[0])
    assert len(set(times)) == len(times) >= 2
    assert times[0] - start == pytest.approx(8.05, abs=0.3)


def test_a_step_while_a_robot_bears_little_is_no_way_of_its_own() -> None:
    log = simulate_team(TeamScene(NOISE, 3, sensing="poses", kinds=("motion",), motion_samples=2000), 0).log
    parts = stretches(log, {})
    light = [np.tile([False, True, True], (len(part), 1)) for part in parts]
    time = parts[0].time - parts[0].time[0]
    slipped = np.where(time < 9.0, 0.0, 30.0)
    rests = np.where(time % 3.0 < 1.5, 30.0 * np.sin(6.0 * time) + 40.0, 40.0)
    off = [np.stack([rests, slipped, rests], axis=1)]
    assert strayers(parts, light, off).tolist() == [False, False, True]


def test_who_bears_more_before_another_joins_leaves_rows_to_tell_it() -> None:
    """Of two, each pushes with little while the other bears most: hardly a row is left of both."""
    rows = 2000
    held = np.ones((rows, 2), np.bool_)
    poses = Pose(Rotation.identity(rows, 2), np.zeros((rows, 2, 3)))
    part = Stretch("one", "motion", np.arange(rows) / 100, poses, held, np.zeros((rows, 2, 6)), held, held)
    light = np.arange(rows)[:, None] < [1010, 0]
    light[1000:, 1] = True
    asked = list[tuple[int, ...]]()

    def fitted(edit: Edit) -> SimpleNamespace:
        unseen = (~edit((part,))[0].seen).sum(0)
        asked.append(tuple(unseen.tolist()))
        return SimpleNamespace(fit=SimpleNamespace(noise=np.array([2.0 if unseen[0] else 1.0])))

    found = _asked((part,), (light,), fitted)  # type: ignore[type-var]
    assert asked == [(1010, 0), (0, 1000)]
    assert found is not None
    np.testing.assert_array_equal(found[0][0], light & [False, True])
