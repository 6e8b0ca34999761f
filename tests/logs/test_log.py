"""MotionLog: what it refuses, and that it keeps what it was given without holding on to it."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from steelyard.errors import BadValue
from steelyard.logs.log import MotionLog, Noise

ROWS = 5
QUIET = Noise.of_std(0.1, 0.01, 0.02, 0.001)


def log_with(**fields: Any) -> MotionLog:
    motion = dict.fromkeys(("gravity", "acceleration", "angular_velocity", "angular_acceleration"), np.ones((ROWS, 3)))
    return MotionLog(**{"wrench": np.ones((ROWS, 6)), **motion, **fields})


@pytest.mark.parametrize(
    ("name", "given"),
    [
        ("wrench", np.ones((ROWS, 6))),
        ("time", np.arange(float(ROWS))),
        ("still", np.zeros(ROWS, np.bool_)),
        ("pose", np.zeros(ROWS, np.int64)),
        ("noise_class", np.zeros(ROWS, np.int64)),
        ("dead", np.zeros(6, np.bool_)),
    ],
)
def test_what_was_given_stays_the_givers(name: str, given: Any) -> None:
    log = log_with(**{name: given})
    given[0] = 7
    assert not (getattr(log, name) == given).all()
    with pytest.raises(ValueError, match="read-only"):
        getattr(log, name)[0] = 7


@pytest.mark.parametrize(
    ("fields", "text"),
    [
        ({"wrench": 1.0}, "wrench must have shape (..., 6); got ()."),
        ({"still": [True]}, "still has 1 rows, wrench has 5; they must agree."),
        (
            {"noise_class": [0, 1, 0, 0, 0], "noise": (QUIET,)},
            "noise_class must be numbers from 0 on below 1, one Noise each; got 0 to 1.",
        ),
        ({"noise_class": [0, 0, -1, 0, 0]}, "noise_class must be numbers from 0 on; got -1 to 0."),
        ({"pose": [0, 0, -2, 0, 0]}, "pose must be -1 or a number from 0 on; got -2."),
        ({"dead": [True]}, "dead must have shape (6,), one for each channel; got (1,)."),
    ],
)
def test_wrong_fields_have_one_clear_error(fields: dict[str, Any], text: str) -> None:
    with pytest.raises(BadValue) as caught:
        log_with(**fields)
    assert str(caught.value) == text
