"""The demo's hammer: the workshop's, a cobot-safe motion, and the recording that a robot would have made.

The recording is what real ones are: a force-torque sensor that reports the reaction with a bias, on its own clock, and
poses from the robot's encoders on another, no accelerometer.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cache

import numpy as np

from steelyard.check import Array, frozen
from steelyard.inertia import InertialParameters
from steelyard.logs.recording import KNOWN_PLACE, Recording, Stream
from steelyard.shape.inside import inside
from steelyard.shape.views import Views
from steelyard.simulate.motions import Step, StopAndGo, needed
from steelyard.simulate.scanning import scan_mesh
from steelyard.spatial import Pose, Rotation
from steelyard.workshop import catalogue
from steelyard.workshop.tools import Tool

GRAVITY = np.array([0.0, 0.0, -9.81])
WRENCH_HZ, POSE_HZ, DURATION = 100.0, 25.0, 49.0
FORCE_STD, TORQUE_STD = 0.1, 0.005
BIAS = np.array([0.12, -0.31, 0.05, 3.2, -1.4, 7.9])
ENCODER_M, ENCODER_RAD = 2e-5, 5e-5
VIEWS = 36


@dataclass(frozen=True, eq=False)
class Example:
    """A recording with its known answer, and the tool with its parts."""

    recording: Recording
    truth: InertialParameters
    tool: Tool


@cache
def tool() -> Tool:
    """Return the hammer of the workshop: aluminium shaft, steel head, rubber grip."""
    return catalogue.build("hammer")


def body() -> InertialParameters:
    """Return the hammer in S."""
    return tool().truth_in_sensor


def motion() -> StopAndGo:
    """Return seven stops, gravity along every axis of S; turns of 6 s keep the tool's far end below 0.25 m/s."""
    keys = np.deg2rad([
        [0, 0, 0], [90, 0, 25], [180, 10, -20], [90, 60, 40], [0, -70, 30], [-80, 20, 0], [0, 0, 0],
    ])  # fmt: skip
    lift = Step(0.0, 2.0, np.array([0.0, 0.0, 0.15]))
    return StopAndGo(keys, DURATION / len(keys), 6.0, (lift, Step(DURATION / 2, 2.0, np.array([0.1, 0.0, 0.0]))))


def recording(seed: int = 0) -> Example:
    """Return the hammer's recording: wrench stream and pose stream on two clocks, sensor sign and bias as usual."""
    rng = np.random.default_rng(seed)
    truth = body()
    time = np.arange(int(DURATION * WRENCH_HZ)) / WRENCH_HZ
    noise = rng.standard_normal((len(time), 6)) * np.repeat([TORQUE_STD, FORCE_STD], 3)
    wrench = -needed(truth, motion().at(time), GRAVITY) + BIAS + noise
    poses = motion().at(np.arange(int(DURATION * POSE_HZ)) / POSE_HZ)
    turned = poses.rotation @ Rotation.exp(ENCODER_RAD * rng.standard_normal((len(poses.time), 3)))
    position = poses.position + ENCODER_M * rng.standard_normal((len(poses.time), 3))
    streams = (
        Stream("wrench.csv", {"force": frozen(wrench[:, 3:]), "torque": frozen(wrench[:, :3])}, frozen(time)),
        Stream("pose.csv", {"rotation": turned.matrix, "position": frozen(position)}, frozen(poses.time)),
    )
    place = tool().X_OS.inverse()
    made = Recording(streams, frozen(GRAVITY), -1, object_pose=place, object_pose_std=KNOWN_PLACE, name="hammer")
    return Example(made, truth, tool())


@dataclass(frozen=True, eq=False)
class Seen(Example):
    """The same with views of the hammer on a table.

    views  RGB-D images with the poses of the camera in W
    X_SW   where the world of the views sits in the sensor once the robot has gripped the hammer
    X_WO   where the hammer lay; nobody sees it
    """

    views: Views
    X_SW: Pose
    X_WO: Pose

    def filled(self, count: int = 4000) -> list[tuple[Array, Array]]:
        """Return for each true part about `count` points (N, 3) in W that fill it, and the volumes (N,) around them."""
        out = []
        for label in self.tool.parts.label:
            points, volume = inside(self.tool.mesh.of_part(int(label)), count)
            out.append((self.X_WO.apply(points), volume))
        return out


def scanned(seed: int = 0, views: int = VIEWS) -> Seen:
    """Return the hammer's views on a table, and its recording with the place of the views' world in the sensor."""
    made = recording(seed)
    scan = scan_mesh(made.tool.mesh, seed, count=views)
    X_SW = made.tool.X_OS.inverse() @ scan.X_WO.inverse()
    placed = replace(made.recording, object_pose=X_SW)
    return Seen(placed, made.truth, made.tool, scan.views, X_SW, scan.X_WO)
