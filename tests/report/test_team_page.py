"""The page of a team: closed surfaces that pass through the grasps, residuals of noise alone, the truth beside."""

from __future__ import annotations

import html
import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.evidence import Evidence
from steelyard.inertia import InertialParameters
from steelyard.io import read_result, write_result
from steelyard.report import render
from steelyard.report.drawing import drawing
from steelyard.report.team_page import team_page
from steelyard.report.team_residuals import team_residuals
from steelyard.report.team_scene import team_scene
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import EXACT, TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.tables.numbers import general
from steelyard.tables.team import team_table
from steelyard.team.estimate import BodyEstimate, GraspEstimate, HingeEstimate, TeamEstimate
from steelyard.team.joint import JointTeam


def answer(body: InertialParameters, grasps: dict[str, Pose]) -> TeamEstimate:
    first = next(iter(grasps))
    spread = np.diag([1e-4] * 3 + [1e-3, 2e-3, 5e-4]) ** 2
    return TeamEstimate(
        body, 1e-8 * np.eye(10), "joint", Evidence(10, 4.0, 500, 100, 0.3, 0.2), np.ones(10, np.bool_),
        frame=first, reference=first,
        grasps={n: GraspEstimate(X, np.zeros((6, 6)) if n == first else spread) for n, X in grasps.items()},
        clock_offsets_s=dict.fromkeys(grasps, 0.0), clock_offset_std_s=dict.fromkeys(grasps, 1e-4),
    )  # fmt: skip


def around(count: int) -> TeamEstimate:
    """Robots on a tilted circle about the centre of mass, the reference at the origin."""
    angle = 2 * np.pi * np.arange(count) / count
    circle = np.stack([np.cos(angle), np.sin(angle), 0.1 * np.cos(2 * angle)], axis=1)
    body = InertialParameters.from_com(12.0, -circle[0], np.diag([2.0, 3.0, 4.0]))
    return answer(body, {f"r{k}": Pose(Rotation.identity(), p - circle[0]) for k, p in enumerate(circle)})


@pytest.mark.parametrize("count", [2, 3, 4, 9])
def test_surfaces_are_closed_and_pass_through_the_grasps(count: int) -> None:
    found = around(count)
    ring, *grippers = team_scene(found).bodies
    assert len(grippers) == count
    size = float(np.ptp(ring.vertices, axis=0).max())
    for body in (ring, *grippers):
        # Every edge is shared by two triangles that run along it in opposite ways: closed and facing one side. The
        # ends of the closed curve share their place, not their vertices.
        _, place = np.unique(np.round(body.vertices / size, 7), axis=0, return_inverse=True)
        corners = place.ravel()[body.triangles]
        edges = np.concatenate([corners[:, [k, (k + 1) % 3]] for k in range(3)])
        forward, back = ({tuple(e) for e in edges[:, order]} for order in ([0, 1], [1, 0]))
        assert forward == back
        a, b, c = np.moveaxis(body.vertices[body.triangles], 1, 0)
        assert np.einsum("ij,ij->i", np.cross(a, b), c).sum() > 0
    for grasp in found.grasps.values():
        assert np.linalg.norm(ring.vertices - grasp.pose.position, axis=1).min() < 0.03 * size


def test_marks_hold_every_grasp_magnified_alike() -> None:
    found = around(3)
    page = team_page("t", found)
    assert page.scene is not None
    marks = drawing(page, page.scene)["marks"]
    rows, larger = marks["grasps"]["rows"], marks["grasps"]["larger"]
    assert marks["open"]
    assert "sensor" not in marks
    assert not np.any(rows[0]["spread"])
    lengths = np.linalg.norm(rows[2]["spread"], axis=1)
    np.testing.assert_allclose(np.sort(lengths), larger * np.sqrt(7.815) * np.array([5e-4, 1e-3, 2e-3]), rtol=1e-5)
    json.dumps(marks, allow_nan=False)


@cache
def exact() -> TeamTrial:
    return simulate_team(TeamScene(EXACT, grasp_samples=100, motion_samples=800), 2)


def test_residuals_of_the_truth_are_small_and_of_another_body_are_not() -> None:
    made = exact()
    grasps = {name: made.truth.grasps[k] for k, name in enumerate(made.log.names)}
    left = team_residuals(made.log, answer(made.truth.body, grasps))
    assert left is not None
    assert left.still.sum() == 400
    # What the filter and the differences take away of the motion, far below what carries 12 kg.
    assert float(np.abs(left.force).max()) < 1.0
    assert float(np.abs(left.torque).max()) < 1.0
    heavier = InertialParameters(1.1 * made.truth.body.vector)
    more = team_residuals(made.log, answer(heavier, grasps))
    assert more is not None
    assert float(np.linalg.norm(more.force, axis=1).mean()) == pytest.approx(0.1 * 12 * 9.81, rel=0.05)


def test_residuals_hold_no_bias_and_the_page_one_rms_within_its_axes() -> None:
    noise = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.2, torque_white_Nm=0.02, force_bias_N=3.0)
    made = simulate_team(TeamScene(noise, sensing="poses", kinds=("motion",), motion_samples=1500), 4)
    seen = JointTeam().identify(made.log)
    left = team_residuals(made.log, seen)
    assert left is not None
    assert float(np.linalg.norm(seen.wrench_biases[made.log.recordings[0].name][3:])) > 1.0
    assert float(np.abs(left.force.mean(0)).max()) < 0.05
    page = html.unescape(render(team_page("a team", seen, made.log)))
    assert page.count(f"{general(seen.evidence.residual_force_N)} N per axis, unsmoothed") == 1
    lines = [float(n) for n in re.findall(r">[+]([0-9.]+) N<", page)]
    assert max(lines) >= float(np.abs(left.force).max())


@pytest.mark.parametrize(
    ("wrong", "said"), [(-np.eye(3), "force with its sign turned"), (np.eye(3) / 9.80665, "force times 9.807")]
)
def test_table_and_page_say_whose_wrench_was_put_right_and_the_plot_holds_it(
    wrong: Array, said: str, tmp_path: Path
) -> None:
    noise = TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=0.2, torque_white_Nm=0.02)
    made = simulate_team(TeamScene(noise, sensing="poses", kinds=("still", "motion"), motion_samples=1500), 4)
    recordings = []
    for recording in made.log.recordings:
        track = recording.tracks["robot1"]
        channels = {n: v @ wrong if n in ("force", "torque") else v for n, v in track.channels.items()}
        recordings.append(replace(recording, tracks={**recording.tracks, "robot1": replace(track, channels=channels)}))
    log = made.log.with_recordings(*recordings)
    write_result(JointTeam().identify(log), tmp_path / "result.json")
    seen = read_result(tmp_path / "result.json")
    assert isinstance(seen, TeamEstimate)
    right = JointTeam().identify(made.log)
    assert f"put right: {said}" in team_table(seen, "a team")
    assert "put right" not in team_table(right, "a team")
    page = html.unescape(render(team_page("a team", seen, log)))
    assert page.count(said) >= 2  # beside the picture, and in the table
    assert "put right" not in html.unescape(render(team_page("a team", right)))
    left, once = team_residuals(log, seen), team_residuals(made.log, right)
    assert left is not None
    assert once is not None
    np.testing.assert_allclose(left.force, once.force, atol=0.02)


def test_rests_within_a_motion_are_not_called_moving() -> None:
    seen = around(3)
    assert "500 rows of which 100 in still recordings" in team_table(seen, "a team")
    page = html.unescape(render(team_page("a team", seen)))
    assert "500 samples, 100 in still recordings" in page
    assert "500, of which 100 in still recordings" in page


def test_the_log_must_be_that_of_the_result() -> None:
    with pytest.raises(BadValue, match="the log must be that of the result; it is of robot0, robot1, robot2"):
        team_residuals(exact().log, around(3))


def test_the_page_says_where_everybody_holds_and_how_far_off() -> None:
    made = exact()
    grasps = {name: made.truth.grasps[k] for k, name in enumerate(made.log.names)}
    moved = {
        n: X if n == "robot0" else Pose(X.rotation, X.position + np.array([0.003, 0, 0])) for n, X in grasps.items()
    }
    good, bad = answer(made.truth.body, grasps), answer(made.truth.body, moved)
    text = render(team_page("<b>Team</b>", bad, rivals={"the other": good}, truth=(made.truth.body, grasps)))
    for said in ("Where the robots hold", "3.0 mm, 0°", "the other: 0", "in the grasp frame of robot0", "robot2"):
        assert said in text, said
    assert "<b>Team" not in text


def test_table_and_page_show_the_same_two_figures_of_a_spread() -> None:
    turned = Pose(Rotation.from_rpy([0.0, np.deg2rad(-0.001), 1.0]), np.ones(3))
    spread = np.diag([np.deg2rad(0.0999)] * 3 + [0.0999e-3] * 3) ** 2
    seen = around(2)
    name = next(n for n in seen.grasps if n != seen.reference)
    seen = replace(seen, grasps={**seen.grasps, name: GraspEstimate(turned, spread)})
    table, page = team_table(seen, "a team"), html.unescape(render(team_page("a team", seen)))
    assert "(0.00, 0.00, 57.30) ± 0.10°" in table
    assert "1000.00 ± 0.10 mm" in table
    assert '<span class="v">0.00, 0.00, 57.30</span><span class="pm"> ± 0.10</span>' in page
    assert '<span class="v">1000.00</span><span class="pm">\u202f±\u202f0.10</span>' in page


def test_table_and_page_tell_what_each_of_two_bodies_shows_and_what_it_does_not() -> None:
    shown = BodyEstimate(("r0",), 0.31, 0.02, np.array([0.3, 0.4, 0.0]), np.full(3, 0.01), 0.01, np.array([0.8, 2.0]))
    nan = np.full(3, np.nan)
    unseen = BodyEstimate(("r1", "r2"), np.nan, np.nan, nan, nan, np.nan, nan[:2])
    hinge = HingeEstimate(np.array([0.0, 0, 1]), np.zeros(3), 0.1, 1e-3, np.deg2rad(17), (shown, unseen))
    seen = replace(around(3), hinge=hinge)
    lines = team_table(seen, "a team").splitlines()
    at = lines.index("  two bodies with a hinge")
    assert [cell.strip() for cell in re.split(" {3,}", lines[at + 2].strip())] == [
        "held by r0", "0.310 ± 0.020 kg m²", "0.500 ± 0.010 kg m", "0.800 and 2.00 kg",
    ]  # fmt: skip
    assert re.split(" {3,}", lines[at + 3].strip()) == ["held by r1, r2", "not shown", "not shown", "not shown"]
    page = html.unescape(render(team_page("a team", seen)))
    section = page[page.index("Two bodies with a hinge") : page.index("All ten parameters")]
    words = re.sub(r"\s+", " ", re.sub("<[^>]+>", " ", section).replace("\u202f", " ").replace("\xa0", " "))
    assert "swung by 17° to either side" in words
    assert "r0 0.310 ± 0.020 kg m² 0.500 ± 0.010 kg m 0.800 to 2.00 kg" in words
    assert "r1, r2 not shown not shown not shown" in words
    assert "10 of 17" in page


def test_small_moments_are_told_in_small_units_and_clocks_by_their_bars() -> None:
    light = around(2)
    small = replace(light, parameters=InertialParameters(light.parameters.vector * 1e-2))
    for seen, unit in ((small, "kg mm²"), (light, "kg m²")):
        moments = [line for line in team_table(seen, "a team").splitlines() if line.startswith("    J")]
        assert len(moments) == 3
        assert all(line.endswith(f" {unit}") for line in moments)
    late = replace(light, clock_offsets_s={"r0": 0.0, "r1": -0.000042}, clock_offset_std_s={"r0": 0.0, "r1": 9.4e-5})
    assert "clock late by −0.042 ms" in render(team_page("a team", late))


def test_no_spokes_lead_to_the_centre_of_what_is_no_body() -> None:
    seen = around(3)
    none = replace(seen, parameters=InertialParameters(-seen.parameters.vector))
    with_spokes, without = (len(team_scene(each).bodies[0].vertices) for each in (seen, none))
    assert without < with_spokes
    assert render(team_page("no body", none))


@pytest.mark.parametrize(("width", "turns"), [(0.06, [0.3, 0.3, 3.0]), (2e-4, [3.0, 0, 0])])
def test_the_payload_is_seen_from_above_whether_its_grasps_span_a_plane_or_nearly_a_line(
    width: float, turns: list[float]
) -> None:
    triangle = np.array([[0.0, 0, 0], [1.0, 0, 0], [0.45, width, 0]])
    for turn in Rotation.exp(np.random.default_rng(0).normal(size=(12, 3)) * turns).matrix:
        places = triangle @ turn.T
        body = InertialParameters.from_com(12.0, places.mean(0), np.eye(3))
        view = team_scene(answer(body, {f"r{k}": Pose(Rotation.identity(), p) for k, p in enumerate(places)})).view
        assert view is not None
        assert view[1, 2] > 0.5


def test_what_hands_may_have_moved_is_not_called_left_over() -> None:
    made = simulate_team(TeamScene(EXACT, sensing="poses", kinds=("grasp", "motion"), motion_samples=300), 1)
    kinds = [recording.kind for recording in made.log.recordings]
    assert "grasp" in kinds
    grasps = {name: made.truth.grasps[k] for k, name in enumerate(made.log.names)}
    found = answer(made.truth.body, grasps)
    alone = replace(made.log, recordings=tuple(r for r in made.log.recordings if r.kind != "grasp"))
    whole, less = team_residuals(made.log, found), team_residuals(alone, found)
    assert whole is not None
    assert less is not None
    assert len(whole.time) == len(less.time)
    only = team_residuals(replace(made.log, recordings=made.log.recordings[kinds.index("grasp") :][:1]), found)
    assert only is not None
