"""The rows in which the robot alone held one body, where something else may spoil the log as a whole.

A sensor that is turned, gains that differ or positions of another point than S make a wrench that does not fit one body
in some of the time, as a hand does. Contact is what is left of it once they are put right.
"""

from __future__ import annotations

from steelyard.check import Mask
from steelyard.findings import Finding
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.sanity.fitted.full_fit import force_left
from steelyard.sanity.fitted.misplaced import misplaced
from steelyard.sanity.fitted.sensor_matrix import in_world, sensor_matrix
from steelyard.sanity.holding.contact import untouched

# A hand passes for a sensor that is turned or unlike: put right, one body leaves then more of the forces than this many
# times what it leaves of the time without the hand.
WORSE = 2.0


def one_body(
    log: MotionLog, recording: Recording, with_bias: bool, drift: bool = False
) -> tuple[Mask, tuple[Finding, ...]]:
    """Return the rows (N,) in which the robot alone held one body, and what was found in the others.

    with_bias, drift  whether a wrench bias is free, and whether it may grow with time
    """
    kept, touched = untouched(log, with_bias)
    if not touched:
        return kept, touched
    right = _put_right(log, recording, drift)
    if right is log:
        return kept, touched
    more, still_touched = untouched(right, with_bias)
    if more.sum() < kept.sum() or force_left(right.rows(more)) > WORSE * force_left(log.rows(kept)):
        return kept, touched
    return more, still_touched


def _put_right(log: MotionLog, recording: Recording, drift: bool) -> MotionLog:
    """Return the log without what spoils all of it beyond doubt; the same log where nothing does.

    A point where only a wrong unit or sign puts it serves as well: with it, one body explains all rows.
    """
    stream, sensor = recording.stream_of("force"), sensor_matrix(log, drift)
    turns = stream is not None and not in_world(stream)
    if sensor is not None and (sensor.unlike or (turns and sensor.turned)):
        log = sensor.put_right(log)
    place = misplaced(log, drift)
    return place.put_right(log) if place is not None and place.seen else log
