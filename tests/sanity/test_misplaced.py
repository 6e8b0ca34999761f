"""Positions of another point than S are found, and the answer is that of S all the same."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from sanity.held_poses import BODY, of_the_tip, recorded, swaying
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.logs.alignment import align
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Mount, Recording, Stream
from steelyard.pipelines import rows
from steelyard.pipelines.held_object import identify
from steelyard.pipelines.left_over import left_over, of_another_fit
from steelyard.pipelines.options import Options
from steelyard.sanity.before import examine
from steelyard.sanity.fitted.misplaced import misplaced
from steelyard.simulate.logs import simulate_log
from steelyard.spatial import Rotation

TIPS = [(0.0, 0.0, 0.03), (0.0, 0.05, 0.0), (0.02, -0.03, 0.1)]


@cache
def sound_answer() -> Estimate:
    """Return the answer where positions are those of S."""
    return identify(recorded("paper", 0))


def off(found: Estimate) -> float:
    """Return how many standard deviations mass, centre of mass and inertia are off at most."""
    inertia = (found.parameters.inertia_com - BODY.inertia_com)[np.triu_indices(3)]
    gap = np.concatenate([[found.mass - BODY.mass], found.com - BODY.com, inertia])
    return float(np.abs(gap / found.std).max())


@pytest.mark.parametrize("tip", TIPS)
def test_the_tip_of_a_tool_is_told_and_the_answer_holds(tip: tuple[float, float, float]) -> None:
    recording = of_the_tip(recorded("paper", 0), tip)
    found = identify(recording)
    assert [f.code for f in found.findings] == ["motion-mismatch"]
    said = re.search(r"a point \((.*?)\) ±", found.findings[0].message)
    assert said is not None
    np.testing.assert_allclose([float(v) for v in said[1].split(",")], 1e3 * np.array(tip), atol=1.5)
    assert off(found) < 3.5
    assert not of_another_fit(found, left_over(recording, found)[1])


def test_positions_of_the_sensor_are_left_alone() -> None:
    found = sound_answer()
    assert found.codes() == set()
    assert off(found) < 3.5


def from_accelerometer(recording: Recording) -> Recording:
    """Return the recording with what an accelerometer at the point of its positions shows in their place."""
    (stream,) = recording.streams
    channels = dict(stream.channels)
    moved = np.gradient(np.gradient(channels.pop("position"), stream.time, axis=0), stream.time, axis=0)
    felt = Rotation(channels["rotation"]).inverse().apply(moved - recording.gravity)
    mount = Mount(Rotation.identity(), np.zeros(3))
    imu = Stream("imu", {"specific_force": felt}, stream.time, mount=mount, delay=0.0)
    return replace(recording, streams=(replace(stream, channels=channels), imu))


def as_table(recording: Recording) -> Recording:
    """Return the rows of the recording, accelerations with them, as a table without a clock."""
    aligned = align(recording)
    log = aligned.log
    channels = {"rotation": aligned.rotation.matrix, "torque": log.wrench[:, :3], "force": log.wrench[:, 3:]}
    motion = ("angular_velocity", "angular_acceleration")
    channels |= {name: getattr(log, name) for name in motion} | {"linear_acceleration": log.acceleration}
    return replace(recording, streams=(Stream("table", channels),))


@pytest.mark.parametrize("made_of", [from_accelerometer, as_table])
def test_accelerations_of_another_point_are_moved_to_the_sensor_once(
    made_of: Callable[[Recording], Recording],
) -> None:
    found = identify(made_of(of_the_tip(recorded("paper", 0), TIPS[2])))
    said = re.search(
        r"a point \((.*?)\) ± 2 mm", next(f.message for f in found.findings if f.code == "motion-mismatch")
    )
    assert said is not None
    np.testing.assert_allclose([float(v) for v in said[1].split(",")], 1e3 * np.array(TIPS[2]), atol=2.5)
    assert found.mass == pytest.approx(BODY.mass, rel=0.01)


def test_the_point_told_is_the_one_that_rows_were_made_with(monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where the search does not settle: then bars hold what is left."""
    recording, before = examine(of_the_tip(recorded("paper", 0), (0.0, 0.2, 0.5)))
    used = []
    monkeypatch.setattr(rows, "SETTLED", 0.0)
    monkeypatch.setattr(rows, "align", lambda r, how: (used.append(how.place), align(r, how))[1])
    place = rows.Reading(recording, before, Options()).rows_to_fit().place
    assert place is not None
    assert len(used) == rows.ROUNDS + 1
    np.testing.assert_array_equal(place.place, used[-1])


@pytest.mark.parametrize(("axis", "noise"), [((1.0, 0.0, 0.0), 0.0), ((1.0, 1.0, 0.3), 1e-4)])
def test_turns_about_one_axis_tell_the_point_but_for_that_axis(axis: tuple[float, ...], noise: float) -> None:
    rng, time, g = np.random.default_rng(0), np.arange(0, 30, 0.01), np.array([0.0, 0.0, -9.81])
    along, tip, com = np.array(axis) / np.linalg.norm(axis), np.array([0.02, -0.03, 0.1]), np.array([0.02, 0.01, 0.05])
    R = Rotation.exp(np.outer(1.2 * np.sin(1.5 * time) + 0.5 * np.sin(4.3 * time), along))
    path = np.stack([0.1 * np.sin(0.7 * time), 0.1 * np.cos(1.1 * time), 0.05 * np.sin(1.9 * time)], 1)
    moved = np.gradient(np.gradient(path + R.apply(com), time, axis=0), time, axis=0)
    force = 2.0 * R.inverse().apply(moved - g)
    shown = R @ Rotation.exp(noise * rng.normal(size=(len(time), 3)))
    channels = {"rotation": shown.matrix, "position": path + R.apply(tip) + noise * rng.normal(size=path.shape),
                "force": force + 0.05 * rng.normal(size=path.shape),
                "torque": np.cross(com, force) + 0.0025 * rng.normal(size=path.shape)}  # fmt: skip
    found = identify(Recording((Stream("log", channels, time),), g))
    (said,) = (f.message for f in found.findings if f.code == "motion-mismatch")
    place = [float(v) for v in re.search(r"a point \((.*?)\) ±", said)[1].split(",")]  # type: ignore[index]
    np.testing.assert_allclose(place, 1e3 * (tip - along * (along @ tip)), atol=0.6)
    assert f"where it is along ({', '.join(f'{v:.2f}' for v in along)}) of S, turns about that axis alone" in said
    assert "gains-differ" not in found.codes()
    assert found.mass == pytest.approx(2.0, abs=0.002)


def made(motion: str, noise: str, seed: int) -> MotionLog:
    return simulate_log("drill", motion, noise, seed, shuffled=False)[0]


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow", "dyn_fast"])
@pytest.mark.parametrize("noise", ["low", "moderate", "high"])
def test_a_sound_log_shows_no_other_point(motion: str, noise: str) -> None:
    for seed in range(3):
        found = misplaced(made(motion, noise, seed))
        assert found is not None
        assert not found.sure


def test_rows_at_rest_show_no_point() -> None:
    log = made("stop_go", "low", 0)
    assert misplaced(log.rows(log.still)) is None


def told_of(recording: Recording) -> str:
    """Return what is said of a recording, with an answer or a refusal."""
    try:
        found = identify(recording)
    except CannotAnswer as error:
        return str(error)
    return " ".join(f.message for f in found.findings)


@pytest.mark.parametrize("motion", ["paper", "slow"])
@pytest.mark.parametrize(
    ("torque", "force", "said"),
    [
        (-1.0, 1.0, "The torques have the sign opposite to that of the forces"),
        (1.0, 1 / 9.80665, "as when forces in kgf are read as N"),
    ],
)
def test_a_point_where_a_unit_or_a_sign_puts_it_is_no_tip(torque: float, force: float, said: str, motion: str) -> None:
    made = recorded(motion, 1)
    (stream,) = made.streams
    channels = {**stream.channels, "torque": torque * stream.channels["torque"]}
    channels["force"] = force * stream.channels["force"]
    told = told_of(replace(made, streams=(replace(stream, channels=channels),)))
    assert said in told
    assert "the positions were those of a point" not in told


def test_a_gain_of_the_forces_is_said_to_be_in_no_bar() -> None:
    notes = [n for n in sound_answer().notes if "no gain of the sensor" in n]
    moved = 0.01 * float(BODY.mass)
    assert notes == [
        f"error bars hold no gain of the sensor: forces 1 % too large would move the mass by {moved:.2g} kg, "
        "and no log shows it; weigh a known mass once"
    ]


@pytest.mark.parametrize("motion", ["paper", "slow"])
@pytest.mark.parametrize("times", [2.0, 1.0])
def test_a_tip_at_the_end_of_a_rod_or_at_its_middle_is_no_sign_and_no_unit(times: float, motion: str) -> None:
    """Reversed torques put the point at twice the centre of mass, too, but with an inertia below zero."""
    tip = tuple(float(v) for v in times * BODY.com)
    told = told_of(of_the_tip(recorded(motion, 2), tip))
    assert "torques have the sign" not in told
    assert "times too small beside" not in told
    if times > 1:
        assert "the positions were those of a point" in told


def bars(found: Estimate) -> float:
    """Return how many standard deviations mass and centre of mass are off at most."""
    return float(np.abs(np.append(found.mass - BODY.mass, found.com - BODY.com) / found.std[:4]).max())


@pytest.mark.parametrize("seed", range(3))
def test_in_slow_motion_noise_does_not_hide_the_tip_of_a_tool(seed: int) -> None:
    """There white noise is nearly all of the residual; what lasts a second tells."""
    found = identify(of_the_tip(swaying(seed, 0.8), (0.0, 0.0, 0.05)))
    assert "motion-mismatch" in found.codes()
    assert bars(found) < 3


@pytest.mark.parametrize("seed", range(3))
def test_slow_motion_of_the_sensor_is_left_alone(seed: int) -> None:
    recording = swaying(seed, 0.8)
    made = rows.Reading(recording, (), Options()).rows_to_fit()
    assert made.place is None
    assert made.maybe is None


@pytest.mark.parametrize("seed", [0, 3])
def test_a_point_that_may_be_one_is_in_the_bars(seed: int) -> None:
    recording = of_the_tip(swaying(seed, 0.4, 2.0), (0.0, 0.0, 0.1))
    found = identify(recording)
    assert "motion-mismatch" not in found.codes()
    assert any("moves as if the positions were those of a point" in note for note in found.notes)
    assert bars(found) < 3
