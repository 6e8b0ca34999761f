"""What goes wrong in a session and is put right: answers from spoilt logs beside those from sound ones."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from steelyard.bench.jobs import spread
from steelyard.bench.teams.errors import score
from steelyard.check import Array
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.logs.team_track import Track
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import Slip, TeamNoise, TeamScene, case
from steelyard.team.joint import JointTeam

FIRST_SEED = 8000
KINDS = ("position_mm", "mass_pct", "com_mm")
SPOILT = "robot1"
_STIFF = TeamScene(
    TeamNoise(pose_rad=3e-4, pose_m=2e-4, force_white_N=1.0, torque_white_Nm=0.1), sensing="poses",
    six_axis=frozenset({0, 1, 2}),
)  # fmt: skip
RULES = (
    "Every trial is a session as in `cases` and the same one with one thing wrong: robot 1's clock 5 ms later in the "
    "motion than before; that clock 100 ppm fast in it; its grasp slips by 5 mm before it; robots with six-axis wrists "
    "(poses with white noise of 0.3 mrad and 0.2 mm, 1 N, 0.1 N m) whose grasps yield by 1e5 N/m and 3000 N m/rad; a "
    "table that bears half of the payload in one still pose. named = the finding was there; false = it was there in "
    "the sound session; errors are means of position, mass and centre of mass, spoilt and sound."
)


@dataclass(frozen=True)
class Trouble:
    """A scene, what is wrong with it (the scene that is simulated, or its log), and the finding that says so."""

    sound: TeamScene
    code: str
    scene: Callable[[TeamScene], TeamScene] = lambda scene: scene
    log: Callable[[TeamLog], TeamLog] = lambda log: log


def _in_motion(change: Callable[[Track], Track]) -> Callable[[TeamLog], TeamLog]:
    """Return what changes robot 1's track of the last recording."""

    def changed(log: TeamLog) -> TeamLog:
        last = log.recordings[-1]
        tracks = {**last.tracks, SPOILT: change(last.tracks[SPOILT])}
        return log.with_recordings(*log.recordings[:-1], replace(last, tracks=tracks))

    return changed


def _on_a_table(log: TeamLog) -> TeamLog:
    """Return the log with forces halved in its first still pose."""

    def halved(recording: TeamRecording) -> TeamRecording:
        return replace(recording, tracks={n: _halved(t) for n, t in recording.tracks.items()})

    first = next(k for k, recording in enumerate(log.recordings) if recording.kind == "still")
    return log.with_recordings(*(halved(r) if k == first else r for k, r in enumerate(log.recordings)))


def _halved(track: Track) -> Track:
    return replace(track, channels={n: v / 2 if n in ("force", "torque") else v for n, v in track.channels.items()})


TROUBLES: Mapping[str, Trouble] = MappingProxyType(
    {
        "clock_set_anew": Trouble(case("B"), "clock-unsteady", log=_in_motion(lambda t: t.shifted(0.005))),
        "clock_fast": Trouble(
            case("B"), "clock-unsteady", log=_in_motion(lambda t: t.stamped(t.time + 1e-4 * (t.time - t.time[0])))
        ),
        "slip_between": Trouble(
            case("C"), "grasp-slipped", lambda scene: replace(scene, slip=Slip(1, np.array([0.0, 0.003, 0.004]), -1.0))
        ),
        "soft_grasps": Trouble(_STIFF, "grasp-yields", lambda scene: replace(scene, stiffness=(1e5, 3e3))),
        "on_a_table": Trouble(case("B"), "contact", log=_on_a_table),
    }
)


def trial(job: tuple[str, int]) -> tuple[bool, bool, Array]:
    """Return whether the trouble was named, whether it was in the sound session, and errors (2, 3) spoilt and sound."""
    name, seed = job
    trouble = TROUBLES[name]
    rows, codes = [], []
    for spoil in (True, False):
        made = simulate_team(trouble.scene(trouble.sound) if spoil else trouble.sound, seed)
        found = JointTeam().identify(trouble.log(made.log) if spoil else made.log)
        codes.append(trouble.code in found.codes())
        errors = score(made, found)
        rows.append([errors[kind] for kind in KINDS])
    return codes[0], codes[1], np.array(rows)


def run(trials: int, workers: int) -> dict[str, Any]:
    """Return every trouble over `trials`."""
    out: dict[str, Any] = {"rules": RULES, "trials": trials}
    for name in TROUBLES:
        named, false, errors = zip(
            *spread(trial, [(name, FIRST_SEED + k) for k in range(trials)], workers), strict=True
        )
        spoilt, sound = np.mean(errors, axis=0)
        out[name] = {
            "named": sum(named),
            "false": sum(false),
            **{kind: {"spoilt": float(a), "sound": float(b)} for kind, a, b in zip(KINDS, spoilt, sound, strict=True)},
        }
    return out
