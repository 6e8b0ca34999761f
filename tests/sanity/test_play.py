"""Play of the sensor (hysteresis) is found beside delays, taken out, and in the bars."""

from __future__ import annotations

import numpy as np
import pytest

import steelyard as sy
from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.pipelines import held_object
from steelyard.simulate.handling import motion_arrays
from steelyard.spatial import Pose, Rotation

BODY = InertialParameters.from_com(2.0, np.array([0.01, -0.02, 0.08]), np.diag([0.012, 0.011, 0.004]))
TURNED = np.array([[0.0, -1, 0], [1, 0, 0], [0, 0, 1]])  # the sensor's own axes in S
AWAY = np.array([0.0, 0.01, -0.02])  # and its own origin
GRAVITY = np.array([0, 0, -9.81])


def behind(load: Array, half: Array) -> Array:
    """Return what a sensor with play reads of loads (N, 6)."""
    read = load.copy()
    for k in range(1, len(load)):
        read[k] = np.clip(read[k - 1], load[k] - half, load[k] + half)
    return read


def many(load: Array, half: Array) -> Array:
    """Return what a sensor with plays of 1, 4 and 12 % of the range in parallel reads, as far behind in the end."""
    read = load.copy()
    for width, part in ((0.01, 0.5), (0.04, 0.3), (0.12, 0.2)):
        wide = width * np.ptp(load, axis=0)
        read += part * half / wide * (behind(load, wide) - load)
    return read


def bent(load: Array, half: Array) -> Array:
    """Return what a sensor reads whose loops bend as Bouc and Wen have it, over 4 % of the range."""
    way = np.diff(load, axis=0) / (0.04 * np.ptp(load, axis=0))
    kept = np.zeros_like(load)
    for k, step in enumerate(way):
        kept[k + 1] = kept[k] + step * (1 - np.abs(kept[k]) * (0.7 * np.sign(step * kept[k]) + 0.3))
    return load - half * kept


LOOPS = {"three widths": many, "bent": bent}


def found(seed: int, share: float, late: float = 0.0, mounted: bool = False, loop: str = "play") -> Estimate:
    """Return what is found where channels play by a share of their range on either side, and the wrench is late."""
    seen = motion_arrays("paper", BODY)
    time, force, torque = seen["time"], seen["force_sensor"], seen["torque_sensor"]
    if mounted:
        force, torque = force @ TURNED, (torque - np.cross(AWAY, force)) @ TURNED
    load = np.concatenate([force, torque], 1)
    load = np.column_stack([np.interp(time - late, time, channel) for channel in load.T])
    read = LOOPS.get(loop, behind)(load, share * np.ptp(load, axis=0))
    read += np.random.default_rng(seed).normal(size=read.shape) * np.repeat([0.05, 0.002], 3)
    read = -read - [1, 2, -3, 0.1, 0.2, 0.1]
    wrench = {"time": time, "force": read[:, :3], "torque": read[:, 3:]}
    if mounted:
        wrench["mount"] = Pose(Rotation(TURNED), AWAY)
    pose = {
        "time": time,
        "rotation": seen["rotation_world_from_sensor"],
        "position": seen["position_world"],
        "name": "arm",
    }
    return held_object.identify(sy.recording(wrench, pose, gravity=GRAVITY, wrench="on-sensor"))


def errors(answer: Estimate) -> tuple[float, float]:
    """Return the error of the mass as a share, and the largest of mass and centre of mass in bars."""
    off = np.append(answer.mass, answer.com) - np.append(BODY.mass, BODY.com)
    return abs(off[0]) / BODY.mass, float((np.abs(off) / answer.std[:4]).max())


# Without it the mass was 0.1 to 0.6 % off, two to four bars, and the wrench was called 5 to 18 ms late.
@pytest.mark.parametrize(("share", "mounted"), [(0.0025, False), (0.01, False), (0.01, True)])
def test_play_is_taken_out_and_no_delay(share: float, mounted: bool) -> None:
    answer = found(0, share, mounted=mounted)
    off, bars = errors(answer)
    assert off < 3e-4
    assert bars < 1.5
    assert "bias-drift" in answer.codes()
    assert "stream-delayed" not in answer.codes()


def test_play_and_a_delay_are_told_apart() -> None:
    answer = found(1, 0.005, late=0.02)
    off, bars = errors(answer)
    assert off < 3e-4
    assert bars < 1.5
    assert answer.delays_s["arm"] == pytest.approx(-0.02, abs=1e-3)


def test_a_late_wrench_has_no_play() -> None:
    assert "bias-drift" not in found(2, 0.0, late=0.02).codes()


# With play of one width alone masses were 0.2 to 1.2 % off, up to four bars.
@pytest.mark.parametrize("loop", LOOPS)
@pytest.mark.parametrize(("share", "late"), [(0.0025, 0.0), (0.01, 0.02)])
def test_loops_of_many_widths_are_taken_out(loop: str, share: float, late: float) -> None:
    answer = found(3, share, late=late, loop=loop)
    off, bars = errors(answer)
    assert off < 1e-3
    assert bars < 1.5
    assert "bias-drift" in answer.codes()
    assert answer.delays_s["arm"] == pytest.approx(-late, abs=2e-3)
