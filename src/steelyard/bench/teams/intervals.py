"""Are the error bars of the joint team estimate honest? How often 95 % intervals hold the truth, and how wide they are.

Intervals of one kind (grasp rotations, grasp positions, mass, centre of mass, inertia) are pooled over trials: white
encoder and force noise, both correlated with a corner at 2 Hz, and case D with force bias and gain errors.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from steelyard.bench.jobs import spread
from steelyard.check import Array
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene, case
from steelyard.team.adjoint import log as pose_log
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

FIRST_SEED = 5000
WIDE = 1.959964
NOISES: Mapping[str, TeamNoise] = MappingProxyType(
    {
        "white": TeamNoise(None, 1e-3, 0.0, 1.0),
        "correlated": replace(CASES["C"], force_spectrum="2hz"),
        "biased": CASES["D"],
    }
)
KINDS = ("rotation", "position", "mass", "com", "inertia")
MOTION_SAMPLES = 2000


def errors(made: TeamTrial, found: TeamEstimate) -> dict[str, tuple[Array, Array]]:
    """Return errors and their standard deviations by kind, each (k,), in the axes in which they are reported."""
    turned, moved, turned_std, moved_std = [], [], [], []
    for i, name in enumerate(made.log.names):
        if name == made.log.reference:
            continue
        truth, grasp = made.truth.grasps[i], found.grasps[name]
        # Errors turn the true grasp in R's axes: exp(error) truth.
        turned.append(truth.rotation.apply(pose_log(truth.inverse() @ grasp.pose)[:3]))
        moved.append(grasp.pose.position - truth.position)
        turned_std.append(grasp.std[:3])
        moved_std.append(grasp.std[3:])
    body, upper = made.truth.body, np.triu_indices(3)
    return {
        "rotation": (np.concatenate(turned), np.concatenate(turned_std)),
        "position": (np.concatenate(moved), np.concatenate(moved_std)),
        "mass": (np.array([found.mass - float(body.mass)]), found.std[:1]),
        "com": (found.com - body.com, found.std[1:4]),
        "inertia": ((found.parameters.inertia_com - body.inertia_com)[upper], found.std[4:]),
    }


def trial(job: tuple[str, int]) -> dict[str, tuple[Array, Array]]:
    """Return errors and standard deviations of one trial: the noise called so, and the seed."""
    noise, seed = job
    scene: TeamScene = replace(case("A"), noise=NOISES[noise], motion_samples=MOTION_SAMPLES)
    made = simulate_team(scene, seed)
    return errors(made, JointTeam().identify(made.log))


def coverage(trials: int = 400, workers: int = 1) -> dict[str, Any]:
    """Return by noise and kind: share of 95 % intervals that hold the truth, mean half-width over the rms error."""
    out: dict[str, Any] = {"trials": trials}
    for noise in NOISES:
        rows = list(spread(trial, [(noise, FIRST_SEED + k) for k in range(trials)], workers))
        out[noise] = {kind: pooled([row[kind] for row in rows]) for kind in KINDS}
    return out


def pooled(rows: list[tuple[Array, Array]]) -> dict[str, float]:
    """Return coverage [%], mean half-width over rms error, and that rms, of intervals of one kind."""
    error, std = (np.concatenate([row[part] for row in rows]) for part in (0, 1))
    rms = float(np.sqrt((error**2).mean()))
    return {
        "coverage_pct": 100 * float((np.abs(error) < WIDE * std).mean()),
        "half_width_over_rms": float(WIDE * std.mean() / rms),
        "rms": rms,
    }
