"""torque = "zero" of one arm measures nothing: no centre of mass, and no bar, is concluded from it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from held_poses import BODY, recorded, rows, swaying

from steelyard.errors import CannotAnswer
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify


def zeroed(recording: Recording) -> Recording:
    (stream,) = recording.streams
    nothing = np.zeros_like(stream.channels["torque"])
    return replace(recording, streams=(replace(stream, channels={**stream.channels, "torque": nothing}),))


@pytest.mark.parametrize("seed", range(3))
def test_the_force_tells_what_it_can_of_the_centre_of_mass(seed: int) -> None:
    whole, felt = (identify(log) for log in (recorded("paper", seed), zeroed(recorded("paper", seed))))
    off = np.append(felt.mass - BODY.mass, felt.com - BODY.com)
    assert (np.abs(off) < 4 * felt.std[:4]).all()
    assert felt.std[0] < 0.01 * BODY.mass
    assert (felt.std[1:4] > 5 * whole.std[1:4]).all()
    assert not felt.identified[4:].any()
    assert any('torque = "zero" tells nothing of the centre of mass' in note for note in felt.notes)
    assert felt.codes() <= whole.codes() | {"inertia-not-identified"}


def test_still_poses_are_refused_with_what_is_missing() -> None:
    log = rows(zeroed(recorded("static", 0)), np.arange(0, 600, 50))
    (stream,) = log.streams
    channels = {name: stream.channels[name] for name in ("rotation", "force", "torque")}
    table = replace(log, streams=(Stream("poses.csv", channels, poses=True),))
    with pytest.raises(CannotAnswer, match=r'torque = "zero" tells nothing .* Give the columns of the torque'):
        identify(table)


@pytest.mark.parametrize("seed", range(2))
def test_slow_moves_give_bars_of_millimetres(seed: int) -> None:
    felt = identify(zeroed(swaying(seed)))
    assert (np.abs(felt.com - BODY.com) < 4 * felt.std[1:4]).all()
    assert (felt.std[1:4] > 1e-3).all()
