"""Laws of a payload of two bodies with a hinge: what its motion shows of each body, and what no motion does."""

from __future__ import annotations

import json
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import made_teams
import numpy as np
import pytest
from made_teams import HINGE

from steelyard.check import Array
from steelyard.errors import BadFile, BadValue, CannotAnswer
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.regressor import basis
from steelyard.io.result_files import read_result, result_dict, write_result
from steelyard.report import render
from steelyard.report.team_page import team_page
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.tables.team import team_table
from steelyard.team.estimate import TeamEstimate
from steelyard.team.hinge.payload import FROM_TEN, least_mass
from steelyard.team.hinge.rows import COUNT, EXCHANGED, SEVEN, about_z, equations
from steelyard.team.hinge.team import _places
from steelyard.team.joint import JointTeam
from steelyard.team.split import find_split
from steelyard.team.stacked import stretches
from steelyard.team.team_findings import open_parameters

QUIET = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.2, torque_white_Nm=0.02)
trial = partial(made_teams.trial, QUIET, robots=4, hinge=HINGE)


@pytest.fixture(scope="module")
def quiet() -> tuple[TeamTrial, TeamEstimate]:
    made = trial(100)
    return made, JointTeam().identify(made.log)


def truth(made: TeamTrial, found: TeamEstimate) -> tuple[InertialParameters, InertialParameters]:
    """Return both bodies in R with the hinge at the angle that the estimate calls zero."""
    place = made.truth.payload
    axis, point = place.rotation.apply(HINGE.axis), place.apply(HINGE.point)
    second = InertialParameters.from_com(HINGE.mass, HINGE.centre, np.diag(HINGE.moments)).in_frame(place)
    turned = (found.grasps["robot2"].pose.rotation @ made.truth.grasps[2].rotation.inverse()).log() @ axis
    turn = Rotation.exp(float(turned) * axis)
    return made.truth.body - second, second.in_frame(Pose(turn, point - turn.apply(point)))


def scores(made: TeamTrial, found: TeamEstimate) -> tuple[Array, Array]:
    """Return errors over standard deviations: of the whole's ten, and of moments and levers of both bodies."""
    first, second = truth(made, found)
    assert found.hinge is not None
    point = Pose(Rotation.identity(), made.truth.payload.apply(HINGE.point))
    axis = made.truth.payload.rotation.apply(HINGE.axis)
    each = []
    for body, true in zip(found.hinge.bodies, (first, second), strict=True):
        here = true.in_frame(point.inverse())
        lever = here.first_moment - axis * float(axis @ here.first_moment)
        each.append((body.hinge_moment - axis @ here.inertia @ axis) / body.hinge_moment_std)
        each += list((body.first_moment - lever) / body.first_moment_std)
        assert body.mass_range[0] < float(true.mass) < body.mass_range[1]
    whole = found.parameters.vector - (first + second).vector
    return whole / np.sqrt(np.diag(found.covariance)), np.array(each)


def test_mass_on_the_line_of_the_hinge_may_be_either_bodys() -> None:
    rng = np.random.default_rng(0)
    angle = rng.uniform(-1, 1, 50)
    first = rng.normal(size=(50, 12))
    # The second body's motion in H': the hinge adds a spin about z, and the common origin accelerates alike.
    spin, speed = rng.normal(size=(2, 50))
    omega = rng.normal(size=(50, 3))
    squares = forms.upper(omega[:, :, None] * omega[:, None, :])
    first[:, 6:] = squares
    back = Rotation.exp(-angle[:, None] * [0.0, 0.0, 1.0])
    z = np.array([0.0, 0.0, 1.0])
    faster = back.apply(omega) + spin[:, None] * z
    growth = back.apply(first[:, :3]) + speed[:, None] * z + np.cross(back.apply(omega), spin[:, None] * z)
    outer = forms.upper(faster[:, :, None] * faster[:, None, :])
    second = np.concatenate([growth, back.apply(first[:, 3:6]), outer], axis=1)
    one, two = (np.einsum("kix,tx->tik", basis(), x) for x in (first, second))
    moved = about_z(angle) @ two @ EXCHANGED - one @ EXCHANGED
    np.testing.assert_allclose(moved, 0, atol=1e-12)
    np.testing.assert_allclose((two @ EXCHANGED)[:, 2], 0, atol=1e-12)
    assert np.linalg.matrix_rank(equations(first, second, angle).reshape(-1, COUNT)) == COUNT
    np.testing.assert_allclose(FROM_TEN @ SEVEN, np.eye(7), atol=1e-15)
    np.testing.assert_allclose(FROM_TEN @ EXCHANGED, 0, atol=1e-15)


def test_both_bodies_are_found_within_their_error_bars(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    made, found = quiet
    assert found.hinge is not None
    assert found.evidence.rank == COUNT
    assert [body.robots for body in found.hinge.bodies] == [("robot0", "robot1"), ("robot2", "robot3")]
    axis = made.truth.payload.rotation.apply(HINGE.axis)
    assert np.rad2deg(np.arccos(min(1.0, abs(float(axis @ found.hinge.axis))))) < 0.05
    off = np.cross(axis, found.hinge.point - made.truth.payload.apply(HINGE.point))
    assert np.linalg.norm(off) < 1e-3
    assert found.mass == pytest.approx(16, abs=0.02)
    assert {body.hinge_moment_std / body.hinge_moment < 0.02 for body in found.hinge.bodies} == {True}
    every = [scores(made, found)]
    for seed in (101, 102, 103):
        other = trial(seed)
        every.append(scores(other, JointTeam().identify(other.log)))
    for part in zip(*every, strict=True):
        values = np.concatenate(part)
        assert 0.6 < np.sqrt((values**2).mean()) < 1.5
        assert np.abs(values).max() < 4.5


def test_a_long_log_is_used_whole(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    made = trial(100, motion_samples=6000)
    found = JointTeam().identify(made.log)
    whole, each = scores(made, found)
    assert np.abs(np.concatenate([whole, each])).max() < 4.5
    first, second = (max(float(g.std_m.max()) for g in one.grasps.values()) for one in (quiet[1], found))
    assert second < 0.65 * first
    where = found.grasps["robot1"]
    off = where.pose.position - made.truth.grasps.position[1]
    assert np.abs(off / where.std_m).max() < 4.5


def test_one_robot_on_a_body_is_enough_and_clocks_are_put_right() -> None:
    held = replace(HINGE, robots=frozenset({2}))
    scene = TeamScene(QUIET, 3, "poses", frozenset({0, 1, 2}), kinds=("still", "motion"), motion_samples=1500)
    made = simulate_team(replace(scene, hinge=held, late_s={1: 0.013, 2: 0.008}), 7)
    found = JointTeam().identify(made.log)
    assert found.hinge is not None
    assert found.clock_offsets_s["robot1"] == pytest.approx(0.013, abs=3e-4)
    assert found.clock_offsets_s["robot2"] == pytest.approx(0.008, abs=3e-4)
    whole, each = scores(made, found)
    assert np.abs(np.concatenate([whole, each])).max() < 4.5


@pytest.mark.parametrize("changes", [{"dropout": 0.02}, {"gaps": {1: ((8.0, 8.15),)}}, {"gaps": {2: ((5.0, 6.0),)}}])
def test_the_hinge_is_noticed_where_rows_are_missing(changes: dict[str, Any]) -> None:
    made = trial(100, **changes)
    split = find_split(stretches(made.log, {}))
    assert split is not None
    assert split.groups == ((0, 1), (2, 3))
    assert split.hinge is not None


def test_rows_that_nobody_saw_do_no_harm() -> None:
    made = trial(100, gaps=dict.fromkeys(range(4), ((8.0, 8.15),)))
    found = JointTeam().identify(made.log)
    assert found.hinge is not None
    whole, each = scores(made, found)
    assert np.abs(np.concatenate([whole, each])).max() < 4.5


def test_wrists_are_taken_out_of_the_body_that_they_move_with(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    made, found = quiet
    less = JointTeam(wrists={"robot3": 0.5}).identify(made.log)
    assert found.hinge is not None
    assert less.hinge is not None
    assert less.mass == pytest.approx(found.mass - 0.5)
    assert less.hinge.bodies[0].hinge_moment == pytest.approx(found.hinge.bodies[0].hinge_moment)
    arm = np.cross(found.hinge.axis, found.grasps["robot3"].pose.position - found.hinge.point)
    apart = found.hinge.bodies[1].hinge_moment - less.hinge.bodies[1].hinge_moment
    assert apart == pytest.approx(0.5 * float(arm @ arm))


def test_the_length_of_a_lever_errs_no_more_than_all_its_axes_together(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    assert quiet[1].hinge is not None
    for body in quiet[1].hinge.bodies:
        assert body.first_moment_std.min() / 2 < body.lever_std < np.linalg.norm(body.first_moment_std)


def test_wrists_that_weigh_more_than_both_bodies_are_refused(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    with pytest.raises(CannotAnswer, match="without the wrists"):
        JointTeam(wrists={"robot3": 500.0}).identify(quiet[0].log)


def test_rows_of_clocks_put_right_begin_at_the_nearest_rows_of_before() -> None:
    made = trial(100, late_s={1: 0.13, 2: -0.06})
    before = stretches(made.log, {})
    after = stretches(made.log, {"robot0": -0.02, "robot1": 0.13, "robot2": -0.06})
    ends = np.cumsum([len(part) for part in after])
    start = 0
    for was, now, rows in zip(before, after, np.split(_places(before, after), ends[:-1]), strict=True):
        nearest = np.abs(was.time[:, None] - now.time).min(0)
        np.testing.assert_allclose(np.abs(was.time[rows - start] - now.time), nearest, atol=1e-9)
        start += len(was)


@pytest.mark.parametrize("failure", [BadValue("a rotation vector must be finite."), np.linalg.LinAlgError()])
def test_numbers_that_degenerate_leave_the_rigid_answer_with_the_cause(
    quiet: tuple[TeamTrial, TeamEstimate], failure: Exception, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fails(*_: object) -> None:
        raise failure

    monkeypatch.setattr("steelyard.team.joint.identify_two_bodies", fails)
    found = JointTeam().identify(quiet[0].log)
    assert found.hinge is None
    assert "payload-jointed" in found.codes()


def test_open_inertia_of_two_bodies_is_named_out_of_seventeen() -> None:
    (finding,) = open_parameters(np.arange(10) < 4, 15, COUNT)
    assert finding.code == "inertia-not-identified"
    assert "15 of the 17 parameters" in finding.message


def test_the_page_shows_both_bodies(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    page = render(team_page("team", quiet[1], quiet[0].log))
    assert "17 of 17" in page
    assert "robot2, robot3" in page


def test_least_mass_is_that_of_a_body_with_these_moments() -> None:
    # All mass at one distance from the hinge weighs exactly so much.
    ten = InertialParameters.from_point_masses(np.array([2.0]), np.array([[0.3, 0.1, 0.5]])).vector
    spread = FROM_TEN @ (ten + InertialParameters.from_com(0.0001, np.zeros(3), 1e-9 * np.eye(3)).vector)
    assert least_mass(spread) == pytest.approx(2.0, abs=1e-3)
    assert least_mass(np.array([1.0, 0, -1.0, 1.0, 0, 0, 0])) == 0


def test_the_finding_says_who_holds_what_and_what_to_do(quiet: tuple[TeamTrial, TeamEstimate]) -> None:
    _, found = quiet
    (finding,) = [f for f in found.findings if f.code == "payload-jointed"]
    assert "No motion tells how their mass is shared" in finding.message
    assert "Weigh one body by itself" in finding.remedy
    assert "'robot0' and 'robot1' hold one body, 'robot2' and 'robot3' another" in finding.message
    table = team_table(found, "team")
    assert "two bodies with a hinge" in table
    assert "held by robot2, robot3" in table


def test_result_files_hold_the_hinge_and_both_bodies(quiet: tuple[TeamTrial, TeamEstimate], tmp_path: Path) -> None:
    _, found = quiet
    values = result_dict(found)
    assert values["bodies"][0]["mass_kg"] is None
    assert values["bodies"][1]["robots"] == ["robot2", "robot3"]
    write_result(found, tmp_path / "result.json")
    again = read_result(tmp_path / "result.json")
    assert isinstance(again, TeamEstimate)
    assert again.hinge is not None
    assert found.hinge is not None
    for one, two in zip(again.hinge.bodies, found.hinge.bodies, strict=True):
        assert one.hinge_moment == two.hinge_moment
        assert one.lever_std == two.lever_std
        np.testing.assert_array_equal(one.mass_range, two.mass_range)
    values["bodies"] = []
    (tmp_path / "bad.json").write_text(json.dumps(values))
    with pytest.raises(BadFile, match='"bodies" a list of two'):
        read_result(tmp_path / "bad.json")
