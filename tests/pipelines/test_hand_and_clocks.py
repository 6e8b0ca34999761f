"""A hand on the object costs its own time, not the clocks of the rest: how hard it pushed hardly matters."""

from __future__ import annotations

from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from logs.made_recordings import BODY, Swing, recording
from steelyard.errors import CannotAnswer
from steelyard.identify.estimate import Estimate
from steelyard.io import read_recording
from steelyard.logs.alignment import Aligned, align
from steelyard.logs.prepared import AlignOptions
from steelyard.logs.recording import Recording
from steelyard.pipelines import rows
from steelyard.pipelines.held_object import identify
from steelyard.spatial import Rotation

LEVER = np.array([0.03, -0.02, 0.12])
NO_CAUSE = {"clock-unsteady", "sensor-turned", "gains-differ", "wrench-unexplained"}


def pushed(sound: Recording, size: float, *spans: tuple[float, float]) -> Recording:
    """Return the recording with a hand that pushes by about `size` [N], unsteadily, at `spans` [s] since the start."""
    wrench = next(s for s in sound.streams if "force" in s.channels)
    assert wrench.time is not None
    since = wrench.time - wrench.time[0]
    rng = np.random.default_rng(5)
    force = np.zeros((len(since), 3))
    for start, end in spans:
        share = np.clip((since - start) / (end - start), 0, 1)[:, None]
        mean, tremble = rng.normal(size=(2, 3))
        gently = np.minimum(1, 20 * np.minimum(share, 1 - share))
        force += size * gently * (mean + tremble * np.sin(2 * np.pi * 1.3 * since[:, None] + rng.uniform(0, 6, 3)))
    felt = {
        **wrench.channels,
        "force": wrench.channels["force"] + force,
        "torque": wrench.channels["torque"] + np.cross(LEVER, force),
    }
    streams = tuple(replace(s, channels=felt) if s is wrench else s for s in sound.streams)
    return replace(sound, streams=streams)


def made(seed: int) -> Recording:
    """Return 12 s of slow motion with a turned and late accelerometer and late poses."""
    return recording(
        Swing(seed, travel=0.08), seed=seed, position=True, imu_delay=0.008, pose_delay=0.02,
        mount=Rotation.exp([0.3, -0.2, 1.5]), lever=(0.03, 0.01, -0.02),
    )  # fmt: skip


@cache
def sound_answer() -> Estimate:
    """Return the answer of the made motion without a hand."""
    return identify(made(0))


def causes(estimate: Estimate) -> set[str]:
    return estimate.codes() & NO_CAUSE


@pytest.mark.parametrize(("size", "spans"), [(6.0, ((6.0, 99.0),)), (40.0, ((4.0, 5.5),))])
def test_a_hand_moves_no_clock(size: float, spans: tuple[tuple[float, float], ...]) -> None:
    sound, found = sound_answer(), identify(pushed(made(0), size, *spans))
    assert "contact" in found.codes()
    assert not causes(found)
    assert found.delays_s == pytest.approx(sound.delays_s, abs=1e-3)
    assert abs(found.mass - BODY.mass) < 3 * found.std[0]
    assert found.com == pytest.approx(BODY.com, abs=1.5e-3)


def test_where_too_little_is_left_for_clocks_all_rows_tell_them(monkeypatch: pytest.MonkeyPatch) -> None:
    def scarce(recording: Recording, options: AlignOptions) -> Aligned:
        if options.touched:
            raise CannotAnswer("too few rows are left")
        return align(recording, options)

    monkeypatch.setattr(rows, "align", scarce)
    found = identify(pushed(made(0), 6.0, (4.0, 5.5)))
    assert "contact" in found.codes()
    assert abs(found.mass - BODY.mass) < 3 * found.std[0]


@pytest.mark.parametrize(("seed", "start", "end"), [(0, 0.0, 7.0), (0, 5.0, 99.0), (1, 5.0, 99.0)])
def test_time_without_a_load_tells_no_clocks(seed: int, start: float, end: float) -> None:
    sound = made(seed)
    wrench = sound.streams[0]
    empty = ((wrench.time - wrench.time[0] >= start) & (wrench.time - wrench.time[0] < end))[:, None]
    load = Swing(seed, travel=0.08).log(wrench.time).wrench * empty
    felt = {"force": wrench.channels["force"] - load[:, 3:], "torque": wrench.channels["torque"] - load[:, :3]}
    found = identify(replace(sound, streams=(replace(wrench, channels=felt), *sound.streams[1:])))
    assert "load-changed" in found.codes()
    assert not causes(found)
    assert abs(found.mass - BODY.mass) < 4 * found.std[0]
    assert found.std[0] < 0.01 * BODY.mass


THRICE = ((1.0, 1.6), (2.7, 3.3), (4.5, 5.2))


@pytest.mark.parametrize(
    ("run", "hands"),
    [("kuka_run1", (((2.0, 3.0),), ((-1.0, 2.5),))), ("kuka_run2", (((3.0, 99.0),), THRICE))],
    ids=["kuka_run1", "kuka_run2"],
)
def test_a_strong_hand_costs_its_time_alone(
    run: str, hands: tuple[tuple[tuple[float, float], ...], ...], examples_dir: Path, data_dir: Path
) -> None:
    swing = read_recording(examples_dir / f"{run}.toml", data=data_dir)
    sound = identify(swing)
    for spans in hands:
        found = identify(pushed(swing, 25.0, *spans))
        assert "contact" in found.codes()
        assert not causes(found)
        assert found.delays_s == pytest.approx(sound.delays_s, abs=2.5e-3)
        assert found.mass == pytest.approx(sound.mass, abs=3 * found.std[0])
        assert found.com == pytest.approx(sound.com, abs=1.5e-3)
