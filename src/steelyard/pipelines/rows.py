"""From a recording to the rows that are fitted: aligned, those whose motion is known, and that nobody touched.

Where the poses turn out to be of another point than S, all is done anew for that point: delays and contact hang on it.
A sensor that is turned looks like a delay, too: then delays are found anew without the turn. A hand spoils delays as
well: then they are found anew without its time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, codes
from steelyard.identify.fit import Bias
from steelyard.identify.noise_levels import with_declared, without_dead
from steelyard.logs.alignment import Aligned, align
from steelyard.logs.log import MotionLog
from steelyard.logs.prepared import AlignOptions
from steelyard.logs.recording import Recording
from steelyard.logs.runs import runs
from steelyard.pipelines.known_motion import with_known_acceleration
from steelyard.pipelines.options import Options
from steelyard.sanity.after import rotation_of
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.biases import SeenRoomBias, examine_room_bias
from steelyard.sanity.fitted.full_fit import force_left
from steelyard.sanity.fitted.gravity import FittedGravity, as_levelled
from steelyard.sanity.fitted.misplaced import Misplaced, examine_place, misplaced, of_sensor
from steelyard.sanity.fitted.play import Play, lasts, play
from steelyard.sanity.fitted.sensor_matrix import turn_of
from steelyard.sanity.fitted.tether import Tether, examine_tether
from steelyard.sanity.holding.consensus import FINE
from steelyard.sanity.holding.contact import agreeing
from steelyard.sanity.holding.load_change import small_slip
from steelyard.sanity.one_body import one_body

# How the note begins that says which direction of gravity was used.
GRAVITY_FOUND = "gravity was estimated"
# The point is sought anew with the delays found for it until it moves by less [m].
ROUNDS, SETTLED = 3, 1e-3
# Where the acceleration comes from if an accelerometer gives it.
MEASURED = "specific_force"
# Findings before the fit that say that rows in motion carry another mass than rows at rest.
UNLIKE_ONE_BODY = {"motion-mismatch", "weight-compensated"}
# Stretches of time (start, end) [s].
Spans = tuple[tuple[float, float], ...]
# So often clocks are found anew without the time of a hand.
HANDS = 2
# So often play of the sensor is found, with clocks anew, from so many standard deviations on where it leaves less than
# this share of what lasts a second.
PLAYS, LIKELY, MAYBE = 6, 2.0, 0.7
# A hand may hide where one body leaves more (rms) than this share of the range of the forces. It is there where a part
# of the log, no smaller than that, leaves less than so much of it. Where one was found, clocks without it may leave so
# many times as much.
POOR, LEAST_KEPT, CLEARER, WORSE = 0.03, 1 / 3, 0.3, 2.0


@dataclass(frozen=True, eq=False)
class FitRows:
    """Rows of a recording, ready to be fitted.

    log         the rows
    aligned     what they were taken from
    level       the direction of gravity, where that was asked for
    unmeasured  note on rows that were left out since their acceleration is not known
    touched     findings about time in which a hand or another load spoiled the wrench
    left_out    that time, (start, end) [s] on the wrench clock, where its rows were left out
    place       the point whose positions the recording has, where it is not the origin of S
    maybe       the same where that is not beyond doubt: the rows are those of the origin
    room        a bias that keeps its direction in the room, which the rows are without
    tether      a hose, cable or spring that pulls, without which the rows are
    play        play of the sensor, which the rows are without
    unplayed    rows without play, where what one body leaves may be play as well as a delay
    units       findings that forces and torques do not belong together, where such a point would be no point
    """

    log: MotionLog
    aligned: Aligned
    level: FittedGravity | None
    unmeasured: tuple[str, ...]
    touched: tuple[Finding, ...]
    left_out: Spans = ()
    place: Misplaced | None = None
    maybe: Misplaced | None = None
    units: tuple[Finding, ...] = ()
    room: SeenRoomBias | None = None
    tether: Tether | None = None
    play: Play | None = None
    unplayed: MotionLog | None = None

    @property
    def kept(self) -> float:
        """The share of the aligned rows that is fitted."""
        return len(self.log) / max(len(self.aligned.log), 1)

    @property
    def whole(self) -> MotionLog:
        """All aligned rows, without the pull of a hose, or a bias that stays put in the room."""
        log = self.aligned.log
        if self.tether is not None:
            return self.tether.put_right(log, self.aligned)
        if self.room is None or self.aligned.rotation is None:
            return log
        return self.room.put_right(log, self.aligned.rotation.matrix)

    @property
    def causes(self) -> tuple[Misplaced | SeenRoomBias | Tether | Play, ...]:
        """What spoiled the whole log, and was put right."""
        return tuple(cause for cause in (self.place, self.room, self.tether, self.play) if cause is not None)

    @property
    def delayed(self) -> bool:
        """Whether a delay was found."""
        return any(f.code == "stream-delayed" for f in self.aligned.findings)

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say about gravity and about rows whose acceleration is not known."""
        if self.level is None:
            return self.unmeasured
        return (f"{GRAVITY_FOUND} {self.level.words} off the direction given", *self.unmeasured)


@dataclass(frozen=True, eq=False)
class Reading:
    """A recording, what was found in it as it was read, and what the caller chose."""

    recording: Recording
    before: tuple[Finding, ...]
    options: Options

    @property
    def left_in(self) -> bool:
        """Whether the cause of a finding was left in: then nothing fits one body."""
        return any(f.left_in for f in self.before)

    @property
    def unlike_one_body(self) -> bool:
        """Whether rows in motion carry another mass than rows at rest."""
        return bool(codes(self.before) & UNLIKE_ONE_BODY)

    def rows_to_fit(self) -> FitRows:
        """Return the rows that are fitted."""
        how, drift = AlignOptions(), self.options.drift
        rows = self._rows(how)
        if rows.unmeasured:
            return rows
        place, units = examine_place(rows.log, self.before, drift)
        if units:
            return replace(rows, units=units)
        if place is not None:
            place = replace(place, measured=rows.aligned.acceleration_from == MEASURED)
        if place is not None and not place.seen:
            rows = replace(rows, maybe=place)
        elif place is not None:
            rows, how = self._placed(place)
        if rows.delayed and (turn := turn_of(rows.log, self.recording, self.before, drift)) is not None:
            rows = replace(self._rows(replace(how, turn=turn)), place=rows.place, maybe=rows.maybe)
        return rows

    def without_play(self) -> tuple[Recording, FitRows]:
        """Return recording and rows without play of the sensor, with delays that it passed for found anew."""
        rows = self.rows_to_fit()
        try:
            found = self._play(rows)
            return (self.recording, rows) if found is None else self._by_turns(rows, found)
        except CannotAnswer:  # with other clocks, or without such play, too little is left: there is none
            return self.recording, rows

    def _by_turns(self, rows: FitRows, found: Play) -> tuple[Recording, FitRows]:
        """Return recording and rows without play, sought from `found` on by turns with delays; else as they are."""
        drift = self.options.drift
        for _ in range(PLAYS):
            right = replace(self, recording=found.put_right(self.recording))
            again = right.rows_to_fit()
            log = found.back(again.log)
            now = play(log, found.back(again.aligned.log), self.recording, drift)
            if now is None:
                break
            if now.like(found):
                if not now.told(log, drift):
                    break
                if now.clear(lasts(rows.log, drift)):
                    return right.recording, replace(again, play=now)
                return self.recording, replace(rows, unplayed=again.log)
            found = now
        return self.recording, rows

    def _play(self, rows: FitRows) -> Play | None:
        """Return the play that rows may show; None where they show none, or may not be judged."""
        drift = self.options.drift
        if rows.unmeasured or self.left_in or stands_aside("room bias", self.before):
            return None
        found = play(rows.log, rows.aligned.log, self.recording, drift)
        if found is None or found.times < LIKELY or found.slowly > MAYBE * lasts(rows.log, drift):
            return None
        return found

    def _placed(self, place: Misplaced) -> tuple[FitRows, AlignOptions]:
        """Return the rows with accelerations of S, where they were of another point, and how they were aligned.

        The point told is the one that the rows were made with: what they still show beside it widens its bars.
        """
        for left in reversed(range(ROUNDS)):
            x, y, z = (float(v) for v in place.place)
            how = AlignOptions(place=(x, y, z))
            rows = self._rows(how)
            rest = misplaced(rows.log, self.options.drift)
            if rest is None or np.linalg.norm(rest.place) < SETTLED:
                break
            if not left:
                place = replace(place, std=np.hypot(place.std, rest.place))
                break
            place = replace(place, place=place.place + rest.place, std=rest.std)
        return replace(rows, place=place), how

    def _rows(self, how: AlignOptions) -> FitRows:
        """Return the rows to fit, aligned as said; where a hand touched the object, the rest alone tells the clocks.

        A strong hand draws delays so far off that the wrong time, or none, seems free of it: what agrees with clocks as
        stamped is tried, too, and the time counts in which one body explains most, and best.
        """
        rows = self._as_aligned(how)
        left = force_left(rows.log)
        poor = rows.left_out or left > POOR * np.ptp(rows.log.wrench[:, 3:])
        misread = self.left_in or self.unlike_one_body
        if rows.unmeasured or misread or not poor or not any(rows.aligned.delays_std_s.values()):
            return rows
        stamped, _ = self._aligned(replace(how, estimate_delays=False))
        agree = _times_of(stamped.log, agreeing(stamped.log, self.options.bias == "free"))
        enough = (WORSE if rows.left_out else CLEARER) * left
        found: list[FitRows] = []
        hands = {rows.left_out, agree} - {()}
        for _ in range(HANDS):
            for hand in sorted(hands):
                try:
                    again = self._as_aligned(replace(how, touched=hand))
                except CannotAnswer:
                    continue  # too little is left for clocks: what all rows say stands
                if again.left_out and again.kept > LEAST_KEPT and force_left(again.log) < enough:
                    found.append(again)
            hands = {min(found, key=_cost).left_out} - hands if found else set()
        return min(found, key=_cost, default=rows)

    def _as_aligned(self, how: AlignOptions) -> FitRows:
        """Return the rows to fit, aligned as said, without the pull of a hose, or a bias that stays put in the room.

        Either looks like a hand in some poses: whether there is one shows without it.
        """
        aligned, level = self._aligned(how)
        log, unmeasured = with_known_acceleration(aligned.log, aligned, "motion-mismatch" in codes(self.before))
        rows = self._held(FitRows(log, aligned, level, unmeasured, ()))
        tether, rotation = self._tether(rows, log), rotation_of(log, aligned)
        if tether is not None:
            whole = FitRows(tether.put_right(log, aligned), aligned, level, unmeasured, ())
            return replace(self._held(whole), tether=tether)
        room = self._room_bias(rows, log)
        if room is None or rotation is None:
            return rows
        whole = FitRows(room.put_right(log, rotation), aligned, level, unmeasured, ())
        return replace(self._held(whole), room=room)

    def _tether(self, rows: FitRows, log: MotionLog) -> Tether | None:
        """Return what pulls as a hose does in the rows kept, or in all of `log`; else None."""
        if self.options.gravity != "given" or rows.unmeasured or self.left_in:
            return None
        recording, drift = self.recording, self.options.drift
        turned = "wrench-sign-flipped" in codes(self.before) or not recording.sign_said
        some = (rows.log, without_dead(with_declared(log, recording.noise)))[: 1 + bool(rows.touched)]
        found = (examine_tether(each, rows.aligned, recording.gravity, turned, drift) for each in some)
        return next((tether for tether in found if tether is not None), None)

    def _room_bias(self, rows: FitRows, log: MotionLog) -> SeenRoomBias | None:
        """Return the bias that keeps its direction in the room in the rows kept, or in all of `log`; else None."""
        if self.options.gravity != "given" or stands_aside("room bias", self.before) or self.left_in:
            return None
        bias, recording = Bias(self.options.bias, drift=self.options.drift), self.recording
        # Noise that aligning judged with the bias in is not kept.
        everything = without_dead(with_declared(log, recording.noise))
        for some in (rows.log, everything)[: 1 + bool(rows.touched)]:
            rotation = rotation_of(some, rows.aligned)
            found = examine_room_bias(some, rotation, recording.gravity, recording.wrench_sign, bias)
            if found is not None:
                return found
        return None

    def _held(self, rows: FitRows) -> FitRows:
        """Return the rows in which the robot alone held one body, and findings about the others."""
        log, recording, options = rows.log, self.recording, self.options
        keep: slice | Mask = slice(None)
        touched: tuple[Finding, ...] = ()
        # Where a cause is left in, rows that are left out as touched would be chance.
        whole = not rows.unmeasured and not self.left_in
        if whole:
            keep, touched = one_body(since_start(log, recording), recording, options.bias == "free", options.drift)
        if self.unlike_one_body:
            touched = ()  # moving rows carry another mass, and only look touched
        left_out = _times_of(log, keep)
        log = without_dead(with_declared(log.rows(keep), recording.noise))
        if whole and not touched:
            since = since_start(log, recording)
            slip = small_slip(since, rotation_of(log, rows.aligned), recording.gravity)
            if slip is not None:
                keep, finding = slip.longer_side(since)
                log, touched = log.rows(keep), (finding,)
        return replace(rows, log=log, touched=touched, left_out=left_out)

    def _aligned(self, how: AlignOptions) -> tuple[Aligned, FittedGravity | None]:
        """Return the recording aligned, with accelerations of S, and the direction of gravity where that was asked for.

        Aligning takes the accelerations of poses to S; those of an accelerometer or a table come as they are.
        """
        aligned = align(self.recording, how)
        if any(how.place) and (aligned.acceleration_from == MEASURED or aligned.log.time is None):
            aligned = replace(aligned, log=of_sensor(aligned.log, np.array(how.place)))
        return (aligned, None) if self.options.gravity == "given" else as_levelled(aligned, self.recording.gravity)


def _cost(rows: FitRows) -> float:
    """Return the log of what one body leaves, and a fine on the time left out."""
    return float(np.log(max(force_left(rows.log), 1e-12))) - FINE * rows.kept


def _times_of(log: MotionLog, keep: slice | Mask) -> Spans:
    """Return the stretches of rows that are not kept, without end beyond the log: delays move what it covers."""
    if log.time is None or isinstance(keep, slice):
        return ()
    time = np.concatenate([[-np.inf], log.time[1:-1], [np.inf]])
    return tuple((float(time[a]), float(time[b - 1])) for a, b in runs(~keep).tolist())


def since_start(log: MotionLog, recording: Recording) -> MotionLog:
    """Return the log with times [s] since the first row of the wrench, as findings tell them."""
    start = next((s.time[0] for s in recording.streams if "force" in s.channels and s.time is not None), 0.0)
    return log if log.time is None else replace(log, time=log.time - start)
