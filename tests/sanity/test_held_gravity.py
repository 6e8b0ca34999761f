"""An acceleration that holds gravity is an accelerometer's, and is asked for as such."""

from __future__ import annotations

import numpy as np
import pytest

import steelyard as sy
from steelyard.errors import BadDescription
from steelyard.sanity.before import examine
from steelyard.simulate import scenarios
from steelyard.simulate.handling import motion_arrays

MADE = motion_arrays(body=scenarios.body("wrench").parameters())
ROTATION = MADE["rotation_world_from_sensor"]
UP = np.array([0.0, 0.0, 9.81])


def recording(acceleration: np.ndarray, frame: str = "S") -> sy.Recording:
    """Return the made log with these linear accelerations."""
    return sy.recording(
        time=MADE["time"], force=MADE["force_sensor"], torque=MADE["torque_sensor"], rotation=ROTATION,
        linear_acceleration=acceleration, frame={"linear_acceleration": frame}, gravity=-UP, name="arm",
    )  # fmt: skip


@pytest.mark.parametrize("frame", ["S", "W"])
def test_an_acceleration_that_holds_gravity_is_refused(frame: str) -> None:
    felt = MADE["linear_acceleration_sensor"] - MADE["gravity_sensor"]
    values = felt if frame == "S" else np.einsum("nij,nj->ni", ROTATION, felt)
    with pytest.raises(BadDescription) as caught:
        examine(recording(values, frame))
    assert str(caught.value) == (
        "linear_acceleration of 'arm' is 9.81 m/s^2 long in the median, as gravity is: it holds gravity, as what "
        "accelerometers read does (and MuJoCo's framelinacc). Give an accelerometer as specific_force, in its own "
        "axes, or leave linear_acceleration out where there are positions."
    )


def test_an_acceleration_without_gravity_is_taken() -> None:
    _, findings = examine(recording(MADE["linear_acceleration_sensor"]))
    assert findings == ()
