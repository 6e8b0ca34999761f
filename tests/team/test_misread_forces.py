"""Forces of one robot in another unit, or with axes in another order: put right and named; right ones left alone."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

import steelyard.simulate.team_payload as team_payload
from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.misread.readings import READINGS, SIGN, WrenchReading, torques_beside

POSES = TeamNoise(pose_rad=3e-4, pose_m=2e-4, rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=1.0)
TURNED = np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
EXCHANGED = np.array([[0.0, 1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
CODES = {"force-unit", "wrench-sign-flipped", "wrench-unexplained"}
# What the file says of a force, the words for it, and the remedy.
MISREAD: dict[str, tuple[Array, str, str]] = {
    "kgf": (np.eye(3) / 9.80665, "kgf read as N", '"kgf"'),
    "lbf": (np.eye(3) / 4.4482216152605, "lbf read as N", '"lbf"'),
    "kN": (np.eye(3) / 1e3, "kN read as N", '"kN"'),
    "mN": (np.eye(3) * 1e3, "N read as kN", '"N"'),
    "N for kgf": (np.eye(3) * 9.80665, "N read as kgf", '"N"'),
    "x and y": (EXCHANGED, "Fx = Fy, Fy = Fx", "order and with the signs y, x, z"),
    "-z": (np.diag([1.0, 1.0, -1.0]), "Fz = -Fz", "order and with the signs x, y, -z"),
    "-x": (np.diag([-1.0, 1.0, 1.0]), "Fx = -Fx", "order and with the signs -x, y, z"),
    "half a turn": (np.diag([-1.0, -1.0, 1.0]), "Fx = -Fx, Fy = -Fy", "[-1, 0, 0, 0, -1, 0, 0, 0, 1]"),
    "quarter": (TURNED, "Fx = Fy, Fy = -Fx", "[0, 1, 0, -1, 0, 0, 0, 0, 1]"),
    "upside down": (np.diag([1.0, -1.0, -1.0]), "Fy = -Fy, Fz = -Fz", "[1, 0, 0, 0, -1, 0, 0, 0, -1]"),
    "cycle": (np.roll(np.eye(3), 1, 0), "Fx = Fy, Fy = Fz, Fz = Fx", "[0, 1, 0, 0, 0, 1, 1, 0, 0]"),
}  # fmt: skip
# One of each: a unit, a unit of torques too, another order, another sign, a turn.
OF_EACH = {way: MISREAD[way] for way in ("kgf", "lbf", "x and y", "-z", "quarter")}


def scene(case: str = "", robots: int = 3, **changes: Any) -> TeamScene:
    noise = CASES[case] if case else POSES
    made: dict[str, Any] = {"kinds": ("still", "motion"), "motion_samples": 1500}
    if not case:
        made |= {"sensing": "poses", "six_axis": frozenset({0} if robots == 2 else ())}
    return TeamScene(noise, robots, **(made | changes))


def said(log: TeamLog, name: str, force: Array, torque: Array | None = None) -> TeamLog:
    """Return the log with what this robot says of its wrench changed."""
    made = []
    for recording in log.recordings:
        channels = dict(recording.tracks[name].channels)
        channels["force"] = channels["force"] @ force.T
        if torque is not None and "torque" in channels:
            channels["torque"] = channels["torque"] @ torque.T
        track = replace(recording.tracks[name], channels=channels)
        made.append(replace(recording, tracks={**recording.tracks, name: track}))
    return log.with_recordings(*made)


def about_forces(found: TeamEstimate) -> list[Finding]:
    return [finding for finding in found.findings if finding.code in CODES]


def alike(found: TeamEstimate, right: TeamEstimate) -> None:
    np.testing.assert_allclose(found.parameters.vector, right.parameters.vector, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(
        found.covariance, right.covariance, rtol=1e-5, atol=1e-6 * np.abs(right.covariance).max()
    )


def put_right(log: TeamLog, kinds: dict[str, tuple[Array, str, str]], turn: bool = True) -> None:
    """Ask that each misreading of each robot is named and put right; with it, if `turn`, that of the torque."""
    right = JointTeam().identify(log)
    assert not about_forces(right)
    for number, (force, words, remedy) in enumerate(kinds.values()):
        name = log.names[number % len(log.names)]
        torque = force / 0.0254 if "lbf" in words else force
        found = JointTeam().identify(said(log, name, force, torque if turn else None))
        (finding,) = about_forces(found)
        assert finding.code == "force-unit"
        assert f"'{name}'" in finding.message
        assert words in finding.message
        assert f"'{name}'" in finding.remedy
        assert remedy in finding.remedy
        assert ("mount" in finding.remedy) == remedy.startswith("[")
        alike(found, right)


@pytest.mark.parametrize(("case", "seed"), [("A", 11), ("B", 12), ("C", 13), ("D", 11)])
def test_each_misreading_is_put_right_and_named(case: str, seed: int) -> None:
    put_right(simulate_team(scene(case), seed).log, {k: v for k, v in MISREAD.items() if case != "D" or k != "lbf"})


@pytest.mark.parametrize(
    "changes",
    [
        {"robots": 5},
        {"sensing": "twists"},
        {"sensing": "twists", "bases_move": True},
        {"kinds": ("still",), "still_turns": ((0.1, 0, 0), (-0.06, 0.08, 0), (0, -0.1, 0.1), (-0.12, -0.1, 0))},
        {"kinds": ("motion",)},
        {"six_axis": frozenset({0, 1, 2})},
        {"squeeze_N": 20.0},
    ],
)
def test_with_other_robots_recordings_and_wrists(changes: dict[str, Any]) -> None:
    put_right(simulate_team(scene(**changes), 21).log, OF_EACH)


def test_torques_may_be_right_where_forces_are_not() -> None:
    made = scene(six_axis=frozenset({0, 1, 2}))
    kinds = {k: MISREAD[k] for k in ("kgf", "x and y")}
    put_right(simulate_team(made, 22).log, kinds, turn=False)
    log = simulate_team(made, 22).log
    found = JointTeam().identify(said(log, "robot1", TURNED))
    assert "columns of force of 'robot1' in the order" in about_forces(found)[0].remedy  # no mount turns forces alone


def test_of_two_robots_axes_are_put_right_and_a_unit_is_only_named() -> None:
    log = simulate_team(scene(robots=2), 24).log
    put_right(log, {k: v for k, v in MISREAD.items() if np.isclose(abs(np.linalg.det(v[0])), 1)})
    found = JointTeam().identify(said(log, "robot1", MISREAD["kgf"][0]))
    (finding,) = about_forces(found)  # all forces may be in kgf but one robot's, which are in N
    assert "'robot1' as kgf read as N" in finding.message
    assert "'robot0' as N read as kgf" in finding.message
    assert "Nothing was changed" in finding.message


def test_a_sign_is_found_by_weight_alone() -> None:
    log = simulate_team(scene(squeeze_N=0.0), 25).log
    found = JointTeam().identify(said(log, "robot1", -np.eye(3)))
    assert [f.code for f in about_forces(found)] == ["wrench-sign-flipped"]
    alike(found, JointTeam().identify(log))


@pytest.mark.parametrize("case", ["A", "D"])  # the least noise of forces and the most
@pytest.mark.parametrize("robots", [2, 3, 5])
def test_right_forces_are_left_alone(case: str, robots: int) -> None:
    for seed in range(4):
        noise = replace(CASES[case], encoder_bits=None, white_rad=0.0, ar_rad=0.0, pose_rad=3e-4, pose_m=2e-4)
        log = simulate_team(replace(scene(robots=robots, motion_samples=800), noise=noise), 30 + seed).log
        assert not about_forces(JointTeam().identify(log))


@pytest.mark.parametrize(
    "changes",
    [
        {"noise": replace(POSES, force_gain=0.03)},
        {"noise": replace(POSES, force_gain=0.1), "bias_per": "session"},
        {"noise": replace(POSES, force_gain=0.1)},
        {"noise": replace(POSES, force_gain=0.1), "bias_per": "session", "kinds": ("still",)},
        {"noise": replace(POSES, force_bias_N=0.5), "bias_per": "session"},
        {"noise": replace(POSES, force_bias_N=0.5), "bias_per": "session", "kinds": ("still",)},
        {"squeeze_N": 0.0},
    ],
)
def test_gains_and_biases_are_no_unit(changes: dict[str, Any], monkeypatch: pytest.MonkeyPatch) -> None:
    for seed in range(3):
        log = simulate_team(replace(scene(motion_samples=800), **changes), 40 + seed).log
        assert not about_forces(JointTeam().identify(log))
    monkeypatch.setattr(team_payload, "RING_CENTRE", np.array([0.39, 0.1, -0.1]))  # one robot carries next to nothing
    for seed in range(3):
        log = simulate_team(replace(scene(motion_samples=800), **changes), 50 + seed).log
        assert not about_forces(JointTeam().identify(log))


@pytest.mark.parametrize("robots", [2, 3, 5])
def test_a_sensor_turned_by_another_angle_is_named(robots: int) -> None:
    tilt = np.deg2rad(30.0)
    turn = np.array([[1, 0, 0], [0, np.cos(tilt), -np.sin(tilt)], [0, np.sin(tilt), np.cos(tilt)]])
    log = simulate_team(scene(robots=robots), 26).log
    found = JointTeam().identify(said(log, "robot1", turn))
    (finding,) = about_forces(found)
    off = found.parameters.vector - JointTeam().identify(log).parameters.vector
    assert (np.abs(off) < 2 * np.sqrt(np.diag(found.covariance))).all()
    assert finding.code == "wrench-unexplained"
    assert "What 'robot1' pushes fits neither" in finding.message
    assert "turned by about 30 deg" in finding.message


@pytest.mark.parametrize(("robots", "seed"), [(2, 1006), (3, 1002), (3, 1003), (3, 1008), (5, 1001)])
def test_forces_in_axes_that_nobody_knows_are_not_compared(robots: int, seed: int) -> None:
    two_poses = scene(robots=robots, kinds=("still",), still_turns=((0.1, 0, 0), (-0.06, 0.08, 0)))
    found = JointTeam().identify(simulate_team(two_poses, seed).log)
    assert "grasp-direction-lost" in found.codes()
    assert not about_forces(found)
    assert "common-gain-unseen" not in found.codes()


@pytest.mark.parametrize("robots", [2, 3, 4])
def test_a_loud_sensor_is_no_unit(robots: int) -> None:
    for seed in (1002, 1003):
        log = simulate_team(scene(robots=robots, motion_samples=800), seed).log
        loud = log.with_recordings(
            *(
                replace(r, tracks={**r.tracks, "robot1": shaken(r.tracks["robot1"], 30.0 if robots > 2 else 80.0)})
                for r in log.recordings
            )
        )
        assert not about_forces(JointTeam().identify(loud))


def shaken(track: Track, level: float) -> Track:
    force = track.channels["force"]
    noise = level * np.random.default_rng(0).normal(size=force.shape)
    return replace(track, channels={**track.channels, "force": force + noise})


def test_wrong_gravity_is_no_reading_of_forces() -> None:
    log = simulate_team(scene(motion_samples=800), 60).log
    tilted = tuple(replace(robot, gravity=np.array([-6.3, 0.0, -7.5])) for robot in log.robots)
    (finding,) = about_forces(JointTeam().identify(replace(log, robots=tilted)))
    assert "that no rigid payload explains" in finding.message
    assert not any(f"'{name}'" in finding.message for name in log.names)


def test_readings() -> None:
    np.testing.assert_array_equal(READINGS[0], np.eye(3))
    np.testing.assert_array_equal(READINGS[SIGN], -np.eye(3))
    assert len({X.tobytes() for X in READINGS}) == len(READINGS) == 7 * 48
    both = WrenchReading(48 + 3, np.eye(3)).words()
    assert both.startswith("kgf read as N and F")
    for number in (1, 48, 48 + 1):
        first, *others = torques_beside(number)
        np.testing.assert_array_equal(first.wrench()[:3, :3], np.eye(3))
        assert all(np.array_equal(one.wrench()[3:, 3:], READINGS[number]) for one in others)
