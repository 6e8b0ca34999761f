"""What happens to teams: a clock that is late, a grasp that slips, a robot that leaves."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.bench.jobs import spread
from steelyard.bench.teams.errors import score
from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import TeamTrial, simulate_team
from steelyard.simulate.team_cases import Presence, Slip, TeamNoise, TeamScene, case
from steelyard.team.joint import JointTeam

LATE_CASE, LATE_S = "B", 0.013
SLIP_M, SLIP_AT, SLIP_ROWS = 0.005, 7.0, 1500
LEAVER, LEFT_TEAM = 2, 4
# Bases that stand, by case, and bases that move, whose robots measure twists.
TWISTS = TeamNoise(force_white_N=1.0, rate_rad_s=0.008, velocity_m_s=0.002)
SLIP_SCENES = {"B": case("B"), "C": case("C"), "twists": TeamScene(TWISTS, sensing="twists", bases_move=True)}
LEFT_SCENES = {name: replace(SLIP_SCENES[name], robots=LEFT_TEAM) for name in ("C", "twists")}
LEFT_KINDS = ("position_mm", "mass_pct", "com_mm", "inertia_pct")
FIRST_SEED = 7000
RULES = (
    "late_clock: case B, robot 1 stamps 13 ms late; position error over that of the same trials with clocks in step, "
    "with and without the estimate of clocks. slips: one motion of 15 s, robot 1 slips by 5 mm in a random direction "
    "within 0.1 s at 7 s; found = named, of that robot, within 0.3 s of the middle of the slip; false = named without "
    "one. leaving: four robots, one lets go at half of the motion; errors over those of the same log with that told "
    "and its motion from there on left out. twists: bases move, twists have white noise of 8 mrad/s and 2 mm/s, forces "
    "of 1 N."
)


def late_trial(seed: int) -> Array:
    """Return position errors [mm] in step, late with the clocks found, late without, and the offset's error [s]."""
    together = simulate_team(case(LATE_CASE), seed)
    late = simulate_team(replace(case(LATE_CASE), late_s={1: LATE_S}), seed)
    found = JointTeam().identify(late.log)
    return np.array(
        [
            score(together, JointTeam().identify(together.log))["position_mm"],
            score(late, found)["position_mm"],
            score(late, JointTeam(clocks=False).identify(late.log))["position_mm"],
            found.clock_offsets_s["robot1"] - LATE_S,
        ]
    )


def slip_trial(job: tuple[str, int, bool]) -> tuple[bool, float]:
    """Return whether a slip of robot 1 was named, and how far [s] from its middle; of any robot where there is none."""
    name, seed, slips = job
    way = np.random.default_rng([seed, 4]).normal(size=3)
    slip = Slip(1, SLIP_M * way / np.linalg.norm(way), SLIP_AT) if slips else None
    scene = replace(SLIP_SCENES[name], slip=slip, kinds=("motion",), motion_samples=SLIP_ROWS)
    made = simulate_team(scene, seed)
    named = [f.message for f in JointTeam().identify(made.log).findings if f.code == "grasp-slipped"]
    if not slips:
        return bool(named), np.nan
    mine = [message for message in named if "grasp of 'robot1'" in message]
    times = [float(message.split(" at ")[1].split(" s of")[0]) for message in mine]
    start = made.log.recordings[0].tracks["robot0"].time[0]
    return bool(mine), min((abs(t - start - SLIP_AT - 0.05) for t in times), default=np.inf)


def told(made: TeamTrial) -> TeamLog:
    """Return the log in which the robot that leaves says so, and measures no motion from there on."""
    log, name = made.log, f"robot{LEAVER}"
    last = log.recordings[-1]
    track, holds = last.tracks[name], made.truth.holds[:, LEAVER]
    valid = {channel: mask & holds if channel != "force" else mask for channel, mask in track.valid.items()}
    said = replace(track, carrying=holds, valid=valid)
    return log.with_recordings(*log.recordings[:-1], replace(last, tracks={**last.tracks, name: said}))


def leaving_trial(job: tuple[str, int]) -> tuple[bool, Array]:
    """Return whether the leaving was named; squared errors (2, 4) found and told, by LEFT_KINDS."""
    name, seed = job
    scene = LEFT_SCENES[name]
    half = scene.motion_samples / 200
    made = simulate_team(replace(scene, presence=(Presence(LEAVER, leaves=half),)), seed)
    rows, named = [], False
    for k, log in enumerate((made.log, told(made))):
        found = JointTeam().identify(log)
        named = named or (k == 0 and "robot-left" in found.codes())
        errors = score(made, found)
        rows.append([np.nan if errors[kind] is None else np.mean(errors[kind]) for kind in LEFT_KINDS])
    return named, np.square(np.array(rows))


def run(trials: int, slips: int, workers: int) -> dict[str, Any]:
    """Return late_clock over `trials`, slips over `slips` with and as many without, leaving over `trials`."""
    seeds = [FIRST_SEED + k for k in range(trials)]
    late = np.array(list(spread(late_trial, seeds, workers)))
    step, clocks, without, off = late.T
    out: dict[str, Any] = {
        "rules": RULES,
        "late_clock": {
            "case": LATE_CASE, "late_ms": 1e3 * LATE_S, "trials": trials,
            "offset_error_ms": {"mean": 1e3 * float(np.abs(off).mean()), "worst": 1e3 * float(np.abs(off).max())},
            "position_mm": {
                "in_step": float(step.mean()), "clocks": float(clocks.mean()), "without": float(without.mean()),
            },
            "ratio_clocks": float(clocks.mean() / step.mean()), "ratio_without": float(without.mean() / step.mean()),
        },
    }  # fmt: skip
    out["slips"] = {name: _slips(name, slips, workers) for name in SLIP_SCENES} if slips else {}
    return out | {"leaving": _leaving("C", seeds, workers), "leaving_twists": _leaving("twists", seeds, workers)}


def _leaving(name: str, seeds: Sequence[int], workers: int) -> dict[str, Any]:
    named, squares = zip(*spread(leaving_trial, [(name, seed) for seed in seeds], workers), strict=True)
    rms = np.sqrt(np.nanmean(squares, axis=0))
    errors = {
        kind: {"found": float(found), "told": float(told), "ratio": float(found / told)}
        for kind, found, told in zip(LEFT_KINDS, *rms, strict=True)
    }
    return {"case": name, "robots": LEFT_TEAM, "trials": len(seeds), "named": sum(named), **errors}


def _slips(name: str, trials: int, workers: int) -> dict[str, Any]:
    jobs: Sequence[tuple[str, int, bool]] = [(name, FIRST_SEED + k, s) for s in (True, False) for k in range(trials)]
    rows = list(spread(slip_trial, jobs, workers))
    times = np.array([apart for _, apart in rows[:trials]])
    return {
        "trials": trials,
        "found": int((times < 0.3).sum()),
        "named": sum(named for named, _ in rows[:trials]),
        "false": sum(named for named, _ in rows[trials:]),
        "apart_s": float(np.median(times)),
    }
