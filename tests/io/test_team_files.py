"""Team descriptions: what is written comes back, clocks and frames are joined, and every wrong file says so clearly."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import json
import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile, BadInput
from steelyard.evidence import Evidence
from steelyard.inertia import InertialParameters
from steelyard.io import read_result, read_team, write_result, write_team
from steelyard.logs.recording import Mount, Stream
from steelyard.logs.team_log import TeamLog, TeamRecording, TeamRobot
from steelyard.logs.team_streams import in_grasp_axes, on_one_clock
from steelyard.logs.team_track import Track
from steelyard.pipelines.lacking import missing_rows, repeated_rows
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene
from steelyard.spatial import Pose, Rotation
from steelyard.team.estimate import GraspEstimate, TeamEstimate


@cache
def omnids() -> TeamTrial:
    """A short session of three Omnids."""
    scene = TeamScene(CASES["B"], grasp_samples=150, motion_samples=200, still_samples=10)
    return simulate_team(scene, 3)


def assert_same(written: TeamLog, read: TeamLog, within: float) -> None:
    assert read.names == written.names
    assert read.reference == written.reference
    assert [r.name for r in read.recordings] == [r.name for r in written.recordings]
    for before, after in zip(written.recordings, read.recordings, strict=True):
        assert after.kind == before.kind
        assert after.away == before.away
        assert after.tracks.keys() == before.tracks.keys()
        for name, track in before.tracks.items():
            found = after.tracks[name]
            assert found.channels.keys() == track.channels.keys()
            np.testing.assert_allclose(found.time, track.time, atol=1e-6)
            for channel in track.channels:
                np.testing.assert_array_equal(found.valid[channel], track.valid[channel])
                good = track.valid[channel]
                np.testing.assert_allclose(found.channels[channel][good], track.channels[channel][good], atol=within)


def test_joint_angles_and_spring_torques_come_back_as_poses_and_forces(tmp_path: Path) -> None:
    made = omnids()
    path = write_team(made.log, tmp_path / "team.toml", made.joints)
    assert "joint_torque" in path.read_text()
    assert "rotation" not in path.read_text()
    assert_same(made.log, read_team(path), 2e-4)


def test_every_channel_gap_and_absence_comes_back(tmp_path: Path) -> None:
    rng = np.random.default_rng(0)
    time = np.arange(40) * 0.01
    vectors = {
        name: rng.normal(size=(40, 3))
        for name in (
            "position", "angular_velocity", "linear_velocity", "angular_acceleration", "linear_acceleration",
            "specific_force", "gravity", "force", "torque",
        )
    }  # fmt: skip
    vectors["force"][7] = np.nan
    turns = Rotation.exp(rng.normal(size=(40, 3))).matrix
    full = Track.of(time, time < 0.2, rotation=turns, **vectors)
    bare = Track.of(time + 0.003, rotation=turns, force=vectors["force"])
    log = TeamLog(
        (
            TeamRobot("a b", None, "moving"),
            TeamRobot("c", np.array([0, 0, -9.81])),
            TeamRobot("d", np.array([0, 0, -9.8])),
        ),
        (
            TeamRecording("motion", {"a b": full, "c": bare, "d": bare}, "all"),
            TeamRecording("still", {"a b": full, "c": bare}, "two", frozenset({"d"})),
            TeamRecording("still", {"a b": full}, "lonely"),
        ),
        "c",
    )
    back = read_team(write_team(log, tmp_path / "team.toml"))
    assert_same(log, back, 1e-6)
    assert [r.base for r in back.robots] == ["moving", "still", "still"]
    assert back.robots[0].gravity is None
    np.testing.assert_allclose(back.robots[2].gravity, [0, 0, -9.8])
    np.testing.assert_array_equal(back.recordings[0].tracks["a b"].carrying, time < 0.2)
    assert not back.recordings[0].tracks["a b"].valid["torque"][7]
    assert back.force_only("c")
    assert not back.force_only("a b")


def test_the_example_is_what_the_demo_makes(examples_dir: Path) -> None:
    from steelyard.simulate.three_omnids import three_omnids

    assert_same(three_omnids(0).log, read_team(examples_dir / "omnid_three.toml"), 5e-4)
    assert sum(f.stat().st_size for f in (examples_dir / "omnid_three").iterdir()) < 1.5e6


def test_streams_on_other_clocks_meet_on_that_of_the_pose() -> None:
    """Smooth signals at 1 kHz, 100 Hz and 40 Hz are what they are at the stamps of the pose, delays taken away."""

    def wave(t: np.ndarray) -> np.ndarray:
        return np.stack([np.sin(3 * t), np.cos(2 * t), np.sin(t + 1)], axis=1)

    pose, fast, slow = np.arange(0, 4, 0.01), np.arange(-0.1, 4.1, 0.001), np.arange(-0.1, 4.1, 0.025)
    turns = Rotation.exp(0.3 * wave(slow)).matrix
    streams = (
        Stream("f", {"force": wave(fast)}, fast + 0.02, delay=0.02),
        Stream("p", {"position": wave(pose)}, pose),
        Stream("r", {"rotation": turns}, slow),
    )
    time, channels = on_one_clock(streams[:2])
    np.testing.assert_array_equal(time, pose)
    np.testing.assert_allclose(channels["force"], wave(pose), atol=1e-4)
    time, channels = on_one_clock(streams)
    np.testing.assert_array_equal(time, slow)
    inside = (slow > 0.1) & (slow < 3.9)
    np.testing.assert_allclose(channels["position"][inside], wave(slow[inside]), atol=1e-3)
    assert np.isnan(channels["position"][slow < -0.01]).all()
    np.testing.assert_array_equal(channels["rotation"], turns)


def test_rotations_are_interpolated_on_the_group() -> None:
    own, at = np.arange(0, 2, 0.02), np.arange(0, 1.9, 0.013)

    def vectors(t: np.ndarray) -> np.ndarray:
        return np.stack([0.2 * np.sin(t), 0.1 * t, 3.0 + 0 * t], axis=1)

    joints = Stream("j", {"joint_position": np.zeros((len(at), 6))}, at)
    turns = Stream("r", {"rotation": Rotation.exp(vectors(own)).matrix}, own)
    _, channels = on_one_clock((turns, joints))
    apart = Rotation.exp(vectors(at)).inverse() @ Rotation(channels["rotation"])
    assert float(apart.angle().max()) < 1e-5


def test_noise_of_a_fast_stream_is_averaged() -> None:
    rng = np.random.default_rng(1)
    fast, pose = np.arange(0, 10, 0.001), np.arange(0, 10, 0.01)
    streams = (Stream("p", {"position": np.zeros((len(pose), 3))}, pose),
               Stream("f", {"force": rng.normal(size=(len(fast), 3))}, fast))  # fmt: skip
    assert float(on_one_clock(streams)[1]["force"].std()) == pytest.approx(11**-0.5, rel=0.1)


def test_mounts_and_home_axes_are_turned_into_the_grasp() -> None:
    rng = np.random.default_rng(2)
    time, turn = np.arange(5.0), Rotation.exp(rng.normal(size=(5, 3)))
    force, torque = rng.normal(size=(2, 5, 3))
    X = Pose(Rotation.exp(np.array([0.3, -0.2, 0.9])), np.array([0.1, -0.05, 0.2]))
    # The wrench at the grasp, as a sensor at X sees it.
    seen = X.rotation.inverse().apply(force)
    lever = X.rotation.inverse().apply(torque - np.cross(X.position, force))
    mounted = Stream("w", {"force": seen, "torque": lever}, time, mount=Mount(X.rotation, X.position))
    home = Stream("v", {"linear_velocity": turn.apply(force)}, time, {"linear_velocity": "W"})
    streams = (Stream("r", {"rotation": turn.matrix}, time), mounted, home)
    out = in_grasp_axes(streams, on_one_clock(streams)[1])
    np.testing.assert_allclose(out["force"], force, atol=1e-12)
    np.testing.assert_allclose(out["torque"], torque, atol=1e-12)
    np.testing.assert_allclose(out["linear_velocity"], force, atol=1e-12)


@pytest.fixture
def files(tmp_path: Path) -> Path:
    made = omnids()
    return write_team(made.log, tmp_path / "team.toml", made.joints)


def test_recordings_are_matched_by_kind_and_order_where_they_have_no_name(files: Path) -> None:
    named = read_team(files)
    files.write_text(re.sub(r'\n  name = "[^"]*"', "", files.read_text()))
    bare = read_team(files)
    assert [r.name for r in bare.recordings] == ["grasp", "still 1", "still 2", "still 3", "still 4", "motion"]
    for a, b in zip(named.recordings, bare.recordings, strict=True):
        np.testing.assert_array_equal(a.tracks["robot1"].time, b.tracks["robot1"].time)


def test_the_reaction_is_turned_round_and_gravity_may_be_unknown(files: Path) -> None:
    before = read_team(files)
    text = files.read_text().replace("[team]\n", '[team]\nwrench = "on-sensor"\n')
    files.write_text(re.sub(r"gravity = [^\n]*", 'gravity = "unknown"', text))
    after = read_team(files)
    first, turned = (log.recordings[0].tracks["robot0"].channels["force"] for log in (before, after))
    np.testing.assert_array_equal(turned, -first)
    assert [robot.gravity for robot in after.robots] == [None, None, None]


def test_rows_with_nan_are_masked(files: Path) -> None:
    table = files.with_suffix("") / "robot1-motion-5.csv"
    rows = table.read_text().splitlines()
    for k in (3, 4, 9):
        cells = rows[k].split(",")
        rows[k] = ",".join(cells[:7] + ["nan"] * 3)
    table.write_text("\n".join(rows) + "\n")
    track = read_team(files).recordings[-1].tracks["robot1"]
    assert np.flatnonzero(~track.valid["force"]).tolist() == [2, 3, 8]
    assert track.valid["rotation"].all()


Change = Callable[[str], str]


def swap(old: str, new: str, count: int = 1) -> Change:
    return lambda text: text.replace(old, new, count)


def only(count: int) -> Change:
    return lambda text: "[[robot]]".join(text.split("[[robot]]")[: count + 1])


WRONG: dict[str, tuple[Change, str]] = {
    "one robot": (only(1), "team.toml: a team must have at least two robots; got 1. For one robot use `steelyard identify`."),
    "no robot": (only(0), "team.toml: no [[robot]] is given, so there is no team. A description begins like this:"),
    "twice": (swap('name = "robot1"', 'name = "robot0"'), "team.toml: each robot must have a name of its own; 'robot0' is used twice."),
    "reference": (swap('reference = "robot0"', 'reference = "top"'), "team.toml: reference must be one of robot0, robot1, robot2; got 'top'."),
    "log": (swap("[team]", "[log]"), "team.toml: [log] and [[stream]] make this the log of one robot. Use it with: steelyard identify"),
    "key": (swap("reference", "referense"), 'team.toml, [team]: unknown key "referense". Did you mean "reference"? Keys here: gravity, reference, wrench.'),
    "model": (swap('"omnid"', '"omnit"'), 'team.toml, [[robot]] 1 ("robot0"): unknown model "omnit". Did you mean "omnid"? Possible here: omnid.'),
    "model and arm": (swap('model = "omnid"\n', 'model = "omnid"\nurdf = "arm.urdf"\n'), 'team.toml, [[robot]] 1 ("robot0"): "model" and "urdf" say the same. Give one of them.'),
    "no model": (swap('model = "omnid"\n', ""), 'team.toml, [[robot]] 1 ("robot0"), recording 1, stream 1 ("team/robot0-grasp-0.csv"): "joint_position" needs the kinematics of the robot. Write model = "omnid" in its [[robot]], or, for the pose of an arm, urdf = "arm.urdf" and sensor_link = ".."; or give the pose and the wrench of the grasp instead.'),
    "kind": (swap('kind = "grasp"', 'kind = "grip"'), 'team.toml, [[robot]] 1 ("robot0"), recording 1: unknown kind "grip". Did you mean "grasp"? Possible here: grasp, still, motion.'),
    "kinds": (swap('kind = "grasp"', 'kind = "motion"'), 'team.toml, [[robot]] 2 ("robot1"), recording 1: recording "grasp-0" is "grasp" here and "motion" for "robot0". Give both one kind.'),
    "named twice": (swap('name = "still-2"', 'name = "still-1"'), 'team.toml, [[robot]] 1 ("robot0"), recording 3: the robot has another recording named "still-1". Rename one.'),
    "no time": (swap('time = { columns = ["t"], unit = "s" }', ""), 'team.toml, [[robot]] 1 ("robot0"), recording 1, stream 1 ("team/robot0-grasp-0.csv"): the streams of a team need time: robots are brought together by their clocks. Give time = { columns = ["t"], unit = "s" }, or time = { rate = 100, unit = "Hz" } where all start together.'),
    "gravity": (swap("gravity = [0, 0, -9.81]", "gravity = [0, 0, -981]"), 'team.toml, [team]: "gravity" must be in m/s^2, [0, 0, -9.81] on a level base; got [0, 0, -981].'),
    "torque alone": (lambda t: re.sub(r"    joint_position[^\n]*\n", "", t, count=1), 'team.toml, [[robot]] 1 ("robot0"), recording 1: "joint_torque" becomes a force only at known joint angles. Give "joint_position" as well.'),
    "away": (swap('name = "grasp-0"', 'name = "grasp-0"\n  away = true'), 'team.toml, [[robot]] 1 ("robot0"), recording 1: "away" says that the robot holds nothing in this recording; leave out its streams.'),
    "no file": (swap("team/robot0-grasp-0.csv", "team/none.csv"), 'team.toml, [[robot]] 1 ("robot0"), recording 1, stream 1 ("team/none.csv"): "team/none.csv" was not found. Searched: '),
}  # fmt: skip


@pytest.mark.parametrize("what", WRONG)
def test_wrong_descriptions(files: Path, what: str) -> None:
    change, said = WRONG[what]
    files.write_text(change(files.read_text()))
    with pytest.raises(BadInput) as error:
        read_team(files)
    assert str(error.value).startswith(said)


def test_all_mistakes_of_a_description_are_told_at_once(files: Path) -> None:
    text = files.read_text().replace('name = "robot1"\n', 'name = "robot1"\nbase = "rolling"\nwrench = "up"\n')
    first, rest = text.split('name = "robot2"')
    rest = rest.replace('kind = "grasp"', 'kind = "grip"', 1).replace('kind = "motion"', 'kind = "moved"', 1)
    files.write_text(f'{first}name = "robot2"{rest}')
    with pytest.raises(BadInput) as error:
        read_team(files)
    assert [line.removeprefix("team.toml, ").split(".")[0] for line in str(error.value).splitlines()] == [
        '[[robot]] 2 ("robot1"): unknown base "rolling"',
        '[[robot]] 2 ("robot1"): unknown wrench "up"',
        '[[robot]] 3 ("robot2"), recording 1: unknown kind "grip"',
        '[[robot]] 3 ("robot2"), recording 6: unknown kind "moved"',
    ]


def rewritten(files: Path, name: str, change: Callable[[np.ndarray], np.ndarray]) -> None:
    """Write one table of the team anew, its joint angles changed."""
    table = files.with_suffix("") / name
    head, *rows = table.read_text().splitlines()
    numbers = np.array([row.split(",") for row in rows], float)
    numbers[:, 1:7] = change(numbers[:, 1:7])
    np.savetxt(table, numbers, delimiter=",", header=head, comments="")


def test_degrees_called_radians_are_named_with_the_key_to_set(files: Path) -> None:
    rewritten(files, "robot1-motion-5.csv", np.rad2deg)
    with pytest.raises(
        BadInput,
        match=r'\("robot1"\), recording 6: joint angles look like degrees that are read as "rad": they would be between '
        r'.* deg, where no Omnid works. Set unit = "deg" for "joint_position".',
    ):
        read_team(files)


@pytest.mark.parametrize("recording", ["motion-5", "still-2"])
def test_radians_called_degrees_are_named_with_the_key_to_set(files: Path, recording: str) -> None:
    rewritten(files, f"robot1-{recording}.csv", np.deg2rad)
    with pytest.raises(
        BadInput, match=r'\("robot1"\).*: joint angles look like radians that are read as "deg": .*Set unit = "rad" for'
    ):
        read_team(files)


def test_joints_in_another_order_are_no_matter_of_units(files: Path) -> None:
    rewritten(files, "robot1-motion-5.csv", lambda q: q[:, [3, 4, 5, 0, 1, 2]] - 1.0)
    with pytest.raises(BadInput, match=r'\("robot1"\), recording 6: Delta joint 1 must be within -25.0 to 105.0 deg;'):
        read_team(files)


def test_a_spring_torque_that_is_always_zero_is_refused(files: Path) -> None:
    table = files.with_suffix("") / "robot1-motion-5.csv"
    head, *rows = table.read_text().splitlines()
    numbers = np.array([row.split(",") for row in rows], float)
    numbers[:, head.split(",").index("tau2")] = 0
    np.savetxt(table, numbers, delimiter=",", header=head, comments="")
    with pytest.raises(BadInput, match=r'\("robot1"\), recording 6: torque 2 of 3 is exactly 0 in all'):
        read_team(files)


def test_an_arm_parked_below_where_it_works_is_read(files: Path) -> None:
    rewritten(files, "robot1-still-2.csv", lambda q: 0.05 * q + np.deg2rad([2.0, 2.0, 2.0, 0.0, 0.0, 0.0]))
    assert read_team(files).names == ("robot0", "robot1", "robot2")


def test_counts_that_differ_need_names(files: Path) -> None:
    text = re.sub(r'\n  name = "[^"]*"', "", files.read_text())
    first, one, *rest = text.split("[[robot]]")
    blocks = one.split("  [[robot.recording]]")
    files.write_text("[[robot]]".join([first, "  [[robot.recording]]".join(blocks[:2] + blocks[3:]), *rest]))
    with pytest.raises(
        BadInput, match=r'different numbers of "still" ones: "robot0" 3, "robot1" 4, "robot2" 4. Give each a name'
    ):
        read_team(files)


def plain_team(tmp_path: Path, late: float = 0.0) -> Path:
    """Write two robots with rotations and forces; the stamps of the second are late."""
    rng, down = np.random.default_rng(3), np.array([0, 0, -9.81])
    track = Track.of(
        np.arange(50) * 0.01, rotation=Rotation.exp(rng.normal(size=(50, 3))).matrix, force=rng.normal(size=(50, 3))
    )
    log = TeamLog(
        (TeamRobot("a", down), TeamRobot("b", down)), (TeamRecording("motion", {"a": track, "b": track}, "m"),), "a"
    )
    path = write_team(log, tmp_path / "team.toml")
    late_rows = (tmp_path / "team" / "b-m.csv").read_text().splitlines()
    shifted = [f"{float(row.split(',')[0]) + late:g},{row.split(',', 1)[1]}" for row in late_rows[1:]]
    (tmp_path / "team" / "b-m.csv").write_text("\n".join([late_rows[0], *shifted]) + "\n")
    return path


def test_clocks_that_do_not_overlap(tmp_path: Path) -> None:
    with pytest.raises(
        BadInput,
        match=r"team.toml: clocks of 'm' must overlap; they do not: a 0 to 0.49 s; b 7 to 7.49 s. Give stamps of one clock",
    ):
        read_team(plain_team(tmp_path, late=7.0))


def test_a_robot_without_rotation(tmp_path: Path) -> None:
    path = plain_team(tmp_path)
    head, tail = path.read_text().split('name = "b"')
    path.write_text(head + 'name = "b"' + re.sub(r"    rotation[^\n]*\n", "", tail))
    with pytest.raises(
        BadInput,
        match=r"team.toml: 'b' must measure how it turns; none of its recordings has a rotation or an angular velocity.",
    ):
        read_team(path)


def test_a_force_must_say_what_its_moment_is(tmp_path: Path) -> None:
    path = plain_team(tmp_path)
    path.write_text(path.read_text().replace('    torque = "zero"   # a passive gimbal\n', ""))
    with pytest.raises(
        BadInput, match=r'"force" is given without "torque". Give its columns, or torque = "zero" for a passive gimbal.'
    ):
        read_team(path)


def test_a_team_is_told_from_a_log(tmp_path: Path) -> None:
    (tmp_path / "team.csv").write_text("t,fx\n0,1\n")
    with pytest.raises(BadFile, match=r"a team is described by a TOML text; found .csv."):
        read_team(tmp_path / "team.csv")
    with pytest.raises(BadFile, match=r'"none.toml" was not found'):
        read_team("none.toml", tmp_path)


def result() -> TeamEstimate:
    rng = np.random.default_rng(5)
    root = rng.normal(size=(10, 10))
    loose = rng.normal(size=(6, 6))
    return TeamEstimate(
        InertialParameters.from_com(12.0, [0.1, 0.2, 0.3], np.diag([2.0, 3.0, 4.0])), root @ root.T, "joint",
        Evidence(10, 4.0, 500, 100, 0.3, 0.2, 1.1), np.ones(10, np.bool_), frame="left", reference="left",
        grasps={
            "left": GraspEstimate(Pose.identity(), np.zeros((6, 6))),
            "right": GraspEstimate(Pose(Rotation.exp(np.array([0.1, 0.2, 2.0])), np.array([1.0, -0.5, 0.1])), loose @ loose.T, np.eye(6)[:1]),
        },
        clock_offsets_s={"left": 0.0, "right": 0.013}, clock_offset_std_s={"left": 0.0, "right": 1e-4},
        wrench_biases={"moves": np.arange(6.0)},
    )  # fmt: skip


def test_results_come_back(tmp_path: Path) -> None:
    made = result()
    write_result(made, tmp_path / "r.json")
    back = read_result(tmp_path / "r.json")
    assert isinstance(back, TeamEstimate)
    assert (back.frame, back.reference, back.method) == ("left", "left", "joint")
    assert back.clock_offsets_s == made.clock_offsets_s
    assert back.clock_offset_std_s == made.clock_offset_std_s
    assert {name: bias.tolist() for name, bias in back.wrench_biases.items()} == {
        "moves": [0.0, 1.0, 2.0, 3.0, 4.0, 5.0]
    }
    for name, grasp in made.grasps.items():
        np.testing.assert_allclose(back.grasps[name].pose.matrix(), grasp.pose.matrix(), atol=1e-15)
        np.testing.assert_array_equal(back.grasps[name].covariance, grasp.covariance)
        np.testing.assert_array_equal(back.grasps[name].lost, grasp.lost)
    values = json.loads((tmp_path / "r.json").read_text())
    assert values["principal_moments_kgm2"] == pytest.approx([2, 3, 4])
    assert set(values["principal_frame"]["right"]) == {"rotation", "position_m"}
    np.testing.assert_allclose(values["grasps"]["right"]["std_deg"], made.grasps["right"].std_deg)
    for entry in (values, values["std"]):  # every robot has biases of its own
        assert entry["force_bias_N"] is entry["torque_bias_Nm"] is None
    assert values["bias_covariance"] is values["cross_covariance"] is None
    write_result(replace(made, identified=np.arange(10) < 4), tmp_path / "open.json")
    values = json.loads((tmp_path / "open.json").read_text())
    assert values["principal_moments_kgm2"] is None
    assert values["principal_frame"] == {}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"grasps": {}}, '"grasps" must be one object with a grasp of every robot.'),
        ({"reference": "top"}, 'the reference must be one of the grasps; found "top".'),
        ({"grasps": {"left": {"rotation": [1], "position_m": [0, 0, 0]}}}, '"rotation" of the grasp of "left" must be 3 x 3 finite numbers; found something else.'),
        ({"grasps": {"left": {"rotation": [[2, 0, 0], [0, 1, 0], [0, 0, 1]], "position_m": [0, 0, 0]}}}, '"rotation" of the grasp of "left": '),
        ({"grasps": {"left": {"rotation": np.eye(3).tolist(), "position_m": [0, 0, True]}}}, '"position_m" of the grasp of "left" must be 3 finite numbers; found something else.'),
        ({"grasps": {"left": {"rotation": np.eye(3).tolist(), "position_m": [0, 0, 0], "lost": [[1, 2]]}}}, '"lost" of the grasp of "left" must be n x 6 finite numbers; found something else.'),
        ({"clock_offsets_s": {"left": "x"}}, '"left" of clock_offsets_s must be one finite number; found something else.'),
        ({"clock_offsets_s": {"left": "0.7"}}, '"left" of clock_offsets_s must be one finite number; found something else.'),
    ],
)  # fmt: skip
def test_wrong_results(tmp_path: Path, change: dict[str, object], said: str) -> None:
    path = tmp_path / "r.json"
    write_result(result(), path)
    path.write_text(json.dumps(json.loads(path.read_text()) | change))
    with pytest.raises(BadFile) as error:
        read_result(path)
    assert str(error.value).startswith(f"{path}: {said}")


def test_a_team_of_poses_and_six_axis_wrists(tmp_path: Path) -> None:
    scene = TeamScene(
        TeamNoise(), 2, "poses", six_axis=frozenset({1}), grasp_samples=60, motion_samples=60, still_samples=5
    )
    made = simulate_team(scene, 1)
    assert_same(made.log, read_team(write_team(made.log, tmp_path / "t.toml")), 1e-5)


def test_the_description_that_the_format_shows(tmp_path: Path) -> None:
    text = (Path(__file__).parents[2] / "docs" / "formats.md").read_text()
    (tmp_path / "team.toml").write_text(
        text.split("## Team description (TOML)")[1].split("```toml\n")[1].split("```")[0]
    )
    made = omnids()
    motion, joints = made.log.recordings[-1], made.joints[-1]["robot1"]
    left = motion.tracks["robot0"]
    columns = {
        "left": ("t,qw,qx,qy,qz,x,y,z,wx,wy,wz,fx,fy,fz", [
            left.time[:, None], left.pose.rotation.quaternion_wxyz(), left.pose.position, 0 * left.pose.position,
            left.channels["force"],
        ]),
        "right": ("t,q1,q2,q3,q4,q5,q6,tau1,tau2,tau3", [joints.time[:, None], joints.angles, joints.torques]),
    }  # fmt: skip
    for name, (head, parts) in columns.items():
        np.savetxt(tmp_path / f"{name}.csv", np.concatenate(parts, 1), delimiter=",", header=head, comments="")
    log = read_team(tmp_path / "team.toml")
    assert (log.names, log.reference) == (("left", "right"), "left")
    assert log.force_only("left")
    assert log.force_only("right")
    np.testing.assert_allclose(log.recordings[0].tracks["left"].channels["force"], left.channels["force"])
    expected = motion.tracks["robot1"].channels["position"]
    np.testing.assert_allclose(log.recordings[0].tracks["right"].channels["position"], expected, atol=1e-12)


def logged_again(path: Path, how: Callable[[list[str], int], list[str]]) -> None:
    """Write every table of robot1 beside a team's description anew, row by row."""
    for table in path.with_suffix("").glob("robot1-*.csv"):
        head, *rows = table.read_text().splitlines()
        table.write_text("\n".join([head, *(line for k in range(len(rows)) for line in how(rows, k))]) + "\n")


def held(rows: list[str], k: int) -> list[str]:
    """Return row k with its own stamp and the numbers of the row at which a sensor of half the rate was last read."""
    return [rows[k].partition(",")[0] + "," + rows[k - k % 2].partition(",")[2]]


@pytest.mark.parametrize(
    ("how", "repeated"),
    [(lambda rows, k: [rows[k]] * (2 if k % 10 == 3 else 1), 20), (held, 100)],
    ids=["logged twice", "sensor slower than the logger"],
)
def test_rows_that_a_robot_logged_again_are_used_once_and_told(
    how: Callable[[list[str], int], list[str]], repeated: int, tmp_path: Path
) -> None:
    path = write_team(omnids().log, tmp_path / "team.toml", omnids().joints)
    whole = read_team(path)
    logged_again(path, how)
    log = read_team(path)
    for before, after in zip(whole.recordings, log.recordings, strict=True):
        for name, track in before.tracks.items():
            found = after.tracks[name]
            assert (found.repeated > 0) == (name == "robot1" and len(track) >= 150)
            if name != "robot1" or (repeated == 20 and found.repeated):
                np.testing.assert_allclose(found.channels["position"], track.channels["position"], atol=1e-12)
    assert log.recordings[-1].tracks["robot1"].repeated == repeated
    (told,) = repeated_rows(log)
    assert told.code == "rows-duplicated"
    assert f"{repeated} rows of 'motion-" in told.message
    assert "'robot1'" in told.message
    assert not list(missing_rows(log))


def test_equal_stamps_of_a_coarse_clock_are_spread(tmp_path: Path) -> None:
    path = write_team(omnids().log, tmp_path / "team.toml", omnids().joints)
    whole = read_team(path)
    logged_again(path, lambda rows, k: [rows[k - k % 2].partition(",")[0] + "," + rows[k].partition(",")[2]])
    log = read_team(path)
    for before, after in zip(whole.recordings, log.recordings, strict=True):
        step = after.tracks["robot1"].time - before.tracks["robot1"].time
        assert np.abs(step - step[0]).max() < 1e-6
        assert after.tracks["robot1"].repeated == 0
