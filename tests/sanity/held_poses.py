"""Logs of a hammer at rest in one pose after another, as rows of one stream."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording, Stream
from steelyard.simulate.handling import RATE_HZ, motion_arrays
from steelyard.simulate.noise import Spectrum, unit_noise
from steelyard.spatial import Rotation
from steelyard.workshop.catalogue import build

BODY = build("hammer").truth_in_sensor
FORCE, TORQUE = 0.05, 0.0025
NAMES = {"rotation": "rotation_world_from_sensor", "position": "position_world"}
FELT = {"force": ("force_sensor", FORCE), "torque": ("torque_sensor", TORQUE)}


def recorded(variant: str, seed: int, spectrum: Spectrum = "white") -> Recording:
    """Return a log of handling the hammer with noise of forces and torques, all of it in one stream."""
    arrays = motion_arrays(variant, BODY)
    noise = unit_noise(np.random.default_rng(seed), len(arrays["time"]), 6, spectrum, RATE_HZ)
    channels = {name: arrays[column] for name, column in NAMES.items()}
    for part, (name, (column, std)) in zip(np.split(noise, 2, axis=1), FELT.items(), strict=True):
        channels[name] = arrays[column] + std * part
    return Recording((Stream("log", channels, arrays["time"]),), np.array([0, 0, -9.81]))


def of_the_tip(recording: Recording, tip: tuple[float, float, float]) -> Recording:
    """Return the recording whose positions are those of `tip` [m] in S."""
    (stream,) = recording.streams
    moved = stream.channels["position"] + stream.channels["rotation"] @ np.array(tip)
    return replace(recording, streams=(replace(stream, channels={**stream.channels, "position": moved}),))


def rows(recording: Recording, which: np.ndarray, restamped: bool = False) -> Recording:
    """Return some rows of the log, with their stamps, or stamped anew without a gap."""
    (stream,) = recording.streams
    assert stream.time is not None
    time = stream.time[which]
    time = np.arange(len(time)) / RATE_HZ if restamped else time
    cut = Stream(stream.name, {q: v[which] for q, v in stream.channels.items()}, time)
    return Recording((cut,), recording.gravity, noise=recording.noise)


def swaying(seed: int, amplitude: float = 1.0, noise: float = 1.0, down: int = 2) -> Recording:
    """Return 40 s of the hammer in slow motion without a stop: turns of about `amplitude` [rad] in 10 to 30 s.

    down  the axis of W that gravity is against: the hammer's head is along the second of S
    """
    rng = np.random.default_rng(seed)
    time = np.arange(0, 40, 1 / 125)

    def waves(size: float) -> np.ndarray:
        rates, phases = rng.uniform(0.03, 0.12, (3, 3)), rng.uniform(0, 2 * np.pi, (3, 3))
        return np.asarray(size / 2 * np.sin(2 * np.pi * rates * time[:, None, None] + phases).sum(2))

    R, position = Rotation.exp(waves(amplitude)).matrix, waves(0.2)

    def change(values: np.ndarray) -> np.ndarray:
        return np.asarray(np.gradient(values, time, axis=0, edge_order=2))

    turning = np.swapaxes(R, 1, 2) @ change(R)
    omega = 0.5 * np.stack([turning[:, i, j] - turning[:, j, i] for i, j in ((2, 1), (0, 2), (1, 0))], 1)
    gravity = -9.81 * np.eye(3)[down]
    pull, moved = np.einsum("nji,j->ni", R, gravity), np.einsum("nji,nj->ni", R, change(change(position)))
    wrench = MotionLog(np.zeros((len(time), 6)), pull, moved, omega, change(omega)).predicted(BODY.vector)
    wrench = wrench + noise * rng.normal(size=wrench.shape) * np.repeat([TORQUE, FORCE], 3) + 0.1
    position = position + 2e-5 * rng.normal(size=position.shape)
    channels = {"rotation": R, "position": position, "force": wrench[:, 3:], "torque": wrench[:, :3]}
    return Recording((Stream("log", channels, time),), gravity)
