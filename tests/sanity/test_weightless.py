"""A force that shows no weight is refused in these words, whatever else would be asked for."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import FORCE, TORQUE, recorded

from steelyard.errors import CannotAnswer
from steelyard.logs.recording import Recording
from steelyard.pipelines import held_object


def feeling(recording: Recording, force: np.ndarray, torque: np.ndarray) -> Recording:
    (stream,) = recording.streams
    return replace(
        recording, streams=(replace(stream, channels={**stream.channels, "force": force, "torque": torque}),)
    )


@pytest.mark.parametrize("variant", ["paper", "slow", "static"])
def test_noise_alone_and_a_frozen_sensor(variant: str) -> None:
    log = recorded(variant, 0)
    shape, rng = log.streams[0].channels["force"].shape, np.random.default_rng(1)
    with pytest.raises(CannotAnswer, match=r"no weight: gravity takes \d+ directions of S, and the force varies by"):
        held_object.identify(feeling(log, FORCE * rng.normal(size=shape), TORQUE * rng.normal(size=shape)))
    with pytest.raises(CannotAnswer, match=r"the force stands still\. Nothing is held"):
        held_object.identify(feeling(log, np.full(shape, 2.0), np.full(shape, 0.1)))


def test_what_is_light_is_weighed() -> None:
    log = recorded("slow", 0)
    exact = {q: v / 60 for q, v in log.streams[0].channels.items() if q in ("force", "torque")}
    found = held_object.identify(feeling(log, **exact))
    assert found.mass == pytest.approx(0.62464 / 60, rel=0.01)
