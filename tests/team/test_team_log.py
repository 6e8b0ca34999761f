"""Team logs: every wrong one has its one clear error; missing numbers become masks."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as ScipyRotation

from steelyard.errors import BadInput, BadValue
from steelyard.logs.team_log import TeamLog, TeamRecording, TeamRobot
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose, Rotation

DOWN = np.array([0.0, 0.0, -9.81])
TIME = np.arange(5) / 100


def track(**changed: object) -> Track:
    channels = {"rotation": np.tile(np.eye(3), (5, 1, 1)), "position": np.ones((5, 3)), "force": np.ones((5, 3))}
    return Track.of(TIME, **{**channels, **changed})  # type: ignore[arg-type]


def team(names: tuple[str, ...] = ("left", "right"), reference: str = "left", **tracks: Track) -> TeamLog:
    chosen = {name: track() for name in dict.fromkeys(names)} | tracks
    robots = tuple(TeamRobot(name, DOWN) for name in names)
    return TeamLog(robots, (TeamRecording("motion", chosen, "run"),), reference)


def fresh(start: float) -> Track:
    return track().shifted(start)


WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "one robot": (
        lambda: team(("left",)),
        "a team must have at least two robots; got 1. For one robot use `steelyard identify`.",
    ),
    "name twice": (
        lambda: team(("left", "left")),
        "each robot must have a name of its own; 'left' is used twice.",
    ),
    "reference": (
        lambda: team(reference="middle"),
        "reference must be one of left, right; got 'middle'.",
    ),
    "no rotation": (
        lambda: team(right=track(rotation=None)),
        "'right' must measure how it turns; none of its recordings has a rotation or an angular velocity.",
    ),
    "all rotations missing": (
        lambda: team(right=track(rotation=np.full((5, 3, 3), np.nan))),
        "'right' must measure how it turns; none of its recordings has a rotation or an angular velocity.",
    ),
    "nanoseconds": (
        lambda: team(left=track().stamped(TIME * 1e9), right=track().stamped(TIME * 1e9)),
        "time of 'left' in 'run': rows are 1e+07 s apart, which no force-torque log is. Correct the unit of "
        "time (s, ms, us, ns; arrays are in s: of nanoseconds give (ns - first) * 1e-9, one `first` for all), the "
        "column or the rate.",
    ),
    "quaternions": (
        lambda: track(rotation=np.ones((5, 4))),
        "rotation must have shape (T, 3, 3); got (5, 4). Quaternions become one with "
        "sy.Rotation.from_quaternion_wxyz or .._xyzw.",
    ),
    "clocks": (
        lambda: team(right=fresh(10.0)),
        "clocks of 'run' must overlap; they do not: left 0 to 0.04 s; right 10 to 10.04 s. Give stamps of one clock, "
        "to within the offsets that are to be estimated.",
    ),
    "stranger": (lambda: team(other=track()), "'run' names 'other', who is not in the team."),
    "no recording": (
        lambda: replace(team(), recordings=()),
        "a team log needs at least one recording; got none.",
    ),
    "no data": (
        lambda: TeamLog(
            (TeamRobot("left", DOWN), TeamRobot("right", DOWN)), (TeamRecording("motion", {"left": track()}),), "left"
        ),
        "'right' has no recording; give one, or leave the robot out of the team.",
    ),
    "recordings of other names": (
        lambda: replace(
            team(),
            recordings=(
                TeamRecording("motion", {"left": track()}, "a"),
                TeamRecording("motion", {"right": track()}, "b"),
            ),
        ),
        "'left' has data in no recording of another robot: it has 'a', others have 'b'. Recordings of one time must "
        "have one name.",
    ),
    "empty recording": (
        lambda: TeamRecording("still", {}, "run"),
        "'run' holds no robot's data; give at least one stream.",
    ),
    "kind": (
        lambda: TeamRecording("moving", {"left": track()}, "run"),  # type: ignore[arg-type]
        "kind of 'run' must be one of grasp, still, motion; got 'moving'.",
    ),
    "falling clock": (
        lambda: Track.of([0.0, 0.02, 0.01], force=np.ones((3, 3))),
        "time must rise from row to row; 1 row does not, the first is row 3.",
    ),
    "lengths": (
        lambda: Track.of(TIME, force=np.ones((4, 3))),
        "force has 4 rows, time has 5; they must agree.",
    ),
    "columns": (lambda: track(force=np.ones((5, 2))), "force must have shape (T, 3); got (5, 2)."),
    "rotation": (
        lambda: track(rotation=np.tile(2 * np.eye(3), (5, 1, 1))),
        "rotation must be orthonormal; entry (0,) is off by 3 in R^T R (tolerance 1e-06).",
    ),
    "gravity": (
        lambda: TeamRobot("left", np.zeros(3)),
        "gravity of 'left' must be three numbers, not all zero; got [0.0, 0.0, 0.0].",
    ),
    "base": (
        lambda: TeamRobot("left", DOWN, "rolling"),  # type: ignore[arg-type]
        "base of 'left' must be 'still' or 'moving'; got 'rolling'.",
    ),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_logs_have_one_clear_error(wrong: str) -> None:
    make, message = WRONG[wrong]
    with pytest.raises(BadInput) as caught:
        make()
    assert str(caught.value) == message


def test_a_missing_number_loses_its_channel_only_and_the_whole_wrench() -> None:
    force, torque, position = np.ones((5, 3)), np.ones((5, 3)), np.ones((5, 3))
    force[1, 2] = torque[3, 0] = position[4, 1] = np.nan
    made = track(force=force, torque=torque, position=position)
    assert made.mask("force").tolist() == made.mask("torque").tolist() == [True, False, True, False, True]
    assert made.mask("position").tolist() == [True] * 4 + [False]
    assert made.mask("rotation").all()
    assert not made.mask("specific_force").any()
    assert np.isfinite(made.wrench()).all()


def test_dates_are_seconds_and_rotations_are_matrices() -> None:
    turn = Rotation.exp(np.ones((5, 3)))
    dated = np.datetime64("2024-05-01T12:00:00") + (TIME * 1e9).astype("m8[ns]")
    for rotation in (turn, turn.matrix, ScipyRotation.from_matrix(turn.matrix.copy())):
        made = Track.of(dated, rotation=rotation)  # type: ignore[arg-type]
        assert np.diff(made.time) == pytest.approx(0.01, abs=1e-6)
        assert made.rotation.matrix == pytest.approx(turn.matrix)
    dated[2] = np.datetime64("NaT")
    with pytest.raises(BadValue, match="time must be finite; 1 entry is not"):
        Track.of(dated, force=np.ones((5, 3)))


def test_a_zero_torque_column_is_a_passive_gimbal() -> None:
    log = team(right=track(torque=np.zeros((5, 3))))
    assert log.force_only("left")
    assert log.force_only("right")
    assert not team(right=track(torque=np.ones((5, 3)))).force_only("right")


def test_other_kinds_stand_in_but_still_poses_never_do() -> None:
    tracks = {"left": track(), "right": track()}
    motion, still = TeamRecording("motion", tracks, "a"), TeamRecording("still", tracks, "b")
    log = team().with_recordings(motion, still)
    assert log.of_kind("grasp") == (motion,)
    assert log.of_kind("still") == (still,)


def test_moved_homes_move_poses_and_gravity_alike() -> None:
    home = Pose(Rotation.exp([0.3, -0.2, 0.9]), np.array([1.0, 2.0, 3.0]))
    moved = team().with_homes({"right": home})
    before, after = dict(team().recordings[0].tracks), dict(moved.recordings[0].tracks)
    assert after["left"] is not before["left"] or np.array_equal(after["left"].time, before["left"].time)
    assert np.allclose(after["right"].pose.matrix(), home.matrix() @ before["right"].pose.matrix())
    assert np.allclose(moved.robot("right").gravity, home.rotation.apply(DOWN))
    assert np.array_equal(after["right"].channels["force"], before["right"].channels["force"])


def test_renaming_keeps_order_and_reference() -> None:
    renamed = team().renamed({"left": "port"})
    assert renamed.names == ("port", "right")
    assert renamed.reference == "port"
    assert set(renamed.recordings[0].tracks) == {"port", "right"}


def test_a_shifted_track_keeps_what_was_measured() -> None:
    first = track()
    later = first.shifted(0.25)
    np.testing.assert_array_equal(later.time, first.time + 0.25)
    assert later.channels == first.channels
    assert later.valid == first.valid
    assert not later.time.flags.writeable
    with pytest.raises(BadValue, match="time must be finite"):
        first.shifted(float("nan"))
