"""What a simulated team is: the payload, the grasps, the noise of the cases A to D, and what happens on the way.

Source: the team cases of the project's facts: three Omnids, a payload of 12 kg and moments of inertia like those of the
published experiment, noise from clean encoders (A) to what matches the published errors (D).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Literal

import numpy as np

from steelyard.check import Array, frozen
from steelyard.simulate.noise import Spectrum
from steelyard.simulate.team_motions import Freedom

Sensing = Literal["joints", "poses", "twists"]
GRAVITY = 9.81
DOWN = frozen([0.0, 0.0, -GRAVITY])  # gravity in W [m/s^2]
RATE_HZ = 100.0
ROTATION_MAX, TRANSLATION_MAX = float(np.deg2rad(8.0)), 0.03
STILL_TURNS = ((0.1, 0.0, 0.0), (-0.06, 0.08, 0.0), (0.0, -0.1, 0.1), (-0.07, -0.07, 0.0))
MASS = 12.0
MOMENTS = (2.257, 3.451, 5.14)
RING = (0.8, 0.64)  # [m] half axes of the ellipse that the grasps stand on
RING_CENTRE = (0.12, -0.08, -0.1)  # [m] from the centre of mass


@dataclass(frozen=True)
class TeamNoise:
    """Standard deviations of what the sensors add.

    encoder_bits                per turn of every joint; None = not quantised
    white_rad, ar_rad           of every joint: white, and first-order autoregressive with its corner at 2 Hz [rad]
    force_white_N, force_spectrum   of every grasp axis
    force_bias_N, force_gain    drawn anew for every recording and grasp axis
    torque_white_Nm, torque_bias_Nm   the same for six-axis wrists
    pose_rad, pose_m, pose_spectrum   of poses, when `sensing` is "poses"
    imu_rad_s, imu_m_s2         of the IMUs at the grasps, white
    rate_rad_s, velocity_m_s, twist_spectrum   of twists, when `sensing` is "twists"
    """

    encoder_bits: int | None = None
    white_rad: float = 0.0
    ar_rad: float = 0.0
    force_white_N: float = 0.0
    force_bias_N: float = 0.0
    force_gain: float = 0.0
    force_spectrum: Spectrum = "white"
    torque_white_Nm: float = 0.0
    torque_bias_Nm: float = 0.0
    pose_rad: float = 0.0
    pose_m: float = 0.0
    pose_spectrum: Spectrum = "white"
    imu_rad_s: float = 0.0
    imu_m_s2: float = 0.0
    rate_rad_s: float = 0.0
    velocity_m_s: float = 0.0
    twist_spectrum: Spectrum = "white"


EXACT = TeamNoise()
CASES: Mapping[str, TeamNoise] = MappingProxyType(
    {
        "A": TeamNoise(14, 5e-5, 0.0, 0.3),
        "B": TeamNoise(14, 5e-5, 3e-4, 0.5),
        "C": TeamNoise(13, 1e-4, 1e-3, 1.0),
        "D": TeamNoise(13, 1e-4, 1e-3, 1.0, 0.5, 0.01),
    }
)


@dataclass(frozen=True, eq=False)
class Slip:
    """A grasp whose place on the payload moves by `change` (3,) [m], in its own axes, in one recording.

    start     [s] after the recording's first sample
    duration  [s] of the minimum-jerk change
    kind      of the recording that it happens in
    """

    robot: int
    change: Array
    start: float
    duration: float = 0.1
    kind: str = "motion"


@dataclass(frozen=True)
class Presence:
    """A robot that carries only between `joins` and `leaves` [s] after the first sample of the motion recording.

    Before it joins and after it leaves it stands still, beginning and ending within `pause` [s]. In other recordings
    it carries like the others, unless it is `new`: then it has no data there and is said to be away.
    """

    robot: int
    joins: float = -np.inf
    leaves: float = np.inf
    pause: float = 0.5
    new: bool = False


@dataclass(frozen=True, eq=False)
class Hinge:
    """A payload of two bodies: those `robots` hold the second, which turns about `axis` through `point`, both in C.

    swing_max  largest angle between the bodies [rad], a sum of sines in the motion's band; none while still
    mass, moments, centre  [kg], principal (3,) [kg m^2] and (3,) [m] of the second body, at angle zero in C
    """

    robots: frozenset[int]
    axis: Array
    point: Array
    mass: float
    moments: Array
    centre: Array
    swing_max: float = float(np.deg2rad(10.0))


@dataclass(frozen=True, eq=False)
class TeamScene:
    """One simulated session.

    robots        how many
    sensing       "joints" (encoders of Omnids), "poses" or "twists" with white noise, for any number of robots
    six_axis      robots whose wrists also bear a moment; the others have passive gimbals
    imus          robots whose grasps also bear an IMU: angular velocity and specific force (rigid payloads only)
    late_s        by how much a robot's stamps are late [s]
    dropout       share of rows that a robot loses, at random
    gaps          stretches (start, end) [s] of the motion recording that a robot loses
    bases_move    sensing "twists" only: no pose can be measured, gravity is told by a level sensor
    kinds         recordings to make, in order
    still_turns   rotation vector [rad] of each still pose
    bias_per      whether bias and gain are drawn anew per recording, or once per session
    squeeze_N     amplitude of internal forces
    stiffness     of every grasp, along all axes [N/m] and about them [N m/rad]: grippers stand off from where they hold
                  by what they push; None = rigid
    """

    noise: TeamNoise = EXACT
    robots: int = 3
    sensing: Sensing = "joints"
    six_axis: frozenset[int] = frozenset()
    imus: frozenset[int] = frozenset()
    late_s: Mapping[int, float] = field(default_factory=dict)
    dropout: float = 0.0
    gaps: Mapping[int, tuple[tuple[float, float], ...]] = field(default_factory=dict)
    bases_move: bool = False
    kinds: tuple[str, ...] = ("grasp", "still", "motion")
    freedom: Freedom = field(default_factory=Freedom.general)
    grasp_samples: int = 1000
    still_samples: int = 100
    motion_samples: int = 5200
    grasp_band_hz: tuple[float, float] = (0.1, 0.7)
    motion_band_hz: tuple[float, float] = (0.3, 1.0)
    still_turns: tuple[tuple[float, float, float], ...] = STILL_TURNS
    bias_per: Literal["recording", "session"] = "recording"
    squeeze_N: float = 5.0
    stiffness: tuple[float, float] | None = None
    slip: Slip | None = None
    presence: tuple[Presence, ...] = ()
    hinge: Hinge | None = None


def case(name: str, robots: int = 3) -> TeamScene:
    """Return the scene of case "A", "B", "C" or "D"."""
    return TeamScene(CASES[name], robots)
