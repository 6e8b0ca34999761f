"""Forces that one body does not explain: columns mixed up, weights that a controller takes away, and plain misfits."""

from __future__ import annotations

import re
from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation as Turn

import steelyard as sy
from sound_hammer import hammer_answer, hammer_log
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines import held_object
from steelyard.sanity.before import examine
from steelyard.sanity.fitted.no_body import examine_body

MASS = 0.62464


@pytest.fixture(scope="module")
def made() -> Recording:
    return hammer_log()


def forces(recording: Recording, change: np.ndarray) -> Recording:
    """Return the recording with the force columns multiplied by `change` (3, 3)."""
    streams = tuple(
        replace(s, channels={q: v @ change.T if q == "force" else v for q, v in s.channels.items()})
        for s in recording.streams
    )
    return replace(recording, streams=streams)


def compensated(recording: Recording, mass: float) -> Recording:
    """Return the recording as a controller reports it that takes the weight of `mass` away."""
    motion = next(s for s in recording.streams if "rotation" in s.channels)
    out = []
    for s in recording.streams:
        if "force" in s.channels and motion.time is not None and s.time is not None:
            turn = motion.channels["rotation"]
            down = np.einsum("nji,j->ni", turn, recording.gravity)
            pull = np.stack([np.interp(s.time, motion.time, column) for column in down.T], 1)
            force = s.channels["force"] + recording.wrench_sign * mass * pull
            s = replace(s, channels={**s.channels, "force": force})
        out.append(s)
    return replace(recording, streams=tuple(out))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (np.diag([1.0, -1, 1]), "Fx = Fx, Fy = -Fy, Fz = Fz"),
        (np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]]), "Fx = Fy, Fy = Fx, Fz = Fz"),
        (np.array([[0.0, 0, 1], [0, 1, 0], [1, 0, 0]]), "Fx = Fz, Fy = Fy, Fz = Fx"),
    ],
)
def test_columns_of_another_order_or_sign_are_told(made: Recording, change: np.ndarray, words: str) -> None:
    (found,) = (f for f in examine(forces(made, change))[1] if f.code == "force-unit")
    assert (
        words in found.message or words.replace("= -", "= ~").replace("= F", "= -F").replace("~", "") in found.message
    )
    assert "columns" in found.remedy


def test_a_weight_that_a_controller_takes_away_is_told(made: Recording) -> None:
    for mass in (0.9 * MASS, 1.3 * MASS):
        _, findings = examine(compensated(made, mass))
        assert [f.code for f in findings] == ["weight-compensated"], mass
        assert "0.62" in findings[0].message or "0.63" in findings[0].message
    assert examine(compensated(made, 0.0))[1] == ()


def test_what_a_controller_leaves_has_no_inertia(made: Recording) -> None:
    found = held_object.identify(compensated(made, 0.4 * MASS))
    assert "weight-compensated" in found.codes()
    assert found.inertia_com is None
    assert [f.code for f in found.findings].count("inertia-not-identified") == 1


def test_positions_a_thousand_times_too_small(made: Recording) -> None:
    streams = (
        replace(s, channels={q: v / 1000 if q == "position" else v for q, v in s.channels.items()})
        for s in made.streams
    )
    found = held_object.identify(replace(made, streams=tuple(streams)))
    assert found.findings[0].code == "motion-mismatch"
    assert re.search(r"as with positions (9|10)\d+ times too small", found.findings[0].message)
    assert found.mass == pytest.approx(MASS, abs=3 * found.std[0])


def test_wrench_and_gravity_both_of_the_other_sign(made: Recording) -> None:
    both = replace(made, wrench_sign=-made.wrench_sign, gravity=-made.gravity)
    read, (found,) = examine(both)
    assert found.code == "wrench-sign-flipped"
    assert (read.wrench_sign, *read.gravity) == (made.wrench_sign, *made.gravity)


def faster(recording: Recording, times: float) -> Recording:
    """Return the recording with stamps so many times too close together."""
    streams = (replace(s, time=None if s.time is None else s.time / times) for s in recording.streams)
    return replace(recording, streams=tuple(streams))


@pytest.mark.parametrize("times", [3.0, 6.0])
def test_stamps_too_close_together_are_told(made: Recording, times: float) -> None:
    first = examine(faster(made, times))[1][0]
    assert first.code == "motion-mismatch"
    said = re.search(r"Stamps ([0-9.]+) times too close together", first.message)
    assert said is not None
    assert float(said[1]) == pytest.approx(times, rel=0.1)


def test_it_leaves_the_answer_of_rest(made: Recording) -> None:
    found = held_object.identify(faster(made, 3.0))
    assert [f.code for f in found.findings][:2] == ["motion-mismatch", "inertia-not-identified"]
    assert "findings above" in found.findings[1].remedy
    assert found.mass == pytest.approx(MASS, abs=3 * found.std[0])


def test_stamps_too_far_apart_look_like_a_weight_taken_away(made: Recording) -> None:
    (found,) = (f for f in held_object.identify(faster(made, 0.25)).findings if f.code == "weight-compensated")
    assert "Stamps 4 times too far apart, or positions 16 times too small, do so, too" in found.message


def test_columns_are_told_before_a_sensor_that_only_seems_turned() -> None:
    """Where gravity stays near a plane of S, a turn does most of what an exchange of columns does."""
    rng, normal = np.random.default_rng(0), np.array([0.6, 0.0, 0.8])
    around = rng.uniform(0, 2 * np.pi, 40)
    along, across = np.array([0.8, 0.0, -0.6]), np.array([0.0, 1.0, 0.0])
    down = (
        np.outer(np.cos(around), along) + np.outer(np.sin(around), across) + 0.2 * np.outer(rng.normal(size=40), normal)
    )
    down /= np.linalg.norm(down, axis=1, keepdims=True)
    turns = np.stack([Turn.align_vectors([[0, 0, -1.0]], [d])[0].as_matrix() for d in down])
    force = -1.5 * 9.81 * down
    torque = np.cross([0.01, 0.02, 0.06], force)
    felt = {"force": force + rng.normal(0, 0.05, force.shape), "torque": torque + rng.normal(0, 0.003, torque.shape)}
    table = Recording((Stream("poses", {"rotation": turns, **felt}, None),), np.array([0, 0, -9.81]))
    assert examine(table)[1] == ()
    codes = {f.code for f in examine(forces(table, np.array([[0.0, 1, 0], [1, 0, 0], [0, 0, 1]])))[1]}
    assert "force-unit" in codes
    assert "sensor-turned" not in codes


def test_it_is_said_with_the_refusal_too(made: Recording) -> None:
    turn = Turn.from_euler("x", 120, degrees=True).as_matrix()
    with pytest.raises(CannotAnswer, match="Noticed before the fit: The wrench is turned by 120 degrees"):
        held_object.identify(forces(made, turn))


def noisy(recording: Recording, std: float) -> Recording:
    """Return the recording with more white noise of the force [N]."""
    rng = np.random.default_rng(0)

    def more(quantity: str, values: np.ndarray) -> np.ndarray:
        return values + std * rng.normal(size=values.shape) if quantity == "force" else values

    streams = tuple(replace(s, channels={q: more(q, v) for q, v in s.channels.items()}) for s in recording.streams)
    return replace(recording, streams=streams)


@pytest.mark.parametrize("std", [0.0, 0.5])
def test_a_wrench_that_no_body_explains_is_told(made: Recording, std: float) -> None:
    found = sy.identify(noisy(forces(made, np.diag([1.0, 1, 0.2])), std))
    assert "wrench-unexplained" in found.codes()
    sound = sy.identify(noisy(made, std)) if std else hammer_answer()
    assert "wrench-unexplained" not in sound.codes()


def test_forces_in_kgf_leave_no_body_and_are_named(made: Recording) -> None:
    """Ten free numbers fit: a tenth of the mass ten times as far out. But no mass has so little inertia there."""
    found = sy.identify(forces(made, np.eye(3) / 9.80665))
    (unit,) = (f for f in found.findings if f.code == "force-unit")
    assert "times too small beside the torques, as when forces in kgf are read as N" in unit.message
    assert not found.codes() & {"wrench-unexplained", "motion-mismatch"}


def test_residuals_that_nothing_explains_are_said() -> None:
    sound = hammer_answer()
    bad = replace(sound, evidence=replace(sound.evidence, chi2_per_dof=6.25))
    (said,) = examine_body(bad, ())
    assert said.code == "wrench-unexplained"
    assert said.message.startswith("The residuals are 2.5 times what the channels scatter from row to row")
    assert not examine_body(sound, ())
    torques = replace(sound, evidence=replace(sound.evidence, residual_torque_Nm=0.3 * sound.mass))
    (missed,) = examine_body(torques, ())
    assert missed.code == "wrench-unexplained"
    assert missed.message.startswith("The torque misses by")
    assert not examine_body(torques, (), noise=0.1 * sound.mass)
    for code in ("motion-mismatch", "gains-differ", "noise-level-off"):
        assert not examine_body(torques, (Finding.of(code, ""),))
        assert not examine_body(bad, (Finding.of(code, ""),))
