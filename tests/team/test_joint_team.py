"""Laws of the joint estimator, from a log of a whole team to its answer."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import made_teams
import numpy as np
import pytest
from made_teams import HINGE

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.inertia import InertialParameters, forms
from steelyard.logs.team_log import TeamRecording
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, EXACT, Presence, Slip, TeamNoise, TeamScene
from steelyard.simulate.team_motions import Freedom
from steelyard.spatial import Pose, Rotation
from steelyard.team.adjoint import log as pose_log
from steelyard.team.assembled import consistent
from steelyard.team.changes.slips import Slip as SlipFound
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam
from steelyard.team.poses.team import PoseTeam
from steelyard.team.split import bodies, find_hinge, find_split, moving_twists, rigidity_findings
from steelyard.team.stacked import stretches
from steelyard.team.twists.fit import fit_twists
from steelyard.team.twists.rows import twist_stretches
from steelyard.team.twists.statistic import TwistScatter
from steelyard.team.twists.team import TwistTeam

QUIET = TeamNoise(
    pose_rad=3e-4, pose_m=2e-4, rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=0.2, torque_white_Nm=0.02
)
X, Y, Z = np.eye(3)
trial = partial(made_teams.trial, noise=QUIET)


def error(made: TeamTrial, found: TeamEstimate) -> Array:
    """Largest grasp error [rad, m], error of mass [kg], centre of mass [m] and principal moments [kg m^2]."""
    grasps = np.array([found.grasps[n].pose.matrix() for n in made.log.names])
    apart = np.abs(pose_log(made.truth.grasps.inverse() @ Pose.from_matrix(grasps)))
    body = made.truth.body
    moments = found.principal_moments
    assert moments is not None
    return np.array(
        [
            apart[:, :3].max(),
            apart[:, 3:].max(),
            abs(found.mass - float(body.mass)),
            float(np.linalg.norm(found.com - body.com)),
            float(np.abs(moments - made.truth.moments).max()),
        ]
    )


@pytest.mark.parametrize("sensing", ["poses", "twists"])
@pytest.mark.parametrize("robots", [3, 5])
def test_exact_logs_give_exact_answers(sensing: str, robots: int) -> None:
    made = trial(noise=EXACT, sensing=sensing, robots=robots, bases_move=sensing == "twists")
    found = JointTeam().identify(made.log)
    assert (error(made, found) < [1e-8, 1e-8, 1e-4, 1e-5, 1e-4]).all()
    assert found.evidence.rank == 10
    assert found.identified.all()
    assert not found.findings


def test_errors_are_of_the_size_that_is_said() -> None:
    scores = []
    for seed in range(12):
        made = trial(seed=seed, motion_samples=1000)
        found = JointTeam().identify(made.log)
        body, upper = made.truth.body, np.triu_indices(3)
        off = [[found.mass - float(body.mass)], found.com - body.com]
        off.append((found.parameters.inertia_com - body.inertia_com)[upper])
        scores.append(np.concatenate(off) / found.std)
    assert 0.6 < np.sqrt(np.mean(np.square(scores))) < 1.5


LOUD = TeamNoise(pose_rad=2e-3, pose_m=1e-3, rate_rad_s=0.01, velocity_m_s=3e-3, force_white_N=1.0, force_bias_N=0.3)
TEAMS: dict[str, dict[str, Any]] = {
    "poses": {},
    "late poses": {"robots": 4, "late_s": {1: 0.013, 3: -0.04}},
    "two": {"robots": 2, "six_axis": frozenset({0})},
    "missing rows": {"robots": 4, "dropout": 0.05},
    "twists": {"sensing": "twists", "bases_move": True},
}


def same(one: TeamEstimate, two: TeamEstimate) -> None:
    """Both say the same of the body, all grasps and clocks to 1e-8, seen from the first one's reference."""
    X = one.grasps[two.reference].pose
    for name, grasp in one.grasps.items():
        np.testing.assert_allclose((X @ two.grasps[name].pose).matrix(), grasp.pose.matrix(), atol=1e-8)
    np.testing.assert_allclose(two.parameters.in_frame(X).vector, one.parameters.vector, rtol=1e-8, atol=1e-8)
    for name, late in one.clock_offsets_s.items():
        assert late - one.clock_offsets_s[two.reference] == pytest.approx(two.clock_offsets_s[name], abs=1e-8)


@pytest.mark.parametrize("team", TEAMS)
def test_relabelled_robots_give_the_same_answer(team: str) -> None:
    log = trial(noise=LOUD, motion_samples=1000, **TEAMS[team]).log
    one, two = (JointTeam().identify(x) for x in (log, replace(log, robots=log.robots[::-1])))
    same(one, two)
    np.testing.assert_allclose(two.std, one.std, rtol=1e-6)


@pytest.mark.parametrize("team", TEAMS)
def test_another_reference_gives_the_same_answer(team: str) -> None:
    log = trial(noise=LOUD, motion_samples=1000, **TEAMS[team]).log
    same(JointTeam().identify(log), JointTeam().identify(log.with_reference("robot1")))


@pytest.mark.parametrize("team", [name for name in TEAMS if name != "twists"])
def test_moved_homes_give_the_same_answer(team: str) -> None:
    log = trial(noise=LOUD, motion_samples=1000, **TEAMS[team]).log
    homes = {
        n: Pose(Rotation.exp(np.array([0.3, -0.2, 1.0 + i])), np.array([i, 2.0, -1.0])) for i, n in enumerate(log.names)
    }
    one, two = JointTeam().identify(log), JointTeam().identify(log.with_homes(homes))
    same(one, two)
    np.testing.assert_allclose(two.std, one.std, rtol=1e-3)


def test_the_statistic_of_twists_adds_over_time() -> None:
    made = trial(sensing="twists", bases_move=True, kinds=("motion",))
    whole = twist_stretches(made.log, {})
    statistic = TwistScatter.of(whole)
    size = 6 * 3
    rows = whole[0].twist.reshape(-1, size)
    np.testing.assert_allclose(statistic.merged().scatter[0][:size, :size], rows.T @ rows, rtol=1e-12, atol=1e-12)
    twice = TwistScatter.of((*whole, *whole))
    both = fit_twists(twice, 0, made.log.names)
    once = fit_twists(statistic, 0, made.log.names)
    np.testing.assert_allclose(both.grasps.position, once.grasps.position, atol=1e-5)
    np.testing.assert_allclose(both.spread.full[6:12, 6:12], once.spread.full[6:12, 6:12] / 2, rtol=0.5, atol=1e-9)


@pytest.mark.parametrize("sensing", ["poses", "twists"])
def test_a_late_clock_is_found_and_put_right(sensing: str) -> None:
    made = trial(sensing=sensing, bases_move=sensing == "twists", late_s={1: 0.013})
    found = JointTeam().identify(made.log)
    assert abs(found.clock_offsets_s["robot1"] - 0.013) < 5e-4
    assert "clock-offset" in found.codes()
    blind = JointTeam(clocks=False).identify(made.log)
    assert error(made, blind)[1] > 5 * error(made, found)[1]


# Freedom of rotation and translation, ranks of the grasps' lost directions and of the wrench side.
MOTIONS = {
    "general": (Freedom.general(), 0, 10),
    "two axes": (Freedom(np.eye(3)[:, :2], np.eye(3)), 0, 10),
    "planar": (Freedom(np.eye(3)[:, 2:], np.eye(3)[:, :2]), 1, 7),
    "translation": (Freedom(np.zeros((3, 0)), np.eye(3)), 3, 4),
}


@pytest.mark.parametrize("sensing", ["poses", "twists"])
@pytest.mark.parametrize("motion", MOTIONS)
def test_what_a_motion_does_not_show_is_named(motion: str, sensing: str) -> None:
    freedom, lost, rank = MOTIONS[motion]
    quiet = replace(QUIET, pose_rad=1e-4, pose_m=1e-4)
    made = trial(noise=quiet, freedom=freedom, sensing=sensing, bases_move=sensing == "twists", kinds=("motion",))
    found = JointTeam().identify(made.log)
    assert [len(found.grasps[n].lost) for n in made.log.names] == [0, lost, lost]
    assert found.evidence.rank == rank
    assert ("grasp-direction-lost" in found.codes()) == (lost > 0)
    assert (found.inertia_com is None) == (rank < 10)
    if motion == "planar":
        text = next(f.message for f in found.findings if f.code == "grasp-direction-lost")
        assert "Height of grasp 'robot1' along the vertical: all rotation so far was about one axis" in text


def test_still_poses_alone_fix_mass_and_centre() -> None:
    made = trial(kinds=("grasp", "still"))
    recordings = [r for r in made.log.recordings if r.kind == "still"]
    grasp = next(r for r in made.log.recordings if r.kind == "grasp")
    dumb = TeamRecording("grasp", {n: t.without("force") for n, t in grasp.tracks.items()}, "grasp")
    found = JointTeam().identify(made.log.with_recordings(dumb, *recordings))
    assert found.evidence.rank == 4
    assert found.identified[:4].all()
    assert found.inertia_com is None
    assert abs(found.mass - 12) < 0.1
    assert np.linalg.norm(found.com - made.truth.body.com) < 0.02


def test_two_robots_with_gimbals_work_in_motion() -> None:
    made = trial(noise=EXACT, robots=2, six_axis=frozenset({0}), kinds=("motion",))
    found = JointTeam().identify(made.log)
    assert (error(made, found) < [1e-8, 1e-8, 1e-3, 1e-4, 1e-3]).all()


def test_mixed_wrists() -> None:
    made = trial(six_axis=frozenset({1}))
    assert (error(made, JointTeam().identify(made.log)) < [2e-3, 2e-3, 0.03, 0.01, 0.2]).all()


def test_a_slip_is_found_timed_and_isolated() -> None:
    made = trial(slip=Slip(1, np.array([0.003, 0.004, 0.0]), 7.0), kinds=("motion",), motion_samples=1500)
    found = JointTeam().identify(made.log)
    (slipped,) = [f for f in found.findings if f.code == "grasp-slipped"]
    assert "grasp of 'robot1' slipped by 5.0 mm" in slipped.message
    time = float(slipped.message.split(" at ")[1].split(" s of")[0])
    assert abs(time - 7.05) < 0.3
    assert error(made, found)[1] < 2e-3


def test_no_slip_without_one() -> None:
    for seed in range(6):
        assert "grasp-slipped" not in JointTeam().identify(trial(seed=seed).log).codes()


def test_a_slip_that_is_gone_without_what_follows_it_is_none() -> None:
    made = trial(kinds=("motion",))
    team = PoseTeam.of(made.log, clocks=True)
    assert team.measured(made.log, SlipFound(1, 0, 7.0, np.full(6, 0.1), 100.0)) is None


def test_a_robot_that_leaves_is_told_from_one_whose_data_are_missing() -> None:
    left = trial(robots=4, presence=(Presence(2, leaves=8.0),))
    found = JointTeam().identify(left.log)
    assert "robot-left" in found.codes()
    assert error(left, found)[2] < 0.05
    gone = trial(robots=4, gaps={2: ((8.0, 20.0),)})
    missing = JointTeam().identify(gone.log)
    assert not {"robot-left", "robot-joined"} & missing.codes()
    assert error(gone, missing)[2] < 0.05


def test_a_hinge_is_found() -> None:
    made = trial(robots=4, hinge=HINGE, kinds=("motion",))
    team = stretches(made.log, {})
    twist, noise, rate = moving_twists(team)
    assert bodies(twist, noise) == [(0, 1), (2, 3)]
    axis, point, _, share = find_hinge(twist[:, 0], twist[:, 2], rate)
    X = (made.truth.payload.inverse() @ made.truth.grasps)[2].inverse()
    true_axis, true_point = X.rotation.apply(HINGE.axis), X.apply(HINGE.point)
    assert abs(float(axis @ true_axis)) > np.cos(np.deg2rad(1.0))
    assert np.linalg.norm(np.cross(true_axis, point - true_point)) < 0.01
    assert share > 0.9
    (finding,) = rigidity_findings(find_split(team), made.log.names)
    assert finding.code == "payload-jointed"
    assert "'robot2' and 'robot3' another" in finding.message
    assert "payload-jointed" in JointTeam().identify(made.log).codes()


@pytest.mark.parametrize("motion", MOTIONS)
def test_rigid_payloads_are_not_called_otherwise(motion: str) -> None:
    made = trial(freedom=MOTIONS[motion][0], kinds=("motion",))
    assert find_split(stretches(made.log, {})) is None


def test_a_robot_that_joins_is_noticed() -> None:
    made = trial(robots=4, presence=(Presence(2, joins=6.0, new=True),))
    found = JointTeam().identify(made.log)
    assert "robot-joined" in found.codes()
    assert error(made, found)[2] < 0.05


def test_missing_rows_of_one_robot_leave_the_wrench_side_for_all() -> None:
    made = trial(dropout=0.05)
    assert (error(made, JointTeam().identify(made.log)) < [2e-3, 2e-3, 0.05, 0.01, 0.3]).all()


def test_rows_that_nobody_saw_are_left_out() -> None:
    made = trial(gaps={i: ((5.0, 6.0),) for i in range(3)})
    assert (error(made, JointTeam().identify(made.log)) < [2e-3, 2e-3, 0.05, 0.01, 0.3]).all()


def test_a_robot_that_disagrees_is_named_and_hardly_counts() -> None:
    made = trial(robots=4)
    rng, last = np.random.default_rng(0), made.log.recordings[-1]
    track = last.tracks["robot3"]
    shaken = track.channels["position"] + rng.normal(0, 0.05, (len(track), 3))
    worse = replace(track, channels={**track.channels, "position": shaken})
    bad = replace(last, tracks={**last.tracks, "robot3": worse})
    found = JointTeam().identify(made.log.with_recordings(*made.log.recordings[:-1], bad))
    assert "robot-excluded" in found.codes()
    assert abs(found.mass - 12) < 0.05


def test_a_bias_in_every_recording_is_not_pretended_away() -> None:
    made = trial(noise=replace(QUIET, force_bias_N=0.5))
    found = JointTeam().identify(made.log)
    clean = JointTeam().identify(trial().log)
    assert found.std[0] > 2 * clean.std[0]
    assert abs(found.mass - 12) < 4 * found.std[0]


def test_gain_errors_are_spoken_of() -> None:
    made = trial(noise=replace(QUIET, force_gain=0.03))
    found = JointTeam().identify(made.log)
    assert "common-gain-unseen" in found.codes()
    assert found.std[0] > JointTeam(gains=False).identify(trial().log).std[0]


def test_known_wrists_are_taken_out_where_they_are() -> None:
    made = trial()
    whole = JointTeam().identify(made.log)
    wrists = {"robot0": 0.4, "robot2": 0.9}
    alone = JointTeam(wrists=wrists).identify(made.log)
    assert alone.mass == pytest.approx(whole.mass - 1.3)
    places = np.array([whole.grasps[n].pose.position for n in wrists])
    moment = 0.4 * places[0] + 0.9 * places[1]
    np.testing.assert_allclose(alone.mass * alone.com + moment, whole.mass * whole.com, atol=1e-9)
    with pytest.raises(BadValue, match="wrist of 'nobody'"):
        JointTeam(wrists={"nobody": 1.0}).identify(made.log)


@pytest.mark.parametrize("mass", [-3.0, np.nan, np.inf, "heavy"])
def test_a_wrist_weighs_something_or_nothing(mass: Any) -> None:
    with pytest.raises(BadValue, match="mass of the wrist of 'robot1' must be a "):
        JointTeam(wrists={"robot1": mass}).identify(trial(kinds=("still",)).log)


def test_wrists_that_weigh_more_than_all_that_is_held_are_refused() -> None:
    made = trial()
    with pytest.raises(CannotAnswer, match=r"without the wrists' weight, .* a mass of -488 kg"):
        JointTeam(wrists={"robot1": 500}).identify(made.log)
    assert JointTeam(wrists={"robot1": 0.0}).identify(made.log).mass == JointTeam().identify(made.log).mass


@pytest.mark.parametrize("rounds", [1, 2])
def test_clocks_that_are_not_done_are_told_as_they_were_used(rounds: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("steelyard.team.twists.team.CLOCK_ROUNDS", rounds)
    made = trial(sensing="twists", bases_move=True, late_s={1: 0.1})
    team = TwistTeam.of(made.log, True)
    used = twist_stretches(made.log, team.late)
    for part, again in zip(team.parts, used, strict=True):
        np.testing.assert_array_equal(part.twist, again.twist)


@pytest.mark.parametrize(("sensing", "fit"), [("poses", "poses.fit"), ("twists", "twists.fit")])
def test_a_fit_that_ends_too_early_is_told(sensing: str, fit: str, monkeypatch: pytest.MonkeyPatch) -> None:
    made = trial(sensing=sensing, bases_move=sensing == "twists")
    early = "The fit of the grasps ended before it settled"
    notes = JointTeam().identify(made.log).notes
    assert not any(early in note for note in notes)
    assert any("constant error of a robot's tool frame" in note for note in notes) == (sensing == "poses")
    assert not any("come back with the pose" in note for note in notes)
    monkeypatch.setattr(f"steelyard.team.{fit}.STEPS", 1)
    assert any(early in note for note in JointTeam().identify(made.log).notes)


def test_what_gains_would_do_to_the_mass_is_said_where_bars_are_narrower() -> None:
    """Gains of 1 % that last, each axis its own: the mass they make is in no motion, so it is in words."""
    made = simulate_team(TeamScene(CASES["A"], motion_samples=1500), 100)
    (note,) = (n for n in JointTeam().identify(made.log).notes if "gain error that lasts" in n)
    said = float(note.split(" by ")[1].split(" kg")[0])
    off = []
    for seed in range(12):
        gain = 1 + 0.01 * np.random.default_rng(seed).standard_normal((3, 3))
        log = made.log.with_recordings(
            *(
                replace(
                    r,
                    tracks={
                        n: replace(t, channels={**t.channels, "force": t.channels["force"] * gain[i]})
                        for i, (n, t) in enumerate(r.tracks.items())
                    },
                )
                for r in made.log.recordings
            )
        )
        off.append(JointTeam().identify(log).mass - 12)
    assert 0.6 * said < float(np.sqrt(np.mean(np.square(off)))) < 1.6 * said


def test_two_robots_weigh_until_the_noise_has_settled(monkeypatch: pytest.MonkeyPatch) -> None:
    made = simulate_team(TeamScene(CASES["A"], 2, six_axis=frozenset({0})), 100)
    found = JointTeam().identify(made.log)
    monkeypatch.setattr("steelyard.team.payload.fit.SETTLED", 1e-5)
    monkeypatch.setattr("steelyard.team.payload.fit.ROUNDS", 60)
    last = JointTeam().identify(made.log)
    assert np.abs((found.mass - last.mass) / last.std[0]) < 0.05
    np.testing.assert_allclose(found.std, last.std, rtol=0.05)


def test_answers_that_are_no_body_become_the_nearest_one() -> None:
    rng = np.random.default_rng(0)
    body = InertialParameters.from_com(12, np.array([0.1, 0.05, 0.1]), np.diag([2.3, 3.4, 5.6])).vector
    scale = np.array([12.0, *[8.4] * 3, *[6.0] * 6])
    assert consistent(body, np.eye(10), scale) is body
    for _ in range(5):
        factor = rng.normal(size=(10, 10))
        phi = body + np.concatenate([np.zeros(4), rng.normal(0, 1.5, 6)])
        found = consistent(phi, factor @ factor.T, scale)
        assert np.linalg.eigvalsh(forms.pseudo_inertia(found))[0] > 0
        inverse = np.linalg.inv(factor @ factor.T)
        assert (found - phi) @ inverse @ (found - phi) <= (body - phi) @ inverse @ (body - phi)


def test_two_gimbals_that_cannot_balance_the_payload_are_refused() -> None:
    whole = trial().log
    two = replace(
        whole,
        robots=whole.robots[:2],
        recordings=tuple(
            replace(r, tracks={n: t for n, t in r.tracks.items() if n != "robot2"}) for r in whole.recordings
        ),
    )
    with pytest.raises(CannotAnswer, match=r"'robot0' and 'robot1', cannot hold a payload still .* somebody else"):
        JointTeam().identify(two)
    moving = [r for r in two.recordings if r.kind != "still"]
    assert JointTeam().identify(two.with_recordings(*moving)).mass > 0


def test_gravity_that_nobody_knows_is_asked_for() -> None:
    log = trial().log
    lost = replace(log, robots=tuple(replace(robot, gravity=None) for robot in log.robots))
    with pytest.raises(CannotAnswer, match="somebody must know where gravity points"):
        JointTeam().identify(lost)


def test_a_payload_that_bends_is_noticed() -> None:
    made = trial(robots=4, kinds=("motion",))
    (last,) = made.log.recordings
    rng, tracks = np.random.default_rng(1), {}
    for name, track in last.tracks.items():
        t = (track.time - track.time[0])[:, None, None]
        sines = np.sin(2 * np.pi * rng.uniform(0.3, 1.0, (3, 5)) * t + rng.uniform(0, 6.3, (3, 5))).sum(-1)
        bent = Pose(Rotation(track.channels["rotation"]), track.channels["position"]) @ Pose(
            Rotation.exp(0.02 * sines), 0.01 * sines[:, ::-1]
        )
        channels = {**track.channels, "rotation": bent.rotation.matrix, "position": bent.position}
        tracks[name] = replace(track, channels=channels)
    found = JointTeam().identify(made.log.with_recordings(replace(last, tracks=tracks)))
    assert "payload-not-rigid" in found.codes()
    assert "payload-jointed" not in found.codes()


def test_a_mass_that_may_be_a_third_off_is_not_called_identified() -> None:
    made = trial(freedom=Freedom(Z[:, None], np.zeros((3, 0)), np.array([0.5, 0.3, 0.0])), kinds=("motion",))
    found = JointTeam().identify(made.log)
    assert abs(found.mass - 12) > 1
    assert not found.identified[0]


@pytest.mark.parametrize("lost", [("rotation", "position", "force"), ("force",), ("rotation", "position")])
def test_half_a_robots_rows_missing_in_motion_alone_cost_no_more_than_those_rows(lost: tuple[str, ...]) -> None:
    made = trial(kinds=("motion",), motion_samples=2000)
    (last,) = made.log.recordings
    track = last.tracks["robot2"]
    half = np.arange(len(track)) < len(track) // 2
    valid = {name: mask & half if name in lost else mask for name, mask in track.valid.items()}
    missing = replace(last, tracks={**last.tracks, "robot2": replace(track, valid=valid)})
    found = JointTeam().identify(made.log.with_recordings(missing))
    assert (error(made, found) < [2e-3, 2e-3, 0.05, 0.01, 0.3]).all()


def test_one_recording_weighs_as_well_as_its_halves() -> None:
    """A gain that is drawn anew for the only recording is one that lasts: it has the same odds beforehand."""
    made = trial(kinds=("motion",), motion_samples=3000)
    (whole,) = made.log.recordings
    halves = [
        replace(whole, name=name, tracks={n: track.rows(rows) for n, track in whole.tracks.items()})
        for name, rows in (("first", slice(0, 1500)), ("second", slice(1500, 3000)))
    ]
    one, two = (JointTeam().identify(made.log.with_recordings(*cut)) for cut in ([whole], halves))
    assert 0.5 < one.std[0] / two.std[0] < 2
    assert abs(one.mass - 12) < 4 * one.std[0]


def test_an_idle_robot_is_judged_by_the_noise_of_both() -> None:
    """How two robots share their noise is open: by its own alone, next to nothing, one that holds seemed to be off."""
    made = trial(robots=2, six_axis=frozenset({0, 1}))
    team = PoseTeam.of(made.log, clocks=True)
    shared = replace(team, fit=replace(team.fit, noise=team.fit.noise * np.array([[1.4], [0.01]])))
    assert max(float(np.median(off)) for off in shared.off(made.log)) < 2
