"""Sets of files: all of them appear, or none, and what else a folder holds stays."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadFile, BadValue
from steelyard.io.recordings.recording_files import write_recording
from steelyard.io.team_files import read_team
from steelyard.io.teams.team_writing import write_team
from steelyard.logs.recording import Recording, Stream
from steelyard.simulate.three_omnids import three_omnids
from steelyard.whole_files import whole_folder


def names(folder: Path) -> list[str]:
    """All files and folders below, as text."""
    return sorted(path.relative_to(folder).as_posix() for path in folder.rglob("*"))


def write(folder: Path) -> None:
    with whole_folder(folder) as new:
        (new / "in").mkdir()
        (new / "in/a").write_text("new a")
        (new / "b").write_text("new b")


def write_half(folder: Path) -> None:
    with whole_folder(folder) as new:
        (new / "b").write_text("new")
        raise BadValue("no such thing")


def test_a_new_folder_holds_all_and_nothing_else(tmp_path: Path) -> None:
    write(tmp_path / "x/y")
    assert names(tmp_path) == ["x", "x/y", "x/y/b", "x/y/in", "x/y/in/a"]


def test_own_names_are_replaced_and_others_stay(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    for name in ("b", "c", "in/a", "in/d"):
        (tmp_path / name).write_text("old")
    write(tmp_path)
    assert names(tmp_path) == ["b", "c", "in", "in/a", "in/d"]
    assert [(tmp_path / name).read_text() for name in ("b", "c", "in/a", "in/d")] == ["new b", "old", "new a", "old"]


@pytest.mark.parametrize("there", [False, True])
def test_an_error_leaves_everything_as_it_was(tmp_path: Path, there: bool) -> None:
    folder = tmp_path / "x/y"
    if there:
        folder.mkdir(parents=True)
        (folder / "b").write_text("old")
    before = names(tmp_path)
    with pytest.raises(BadValue, match="no such thing"):
        write_half(folder)
    assert names(tmp_path) == before
    assert not there or (folder / "b").read_text() == "old"


def test_a_folder_in_the_way_is_named_before_anything_is_replaced(tmp_path: Path) -> None:
    (tmp_path / "b").mkdir()
    (tmp_path / "in").mkdir()
    (tmp_path / "in/a").write_text("old")
    with pytest.raises(BadFile) as caught:
        write(tmp_path)
    assert str(caught.value) == f"{tmp_path}/b: cannot be written (a folder has this name)."
    assert names(tmp_path) == ["b", "in", "in/a"]
    assert (tmp_path / "in/a").read_text() == "old"


def test_a_file_in_the_way_is_named(tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(BadFile, match=r"taken: cannot be written \(Not a directory\)\.$"):
        write(tmp_path / "taken")
    with pytest.raises(BadFile, match=r"taken/x: cannot be written \(Not a directory\)\.$"):
        write(tmp_path / "taken/x")
    assert names(tmp_path) == ["taken"]


def test_a_recording_with_a_quantity_that_cannot_be_written_leaves_nothing(tmp_path: Path) -> None:
    time = np.arange(3.0)
    good, bad = (
        Stream("a.csv", {"force": np.ones((3, 3))}, time),
        Stream("b.csv", {"angular_velocity": np.ones((3, 3))}, time),
    )
    with pytest.raises(BadFile, match=r"^b\.csv: cannot write angular_velocity"):
        write_recording(Recording((good, bad), np.array([0, 0, -9.81])), tmp_path / "new")
    assert names(tmp_path) == []


def test_stamps_of_a_recording_that_are_large_and_close_stay_apart(tmp_path: Path) -> None:
    time = 900_000 + np.arange(50) / 4000
    channels = {"force": np.ones((50, 3)), "torque": np.ones((50, 3))}
    path = write_recording(Recording((Stream("a.csv", channels, time),), np.array([0, 0, -9.81])), tmp_path)
    again = np.loadtxt(path.parent / "a.csv", delimiter=",", skiprows=1)[:, 0]
    np.testing.assert_allclose(again, time, rtol=0, atol=1e-6)


def test_a_team_with_a_robot_that_cannot_be_written_leaves_what_was_there(tmp_path: Path) -> None:
    made = three_omnids(0)
    path = write_team(made.log, tmp_path / "team.toml", made.joints)
    before, text = names(tmp_path), path.read_bytes()
    *others, last = made.log.recordings
    name, track = list(last.tracks.items())[-1]
    channels = {**track.channels, "torque": np.zeros((len(track.time), 3))}
    valid = {**track.valid, "torque": np.ones(len(track.time), bool)}
    tracks = {**last.tracks, name: replace(track, channels=channels, valid=valid)}
    log = replace(made.log, recordings=(*others, replace(last, tracks=tracks)))
    for goal in (path, tmp_path / "new/other.toml"):
        with pytest.raises(BadValue, match="a six-axis robot is written with poses"):
            write_team(log, goal, made.joints, heading="other")
    assert (names(tmp_path), path.read_bytes()) == (before, text)
    assert len(read_team(path).robots) == 3


def recorded(*names: str) -> Recording:
    channels = {"force": np.ones((3, 3)), "torque": np.ones((3, 3))}
    return Recording(tuple(Stream(name, channels, np.arange(3.0)) for name in names), np.array([0, 0, -9.81]))


@pytest.mark.parametrize(
    "name",
    [
        "../../x.csv", "/x.csv", "a/../../x.csv", "..", "", ".", "..\\x.csv", "C:\\x.csv", "C:x.csv", "\\x.csv",
        "a\0b.csv", "log.toml", "./log.toml",
    ],
)  # fmt: skip
def test_a_stream_whose_name_leads_elsewhere_is_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(BadValue) as caught:
        write_recording(recorded("a.csv", name), tmp_path / "in/new")
    assert str(caught.value) == (
        f"stream {name!r} cannot be written: its name must be a path inside the folder, such as wrench.csv, "
        "and not log.toml."
    )
    assert names(tmp_path) == []


@pytest.mark.parametrize("other", ["a.csv", "./a.csv"])
def test_two_streams_of_one_name_are_refused(other: str, tmp_path: Path) -> None:
    with pytest.raises(BadValue) as caught:
        write_recording(recorded("a.csv", other), tmp_path / "new")
    assert str(caught.value) == f"streams 'a.csv' and {other!r} would be one file: give every stream a name of its own."
    assert names(tmp_path) == []


@pytest.mark.parametrize("name", ["kuka-1/2-baseline.csv", 'the "good" one.csv', "a\nb.csv", "\x7f.csv", "🔨.csv"])
def test_a_stream_of_any_name_inside_the_folder_is_written_as_valid_toml(name: str, tmp_path: Path) -> None:
    path = write_recording(recorded(name), tmp_path)
    said = tomllib.loads(path.read_text(encoding="utf-8"))
    assert [stream["path"] for stream in said["stream"]] == [name]
    assert (tmp_path / name).read_text().startswith("t,fx,fy,fz,tx,ty,tz\n")


def test_robots_whose_names_differ_in_marks_alone_have_tables_of_their_own(tmp_path: Path) -> None:
    log, names = three_omnids(0).log, ("a/b", "a b", "A-b")
    log = log.renamed(dict(zip(log.names, names, strict=True)))
    again = read_team(write_team(log, tmp_path / "team.toml"))
    for recording, read in zip(log.recordings, again.recordings, strict=True):
        for name in recording.tracks:
            forces = (each.tracks[name].channels["force"] for each in (recording, read))
            np.testing.assert_allclose(*forces, atol=1e-6)


def test_robots_and_recordings_of_any_name_are_written_as_valid_toml(tmp_path: Path) -> None:
    log, names = three_omnids(0).log, ("🤖", 'the "left" one', "\x7f\\é")
    log = log.renamed(dict(zip(log.names, names, strict=True)))
    log = log.with_recordings(*(replace(each, name=f"🔨 {each.name}") for each in log.recordings))
    path = write_team(log, tmp_path / "team.toml")
    said = tomllib.loads(path.read_text(encoding="utf-8"))
    assert said["team"]["reference"] == log.reference
    assert tuple(robot["name"] for robot in said["robot"]) == names
    assert [each.name for each in read_team(path).recordings] == [each.name for each in log.recordings]
