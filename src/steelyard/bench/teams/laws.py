"""What a team's answer obeys: directions that a motion does not show are named, and labels change nothing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np
from scipy.linalg import null_space

from steelyard.bench.jobs import spread
from steelyard.bench.teams.events import TWISTS
from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import TeamNoise, TeamScene, case
from steelyard.simulate.team_motions import Freedom
from steelyard.spatial import Pose, Rotation
from steelyard.spatial.screws import log_pose
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

FIRST_SEED = 6000
_ALL, _NONE = np.eye(3), np.zeros((3, 0))
_NOISE = TeamNoise(pose_rad=1e-4, pose_m=1e-4, rate_rad_s=2e-3, velocity_m_s=5e-4, force_white_N=0.2)
_PIVOT = np.array([0.3, 0.2, 0.1])
SENSED: Mapping[str, TeamScene] = MappingProxyType(
    {
        "poses": TeamScene(_NOISE, sensing="poses", kinds=("motion",), motion_samples=1500),
        "twists": TeamScene(_NOISE, sensing="twists", bases_move=True, kinds=("motion",), motion_samples=1500),
    }
)
SESSIONS: Mapping[str, TeamScene] = MappingProxyType(
    {
        "joints": replace(case("D"), robots=4, late_s={1: 0.013}),
        "twists": TeamScene(TWISTS, sensing="twists", bases_move=True, motion_samples=2000),
    }
)
RULES = (
    "motions: three robots, one motion of 15 s with white noise (poses 0.1 mrad and 0.1 mm, twists 2 mrad/s and "
    "0.5 mm/s), bases that stand (poses) or move (twists). asked = how many of a grasp's six directions such a motion "
    "shows; shown = how many the answer calls shown, least and most over trials; named = trials with the finding; "
    "wrench_rank = how many of the ten parameters are called shown; deg, mm = mean error of the grasps along what is "
    "shown. same: case D with four robots and a late clock, and a team with moving bases; largest difference between "
    "the answer and that of the same log with the robots in another order, another reference, or (where they stand) "
    "other homes: of grasps [rad, m], and of the ten parameters as a share of each one's group (mass, first moments, "
    "inertia)."
)


@dataclass(frozen=True, eq=False)
class Motion:
    """What a motion may do, and how many of a grasp's six directions it shows (facts of rigid motion, no noise)."""

    freedom: Freedom
    shows: int


MOTIONS: Mapping[str, Motion] = MappingProxyType(
    {
        "general": Motion(Freedom.general(), 6),
        "two_axes": Motion(Freedom(_ALL[:, :2], _ALL), 6),
        "ball_joint": Motion(Freedom(_ALL, _NONE, _PIVOT), 6),
        "one_axis": Motion(Freedom(_ALL[:, 2:], _ALL), 5),
        "planar": Motion(Freedom(_ALL[:, 2:], _ALL[:, :2]), 5),
        "one_axis_pivot": Motion(Freedom(_ALL[:, 2:], _NONE, _PIVOT), 4),
        "translation": Motion(Freedom(_NONE, _ALL), 3),
        "one_axis_translation": Motion(Freedom(_NONE, _ALL[:, 2:]), 2),
    }
)


def lost_trial(job: tuple[str, str, int]) -> dict[str, Any]:
    """Return what one motion is said to show, and the errors along it."""
    sensed, motion, seed = job
    made = simulate_team(replace(SENSED[sensed], freedom=MOTIONS[motion].freedom), seed)
    found = JointTeam().identify(made.log)
    shown, turned, moved = [], [], []
    for k, name in enumerate(made.log.names):
        if name == found.reference:
            continue
        grasp = found.grasps[name]
        seen = null_space(grasp.lost) if len(grasp.lost) else np.eye(6)
        along = seen @ (seen.T @ _error(grasp.pose, made.truth.grasps[k]))
        shown.append(seen.shape[1])
        turned.append(np.rad2deg(np.linalg.norm(along[:3])))
        moved.append(1000 * np.linalg.norm(along[3:]))
    return {
        "shown": shown,
        "named": "grasp-direction-lost" in found.codes(),
        "wrench_rank": found.evidence.rank,
        "deg": float(np.mean(turned)),
        "mm": float(np.mean(moved)),
    }


def _error(found: Pose, truth: Pose) -> Array:
    """Return the rotation vector [rad] and the move of the grasp [m] (6,), about R's axes, from found to true.

    Both are of one screw: what is lost may be off by any turn, along an arc that a straight move would cut short.
    """
    screw = log_pose(truth @ found.inverse())
    return np.concatenate([screw[:3], np.cross(screw[:3], found.position) + screw[3:]])


def same_trial(job: tuple[str, int]) -> dict[str, list[float]]:
    """Return by how much the grasps and the parameters differ, for every change that must not matter."""
    name, seed = job
    log = simulate_team(SESSIONS[name], seed).log
    once = JointTeam().identify(log)
    return {change: _apart(log, once, JointTeam().identify(other)) for change, other in _changes(log).items()}


def _changes(log: TeamLog) -> dict[str, TeamLog]:
    changed = {
        "relabelled": replace(log, robots=log.robots[::-1]),
        "another_reference": log.with_reference(log.names[1]),
    }
    if all("position" in r.tracks[n].channels for r in log.recordings for n in r.tracks):
        homes = {
            n: Pose(Rotation.exp(np.array([0.3, -0.2, 1.0 + i])), np.array([i, 2.0, -1.0]))
            for i, n in enumerate(log.names)
        }
        changed["moved_homes"] = log.with_homes(homes)
    return changed


def _apart(log: TeamLog, one: TeamEstimate, two: TeamEstimate) -> list[float]:
    """Return the largest difference of grasps and of parameters, both seen from the first one's reference."""
    X = one.grasps[two.reference].pose
    gaps = [log_pose(one.grasps[n].pose.inverse() @ (X @ two.grasps[n].pose)) for n in log.names]
    was, now = one.parameters.vector, two.parameters.in_frame(X).vector
    size = np.repeat([abs(was[0]), np.abs(was[1:4]).max(), np.abs(was[4:]).max()], [1, 3, 6])
    return [float(np.abs(gaps).max()), float(np.abs((now - was) / size).max())]


def run(trials: int, workers: int) -> dict[str, Any]:
    """Return every motion by what is sensed over `trials` seeds, and every change that must not matter."""
    seeds = [FIRST_SEED + k for k in range(trials)]
    motions = {s: {m: _motion(s, m, seeds, workers) for m in MOTIONS} for s in SENSED}
    return {"rules": RULES, "trials": trials, "motions": motions, "same": _same(seeds, workers)}


def _motion(sensed: str, motion: str, seeds: list[int], workers: int) -> dict[str, Any]:
    rows = list(spread(lost_trial, [(sensed, motion, seed) for seed in seeds], workers))
    shown, ranks = np.array([row["shown"] for row in rows]), [row["wrench_rank"] for row in rows]
    return {
        "asked": MOTIONS[motion].shows,
        "shown": [int(shown.min()), int(shown.max())],
        "named": sum(row["named"] for row in rows),
        "wrench_rank": [min(ranks), max(ranks)],
        "deg": float(np.mean([row["deg"] for row in rows])),
        "mm": float(np.mean([row["mm"] for row in rows])),
    }


def _same(seeds: list[int], workers: int) -> dict[str, dict[str, dict[str, float]]]:
    out = {}
    for name in SESSIONS:
        rows = list(spread(same_trial, [(name, seed) for seed in seeds], workers))
        worst = {change: np.max([row[change] for row in rows], axis=0) for change in rows[0]}
        out[name] = {change: {"grasps": float(g), "parameters": float(p)} for change, (g, p) in worst.items()}
    return out
