"""Poses of one robot that are read wrongly are named, with what to set; good logs and other faults are not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from made_teams import ALL_KINDS, HINGE, NOISY, trial

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.logs.misread import rolled
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.simulate.team_cases import CASES, Presence, Slip, TeamNoise
from steelyard.simulate.team_motions import Freedom
from steelyard.spatial import Pose, Rotation
from steelyard.team.joint import JointTeam
from steelyard.team.misread import poses as misread_poses
from steelyard.team.misread.poses import require_well_read

Spoil = Callable[[Array, Array], tuple[Array, Array]]


def scaled(factor: float) -> Spoil:
    return lambda R, p: (R, factor * p)


def turned_back(R: Array) -> Array:
    return np.swapaxes(R, 1, 2)


SPOILED: dict[str, tuple[Spoil, str]] = {
    "mm": (scaled(1e3), "1000 times too large, as when mm are read as m"),
    "cm": (scaled(1e2), "100 times too large, as when cm are read as m"),
    "inches": (scaled(1 / 0.0254), "39.37 times too large, as when inches are read as m"),
    "m as mm": (scaled(1e-3), "1000 times too small, as when m are read as mm"),
    "cm as mm": (scaled(0.1), "10 times too small, as when cm are read as mm"),
    "inches as mm": (scaled(1 / 25.4), "25.4 times too small, as when inches are read as mm"),
    "transposed": (lambda R, p: (turned_back(R), p), "rotation turns W into S, not S into W"),
    "w last": (lambda R, p: (rolled(R, -1), p), "in the order x, y, z, w, not w, x, y, z"),
    "w first": (lambda R, p: (rolled(R, 1), p), "in the order w, x, y, z, not x, y, z, w"),
    "inverted": (
        lambda R, p: (turned_back(R), -np.einsum("tji,tj->ti", R, p)),
        "poses are those of its home in its grasp",
    ),
}
# With two robots, too large here is too small there, and both poses inverted fit each other.
EITHER = {"mm", "cm", "inches", "m as mm", "cm as mm", "inches as mm", "inverted"}


def made(robots: int = 3, seed: int = 100, noise: TeamNoise = NOISY, **changes: Any) -> TeamLog:
    """Return a log of robots whose homes are anywhere."""
    scene: dict[str, Any] = {"robots": robots, "kinds": ALL_KINDS, "motion_samples": 800, "grasp_samples": 400}
    log = trial(noise, seed, **(scene | changes)).log
    rng = np.random.default_rng(seed)
    return log.with_homes({n: Pose(Rotation.exp(rng.normal(size=3)), rng.uniform(-1, 1, 3)) for n in log.names})


def case(name: str, robots: int, seed: int) -> TeamLog:
    return made(robots, seed, CASES[name], sensing="joints")


def spoiled(log: TeamLog, name: str, spoil: Spoil, only: int | None = None) -> TeamLog:
    """Return the log with a robot's poses read in another way, in all recordings or in one."""

    def read(track: Track) -> Track:
        turned, placed = spoil(track.channels["rotation"], track.channels["position"])
        return replace(track, channels={**track.channels, "rotation": turned, "position": placed})

    return log.with_recordings(
        *(
            replace(r, tracks={n: read(t) if n == name and only in (None, k) else t for n, t in r.tracks.items()})
            for k, r in enumerate(log.recordings)
        )
    )


def said(log: TeamLog) -> str:
    with pytest.raises(BadValue, match="do not fit one payload, and do so if") as caught:
        JointTeam().identify(log)
    return str(caught.value)


@pytest.mark.parametrize("way", SPOILED)
@pytest.mark.parametrize("name", ["A", "D"])  # the least noise and the most
def test_one_robot_misread_is_named_with_how(way: str, name: str) -> None:
    spoil, words = SPOILED[way]
    number = list(SPOILED).index(way) + list(CASES).index(name)
    for robots, seed in ((3, 100 + number), (2, 200 + number)):
        wrong = f"robot{number % robots}"
        message = said(spoiled(case(name, robots, seed), wrong, spoil))
        named = message.count("are misread")
        assert f"those of '{wrong}' are misread (" in message
        assert words in message
        assert named == (2 if robots == 2 and way in EITHER else 1)


@pytest.mark.parametrize("way", ["w last", "w first"])
def test_rotations_that_all_robots_tell_wrongly_are_named(way: str) -> None:
    spoil, words = SPOILED[way]
    for robots in (2, 3):
        log = made(robots)
        for name in log.names:
            log = spoiled(log, name, spoil)
        with pytest.raises(BadValue, match="those of all robots are misread") as caught:
            require_well_read(log)
        assert words in str(caught.value)
        assert "Set the form that their quaternions have" in str(caught.value)


def test_one_recording_misread_is_named() -> None:
    log = made(kinds=("grasp", "motion"))
    for way, robot, only in (("mm", 1, 0), ("transposed", 0, 1), ("inverted", 2, 1)):
        spoil, words = SPOILED[way]
        message = said(spoiled(log, f"robot{robot}", spoil, only))
        assert f"those of 'robot{robot}' are misread in '{log.recordings[only].name}' (" in message
        assert words in message


@pytest.mark.parametrize("way", ["cm", "mm", "inches"])
def test_a_unit_shows_though_all_robots_turn_noisily(way: str) -> None:
    """Noise of rotations is the same share whatever the unit: places alone fall to a quarter."""
    spoil, words = SPOILED[way]
    noisy = replace(NOISY, pose_rad=3e-3, pose_m=1e-3)
    for robots, seed in ((3, 700), (4, 701), (5, 702)):
        message = said(spoiled(made(robots, seed, noisy), "robot1", spoil))
        assert "those of 'robot1' are misread (" in message
        assert words in message


def test_a_clock_half_a_second_late_hides_nothing() -> None:
    spoil, words = SPOILED["transposed"]
    log = made(late_s={1: 0.5}, kinds=("grasp", "motion"))
    assert words in said(spoiled(log, "robot2", spoil))


@pytest.mark.parametrize("robots", [2, 3, 5])
@pytest.mark.parametrize("name", CASES)
def test_good_logs_pass(robots: int, name: str) -> None:
    require_well_read(case(name, robots, 300 + robots))


UPRIGHT, NONE = np.eye(3)[:, 2:], np.zeros((3, 0))
OTHERWISE: dict[str, dict[str, Any]] = {
    "hinge": {"robots": 4, "hinge": HINGE, "kinds": ("still", "motion")},
    "slip": {"slip": Slip(1, np.array([0.03, 0.04, 0.0]), 4.0)},
    "late": {"late_s": {1: 0.5}, "kinds": ("motion",)},
    "planar": {"freedom": Freedom(UPRIGHT, np.eye(3)[:, :2]), "kinds": ("grasp", "motion")},
    "planar, two robots": {"robots": 2, "freedom": Freedom(UPRIGHT, np.eye(3)[:, :2]), "kinds": ("motion",)},
    "one axis": {"freedom": Freedom(UPRIGHT, NONE, np.array([0.5, 0.3, 0.0])), "kinds": ("motion",)},
    "translation": {"freedom": Freedom(NONE, np.eye(3)), "kinds": ("motion",)},
    "one line": {"robots": 2, "freedom": Freedom(NONE, UPRIGHT), "kinds": ("motion",)},
}


@pytest.mark.parametrize("name", OTHERWISE)
def test_other_faults_and_poor_motions_are_not_called_misread(name: str) -> None:
    for seed in (100, 101):
        require_well_read(made(seed=seed, **OTHERWISE[name]))


@pytest.mark.parametrize("seed", [100, 101, 102])
def test_a_slip_far_from_the_homes_is_not_called_poses_that_all_tell_the_other_way_round(seed: int) -> None:
    """These fit one another as well, and move farther than poses do, so that noise is a smaller share."""
    log = made(seed=seed, **OTHERWISE["slip"])
    require_well_read(log.with_homes({name: Pose(Rotation.identity(), [3.0, -2.0, 0.5]) for name in log.names}))


def test_a_robot_that_is_merely_noisy_is_not_called_misread() -> None:
    def shaken(R: Array, p: Array) -> tuple[Array, Array]:
        return R, p + np.random.default_rng(0).normal(0, 0.05, p.shape)

    require_well_read(spoiled(made(), "robot2", shaken))


def test_a_large_noisy_team_is_judged_robot_by_robot(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not reading by reading: of twelve whom nobody misread each is left out once; only all are read otherwise."""
    judged, tried = [], []

    def counted(parts: Any, robot: int) -> Any:
        judged.append(robot)
        return left_out(parts, robot)

    def read(part: Any, robot: int, reading: Any) -> Any:
        tried.append(reading.words)
        return _read(part, robot, reading)

    left_out, _read = misread_poses._left_out, misread_poses._read
    monkeypatch.setattr(misread_poses, "_left_out", counted)
    monkeypatch.setattr(misread_poses, "_read", read)
    require_well_read(made(12, noise=replace(NOISY, pose_rad=8e-3, pose_m=4e-3)))
    assert judged == list(range(12))
    assert set(tried) == {way.words for way in misread_poses.TURNS}


@pytest.mark.parametrize(("seed", "seconds"), [(100, 0.9), (101, 0.4)])
def test_a_misreading_is_named_where_clocks_are_far_apart(seed: int, seconds: float) -> None:
    """No fit of such poses brings clocks together; how fast grasps turn does."""
    log = spoiled(made(3, seed), "robot1", scaled(1e3))
    late = [
        replace(r, tracks={n: t.stamped(t.time + seconds * (n == "robot2")) for n, t in r.tracks.items()})
        for r in log.recordings
    ]
    with pytest.raises(BadValue, match=r"if those of 'robot1' are misread \(.*1000 times too large"):
        JointTeam().identify(log.with_recordings(*late))


def test_a_misreading_is_named_beside_a_robot_that_lets_go() -> None:
    """Rows in which it holds nothing fit no reading; what fits without them may be called robots that let go."""
    log = made(5, kinds=("motion",), motion_samples=2500, presence=(Presence(3, leaves=12.0),))
    with pytest.raises(BadValue, match=r"if those of 'robot0' are misread \(.*in the order w, x, y, z, not x, y, z, w"):
        JointTeam().identify(spoiled(log, "robot0", SPOILED["w first"][0]))
