"""A simulated session of a team: the log that its robots would record, and the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, cast

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.logs.team_log import Kind, TeamLog, TeamRecording, TeamRobot
from steelyard.robots import Omnid
from steelyard.simulate.motions import Held, Motion
from steelyard.simulate.team_cases import DOWN, RATE_HZ, ROTATION_MAX, TRANSLATION_MAX, TeamScene
from steelyard.simulate.team_motions import SineMotion, draw_motion
from steelyard.simulate.team_payload import Squeeze, TeamPayload
from steelyard.simulate.team_recording import JointRecord, Plan, View, load_of, presence, record
from steelyard.simulate.team_sensing import draw_calibration
from steelyard.spatial import Pose, Rotation

SHRINK, LEAST = 0.88, 0.05  # what does not fit the workspace is made smaller by this, down to that share
_PAUSE_S = 5.0  # between recordings
_SHARES = {"joints": 1, "motion": 2, "noise": 3}  # of a seed's random streams


@dataclass(frozen=True, eq=False)
class TeamTruth:
    """What the estimators should find.

    grasps   X_RG (N,) of every grasp in the reference grasp R, by the order of the log's robots, before any slip
    body     ten parameters in R (of all bodies, where a hinge stands at zero)
    late_s   (N,) by how much each robot's stamps are late
    homes    X_WH (N,) of the robots' home frames; robots do not know them
    payload  X_RC of the frame that the simulated motion is given in, at rest W
    holds    (T, N) which robots hold the payload in the rows of the motion recording
    """

    grasps: Pose
    body: InertialParameters
    homes: Pose
    payload: Pose
    late_s: Array
    holds: Mask

    @property
    def moments(self) -> Array:
        """Principal moments (3,), rising [kg m^2]."""
        return self.body.principal()[0]


@dataclass(frozen=True, eq=False)
class TeamTrial:
    """A log and its truth; with joint sensing also what each robot logs, by recording and robot."""

    log: TeamLog
    truth: TeamTruth
    joints: tuple[Mapping[str, JointRecord], ...]


def simulate_team(scene: TeamScene, seed: int, reference: int = 0) -> TeamTrial:
    """Return one session; payload, grasps and motion of a seed are the same whatever the noise.

    Robots are called "robot0", "robot1", ... Raises BadValue for a team that cannot carry the payload, or whose
    workspaces hardly let it move.
    """
    geometry, moving, noisy = (np.random.default_rng([seed, share]) for share in _SHARES.values())
    payload = TeamPayload.draw(geometry, scene.robots)
    homes = _homes(geometry, payload)
    plans = _plans(moving, scene, payload, homes)
    squeeze = Squeeze.draw(moving, scene.squeeze_N, 3 * (scene.robots + len(scene.six_axis)))
    recordings, joints = [], []
    session = [draw_calibration(noisy, scene.noise) for _ in range(scene.robots)]
    start, holds = 0.0, cast(Mask, np.ones((0, scene.robots), np.bool_))
    for number, plan in enumerate(plans):
        present = presence(scene, plan)
        if plan.kind == "motion":
            holds = present
        if scene.bias_per == "recording" and number:
            session = [draw_calibration(noisy, scene.noise) for _ in range(scene.robots)]
        view = View(scene, plan, payload, squeeze)
        away = [e.robot for e in scene.presence if e.new and plan.kind != "motion"]
        made = {
            f"robot{i}": record(noisy, view, homes[i], i, session[i], start)
            for i in range(scene.robots)
            if i not in away
        }
        tracks = {name: track for name, (track, _) in made.items()}
        absent = frozenset(f"robot{i}" for i in away)
        recordings.append(TeamRecording(cast(Kind, plan.kind), tracks, f"{plan.kind}-{number}", absent))
        joints.append({name: logged for name, (_, logged) in made.items() if logged is not None})
        start += float(plan.time[-1] - plan.time[0]) + _PAUSE_S
    log = TeamLog(_robots(scene), tuple(recordings), f"robot{reference}")
    return TeamTrial(log, _truth(scene, payload, homes, reference, holds), tuple(joints))


def _robots(scene: TeamScene) -> tuple[TeamRobot, ...]:
    down = None if scene.bases_move else DOWN
    base: Any = "moving" if scene.bases_move else "still"
    return tuple(TeamRobot(f"robot{i}", down, base) for i in range(scene.robots))


def _truth(scene: TeamScene, payload: TeamPayload, homes: Pose, reference: int, holds: Mask) -> TeamTruth:
    back = payload.grasps[reference].inverse()
    body = payload.body
    if scene.hinge is not None:
        hinge = scene.hinge
        body = body + InertialParameters.from_com(hinge.mass, hinge.centre, np.diag(hinge.moments))
    late = np.array([scene.late_s.get(i, 0.0) for i in range(scene.robots)])
    return TeamTruth(back @ payload.grasps, body.in_frame(back), homes, back, late, holds)


def _homes(rng: np.random.Generator, payload: TeamPayload) -> Pose:
    """Return X_WH (N,): level, at the grasps of the payload at rest, yaw anywhere."""
    yaw = rng.uniform(0, 2 * np.pi, len(payload.grasps.position))
    return Pose(Rotation.exp(yaw[:, None] * [0.0, 0.0, 1.0]), payload.grasps.position)


def _plans(rng: np.random.Generator, scene: TeamScene, payload: TeamPayload, homes: Pose) -> list[Plan]:
    """Return the recordings in order."""
    plans = []
    for kind in scene.kinds:
        if kind == "still":
            time = np.arange(scene.still_samples) / RATE_HZ
            for turn in scene.still_turns:
                held = np.array([turn])
                while not _fits(scene, payload, homes, rest := Held(Rotation.exp(held)), time, None):
                    held = held * SHRINK
                plans.append(Plan(kind, time, rest, None))
            continue
        samples = scene.grasp_samples if kind == "grasp" else scene.motion_samples
        band = scene.grasp_band_hz if kind == "grasp" else scene.motion_band_hz
        time = np.arange(samples) / RATE_HZ
        motion = draw_motion(rng, time, band, ROTATION_MAX, TRANSLATION_MAX, scene.freedom)
        swing = _draw_swing(rng, scene, band, time)
        plans.append(Plan(kind, time, _shrunk(scene, payload, homes, motion, time, swing), swing))
    return plans


def _draw_swing(rng: np.random.Generator, scene: TeamScene, band: tuple[float, float], time: Array) -> Array | None:
    """Return the hinge's sines (1, 3, SINES), None for one rigid body."""
    if scene.hinge is None:
        return None
    drawn = draw_motion(rng, time, band, scene.hinge.swing_max, 0.0, scene.freedom)
    return drawn.rotation[:1]


def _shrunk(
    scene: TeamScene, payload: TeamPayload, homes: Pose, motion: SineMotion, time: Array, swing: Array | None
) -> SineMotion:
    """Return the motion, made smaller where it does not fit the workspaces."""
    factor = 1.0
    while not _fits(scene, payload, homes, motion.scaled(factor), time, swing):
        factor *= SHRINK
        if factor < LEAST:
            raise BadValue("these grasps leave the robots' workspaces even for small motions.")
    return motion.scaled(factor)


def _fits(
    scene: TeamScene, payload: TeamPayload, homes: Pose, motion: Motion, time: Array, swing: Array | None
) -> bool:
    """Return whether every robot reaches its grasp at every row, whatever its stamps are late by."""
    if scene.sensing != "joints":
        return True
    for late in {0.0, *scene.late_s.values()}:
        seen = motion.at(time - late)
        placed = load_of(scene, payload, seen, swing, scene.slip).placed(seen)
        home = homes.inverse()
        for i in range(scene.robots):
            if not Omnid().reaches(home[i].apply(placed[:, i])).all():
                return False
    return True
