"""TeamLog: what every robot of a team recorded, each on its own clock and in its own frames.

Frames: H, a robot's home frame, still in the world unless its base moves; G, its grasp, fixed to the payload. Robots
share no world frame.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import ClassVar, Literal, TypeVar, get_args

import numpy as np

from steelyard import check
from steelyard.check import Array, Mask
from steelyard.errors import BadDescription, BadValue
from steelyard.logs.team_clock_units import require_one_clock_unit
from steelyard.logs.team_track import Track
from steelyard.spatial import Pose

Kind = Literal["grasp", "still", "motion"]
Base = Literal["still", "moving"]
KINDS: tuple[Kind, ...] = get_args(Kind)
_TURNING = ("rotation", "angular_velocity")
_WRENCH = ("force", "torque")
T = TypeVar("T")

__all__ = ["KINDS", "Base", "Kind", "Mask", "TeamLog", "TeamRecording", "TeamRobot", "Track"]


@dataclass(frozen=True, eq=False)
class TeamRecording:
    """Tracks by robot of one stretch of time.

    kind  "grasp" (free motion), "still" (held at rest) or "motion" (with wrenches)
    away  robots known to hold nothing during the whole recording; others without a track are merely missing

    Raises BadValue where clocks have no time in common and tracks in motion are too short (LONG_S) to show how far they
    are apart.
    """

    LONG_S: ClassVar[float] = 5.0

    kind: Kind
    tracks: Mapping[str, Track]
    name: str = "recording"
    away: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if self.kind not in KINDS:
            raise BadDescription(f"kind of '{self.name}' must be one of {', '.join(KINDS)}; got {self.kind!r}.")
        if not self.tracks:
            raise BadDescription(f"'{self.name}' holds no robot's data; give at least one stream.")
        for name, track in self.tracks.items():
            if not isinstance(track, Track):
                raise BadDescription(
                    f"'{self.name}' needs a Track of each robot: Track.of(time, rotation=.., ..); that of '{name}' is "
                    f"{type(track).__name__}."
                )
        object.__setattr__(self, "tracks", MappingProxyType(dict(self.tracks)))
        object.__setattr__(self, "away", frozenset(self.away))
        require_one_clock_unit(self.name, self.tracks)
        for name, track in self.tracks.items():
            if len(track) > 1:
                check.likely_step(track.step, f"time of '{name}' in '{self.name}'")
        if self.kind != "still" and min(float(t.time[-1] - t.time[0]) for t in self.tracks.values()) < self.LONG_S:
            self.require_overlap()

    def require_overlap(self) -> None:
        """Raise BadValue where the tracks have no time in common."""
        begin, end = self.span
        if len(self.tracks) > 1 and begin > end:
            ranges = "; ".join(f"{n} {t.time[0]:.6g} to {t.time[-1]:.6g} s" for n, t in self.tracks.items())
            raise BadValue(
                f"clocks of '{self.name}' must overlap; they do not: {ranges}. Give stamps of one clock, to within the "
                "offsets that are to be estimated."
            )

    @property
    def span(self) -> tuple[float, float]:
        """First and last stamp [s] that all tracks cover."""
        tracks = self.tracks.values()
        return max(float(t.time[0]) for t in tracks), min(float(t.time[-1]) for t in tracks)

    @property
    def synchronised(self) -> bool:
        """Whether all tracks have the same stamps, to a microsecond."""
        first, *others = self.tracks.values()
        return all(first.stamped_at(track.time) for track in others)

    def carries(self, name: str, time: Array) -> Mask:
        """Return whether a robot holds the payload, or may, at `time` (M,): what its nearest sample says."""
        track = self.tracks.get(name)
        if track is None or track.carrying is None or name in self.away:
            return np.full(len(time), name not in self.away)
        half = 0.5 * track.step if len(track) > 1 else 0.5
        return track.carrying[np.clip(np.searchsorted(track.time, time - half), 0, len(track) - 1)]

    def changed(self, change: Callable[[Track, T], Track], by: Mapping[str, T]) -> TeamRecording:
        """Return the recording with the tracks of the robots in `by` as `change` makes them of what stands there."""
        if not self.tracks.keys() & by.keys():
            return self
        return replace(self, tracks={n: change(t, by[n]) if n in by else t for n, t in self.tracks.items()})


@dataclass(frozen=True, eq=False)
class TeamRobot:
    """A robot of the team.

    gravity  (3,) [m/s^2] in its home frame H; None = not known, so the tilt of the base is to be estimated
    base     "still", so that its poses are in a frame at rest, or "moving", so that only twists can be trusted
    """

    name: str
    gravity: Array | None
    base: Base = "still"

    def __post_init__(self) -> None:
        if not self.name:
            raise BadDescription("each robot needs a name.")
        if self.base not in get_args(Base):
            raise BadDescription(f"base of '{self.name}' must be 'still' or 'moving'; got {self.base!r}.")
        if self.gravity is not None:
            gravity = check.finite(f"gravity of '{self.name}'", self.gravity)
            if gravity.shape != (3,) or not float(np.linalg.norm(gravity)) > 0:
                raise BadValue(f"gravity of '{self.name}' must be three numbers, not all zero; got {gravity.tolist()}.")
            object.__setattr__(self, "gravity", gravity)


@dataclass(frozen=True, eq=False)
class TeamLog:
    """Robots, their recordings and the reference whose grasp frame R the answer is given in.

    gravity_std  relative standard deviation of the length of their gravity: bars of mass and first moment hold it

    Raises BadDescription or BadValue for fewer than two robots, a name used twice, a reference that is not there, a
    robot that measures no rotation, a track of an unknown robot, and where no robot has a wrench.
    """

    robots: tuple[TeamRobot, ...]
    recordings: tuple[TeamRecording, ...]
    reference: str
    gravity_std: float = 0.0

    def __post_init__(self) -> None:
        object.__setattr__(self, "robots", tuple(self.robots))
        object.__setattr__(self, "recordings", tuple(self.recordings))
        names = self.names
        twice = sorted({name for name in names if names.count(name) > 1})
        if twice:
            raise BadDescription(f"each robot must have a name of its own; '{twice[0]}' is used twice.")
        if len(names) < 2:
            raise BadDescription(
                f"a team must have at least two robots; got {len(names)}. For one robot use `steelyard identify`."
            )
        if self.reference not in names:
            raise BadDescription(f"reference must be one of {', '.join(names)}; got '{self.reference}'.")
        if not self.recordings:
            raise BadDescription("a team log needs at least one recording; got none.")
        for recording in self.recordings:
            unknown = sorted((set(recording.tracks) | recording.away) - set(names))
            if unknown:
                raise BadDescription(f"'{recording.name}' names '{unknown[0]}', who is not in the team.")
        self._check_channels()

    def _check_channels(self) -> None:
        for name in self.names:
            tracks = [track for _, track in self.tracks_of(name)]
            if not tracks:
                raise BadDescription(f"'{name}' has no recording; give one, or leave the robot out of the team.")
            if not any(track.has(channel) for track in tracks for channel in _TURNING):
                raise BadValue(
                    f"'{name}' must measure how it turns; none of its recordings has a rotation or an angular velocity."
                )
        for name in self.names:
            if not any(len(recording.tracks) > 1 for recording, _ in self.tracks_of(name)):
                own, others = (self._recordings_with(name, has) for has in (True, False))
                raise BadDescription(
                    f"'{name}' has data in no recording of another robot: it has {own}, others have {others}. "
                    "Recordings of one time must have one name."
                )

    def _recordings_with(self, name: str, has: bool) -> str:
        """Return the names of the recordings in which a robot has data, or in which it has none."""
        return ", ".join(f"'{r.name}'" for r in self.recordings if (name in r.tracks) == has) or "none"

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the robots, in order."""
        return tuple(robot.name for robot in self.robots)

    @property
    def others(self) -> tuple[str, ...]:
        """Names of the robots other than the reference."""
        return tuple(name for name in self.names if name != self.reference)

    def robot(self, name: str) -> TeamRobot:
        """Return the robot of this name."""
        return self.robots[self.names.index(name)]

    def tracks_of(self, name: str) -> Iterator[tuple[TeamRecording, Track]]:
        """Yield every recording in which the robot has data, with its track."""
        for recording in self.recordings:
            if name in recording.tracks:
                yield recording, recording.tracks[name]

    def of_kind(self, kind: Kind) -> tuple[TeamRecording, ...]:
        """Return the recordings that serve as `kind`: those so called, else, since one may serve all, the others.

        Free motion may stand in for motion and the reverse; a still recording is needed for neither.
        """
        named = tuple(r for r in self.recordings if r.kind == kind)
        if named:
            return named
        return tuple(r for r in self.recordings if r.kind != "still")

    def force_only(self, name: str) -> bool:
        """Return whether a passive gimbal carries the robot's grasp: it has forces and no torque, or only zeros."""
        tracks = [track for _, track in self.tracks_of(name) if track.has("force")]
        return bool(tracks) and not any("torque" in t.channels and t.channels["torque"].any() for t in tracks)

    def has_wrench(self, name: str) -> bool:
        """Return whether the robot has measured a force in any recording."""
        return any(track.has("force") for _, track in self.tracks_of(name))

    def with_reference(self, reference: str) -> TeamLog:
        """Return the same log, to be answered in another robot's grasp frame."""
        return replace(self, reference=reference)

    def without_gravity(self, name: str) -> TeamLog:
        """Return the same log, in which this robot does not know where gravity points."""
        robots = tuple(replace(robot, gravity=None) if robot.name == name else robot for robot in self.robots)
        return replace(self, robots=robots)

    def while_holding(self) -> TeamLog:
        """Return the same log without the motion of robots while they are known to hold nothing: it is their own.

        Of one who never holds anything it is all that there is, and stays.
        """
        held = [{n: r.carries(n, t.time) for n, t in r.tracks.items()} for r in self.recordings]
        holders = {n for rows in held for n, mask in rows.items() if mask.any()}
        return self.with_recordings(*(
            r.changed(_moving_only, {n: mask for n, mask in rows.items() if n in holders and not mask.all()})
            for r, rows in zip(self.recordings, held, strict=True)
        ))  # fmt: skip

    def with_recordings(self, *recordings: TeamRecording) -> TeamLog:
        """Return the same team with other recordings."""
        return replace(self, recordings=recordings)

    def renamed(self, names: Mapping[str, str]) -> TeamLog:
        """Return the same log with robots called anew; those not in `names` keep theirs."""

        def new(name: str) -> str:
            return names.get(name, name)

        return replace(
            self,
            robots=tuple(replace(robot, name=new(robot.name)) for robot in self.robots),
            recordings=tuple(
                replace(r, tracks={new(n): t for n, t in r.tracks.items()}, away=frozenset(map(new, r.away)))
                for r in self.recordings
            ),
            reference=new(self.reference),
        )

    def with_homes(self, homes: Mapping[str, Pose]) -> TeamLog:
        """Return the log as recorded with other home frames: X_AH of each new home A; others keep theirs."""
        robots = tuple(_rehomed(robot, homes.get(robot.name)) for robot in self.robots)
        return replace(self, robots=robots, recordings=tuple(r.changed(Track.moved, homes) for r in self.recordings))


def _moving_only(track: Track, rows: Mask) -> Track:
    """Return the track with what it says of motion in these rows (T,) alone."""
    return replace(track, valid={q: mask if q in _WRENCH else mask & rows for q, mask in track.valid.items()})


def _rehomed(robot: TeamRobot, home: Pose | None) -> TeamRobot:
    if home is None or robot.gravity is None:
        return robot
    return replace(robot, gravity=home.rotation.apply(robot.gravity))
