"""Delays between streams: the question, and a first answer by scanning.

The wrench decides, not a comparison of an accelerometer with orientations: the unknown acceleration of S
would pass for a delay there. Every clock is first scanned by linear fits that know nothing of mounts or
bodies; `joint_fit` then refines delays, mount, lever arm, bias and body together.
Source: Atkeson, An, Hollerbach 1986 (the wrench is linear in ten parameters).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from steelyard.check import Array, Integers
from steelyard.logs.felt import Felt
from steelyard.logs.imu import Imu, Mounting
from steelyard.logs.kinematics import Delays, Kinematics, Motion
from steelyard.logs.runs import picked

_SCANNED = 3000  # rows that are enough to tell a first delay
_LAG_S = 0.004  # between lags that are tried
_COARSELY = 3  # every so many first: what is left hardly changes over 12 ms but at the true lag


@dataclass(frozen=True, eq=False)
class Clocks:
    """What the joint fit found.

    delays_s, delays_std_s   of every stream but the wrench's; std 0 where given
    mounting                 of the accelerometer, None without one
    body                     (10,) parameters of the fit, not the answer
    residual                 (N, 6) of the wrench at the rows given
    """

    delays_s: dict[str, float]
    delays_std_s: dict[str, float]
    mounting: Mounting | None
    body: Array
    residual: Array


@dataclass(frozen=True, eq=False)
class Question:
    """Everything the fit needs: rows on the wrench clock and the other streams as functions of their own time.

    time (N,), felt (N,) the wrench on the object; unknown = streams whose delay is sought, up to `max_delay_s` [s];
    known = the other delays [s]
    """

    time: Array
    felt: Felt
    kinematics: Kinematics
    imu: Imu | None
    unknown: tuple[str, ...]
    known: Mapping[str, float]
    max_delay_s: float
    _cache: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False)

    @property
    def others(self) -> tuple[str, ...]:
        """The streams whose delay is sought, but for the wrench's own: their clocks may part from it."""
        return tuple(n for n in self.unknown if n != self.felt.stream)

    def rows(self, chosen: Integers) -> Question:
        """Return the question with some of its rows."""
        return replace(self, time=self.time[chosen], felt=self.felt.rows(chosen), _cache={})

    def thinned(self, most: int) -> Question:
        """Return the question with at most so many of its rows, evenly taken."""
        return self.rows(picked(len(self.time), most))

    def seen(self, delays: Mapping[str, float]) -> tuple[Motion, Array, Array | None]:
        """Return motion, wrench (N, 6) in S and raw specific force (N, 3) at the rows, for these delays.

        What was given in W is turned by the rotation that the delays make of the rows.
        """
        motion, wrench = self._once(self._moved, delays, self.kinematics.streams)
        return motion, wrench, self._once(self._shown, delays, () if self.imu is None else (self.imu.name,))

    def seen_anew(self, delays: Delays) -> tuple[Motion, Array, Array | None]:
        """Return what `seen` does, for delays that may be others in each row (N,)."""
        return *self._moved(delays), self._shown(delays)

    def _once(self, asked: Callable[[Delays], Any], delays: Mapping[str, float], streams: tuple[str, ...]) -> Any:
        """Return what is asked, which the delays of these streams alone decide: worked out once for each."""
        key = (asked.__name__, *(delays[n] for n in self.unknown if n in streams))
        if key not in self._cache:
            if len(self._cache) > 64:
                self._cache.clear()
            self._cache[key] = asked(delays)
        return self._cache[key]

    def _moved(self, delays: Delays) -> tuple[Motion, Array]:
        motion = self.kinematics.at(self.time, delays)
        return motion, self.felt.in_sensor(motion.rotation)

    def _shown(self, delays: Delays) -> Array | None:
        return None if self.imu is None else self.imu.signal.at(self.time + delays.get(self.imu.name, 0.0))


def scan(question: Question) -> dict[str, float]:
    """Return a first delay [s] for every unknown stream: the lag at which linear fits leave least.

    The accelerometer's is told by the wrench; the others' by the wrench and the accelerometer.
    """
    delays = {**question.known, **dict.fromkeys(question.unknown, 0.0)}
    for name in sorted(question.unknown, key=lambda n: question.imu is None or n != question.imu.name):
        delays[name] = _best_lag(question.thinned(_SCANNED), delays, name)
    return {n: delays[n] for n in question.unknown}


def _best_lag(question: Question, delays: Mapping[str, float], name: str) -> float:
    """Return the lag [s] of a stream at which linear fits leave least: tried coarsely, then about the two best."""
    grid = np.arange(-question.max_delay_s, question.max_delay_s + 1e-9, _LAG_S)
    cost = np.full(len(grid), np.inf)

    def look(places: range) -> None:
        for k in places:
            if np.isinf(cost[k]):
                cost[k] = _scan_cost(question, {**delays, name: float(grid[k])}, name)

    look(range(0, len(grid), _COARSELY))
    for k in np.argsort(cost)[:2].tolist():
        look(range(max(k - _COARSELY + 1, 0), min(k + _COARSELY, len(grid))))
    return float(grid[np.lexsort((np.abs(grid), cost))[0]])  # ties go to no delay


def _scan_cost(question: Question, delays: Mapping[str, float], name: str) -> float:
    """Return the profile likelihood cost of free linear fits of the six channels."""
    motion, wrench, force = question.seen(delays)
    own = force is not None and question.imu is not None and name == question.imu.name
    chosen = [np.ones((len(force), 1)), force] if own and force is not None else features(motion, None)
    values = wrench[:, ~np.array(question.felt.dead)]
    if force is not None and not own and motion.gravity is not None:
        # The accelerometer feels gravity turn as well, and no hand on the object disturbs it.
        values = np.concatenate([values, force], 1)
    return _log_share(values, chosen)


def _log_share(values: Array, chosen: list[Array]) -> float:
    """Return the sum of the logs of what free linear fits leave of the channels' variance."""
    left = (free_residual(values, chosen) ** 2).mean(0) / (values.var(0) + 1e-30)
    return float(np.log(left + 1e-9).sum())


def features(motion: Motion, force: Array | None) -> list[Array]:
    """Return what a body's wrench is linear in, each (N, k), with a constant: a - g [m/s^2], by the
    accelerometer's `force` (N, 3) if given, and turning.
    """
    columns = [np.ones((len(motion.omega), 1)), *turning(motion)]
    if force is not None:
        return [*columns, force]
    columns += [motion.gravity] if motion.gravity is not None else []
    return columns + ([motion.acceleration] if motion.measured else [])


def turning(motion: Motion) -> list[Array]:
    """Return what the turning of a body adds linearly: alpha (N, 3) and the products of omega (N, 6)."""
    w = motion.omega
    return [motion.alpha, w[:, [0, 0, 0, 1, 1, 2]] * w[:, [0, 1, 2, 1, 2, 2]]]


def free_residual(values: Array, features: list[Array]) -> Array:
    """Return what a free linear fit of `values` (N, k) leaves over."""
    X = np.concatenate(features, 1)
    X = X / np.maximum(np.abs(X).max(0), 1e-12)
    normal = X.T @ X + 1e-9 * len(X) * np.eye(X.shape[1])
    return np.asarray(values - X @ np.linalg.solve(normal, X.T @ values))
