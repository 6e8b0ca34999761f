"""Who carries when: robots that let go or join during a log, told from robots whose data are merely missing.

A robot that pushes with next to nothing for a while may have let go. Whether it has, motion tells: a grasp that holds
nothing does not go where the others say it must. Missing rows are no sign of either.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from steelyard.check import Array, Mask
from steelyard.findings import Finding
from steelyard.logs.middles import quantile
from steelyard.logs.runs import lasting, runs
from steelyard.logs.team_log import TeamLog
from steelyard.logs.team_track import Track
from steelyard.team.payload.body_rows import averaged
from steelyard.team.stacked import Stretch

# A push below this share of the robot's usual one, that which it passes in a tenth of its rows, is idle where it stays
# so for IDLE_S [s]; forces are averaged over MEAN_S. What happens within EDGE_S of a change is used for nothing.
SHARE, USUAL, IDLE_S, MEAN_S, EDGE_S = 0.1, 0.9, 1.0, 0.2, 0.4
# One who has let go may still bear a gripper that hangs beyond the sensor: below this share it is asked.
LIGHT = 0.6
# A fifth of the seconds show who goes ways of its own: it may rest between.
OFTEN = 0.8
# What pushes with next to nothing in so many of these rows bears no gripper.
MOSTLY = 0.9
# An idle grasp is off the payload where it is so many times its noise from where the others say it must be.
OFF = 5.0


def idle(parts: Sequence[Stretch], share: float) -> list[Mask]:
    """Return the rows (T, N) of every recording in which a robot pushes with less than a share of its usual push."""
    sizes = [_push(part.wrench[..., 3:], part.rate) for part in parts]
    count = parts[0].seen.shape[1]
    usual = np.zeros(count)
    for i in range(count):
        felt = np.concatenate([size[part.felt[:, i], i] for size, part in zip(sizes, parts, strict=True)])
        usual[i] = quantile(felt, USUAL) if len(felt) else 0.0
    out = []
    for size, part in zip(sizes, parts, strict=True):
        small = (size < share * usual) & part.felt & part.carries
        out.append(np.stack([lasting(small[:, i], IDLE_S * part.rate) for i in range(count)], axis=1))
    return out


def _push(force: Array, rate: float) -> Array:
    """Return the size (T, ...) [N] of a force (T, ..., 3) averaged over MEAN_S; rate in Hz."""
    mean = averaged(force, MEAN_S, rate)
    return np.asarray(np.sqrt(mean[..., 0] ** 2 + mean[..., 1] ** 2 + mean[..., 2] ** 2))


def usual_push(log: TeamLog, name: str) -> float:
    """Return the push [N] that a robot passes in a tenth of its rows, before clocks are known; zero without forces."""
    felt = np.concatenate([np.zeros(0), *(_felt(track) for _, track in log.tracks_of(name))])
    felt = felt[np.isfinite(felt)]
    return float(quantile(felt, USUAL)) if len(felt) else 0.0


def perhaps_idle(track: Track, share: float, usual: float) -> Mask:
    """Return the rows (T,) in which a robot may hold nothing: it says so, or pushes with less than a share for IDLE_S.

    usual  its push [N], as of `usual_push`
    """
    rows = _felt(track) < share * usual
    rows = lasting(rows, IDLE_S / track.step) if rows.any() else rows
    return rows if track.carrying is None else rows | ~track.carrying


def _felt(track: Track) -> Array:
    """Return the size (T,) [N] of a track's averaged force, NaN where none was measured."""
    good = track.mask("force")
    if not good.any() or len(track) < 2:
        return np.full(len(track), np.nan)
    force = np.where(good[:, None], track.channels["force"], 0.0)
    return np.where(good, _push(force, 1 / track.step), np.nan)


def as_long(values: Any, rows: int) -> Any:
    """Return values (T, ...) cut to `rows`, or the last one repeated: a corrected clock gains or loses a few rows."""
    return values[np.minimum(np.arange(rows), len(values) - 1)]


def strayers(parts: Sequence[Stretch], light: Sequence[Mask], off: Sequence[Array]) -> Mask:
    """Return which robots (N,) go ways of their own for a while in which they push with little (`light`).

    off  (T, N) times their noise, of every recording: one that slipped is off by much the same but for that moment
    """
    out = np.zeros(parts[0].seen.shape[1], np.bool_)
    for part, rows, away in zip(parts, light, off, strict=True):
        away = as_long(away, len(part))
        for i in range(len(out)):
            for start, stop in runs(rows[:, i]):
                own = _of(away, part.seen, i, start, stop)
                seconds = np.array_split(own, max(1, int(len(own) / part.rate)))
                out[i] |= np.quantile([second.std() for second in seconds], OFTEN) >= OFF
    return out


def _of(off: Array, seen: Mask, robot: int, start: int, stop: int) -> Array:
    """Return by how much a robot is off in the rows from start to stop in which it was seen; zero where in none."""
    rows = off[start:stop, robot][seen[start:stop, robot]]
    return rows if len(rows) else np.zeros(1)


def let_go(part: Stretch, bare: Mask, light: Mask, off: Array, strays: Mask) -> Stretch:
    """Return the recording with robots let go that push with little where they are `off` (T, N) times their noise.

    bare   (T, N) rows in which they push with next to nothing: the others carry all
    light  (T, N) rows in which it is a gripper's weight: nobody's wrench is used, since whoever holds the payload no
           longer bears the gripper; of robots only who are known to go ways of their own, `strays` (N,)

    Their rows tell no motion; around a change nobody's wrench is used, either, since the sum is in doubt.
    """
    bare, light, off = (as_long(rows, len(part)) for rows in (bare, light, off))
    carries, seen, felt = part.carries.copy(), part.seen.copy(), part.felt.copy()
    edge = int(np.ceil(EDGE_S * part.rate))
    for i in range(bare.shape[1]):
        empty = bare[:, i].copy()
        for start, stop in runs(light[:, i] & strays[i]):
            if empty[start:stop].mean() < MOSTLY and _away(_of(off, part.seen, i, start, stop)):
                around = slice(max(0, start - edge), stop + edge)
                seen[around, i] = felt[around, i] = empty[start:stop] = False
        for start, stop in runs(empty):
            if not _away(_of(off, part.seen, i, start, stop)):
                continue
            carries[start:stop, i] = False
            seen[max(0, start - edge) : stop + edge, i] = False
            for k in (start, stop):
                if 0 < k < len(part):
                    felt[max(0, k - edge) : k + edge] = False
    return replace(part, carries=carries, seen=seen, felt=felt)


def _away(off: Array) -> bool:
    """Tell whether a grasp is off the payload, by so much in rows (T,).

    What stands still beside a payload at rest cannot be told from what holds it.
    """
    return float(np.sqrt((off**2).mean())) >= OFF


def presence_findings(before: Sequence[Stretch], after: Sequence[Stretch], names: Sequence[str]) -> list[Finding]:
    """Return robot-left and robot-joined with times, for every change that was found."""
    out = []
    for was, now in zip(before, after, strict=True):
        for i, name in enumerate(names):
            gone = was.seen[:, i] & ~now.seen[:, i] & now.carries[:, i] & ~now.felt[:, i]
            for start, stop in runs(lasting(gone, IDLE_S * was.rate)):
                out.append(_with_gripper(name, was, was.wrench[:, i, 3:], start, stop))
            for start, stop in runs(was.carries[:, i] & ~now.carries[:, i]):
                if start > 0:
                    text = f"'{name}' let go of the payload at {was.time[start]:.2f} s of '{was.name}'"
                    out.append(Finding.of("robot-left", f"{text}; from then on the others carry it."))
                if stop < len(was):
                    text = f"'{name}' took hold of the payload at {was.time[stop]:.2f} s of '{was.name}'"
                    out.append(Finding.of("robot-joined", f"{text}; until then the others carried it."))
                if start == 0 and stop == len(was):
                    text = f"'{name}' held nothing during all of '{was.name}'"
                    out.append(Finding.of("robot-left", f"{text}; the others carry it."))
    return out


def _with_gripper(name: str, part: Stretch, push: Array, start: int, stop: int) -> Finding:
    """Return what is said of a robot that holds nothing from one row to another and pushes (T, 3) [N] all the same."""
    size = float(np.linalg.norm(push[start:stop].mean(0)))
    still = f"measured {size:.2g} N, as of its gripper's weight; nobody's wrench is used"
    if start == 0 and stop < len(part):
        text = f"'{name}' took hold of the payload at {part.time[stop]:.2f} s of '{part.name}'"
        return Finding.of("robot-joined", f"{text} and until then {still} before.")
    if start == 0:
        return Finding.of("robot-left", f"'{name}' held nothing during all of '{part.name}' and {still} meanwhile.")
    until = "" if stop == len(part) else f" until {part.time[stop]:.2f} s"
    what = f"'{name}' let go of the payload at {part.time[start]:.2f} s of '{part.name}'{until}"
    return Finding.of("robot-left", f"{what} and {still} meanwhile.")
