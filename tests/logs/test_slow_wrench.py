"""Joints that ripple: poses are low-passed as the wrench is, and bars hold what a slow sensor takes of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from made_recordings import BIAS, BODY, Swing, recording
from scipy.signal import lfilter

from steelyard.identify.estimate import Estimate
from steelyard.inertia import forms
from steelyard.logs.alignment import align
from steelyard.logs.prepared import AlignOptions
from steelyard.logs.recording import Recording
from steelyard.pipelines.held_object import identify

WRENCH_HZ = 500.0


def rippling(seed: int) -> Recording:
    swing = Swing(seed, 20.0, shake=(4e-4, 17.0))
    return recording(swing, seed=seed, pose_hz=250.0, position=True, imu=False, angle_std=2e-5)


def filtered(sound: Recording, cutoff: float) -> Recording:
    """Return the recording of a sensor with a low-pass of first order."""
    share = 1 - np.exp(-2 * np.pi * cutoff / WRENCH_HZ)

    def slow(values: np.ndarray) -> np.ndarray:
        return lfilter([share], [1, share - 1], values, axis=0, zi=(1 - share) * values[:1])[0]

    wrench, poses = sound.streams
    return replace(sound, streams=(replace(wrench, channels={q: slow(v) for q, v in wrench.channels.items()}), poses))


def off(found: Estimate) -> float:
    """Return how many standard deviations the inertia is off at most."""
    gap = found.inertia_com - forms.inertia_matrix(BODY.vector) + _at_origin(BODY.vector)
    return float(np.abs(gap[np.triu_indices(3)] / found.std[4:]).max())


def _at_origin(phi: np.ndarray) -> np.ndarray:
    h = phi[1:4]
    return (h @ h * np.eye(3) - np.outer(h, h)) / phi[0]


def test_poses_are_low_passed_as_the_wrench_is() -> None:
    log = align(rippling(0), AlignOptions(cutoff_hz=8.0)).log
    left = (log.wrench - log.predicted(BODY.vector) - BIAS).std(0)
    white = np.repeat([0.005, 0.05], 3) * np.sqrt(2 * 8.0 / WRENCH_HZ)
    assert (left < 1.7 * white).all()


@pytest.mark.parametrize("seed", range(3))
def test_bars_hold_what_a_filter_takes_of_quick_motion(seed: int) -> None:
    sound = identify(rippling(seed))
    assert off(sound) < 3
    assert not any(note.startswith("the wrench is") for note in sound.notes)
    slow = identify(filtered(rippling(seed), 15.0))
    assert slow.codes() == {"stream-delayed"}
    assert off(slow) < 2
    assert any(note.startswith("the wrench is 8") and "a filter" in note for note in slow.notes)
