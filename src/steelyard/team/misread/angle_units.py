"""Whether all robots tell angles in one unit: on one payload, in whatever frames, they all turn alike fast."""

from __future__ import annotations

import numpy as np

from steelyard.errors import BadValue
from steelyard.logs.team_log import TeamLog, TeamRecording
from steelyard.team.turns import turning_speed

# Turning so many times as fast as the others, to within this factor, is degrees beside radians.
DEGREES, WITHIN = 180 / np.pi, 2.0
# They must turn in step: least correlation of how fast. Rates are taken over so long [s], in so many places,
# of which so many must be measured by all.
IN_STEP, OVER_S, PLACES, FEWEST = 0.6, 0.05, 200, 50
# Faster than so many times the usual is a jump.
JUMP = 4.0
# Shorter recordings [s] are not judged.
SHORTEST_S = 2.0


def require_one_angle_unit(log: TeamLog) -> None:
    """Raise BadValue where a robot turns 57 times faster or slower than the others, in step with them."""
    for recording in log.recordings:
        if recording.kind != "still":
            _require_one_unit(recording)


def _require_one_unit(recording: TeamRecording) -> None:
    begin, end = recording.span
    if end - begin < SHORTEST_S:
        return
    time = np.linspace(begin, end - OVER_S, PLACES)
    every = {name: turning_speed(track, time, OVER_S) for name, track in recording.tracks.items()}
    rates = {name: speed for name, speed in every.items() if np.isfinite(speed).mean() > 0.5}
    if len(rates) < 2:
        return
    names, speed = list(rates), np.stack(list(rates.values()))
    speed = speed[:, np.isfinite(speed).all(0)]
    if speed.shape[1] < FEWEST:
        return
    # Angles that go round at half a turn jump where they are misread.
    size = np.median(speed, axis=1)
    speed = np.minimum(speed, JUMP * size[:, None])
    middle = int(np.argsort(size)[len(size) // 2])
    for i, name in enumerate(names):
        times = float(size[i]) / max(float(size[middle]), 1e-300)
        if not any(1 / WITHIN < odd / DEGREES < WITHIN for odd in (times, 1 / max(times, 1e-300))):
            continue
        if float(np.corrcoef(speed[i], speed[middle])[0, 1]) > IN_STEP:
            much, looks = ("faster", "degrees read as radians") if times > 1 else ("slower", "radians read as degrees")
            raise BadValue(
                f"'{name}' turns {max(times, 1 / times):.0f} times {much} than '{names[middle]}' in "
                f"'{recording.name}', in step with it: its angles look like {looks}. Set the unit of its "
                '"joint_position", "rotation" or "angular_velocity", or that of the other robot.'
            )
