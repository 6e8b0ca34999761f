"""One recording of a simulated team: who holds the payload when, and what each robot writes down."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.logs.team_track import Track
from steelyard.robots import Omnid
from steelyard.simulate.motions import Kinematics, Motion
from steelyard.simulate.team_cases import Slip, TeamScene
from steelyard.simulate.team_hinge import hinged_load
from steelyard.simulate.team_motions import sines
from steelyard.simulate.team_payload import Carried, Load, Squeeze, TeamPayload, carry, grasp_load
from steelyard.simulate.team_sensing import read_imu, read_joints, read_pose, read_twist, read_wrench
from steelyard.spatial import Pose, Rotation


@dataclass(frozen=True, eq=False)
class Plan:
    """One recording to be made: kind, true times of its rows (T,), motion of C, hinge's sines (or none)."""

    kind: str
    time: Array
    motion: Motion
    swing: Array | None


@dataclass(frozen=True, eq=False)
class JointRecord:
    """What one Omnid logs: joint angles (T, 6) [rad] and spring torques (T, 3) [N m] at its own stamps (T,) [s]."""

    time: Array
    angles: Array
    torques: Array


def presence(scene: TeamScene, plan: Plan) -> Mask:
    """Return which robots (T, N) hold the payload at the rows of a recording."""
    holds = np.ones((len(plan.time), scene.robots), np.bool_)
    for event in scene.presence:
        if plan.kind == "motion":
            holds[:, event.robot] = (plan.time >= event.joins) & (plan.time < event.leaves)
        elif event.new:
            holds[:, event.robot] = False
    return holds


def _own_time(scene: TeamScene, plan: Plan, robot: int) -> Array:
    """Return the true times (T,) at which a robot's grasp is seen: late stamps, and standing still while away."""
    time = plan.time - scene.late_s.get(robot, 0.0)
    for event in scene.presence:
        if event.robot == robot and plan.kind == "motion":
            time = _eased(time, event.joins, event.leaves, event.pause)
    return time


def _eased(time: Array, joins: float, leaves: float, pause: float) -> Array:
    """Return times that stand still before `joins` - pause and after `leaves` + pause, with no jump in speed."""
    out = time.copy()
    after = time > leaves
    s = np.minimum(time[after] - leaves, pause)
    out[after] = leaves + s - s**2 / (2 * pause)
    before = time < joins
    s = np.minimum(joins - time[before], pause)
    out[before] = joins - s + s**2 / (2 * pause)
    return out


@dataclass(frozen=True, eq=False)
class View:
    """One recording as robots see it; what happens at one set of true times is worked out once."""

    scene: TeamScene
    plan: Plan
    payload: TeamPayload
    squeeze: Squeeze
    known: dict[bytes, Carried] = field(default_factory=dict)

    def at(self, time: Array) -> Carried:
        """Return what happens at all grasps at the true times (T,)."""
        key = time.tobytes()
        if key not in self.known:
            self.known[key] = self._carried(time)
        return self.known[key]

    def _carried(self, time: Array) -> Carried:
        scene, plan = self.scene, self.plan
        motion = plan.motion.at(time)
        slip = scene.slip if scene.slip is not None and scene.slip.kind == plan.kind else None
        loaded = load_of(scene, self.payload, motion, plan.swing, slip)
        holds = presence(scene, replace(plan, time=time))
        return carry(loaded, motion, time, self.squeeze, holds, sorted(scene.six_axis))


def load_of(scene: TeamScene, payload: TeamPayload, motion: Kinematics, swing: Array | None, slip: Slip | None) -> Load:
    """Return what the grasps do and bear along `motion`; `swing` are the hinge's sines, where there is a hinge."""
    if scene.hinge is None:
        return grasp_load(payload, motion, sorted(scene.six_axis), slip)
    turned = _swing_at(swing, motion.time)
    return hinged_load(payload, motion, sorted(scene.six_axis), scene.hinge, turned)


def record(
    rng: np.random.Generator, view: View, home: Pose, robot: int, calibration: tuple[Array, Array], start: float
) -> tuple[Track, JointRecord | None]:
    """Return what one robot records of one plan."""
    scene, plan = view.scene, view.plan
    time, stamps = _own_time(scene, plan, robot), start + plan.time
    seen, pushed = view.at(time), view.at(plan.time - scene.late_s.get(robot, 0.0))
    if scene.stiffness is not None and (scene.sensing == "twists" or scene.imus):
        raise BadValue("grasps that yield are simulated with poses or joints, without IMUs; leave out the stiffness.")
    if scene.stiffness is None:
        held, push = Pose(Rotation(seen.rotation[robot]), seen.position[robot]), pushed.wrench[robot]
    else:
        held, push = seen.yielded(robot, scene.stiffness)[0], pushed.yielded(robot, scene.stiffness)[1]
    wrench = read_wrench(rng, push, scene.noise, *calibration, robot in scene.six_axis)
    pose = home.inverse() @ held
    channels: dict[str, Array | None] = {"force": wrench[:, 3:]}
    if robot in scene.six_axis:
        channels["torque"] = wrench[:, :3]
    record = None
    if scene.sensing == "twists":
        channels |= _twist_channels(rng, scene, seen, robot, pose)
    elif scene.sensing == "poses":
        read = read_pose(rng, pose, scene.noise)
        channels |= {"rotation": read.rotation.matrix, "position": read.position}
    else:
        omnid = Omnid()
        angles = read_joints(rng, omnid.joints(pose), scene.noise)
        read = omnid.pose(angles)
        channels |= {"rotation": read.rotation.matrix, "position": read.position}
        record = JointRecord(stamps, angles, omnid.spring_torques(angles, wrench[:, 3:]))
    if robot in scene.imus:
        channels |= _imu_channels(rng, view, robot, time)
    return Track.of(stamps, None, **_with_gaps(rng, scene, plan, robot, channels)), record


def _twist_channels(
    rng: np.random.Generator, scene: TeamScene, seen: Carried, robot: int, pose: Pose
) -> dict[str, Array | None]:
    twist = read_twist(rng, seen.twist[robot], scene.noise)
    channels: dict[str, Array | None] = {"angular_velocity": twist[:, :3], "linear_velocity": twist[:, 3:]}
    if scene.bases_move:
        return channels | {"gravity": seen.gravity[robot]}
    return channels | {"rotation": read_pose(rng, pose, scene.noise).rotation.matrix}


def _imu_channels(rng: np.random.Generator, view: View, robot: int, time: Array) -> dict[str, Array | None]:
    if view.scene.hinge is not None or view.scene.slip is not None:
        raise BadValue("IMUs are simulated on rigid payloads whose grasps hold; leave out the hinge, or the slip.")
    grasp = view.payload.grasps[robot]
    omega, force = read_imu(rng, view.plan.motion.at(time), grasp, view.scene.noise)
    return {"angular_velocity": omega, "specific_force": force}


def _with_gaps(
    rng: np.random.Generator, scene: TeamScene, plan: Plan, robot: int, channels: dict[str, Array | None]
) -> dict[str, Array | None]:
    """Return the channels with NaN in the rows that a robot loses."""
    lost = np.zeros(len(plan.time), np.bool_)
    if scene.dropout:
        lost |= rng.random(len(plan.time)) < scene.dropout
    if plan.kind == "motion":
        for begin, end in scene.gaps.get(robot, ()):
            lost |= (plan.time >= begin) & (plan.time < end)
    if not lost.any():
        return channels
    return {n: np.where(lost.reshape(-1, *[1] * (v.ndim - 1)), np.nan, v) for n, v in channels.items() if v is not None}


def _swing_at(swing: Array | None, time: Array) -> Array:
    if swing is None:
        return np.zeros((3, len(time)))
    return np.array([part[:, 0] for part in sines(swing, time)])
