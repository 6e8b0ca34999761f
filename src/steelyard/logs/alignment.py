"""Alignment: raw streams on their own clocks and frames become one MotionLog on the wrench clock, in S."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadDescription, CannotAnswer
from steelyard.findings import Finding, counted
from steelyard.logs import alignment_findings as say
from steelyard.logs import clock_jumps, clock_rates, jumped_stamps
from steelyard.logs.bandwidth import rigid_up_to
from steelyard.logs.clock import sampling_rate
from steelyard.logs.clock_jumps import ClockJump
from steelyard.logs.conditioning import noise_left, noise_std, signal
from steelyard.logs.delays import Clocks, Question, scan
from steelyard.logs.felt import Felt
from steelyard.logs.imu import Mounting
from steelyard.logs.intervals import inside, merged
from steelyard.logs.joint_fit import refine
from steelyard.logs.jumped_stamps import Placed
from steelyard.logs.kinematics import Motion
from steelyard.logs.log import MotionLog
from steelyard.logs.noise import classes, levels
from steelyard.logs.outliers import bursts
from steelyard.logs.prepared import AlignOptions, Prepared, prepared
from steelyard.logs.recording import Recording
from steelyard.logs.steady import with_steady_stamps
from steelyard.logs.stillness import pose_numbers, still_rows
from steelyard.logs.untimed import NO_GRAVITY, align_tables
from steelyard.spatial import Rotation

_FIT_ROWS = 6000
_FEWEST_ROWS = 12
# [s] No delay beyond the first, nor beyond a tenth of the log, is looked for; one below the second, or below so many of
# its standard deviations, counts as none: loads of 50 g reach four without any.
_LONGEST_DELAY_S, _SMALLEST_DELAY_S, _SURE = 0.25, 0.5e-3, 5.0
_INTERPOLATION = 0.01  # of a sampling step
# So often clocks that jump or run fast are put right, and what a clock jumped by is found anew.
_MOST_UNSTEADY, _JUMP_ROUNDS = 4, 2


@dataclass(frozen=True, eq=False)
class Aligned:
    """One log on one clock, and what was found on the way.

    log            the rows, in S, wrench as applied to the object
    delays_s       stream -> its stamps are late by this much against the wrench clock [s], given or found
    delays_std_s   stream -> standard deviation [s], 0 where given
    rotation       (N,) S to W at the rows, None without
    position       (N, 3) [m] of the origin of S in W, None without
    mounts         stream -> how its accelerometer sits on S
    acceleration_from   "linear_acceleration", "linear_velocity", "position", "specific_force" or "none"
    left_out       (K, 2) [s] intervals on the wrench clock that were left out
    notes          what the data could not tell, in words
    """

    log: MotionLog
    delays_s: Mapping[str, float] = field(default_factory=dict)
    delays_std_s: Mapping[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    rotation: Rotation | None = None
    mounts: Mapping[str, Mounting] = field(default_factory=dict)
    acceleration_from: str = "none"
    left_out: Array = field(default_factory=lambda: np.zeros((0, 2)))
    notes: tuple[str, ...] = ()
    position: Array | None = None

    @property
    def wrench_late_s(self) -> float:
        """How late the wrench is beside the stream that it is latest beside [s]; zero where it is none."""
        return max(0.0, -min(self.delays_s.values(), default=0.0))


def align(recording: Recording, options: AlignOptions | None = None) -> Aligned:
    """Return the recording on one clock, in S, with delays and mounts found where they were not given.

    Raises BadDescription where the wrench or the direction of gravity is missing or rows cannot be matched,
    and CannotAnswer where the streams share too little time.
    """
    timed = [s for s in recording.streams if s.time is not None and not s.poses]
    if not timed:
        log, rotation, findings, source = align_tables(recording)
        findings = (*findings, *say.planar_finding(log.gravity))
        return Aligned(log, findings=findings, rotation=rotation, acceleration_from=source)
    if len(timed) < len(recording.streams):
        other = next(s for s in recording.streams if s not in timed)
        raise BadDescription(f"'{other.name}' has no time, but '{timed[0].name}' has: all streams need a clock.")
    steady, notes = with_steady_stamps(recording)
    aligned = _align_timed(prepared(steady, options or AlignOptions()), unsteady=_MOST_UNSTEADY)
    return replace(aligned, notes=(*notes, *aligned.notes))


def _align_timed(given: Prepared, unsteady: int = 0, jumped: tuple[Placed, ...] = ()) -> Aligned:
    """Find clocks and mounts on rows without taps, then make the log.

    unsteady  how often clocks may be put right yet
    jumped    jumps that were put right
    """
    taps = _taps(given)
    time, felt = _rows(given)
    touched = inside(time, taps)
    alone = ~touched & ~given.in_hands(time)
    straight = felt.rows(alone).turned_back(given.options.turn)
    clocks, delayed = _clocks(given, time[alone], straight)
    steadier = _steadier(given, _question(given, time[alone], straight, clocks.delays_s), clocks, unsteady, jumped)
    if steadier is not None:
        return steadier
    rigid = _rigid(given, time[alone], felt.rows(alone), clocks)
    if rigid is not None:
        lower = _align_timed(prepared(given.recording, replace(given.options, cutoff_hz=rigid)), jumped=jumped)
        return replace(lower, notes=(*lower.notes, say.swings(rigid)))
    kept = ~touched & given.covered(time, clocks.delays_s)
    if kept.sum() < _FEWEST_ROWS:
        raise CannotAnswer(f"only {counted(int(kept.sum()), 'row')} left after alignment; record a longer stretch.")
    log, motion = _log(given, time[kept], felt.rows(kept), clocks)
    findings = (
        *say.jump_findings(jumped, float(given.clock[0])),
        *say.delay_findings(clocks, delayed, given.felt.stream, given.recording.streams),
        *say.mount_findings(given.imu, clocks.mounting),
        *say.planar_finding(log.gravity),
        *say.tap_findings(taps, float(given.clock[0]), int(touched.sum()), len(time)),
    )
    return Aligned(
        log,
        clocks.delays_s,
        clocks.delays_std_s,
        findings,
        motion.rotation,
        {} if given.imu is None or clocks.mounting is None else {given.imu.name: clocks.mounting},
        given.source,
        taps,
        (*say.gaps(given.recording.streams, jumped), *say.notes(clocks, given.source)),
        motion.position,
    )


def _taps(given: Prepared) -> Array:
    """Return the intervals (K, 2) of taps on the wrench clock, as wide as the low-pass smears them."""
    margin = 0.03 if given.cutoff is None else max(0.03, 1.5 / given.cutoff)
    # Delays are not known yet: a tap is far quicker than what they turn.
    wrench = given.wrench(given.known)
    found = [bursts(given.clock, part, margin) for part in (wrench[:, :3], wrench[:, 3:])]
    for stream, _, values in given.recording.channels("specific_force") if given.imu is not None else ():
        found.append(bursts(stream.stamps - given.known.get(stream.name, 0.0), values, margin))
    return merged(*found)


def _rows(given: Prepared) -> tuple[Array, Felt]:
    """Return the common clock (M,) and the wrench there: low-passed, thinned to what passes."""
    every = 1
    if given.cutoff is not None:
        every = max(int(sampling_rate(given.clock) / (2.5 * given.cutoff)), 1)
        every = min(every, len(given.clock))
    time = given.clock[every // 2 :: every]
    spans = list(given.spans().values())
    start = max((s for s, _ in spans), default=float(time[0]))
    end = min((e for _, e in spans), default=float(time[-1]))
    shared = (time >= start - _LONGEST_DELAY_S) & (time <= end + _LONGEST_DELAY_S)
    if start > end or not shared.any():
        raise CannotAnswer(
            "the streams share no time: "
            f"the wrench runs from {given.clock[0]:.13g} to {given.clock[-1]:.13g} s, "
            f"the others together from {start:.13g} to {end:.13g} s. "
            "Check the time units and that all are of one run. Clocks of separate files that count from different "
            "moments are brought together only where the force turns with the poses: check the rotation, its form and "
            "unit, and the mount of the wrench, too."
        )
    if shared.sum() < _FEWEST_ROWS:
        first, last = max(start, float(given.clock[0])), min(end, float(given.clock[-1]))
        raise CannotAnswer(
            f"the streams share {max(last - first, 0.0):.3g} s ({int(shared.sum())} rows after the low-pass), too "
            f"short a time to tell how the sensor moved; at least {_FEWEST_ROWS} rows are needed. Check the time "
            "units, or record longer."
        )
    values = signal(given.clock, given.felt.values, given.cutoff).at(time[shared])
    return time[shared], replace(given.felt, values=values)


def _clocks(given: Prepared, time: Array, felt: Felt) -> tuple[Clocks, tuple[str, ...]]:
    """Return the joint fit and the streams that are late; a delay that is not significant is set to none."""
    reach = min(_LONGEST_DELAY_S, 0.1 * float(time[-1] - time[0]))
    question = _question(given, time, felt, given.known, reach if given.unknown else 0.0)
    if (shared := len(question.time)) < _FEWEST_ROWS:
        raise CannotAnswer(f"the streams share only {counted(shared, 'row')} in time; record a longer stretch on all.")
    question = question.rows(np.arange(0, shared, max(shared // _FIT_ROWS, 1)))
    clocks = refine(question, {**given.known, **scan(question)})
    clocks = replace(clocks, delays_std_s=_with_interpolation(given, clocks.delays_std_s))
    late = given.unknown
    while True:
        # A delay must stay significant in the fit that is told of in the end.
        stds = clocks.delays_std_s
        sure = tuple(n for n in late if abs(clocks.delays_s[n]) > max(_SMALLEST_DELAY_S, _SURE * stds[n]))
        if sure == late:
            return clocks, late
        late, none = sure, {n: 0.0 for n in given.unknown if n not in sure}
        fixed = replace(question, unknown=late, known={**given.known, **none}, _cache={})
        again = refine(fixed, {**clocks.delays_s, **none})
        found = _with_interpolation(given, again.delays_std_s)
        clocks = replace(again, delays_std_s={**clocks.delays_std_s, **{n: found[n] for n in late}})


def _question(given: Prepared, time: Array, felt: Felt, delays: Mapping[str, float], reach: float = 0.0) -> Question:
    """Return what is asked of clocks by the rows that every stream covers, be it late by up to `reach` [s] besides."""
    ok = given.covered(time, delays, reach)
    return Question(time[ok], felt.rows(ok), given.kinematics, given.imu, given.unknown, given.known, reach)


def _steadier(
    given: Prepared, question: Question, clocks: Clocks, unsteady: int, jumped: tuple[Placed, ...]
) -> Aligned | None:
    """Return the log with clocks put right that jump or run fast; None where none does, or may be put right yet."""
    if len(question.time) < _FEWEST_ROWS or not unsteady:
        return None
    if jumps := clock_jumps.clock_jumps(question, clocks.delays_s):
        recording, placed = _jumps_put_right(given, jumps, clocks.delays_s)
        jumped = jumped_stamps.together((*jumped, *placed))
        return _align_timed(prepared(recording, given.options), unsteady - 1, jumped)
    if rates := clock_rates.clock_rates(question, clocks.delays_s):
        right = _align_timed(prepared(clock_rates.put_right(given.recording, rates), given.options), jumped=jumped)
        return replace(right, findings=(*say.rate_findings(rates), *right.findings))
    return None


def _jumps_put_right(
    given: Prepared, jumps: Mapping[str, ClockJump], delays: Mapping[str, float]
) -> tuple[Recording, tuple[Placed, ...]]:
    """Return the recording with clocks put right that jump; sizes are found anew, since motion is smooth then."""
    wrench, late = given.felt.stream, {**delays, **{name: jump.late for name, jump in jumps.items()}}
    recording, placed = jumped_stamps.put_right(given.recording, jumps, wrench)
    for _ in range(_JUMP_ROUNDS):
        again = prepared(recording, given.options)
        time, felt = _rows(again)
        calm = ~inside(time, _taps(again)) & ~again.in_hands(time)
        question = _question(again, time[calm], felt.rows(calm).turned_back(given.options.turn), late)
        if len(question.time) < _FEWEST_ROWS:
            break
        more = jumped_stamps.still_jumping(question, late, placed, wrench)
        recording = jumped_stamps.moved(recording, more)
        placed = jumped_stamps.together((*placed, *more))
    return recording, placed


def _rigid(given: Prepared, time: Array, felt: Felt, clocks: Clocks) -> float | None:
    """Return the low-pass [Hz] that poses need beside a structure that swings; an accelerometer swings with it."""
    ok = given.covered(time, clocks.delays_s)
    if given.cutoff is None or given.imu is not None or not given.kinematics.differentiates or ok.sum() < _FEWEST_ROWS:
        return None
    motion = given.kinematics.at(time[ok], clocks.delays_s)
    return rigid_up_to(sampling_rate(time), given.cutoff, felt.rows(ok).in_sensor(motion.rotation), motion)


def _with_interpolation(given: Prepared, stds: Mapping[str, float]) -> dict[str, float]:
    """Return standard deviations that allow for interpolation: a hundredth of a stream's step."""
    steps = {s.name: 1 / sampling_rate(s.stamps) for s in given.recording.streams}
    return {n: float(np.hypot(v, _INTERPOLATION * steps[n])) if v > 0 else v for n, v in stds.items()}


def _log(given: Prepared, time: Array, felt: Felt, clocks: Clocks) -> tuple[MotionLog, Motion]:
    """Return the log with its still rows, poses and noise."""
    motion = given.kinematics.at(time, clocks.delays_s)
    wrench = felt.in_sensor(motion.rotation)
    gravity, acceleration, variance = motion.gravity, motion.acceleration, motion.acceleration_variance
    within = given.kinematics.within
    if given.imu is not None and clocks.mounting is not None:
        raw = given.imu.signal.at(time + clocks.delays_s.get(given.imu.name, 0.0))
        own = clocks.mounting.at_sensor(raw, motion.omega, motion.alpha)
        if gravity is None:
            # As an accelerometer alone tells it: what it shows below 1 Hz.
            gravity = -signal(time, own, min(1.0, 0.3 * sampling_rate(time))).at(time)
        acceleration = own + gravity
        arm = float(clocks.mounting.position @ clocks.mounting.position)
        variance, within = given.imu.noise_std**2 + arm * motion.alpha_variance, (within[0], 1.0)
    if gravity is None:
        raise BadDescription(NO_GRAVITY)
    bare = MotionLog(wrench, gravity, acceleration, motion.omega, motion.alpha)
    turning = motion.rotation is not None or "angular_velocity" in given.kinematics.channels
    still = still_rows(time, motion.omega, motion.velocity, wrench, turning)
    index = classes(still, motion.alpha_variance)
    residual = wrench - bare.predicted(clocks.body)
    noise = levels(
        index, motion.alpha_variance, variance, residual - np.median(residual, 0), clocks.body,
        noise_std(given.wrench(clocks.delays_s)) ** 2 * noise_left(given.cutoff, sampling_rate(given.clock)),
        given.recording.noise, within,
    )  # fmt: skip
    pose, dead = pose_numbers(time, still), np.array(felt.dead)
    return replace(bare, time=time, still=still, pose=pose, noise_class=index, noise=noise, dead=dead), motion
