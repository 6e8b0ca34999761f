"""Teams whose bases move: slips, robots that let go or join, and hinges are told from twists, and nothing else is."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest

from steelyard.errors import CannotAnswer
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import Hinge, Presence, Slip, TeamNoise, TeamScene
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.twists.rows import twist_stretches

WHITE = TeamNoise(force_white_N=0.5, rate_rad_s=4e-3, velocity_m_s=2e-3)
SLOW = replace(WHITE, twist_spectrum="2hz")
SCENE = TeamScene(WHITE, sensing="twists", bases_move=True, motion_samples=1500)
AT = 7.0
SLIPS = Slip(1, np.array([0.003, 0.0, 0.004]), AT)
CHANGES = {"grasp-slipped", "robot-left", "robot-joined", "payload-jointed", "payload-not-rigid"}


def answered(scene: TeamScene, seed: int = 0, reference: int = 0) -> tuple[TeamTrial, TeamEstimate]:
    made = simulate_team(scene, seed, reference)
    return made, JointTeam().identify(made.log)


def placed(made: TeamTrial, found: TeamEstimate) -> np.ndarray:
    """Errors [mm] of where the grasps are."""
    true = made.truth.grasps.position
    places = np.array([found.grasps[name].pose.position for name in made.log.names])
    return np.asarray(1e3 * np.linalg.norm(places - true, axis=1))


def messages(found: TeamEstimate, code: str) -> list[str]:
    return [finding.message for finding in found.findings if finding.code == code]


@pytest.mark.parametrize("noise", [WHITE, SLOW], ids=["white", "2hz"])
@pytest.mark.parametrize("reference", [0, 1], ids=["another", "the reference"])
def test_a_slip_is_named_timed_and_taken_out(noise: TeamNoise, reference: int) -> None:
    made, found = answered(replace(SCENE, noise=noise, slip=SLIPS), reference=reference)
    (message,) = messages(found, "grasp-slipped")
    assert "The grasp of 'robot1' slipped by " in message
    size, time = float(message.split(" by ")[1].split(" mm")[0]), float(message.split(" at ")[1].split(" s of")[0])
    start = made.log.recordings[-1].tracks["robot0"].time[0]
    assert time - start == pytest.approx(AT + 0.05, abs=0.2)
    assert size == pytest.approx(5.0, abs=2.5 if noise is SLOW else 0.7)
    bars = 1e3 * np.linalg.norm([found.grasps[name].std_m for name in made.log.names], axis=1)
    assert (placed(made, found) <= 2.5 * bars).all()
    assert bars.max() < (8.0 if noise is SLOW else 2.0)
    assert found.mass == pytest.approx(float(made.truth.body.mass), rel=2e-3)


def test_a_slip_of_a_second_is_one_too() -> None:
    _, found = answered(replace(SCENE, slip=replace(SLIPS, duration=1.0)))
    assert "'robot1'" in messages(found, "grasp-slipped")[0]


@pytest.mark.parametrize("robot", [0, 1], ids=["the reference", "another"])
def test_a_slip_between_recordings_is_named_and_taken_out(robot: int) -> None:
    before = Slip(robot, np.array([0.006, 0.0, 0.008]), -1.0)
    made, found = answered(replace(SCENE, slip=before))
    (message,) = messages(found, "grasp-slipped")
    assert f"The grasp of 'robot{robot}' slipped by " in message
    assert "between 'grasp-0' and 'motion-5'" in message
    assert float(message.split(" by ")[1].split(" mm")[0]) == pytest.approx(10.0, abs=2.0)
    bars = 1e3 * np.linalg.norm([found.grasps[name].std_m for name in made.log.names], axis=1)
    assert (placed(made, found) <= 2.5 * bars).all()


@pytest.mark.parametrize(
    ("event", "code"),
    [(Presence(2, leaves=8.0), "robot-left"), (Presence(2, joins=7.0), "robot-joined")],
    ids=["leaves", "joins"],
)
def test_who_lets_go_or_joins_is_named_and_bends_nothing(event: Presence, code: str) -> None:
    made, found = answered(replace(SCENE, robots=4, presence=(event,)))
    assert found.codes() & CHANGES == {code}
    assert placed(made, found).max() < 1.5
    assert found.mass == pytest.approx(float(made.truth.body.mass), rel=2e-3)
    assert 1e3 * np.linalg.norm(found.com - made.truth.body.com) < 3


def hinged(*robots: int) -> Hinge:
    axis, point = np.array([0.0, 1.0, 0.0]), np.array([0.1, 0.0, 0.0])
    return Hinge(frozenset(robots), axis, point, 4.0, np.array([0.3, 0.5, 0.6]), np.array([0.4, 0.0, 0.0]))


def test_a_hinge_between_two_and_two_is_named_with_what_to_do() -> None:
    with pytest.raises(CannotAnswer) as caught:
        answered(replace(SCENE, robots=4, hinge=hinged(2, 3)))
    assert "'robot0' and 'robot1' hold one body, 'robot2' and 'robot3' another" in str(caught.value)
    assert "let the bases stand and log poses" in str(caught.value)


def test_one_robot_beyond_a_hinge_is_said_beside_the_answer() -> None:
    _, found = answered(replace(SCENE, hinge=hinged(2)), seed=1)
    assert "'robot0' and 'robot1' hold one body, 'robot2' another" in messages(found, "payload-jointed")[0]


def test_beside_a_hinge_the_reference_is_named_first() -> None:
    """Whatever its number is: the answer is for its body."""
    _, found = answered(replace(SCENE, hinge=hinged(2)), seed=1, reference=2)
    (message,) = messages(found, "payload-jointed")
    assert message.startswith("'robot2' hold one body, 'robot0' and 'robot1' another: between them is a hinge about (")
    assert " mm of grasp 'robot0', which swung by " in message


@pytest.mark.parametrize(
    "scene",
    [
        SCENE,
        replace(SCENE, noise=SLOW),
        replace(SCENE, noise=replace(WHITE, rate_rad_s=0.02, velocity_m_s=0.01)),
        replace(SCENE, dropout=0.2),
        replace(SCENE, gaps={1: ((5.0, 6.0), (9.0, 9.7))}),
        replace(SCENE, late_s={1: 0.03, 2: -0.02}),
        replace(SCENE, robots=2, six_axis=frozenset({0, 1})),
        replace(SCENE, bases_move=False),
    ],
    ids=["white", "2hz", "loud", "dropout", "gaps", "late", "two", "standing"],
)
def test_sound_teams_carry_no_such_word(scene: TeamScene) -> None:
    for seed in (100, 101):
        assert not answered(scene, seed)[1].codes() & CHANGES


def test_who_slipped_tells_where_down_is_only_where_nobody_else_does() -> None:
    (*_, part) = twist_stretches(simulate_team(SCENE, 0).log, {})
    seen = part.seen.copy()
    seen[900:, 1] = False
    left = part.changed(replace(part.used, seen=seen))
    assert left.level[:900].all()
    assert not left.level[900:, 1].any()
    assert left.level[900:, [0, 2]].all()
    alone = replace(part, level=part.level & [False, True, False])
    assert alone.changed(replace(part.used, seen=seen)).level[:, 1].all()


def with_gains(made: TeamTrial, gains: dict[str, float]) -> TeamLog:
    """The log with angular velocities too large by a factor."""
    recordings = []
    for one in made.log.recordings:
        tracks = {
            n: replace(
                t, channels=t.channels | {"angular_velocity": gains.get(n, 1.0) * t.channels["angular_velocity"]}
            )
            for n, t in one.tracks.items()
        }
        recordings.append(replace(one, tracks=tracks))
    return made.log.with_recordings(*recordings)


def test_gyros_of_unlike_gains_are_named_and_in_the_bars() -> None:
    made = simulate_team(SCENE, 0)
    found = JointTeam().identify(with_gains(made, {"robot1": 1.02}))
    (message,) = messages(found, "turning-gains")
    first, second, third = (float(share) for share in re.findall(r"' ([+-][\d.]+) %", message))
    assert second - first == pytest.approx(2.0, abs=0.21)
    assert third == pytest.approx(first, abs=0.21)
    bars = 1e3 * np.linalg.norm([found.grasps[name].std_m for name in made.log.names], axis=1)
    assert bars[1:].min() > 8
    assert (placed(made, found) <= 2 * bars).all()
    alike = JointTeam().identify(with_gains(made, dict.fromkeys(made.log.names, 1.02)))
    assert not messages(alike, "turning-gains")
