"""Torque columns that hold zeros, as of a driver that does not fill them, break nothing."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from steelyard.errors import BadValue, CannotAnswer
from steelyard.io import read_recording
from steelyard.logs.recording import Recording, Stream
from steelyard.pipelines.held_object import identify
from steelyard.spatial import Rotation


def test_zero_torque_breaks_nothing() -> None:
    rng = np.random.default_rng(0)
    time = np.arange(0, 12, 0.01)
    turn = Rotation.exp(np.stack([np.sin(0.9 * time), np.sin(0.7 * time + 1), np.cos(0.5 * time)], 1)).matrix
    force = -1.2 * np.einsum("nji,j->ni", turn, [0.0, 0.0, -9.81]) + 0.05 * rng.normal(size=(len(time), 3))
    position = 0.1 * np.stack([np.sin(time), np.cos(time), np.sin(0.3 * time)], 1)
    channels = {"force": force, "torque": np.zeros_like(force), "rotation": turn, "position": position}
    recording = Recording((Stream("log.csv", channels, time),), np.array([0, 0, -9.81]))
    try:
        estimate = identify(recording)
    except CannotAnswer:
        return
    assert np.isfinite(estimate.std).all()


def test_zero_torque_in_a_file_is_bad_input(tmp_path: Path) -> None:
    rows = "\n".join(f"{0.01 * k},1,2,{3 + 0.01 * k},0,0,0,1,0,0,0" for k in range(20))
    (tmp_path / "log.csv").write_text("t,fx,fy,fz,tx,ty,tz,qw,qx,qy,qz\n" + rows + "\n")
    with pytest.raises(BadValue) as caught:
        read_recording(tmp_path / "log.csv")
    text = 'Give the columns that hold it or say torque = "zero" if the wrist passes no moment.'
    assert str(caught.value).endswith(f"torque is zero in every row. {text}")
