"""Full fit: ten parameters and a bias by weighted least squares, with room for what a log should not contain.

Extra columns (a drift, a tilt of gravity) are judged by how much they explain and by leaving out stretches of the log.
How well a log shows the motion of its load decides which of them may be judged.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from weakref import WeakKeyDictionary

import numpy as np

from steelyard.check import Array, Integers
from steelyard.identify.cost import left_out
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.inertia.regressor import design, motion_map
from steelyard.logs.drift import SETTLING, STEADILY, settled_course
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import features
from steelyard.logs.noise import mean_heard, robust_std
from steelyard.logs.runs import picked
from steelyard.sanity.lasting import clear, lasting
from steelyard.spatial import cross_matrix

_MOST_ROWS = 3000
_BLOCKS = 12
_SMALLEST = 1e-9
_MEAN_S = 1.0  # of what is slow in a residual
FEWEST_BLOCKS = 6  # stretches: leaving each out in turn tells a spread from so many of them on
CURVED = 0.9  # of what lasts beside a drift in a line: one that settles must leave less
RANK = 1e-9  # of the largest eigenvalue: what is below is not told

# Noise of an acceleration hides what follows it by its share of the variance; so many times that is allowed. Where
# masses and points lie is judged below the second share only.
NOISE, CALM = 3.0, 0.05
_FEWEST_MOVING = 50


@dataclass(frozen=True, eq=False)
class FullFit:
    """Weighted solution of a log.

    solution    (p,) phi (10), bias (6), then the extra columns
    covariance  (p, p) by leaving out stretches
    left        weighted sum of squares, over the same weights for every fit of one `Rows`
    own         how many columns the rows have by themselves: those behind are extra
    """

    solution: Array
    covariance: Array
    left: float
    own: int

    @property
    def phi(self) -> Array:
        """The parameters (10,)."""
        return self.solution[:10]

    @property
    def extra(self) -> Array:
        """What the extra columns (k,) take."""
        return self.solution[self.own :]

    @property
    def extra_covariance(self) -> Array:
        """Covariance (k, k) of that, by leaving out stretches."""
        return self.covariance[self.own :, self.own :]

    @property
    def extra_std(self) -> Array:
        """Standard deviations (k,) of that, by leaving out stretches."""
        return np.asarray(np.sqrt(np.diag(self.extra_covariance)))

    def beside(self, plain: FullFit) -> float:
        """Return the squared residual beside that of a fit without extra columns; what leaves none is not bettered."""
        return self.left / plain.left if plain.left else 1.0


@dataclass(frozen=True, eq=False)
class Rows:
    """A thinned log as a linear problem: columns (N, 6, 16 or 22), values (N, 6), weights (N, 6), block (N,)."""

    log: MotionLog
    columns: Array
    values: Array
    weights: Array
    block: Integers

    @classmethod
    def of(cls, log: MotionLog, drift: bool = False) -> tuple[Rows, Integers]:
        """Return the rows and which rows of the log they are; weights from the residuals of each class of rows.

        drift  whether six more columns let the bias grow with time
        """
        made = _MADE.setdefault(log, {})
        if drift not in made:
            made[drift] = cls._made(log, drift)
        return made[drift]

    @classmethod
    def _made(cls, log: MotionLog, drift: bool) -> tuple[Rows, Integers]:
        pick = picked(len(log), _MOST_ROWS)
        thin = log.rows(pick)
        first = ~thin.dead / np.maximum(thin.wrench.var(0), _SMALLEST)
        weights = np.broadcast_to(first, thin.wrench.shape).copy()
        rows = cls(thin, cls.columns_of(thin), thin.wrench, weights, _blocks(thin))
        if drift:
            rows = replace(rows, columns=np.concatenate([rows.columns, rows.drifting()], 2))
        for _ in range(2):
            rows = replace(rows, weights=_weights(rows, rows.solve().solution))
        return rows, pick

    @staticmethod
    def columns_of(log: MotionLog) -> Array:
        """Return the regressor (N, 6, 16) of parameters and bias."""
        return np.asarray(-np.einsum("pij,nj->nip", design(True), features(log), optimize=True))

    @property
    def split(self) -> bool:
        """Whether they are of stretches enough to tell a spread by leaving each out."""
        return int(self.block.max()) + 1 >= FEWEST_BLOCKS

    def solve(self, extra: Array | None = None, jackknife: bool = False) -> FullFit:
        """Return the solution with extra columns (N, 6, k)."""
        scatter = self._scatter(extra, jackknife)
        total, size = scatter.sum(0), scatter.shape[1] - 1
        solution = left_out.solutions(total[None], RANK, 0.0)[0]
        left = float(total[size, size] - 2 * solution @ total[:size, size] + solution @ total[:size, :size] @ solution)
        covariance = np.zeros((size, size))
        if len(scatter) > 2:
            covariance = left_out.jackknife(left_out.solutions(total - scatter, RANK, 0.0) - solution)
        return FullFit(solution, covariance, max(left, 0.0), self.columns.shape[2])

    def _scatter(self, extra: Array | None, by_block: bool) -> Array:
        """Return products (B, p, p) of weighted columns, extra columns (N, 6, k) and values, by block or of all."""
        weighed, own = self._own
        own = own if by_block else own.sum(0, keepdims=True)
        if extra is None:
            return own
        added, size = self._weighed(extra), self.columns.shape[2]
        rows = self._stretches[1] if by_block else [slice(None)]
        across = np.stack([added[r].T @ weighed[r] for r in rows])
        within = np.stack([added[r].T @ added[r] for r in rows])
        both = np.block([[own, np.swapaxes(across, 1, 2)], [across, within]])
        values_last = np.r_[:size, size + 1 : both.shape[1], size]
        return np.asarray(both.take(values_last, 1).take(values_last, 2))

    @cached_property
    def _own(self) -> tuple[Array, Array]:
        """Weighted columns and values (6 N, p), and their products (B, p, p) by block: every fit has them."""
        weighed = self._weighed(np.concatenate([self.columns, self.values[:, :, None]], 2))
        return weighed, np.stack([weighed[r].T @ weighed[r] for r in self._stretches[1]])

    def _weighed(self, columns: Array) -> Array:
        """Return columns (N, 6, k) by the roots of their weights, block after block, (6 N, k)."""
        weighed, (order, _) = columns * np.sqrt(self.weights)[:, :, None], self._stretches
        return (weighed if order is None else weighed[order]).reshape(-1, columns.shape[2])

    @cached_property
    def _stretches(self) -> tuple[Integers | None, list[slice]]:
        """The order (N,) of rows, block after block, None if they lie so, and each block's place in 6 N lines then."""
        ends = 6 * np.cumsum(np.bincount(self.block))
        sorted_already = bool((np.diff(self.block) >= 0).all())
        order = None if sorted_already else np.argsort(self.block, kind="stable")
        return order, [slice(int(a), int(b)) for a, b in zip((0, *ends[:-1]), ends, strict=True)]

    def told(self, extra: Array, least: float) -> Array:
        """Return the combinations (k, j) of extra columns (N, 6, k) that no body with a bias mimics.

        least  share of a combination's squares, its columns scaled alike, that the other columns must leave
        """
        size = self.columns.shape[2]
        gram = self._scatter(extra, False)[0, :-1, :-1]
        scale = np.sqrt(np.maximum(np.diag(gram)[size:], _SMALLEST**2))
        across = gram[size:, :size]
        rest = gram[size:, size:] - across @ inverse_scaled(gram[:size, :size].copy(), RANK) @ across.T
        values, vectors = np.linalg.eigh(rest / np.outer(scale, scale))
        return np.asarray(vectors[:, values > least] / scale[:, None])

    def slowly(self, fit: FullFit, extra: Array | None = None) -> float:
        """Return the weighted sum of squares of what a fit with extra columns (N, 6, k) leaves in means over a second.

        White noise hardly lasts that long. Rows of a table are taken one by one.
        """
        return lasting(self._missed(fit, extra), self._second)

    def clear(self, plain: FullFit, fit: FullFit, extra: Array) -> float:
        """Return how many times as much extra columns (N, 6, k) explain of what lasts as they leave (`lasting`)."""
        return clear(self._missed(plain), self._missed(fit, extra), self._second)

    def _missed(self, fit: FullFit, extra: Array | None = None) -> Array:
        """Return the weighted residuals (N, 6)."""
        told = self.columns @ fit.solution[: fit.own]
        told = told if extra is None else told + extra @ fit.extra
        return np.asarray((self.values - told) * np.sqrt(self.weights))

    @cached_property
    def _second(self) -> Integers:
        """The second of the log (N,) that each row is in; rows of a table are one by one."""
        if self.log.time is None:
            return np.arange(len(self.values))
        return np.asarray(np.unique(np.floor(self.log.time / _MEAN_S), return_inverse=True)[1])

    def tilting(self, phi: Array, rotation: Array, gravity: Array) -> Array:
        """Return the derivative (N, 6, 3) of the wrench by a small turn of gravity (3,) in W [rad]."""
        return np.asarray(motion_map(phi)[:, 3:6] @ (np.swapaxes(rotation, 1, 2) @ cross_matrix(gravity)))

    def drifting(self, settling: float | None = None) -> Array:
        """Return columns (N, 6, 6) of a bias that drifts by one over the log, and settles as given or as it shows."""
        if self.log.time is None:
            return np.zeros((len(self.values), 6, 6))
        settling = self.settling if settling is None else settling
        return np.asarray(settled_course(self.log.time, settling)[:, None, None] * np.eye(6) / 2)

    @cached_property
    def settling(self) -> float:
        """The time constant [s] in which a drift settles; infinite where a line leaves hardly more.

        What it leaves is compared in means over a second: white noise hides a drift, and does not last.
        """
        if self.log.time is None:
            return STEADILY
        span = float(np.ptp(self.log.time))
        left = {s: self._drifted(s) for s in (STEADILY, *(span * share for share in SETTLING))}
        best = min(left, key=lambda s: left[s])
        return best if left[best] < CURVED * left[STEADILY] else STEADILY

    def _drifted(self, settling: float) -> float:
        """Return what lasts for a second beside a drift that settles so."""
        columns = self.drifting(settling)
        return self.slowly(self.solve(columns), columns)


# Many rooms ask for the same rows of a log.
_MADE: WeakKeyDictionary[MotionLog, dict[bool, tuple[Rows, Integers]]] = WeakKeyDictionary()


def force_left(log: MotionLog) -> float:
    """Return how much of the forces (rms, N) one body with a bias leaves in a log."""
    rows, _ = Rows.of(log)
    return float((rows.values - rows.columns @ rows.solve().solution)[:, 3:].std())


def _weights(rows: Rows, solution: Array) -> Array:
    """Return inverse variances (N, 6) of the residuals, by class of rows and kind of channel."""
    miss = rows.values - rows.columns @ solution
    out, heard = np.empty_like(miss), ~rows.log.dead
    for kind in np.unique(rows.log.noise_class):
        at = rows.log.noise_class == kind
        variance = robust_std(miss[at]) ** 2 + 0.01 * miss[at].var(0)
        out[at] = heard / np.maximum(np.repeat(mean_heard(variance, heard), 3), _SMALLEST**2)
    return out


def _blocks(log: MotionLog) -> Integers:
    """Return the stretch (N,) each row belongs to: even stretches of time, or the rows of a table one by one."""
    if log.time is None:
        return np.arange(len(log)) % min(len(log), 4 * _BLOCKS)
    share = (log.time - log.time[0]) / max(float(log.time[-1] - log.time[0]), _SMALLEST)
    block = np.minimum((share * _BLOCKS).astype(np.int64), _BLOCKS - 1)
    return np.asarray(np.unique(block, return_inverse=True)[1].astype(np.int64))


def moves(log: MotionLog) -> bool:
    """Tell whether all channels measure, and enough rows are seen to be accelerated."""
    return not log.dead.any() and (~log.still).sum() >= _FEWEST_MOVING and bool(log.acceleration.any())


def at_rest(log: MotionLog) -> MotionLog:
    """Return the log as if nothing moved: gravity alone is left."""
    nothing = np.zeros_like(log.gravity)
    return replace(log, acceleration=nothing, angular_velocity=nothing, angular_acceleration=nothing)


def noise_share(log: MotionLog) -> float:
    """Return the share of its uncertainty in the squared acceleration of moving rows, linear or angular, the larger."""
    moving = ~log.still
    if log.noise is None or not moving.any():
        return 0.0
    variance = np.stack([n.acceleration + n.taken for n in log.noise])[log.noise_class][moving]
    sizes = np.concatenate([log.angular_acceleration, log.acceleration], 1)[moving] ** 2
    shares = [variance[:, part].sum() / max(float(sizes[:, part].sum()), 1e-300) for part in (slice(0, 3), slice(3, 6))]
    return float(max(shares))
