"""Units in which force and torque both are wrong: the lever between them is in their length, and motion has metres."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sanity.held_poses import BODY, of_the_tip, recorded
from sanity.traps import edited
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.sanity.before import examine

LBF, INCH = 4.4482216, 0.0254
INCHES, FEET = (1 / LBF, 1 / (LBF * INCH)), (1 / LBF, 1 / (12 * LBF * INCH))
PLAIN = recorded("paper", 0)


def read_as(recording: Recording, force: float, torque: float) -> Recording:
    """Return the recording with forces and torques so many times larger."""
    return edited(recording, force=lambda v: force * v, torque=lambda v: torque * v)


def poses(arm: float) -> Recording:
    """Return twelve still poses of 2 kg with its centre of mass so far [m] from S."""
    rng = np.random.default_rng(3)
    pull = rng.normal(size=(12, 3))
    pull *= 9.81 / np.linalg.norm(pull, axis=1)[:, None]
    torque = np.cross([0.1 * arm, -0.2 * arm, 0.97 * arm], -2 * pull) + 1e-4 * rng.normal(size=(12, 3))
    channels = {"force": -2 * pull + 1e-2 * rng.normal(size=(12, 3)), "torque": torque, "gravity": pull}
    return Recording((Stream("poses", channels),), np.array([0, 0, -9.81]), 1)


@pytest.fixture(scope="module")
def right() -> Estimate:
    return identify(PLAIN)


def test_pounds_with_inches_are_put_right(right: Estimate) -> None:
    found = identify(read_as(PLAIN, *INCHES))
    assert found.codes() == right.codes() | {"force-unit"}
    assert "forces in lbf and torques in lbf*in are read as N and N*m" in found.findings[0].message
    assert found.mass == pytest.approx(BODY.mass, rel=0.002)
    np.testing.assert_allclose(found.com, right.com, atol=2e-5)


def test_pounds_with_feet_are_named() -> None:
    """A tip of a tool on the way to the centre of mass would look the same."""
    found = identify(read_as(PLAIN, *FEET))
    (unit,) = (f for f in found.findings if f.code == "force-unit")
    assert "forces in lbf and torques in lbf*ft are read as N and N*m" in unit.message
    assert "does not assume this" in unit.message
    assert "motion-mismatch" not in found.codes()


@pytest.mark.parametrize("kgf", [False, True])
def test_centimetres_are_put_right_and_what_looks_alike_is_named(kgf: bool, right: Estimate) -> None:
    scale = 1 / 9.80665 if kgf else 1.0
    found = identify(read_as(PLAIN, scale, 100 * scale))
    (unit,) = (f for f in found.findings if f.code == "force-unit")
    assert "torques in N*cm are read as N*m" in unit.message
    assert "In kgf and kgf*cm they would look the same, and mass and inertia be 9.81 times larger" in unit.message
    assert found.mass == pytest.approx(scale * BODY.mass, rel=0.002)
    np.testing.assert_allclose(found.com, right.com, atol=5e-5)


def test_millimetres_are_told_by_motion() -> None:
    read, (found,) = examine(read_as(PLAIN, 1.0, 1000.0))
    assert found.code == "length-in-mm"
    np.testing.assert_allclose(read.streams[0].channels["torque"], PLAIN.streams[0].channels["torque"])


def test_a_tip_in_the_positions_is_no_unit() -> None:
    found = identify(of_the_tip(PLAIN, (0.0, 0.0, 0.15)))
    assert "force-unit" not in found.codes()
    assert "motion-mismatch" in found.codes()


def test_still_poses_do_not_tell_millimetres_from_inches() -> None:
    with pytest.raises(CannotAnswer, match=r"does not tell which: .*N\*mm.* 2\.04 mm.*lbf\*in.* 51\.8 mm, with 2 kg"):
        examine(read_as(poses(0.052), *INCHES))


def test_still_poses_tell_millimetres_where_all_else_is_far_away() -> None:
    read, (found,) = examine(read_as(poses(0.08), 1.0, 1000.0))
    assert found.code == "length-in-mm"
    assert examine(poses(0.08))[1] == ()
    np.testing.assert_allclose(read.streams[0].channels["torque"], poses(0.08).streams[0].channels["torque"])


def test_a_weight_taken_away_is_not_told_where_gravity_does_not_turn() -> None:
    """Then a bias has all of the weight."""
    (stream,) = PLAIN.streams
    start = stream.channels["rotation"][0]
    acceleration = np.gradient(np.gradient(stream.channels["position"], stream.time, axis=0), stream.time, axis=0)
    force = BODY.mass * (acceleration - PLAIN.gravity) @ start
    channels = {**stream.channels, "force": force, "torque": np.cross(BODY.com, force)}
    channels["rotation"] = np.broadcast_to(start, stream.channels["rotation"].shape).copy()
    still = replace(PLAIN, streams=(replace(stream, channels=channels),))
    assert "weight-compensated" not in {f.code for f in examine(still)[1]}


def test_a_tip_at_the_centre_of_mass_is_no_inch() -> None:
    found = identify(of_the_tip(PLAIN, tuple(float(v) for v in (1 - INCH) * BODY.com)))
    assert found.mass == pytest.approx(BODY.mass, rel=0.01)
