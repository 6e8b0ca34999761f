"""`steelyard bench team`: cases A to D with known answers, the paper's estimator beside ours, cost against N."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from steelyard.bench.jobs import Progress, require_known, require_one, spread, told
from steelyard.bench.middles import middle_of
from steelyard.bench.teams.errors import grasp_errors, score
from steelyard.bench.timing import thread_ms
from steelyard.errors import SteelyardError
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamNoise, TeamScene, case
from steelyard.spatial import Pose
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam, needs_twists
from steelyard.team.poses.team import PoseTeam
from steelyard.team.published import PublishedTeam
from steelyard.team.twists.team import TwistTeam

FIRST_SEED = 100
SIZES = (2, 4, 8, 16, 32, 64)
TIMED = ((3, 1000), (3, 60_000), (16, 1000), (64, 1000))
SCALE_SEEDS = 24
SCALE_NOISE = TeamNoise(rate_rad_s=0.008, velocity_m_s=0.002)
METRICS = ("rotation_deg", "position_mm", "position_pct", "mass_pct", "com_mm", "inertia_pct", "time_s")
TABLE_V = {
    "what": "Table V of the paper: three robots on hardware, four trials, mean absolute error of the principal moments",
    "inertia_pct": [6.824, 3.999, 0.973],
}
RULES = (
    "Three Omnids, force-only, one rigid payload; trial k has seed 100 + k and the same payload, grasps and motion in "
    "every case. A trial is one grasp recording of 10 s, four still poses of 1 s and one motion of 52 s at 100 Hz. "
    "cases.<case>.<method> = means over trials: rotation and position of the grasps other than the reference (position "
    "also in % of the true distance), absolute mass error, distance of the centre of mass, absolute errors of the "
    "principal moments in rising order, thread CPU of one identification (median). scale: grasps alone, from 998 rows "
    "of twists with white noise of 8 mrad/s and 2 mm/s, mean over 24 seeds (12 from 32 robots on) with its standard "
    "error, time = median of five calls. times: one motion with the noise of case C, whole identification, grasps to "
    "inertia, thread CPU in s, median of five calls."
)


@dataclass(frozen=True)
class Method:
    """One estimator in the bench: the whole answer, and the grasps X_RG (N,) alone from unfiltered twists."""

    identify: Callable[[TeamLog], TeamEstimate]
    grasps: Callable[[TeamLog], Pose]


def _published_grasps(log: TeamLog) -> Pose:
    return PublishedTeam(cutoff_hz=None, close_loops=False).grasps(log)[0]


def _joint_grasps(log: TeamLog) -> Pose:
    if needs_twists(log):
        return TwistTeam.of(log, clocks=True).fit.grasps
    return PoseTeam.of(log, clocks=True).fit.grasps


METHODS: Mapping[str, Method] = MappingProxyType(
    {
        "paper": Method(PublishedTeam().identify, _published_grasps),
        "joint": Method(JointTeam().identify, _joint_grasps),
    }
)


def run(
    trials: int = 24,
    progress: Progress | None = None,
    *,
    cases: Sequence[str] = (),
    methods: Sequence[str] = (),
    sizes: Sequence[int] = (),
    workers: int = 1,
    coverage: int = 0,
    slips: int = 40,
) -> dict[str, Any]:
    """Return the errors of every method in every case over `trials` seeds, and the cost of grasps against N.

    With `joint` also its errors over the Cramer-Rao bound where noise is white, over as many trials, and how often its
    95 % intervals hold the truth, over `coverage` trials per kind of noise, and what becomes of it when a clock is
    late, a grasp slips (`slips` times in two cases) or a robot leaves, what motions do not show, and what must not
    change its answer. An empty choice means all.
    `progress(done, all)` is called after every trial of the cases. Raises BadValue for unknown names.
    """
    require_one("trial", trials)
    require_known("case", cases, CASES)
    require_known("method", methods, METHODS)
    chosen, wanted = tuple(cases) or tuple(CASES), tuple(methods) or tuple(METHODS)
    jobs = [(name, FIRST_SEED + k, wanted) for name in chosen for k in range(trials)]
    rows = [row for found in told(spread(trial, jobs, workers), len(jobs), progress) for row in found]
    return {
        "bench": "team",
        "rules": RULES,
        "trials": trials,
        "seeds": [FIRST_SEED + k for k in range(trials)],
        "cases": {name: {m: summary(rows, name, m) for m in wanted} for name in chosen},
        "scale": [scale(n, m) for n in (sizes or SIZES) for m in wanted],
        "published": TABLE_V,
        **(_of_joint(trials, coverage, slips, workers) if "joint" in wanted else {}),
        "rows": rows,
    }


def _of_joint(trials: int, coverage: int, slips: int, workers: int) -> dict[str, Any]:
    """Return what is asked of the joint estimator alone: bound, times, events, troubles, laws, and its intervals."""
    from steelyard.bench.teams import bound, events, intervals, laws, troubles

    out: dict[str, Any] = {
        "bound": bound.run(trials),
        "times": [times(robots, rows) for robots, rows in TIMED],
        "events": events.run(trials, slips, workers),
        "troubles": troubles.run(trials, workers),
        "laws": laws.run(max(1, trials // 4), workers),
    }
    return out | {"coverage": intervals.coverage(coverage, workers=workers)} if coverage else out


def times(robots: int, rows: int) -> dict[str, Any]:
    """Return the cost of one whole identification from joint angles and forces."""
    log = simulate_team(TeamScene(CASES["C"], robots, kinds=("motion",), motion_samples=rows), FIRST_SEED).log
    joint = JointTeam()
    return {"n": robots, "rows": rows, "time_s": thread_ms(lambda: joint.identify(log), repeats=5, warm=1) / 1000}


def trial(job: tuple[str, int, Sequence[str]]) -> list[dict[str, Any]]:
    """Return one row per method: case, seed, method and the errors, or the text of its error."""
    name, seed, methods = job
    made = simulate_team(case(name), seed)
    rows = []
    for method in methods:
        row: dict[str, Any] = {"case": name, "seed": seed, "method": method}
        start = time.thread_time()
        try:
            found = METHODS[method].identify(made.log)
        except SteelyardError as error:
            rows.append(row | {"error": str(error)})
            continue
        rows.append(row | score(made, found) | {"time_s": time.thread_time() - start})
    return rows


def summary(rows: Sequence[Mapping[str, Any]], name: str, method: str) -> dict[str, Any]:
    """Return the means over trials of one method in one case, the median time, and how many trials it answered."""
    mine = [row for row in rows if row["case"] == name and row["method"] == method]
    answered = [row for row in mine if "error" not in row]
    out: dict[str, Any] = {"trials": len(mine), "answered": len(answered)}
    for metric in METRICS:
        middle = np.median if metric == "time_s" else np.mean
        out[metric] = middle_of([row[metric] for row in answered], middle)
    return out


def scale(robots: int, method: str) -> dict[str, Any]:
    """Return error and cost of the grasps of one team size from white twists."""
    scene = TeamScene(
        SCALE_NOISE, robots, "twists", bases_move=True, kinds=("grasp",), grasp_samples=998, six_axis=_bearing(robots)
    )
    estimate = METHODS[method].grasps
    errors, seeds = [], SCALE_SEEDS if robots < 32 else SCALE_SEEDS // 2
    for seed in range(FIRST_SEED, FIRST_SEED + seeds):
        made = simulate_team(scene, seed)
        errors.append(grasp_errors(made.truth, estimate(made.log))[:2])
    (turned, moved), doubt = np.mean(errors, axis=0), np.std(errors, axis=0) / np.sqrt(seeds)
    cpu = thread_ms(lambda: estimate(made.log), repeats=5, warm=1) / 1000
    return {
        "n": robots, "method": method, "time_s": cpu, "rotation_deg": float(turned), "position_mm": float(moved),
        "rotation_se": float(doubt[0]), "position_se": float(doubt[1]), "seeds": seeds,
    }  # fmt: skip


def _bearing(robots: int) -> frozenset[int]:
    """Return who needs a six-axis wrist, so that the payload can be carried at all."""
    return frozenset({0}) if robots == 2 else frozenset()
