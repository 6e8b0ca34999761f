"""Problem: what every estimator solves, a statistic per class of rows with its noise, as plain arrays."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import counted
from steelyard.identify.cost.linear import normal_equations, reweighted, solve_scaled
from steelyard.identify.cost.newton import Rows
from steelyard.identify.cost.noise_cost import information, residual_map_of, weights_at
from steelyard.identify.noise_levels import DEAF, EVERYDAY
from steelyard.inertia.regressor import design
from steelyard.logs.drift import STEADILY, settled_course
from steelyard.logs.log import MotionLog, Noise
from steelyard.logs.moments import Moments, features
from steelyard.logs.noise import mean_heard

# Row counts below this cannot fix four numbers and a bias whatever they hold.
FEWEST_ROWS = 2
ADD_POSES = (
    "Add still poses that turn gravity to other axes of the sensor: at least three, more than 30 degrees apart, "
    "about two different axes"
)


@dataclass(frozen=True, eq=False)
class BiasPrior:
    """What is known of the wrench bias beforehand: mean (6,) [tau, f] and precision (6, 6)."""

    mean: Array
    precision: Array


NOTHING_KNOWN = BiasPrior(np.zeros(6), np.zeros((6, 6)))


@dataclass(frozen=True, eq=False)
class Problem:
    """Scatter (C, Z, Z) with variances of acceleration and wrench (C, 6) each, and the design T (p, 6, Z).

    The linear parameters are phi (10), then the bias (6) unless the sensor is tared, then its drift (6) where asked.

    classes       (C,) number of each class in the log
    columns       (N, Z - 19) what z has beside the features of a log's rows, in order of time; None for nothing
    blocks        (B, Z, Z) the same rows by still pose or time block, with class and number (B,), for hold-out
    """

    scatter: Array
    acceleration: Array
    wrench: Array
    T: Array
    classes: Integers
    blocks: Array
    block_class: Integers
    block_number: Integers
    still_samples: float = 0.0
    bias_prior: BiasPrior = NOTHING_KNOWN
    columns: Array | None = None

    @property
    def heard(self) -> Mask:
        """Which channels [tau, f] (6,) measure."""
        return np.asarray((self.wrench < DEAF).any(0))

    @property
    def wrench_weights(self) -> Array:
        """Weights (C, 6, 6) of the rows by the noise of the wrench alone."""
        return np.stack([np.diag(1 / variance) for variance in self.wrench])

    def rms(self, square: Array) -> tuple[float, float]:
        """Return the rms [N m] and [N] per axis that measures, from mean squares (6,) of the channels."""
        torque, force = np.sqrt(np.maximum(mean_heard(square, self.heard), 0.0))
        return float(torque), float(force)

    @classmethod
    def of(cls, moments: Moments, with_bias: bool) -> Problem:
        """Return the problem of a statistic whose noise is known."""
        if moments.noise is None:
            raise BadValue("The statistic must carry its noise; got none. Declare it, or use identify(log).")
        require_rows(int(moments.samples))
        classes = np.flatnonzero(np.bincount(moments.noise_class))
        label = np.searchsorted(classes, moments.noise_class)
        scatter = np.stack([moments.scatter[label == k].sum(0) for k in range(len(classes))])
        acceleration = np.stack([moments.noise[c].acceleration for c in classes])
        # A reading scatters at least as much as its noise: more noise than that was declared for another motion, and
        # would reward the fit for inertia about axes that nothing turns.
        seen = scatter.diagonal(axis1=1, axis2=2)[:, :6] / scatter[:, 18, 18, None]
        acceleration = np.minimum(acceleration, seen)
        wrench = np.stack([moments.noise[c].wrench for c in classes])
        if (wrench <= 0).any():
            raise BadValue("Wrench noise must be above zero on every axis; a zero variance would weigh infinitely.")
        still = float(moments.counts[moments.still].sum())
        return cls(
            scatter, acceleration, wrench, design(with_bias), classes,
            moments.scatter, label, moments.block, still,
        )  # fmt: skip

    def with_drift(self, log: MotionLog, settling: float = STEADILY) -> Problem:
        """Return the problem with a bias that also drifts in time; `log` is the one the statistic came from.

        The drift's unit is half the change from start to end; it settles with a time constant [s], or grows in a line.
        """
        return self._with_columns(log, course(log, settling)[:, None], -np.eye(6)[:, :, None])

    def with_room(self, log: MotionLog, rotation: Array) -> Problem:
        """Return the problem with a bias (6,) in W as well; rotation (N, 3, 3) turns S into W at the rows of `log`."""
        T = np.zeros((2, 3, 2, 3, 3, 3))
        for k in range(3):
            T[0, k, 0, :, k] = T[1, k, 1, :, k] = -np.eye(3)
        return self._with_columns(log, rotation.reshape(-1, 9), T.reshape(6, 6, 9))

    def _with_columns(self, log: MotionLog, columns: Array, design: Array) -> Problem:
        """Return the problem with columns (N, k) beside the features of the rows of `log`, and a design (q, 6, k)."""
        if log.time is not None:
            order = np.argsort(log.time, kind="stable")
            log, columns = log.rows(order), columns[order]
        wider = replace(self, columns=columns if self.columns is None else np.column_stack([self.columns, columns]))
        z = wider.features(log)
        key = np.stack([log.noise_class, log.still.astype(np.int64), log.pose], 1)
        groups, label = np.unique(key, axis=0, return_inverse=True)
        blocks = np.stack([z[label == g].T @ z[label == g] for g in range(len(groups))])
        block_class = np.searchsorted(self.classes, groups[:, 0])
        scatter = np.zeros((len(self.classes), *blocks.shape[1:]))
        np.add.at(scatter, block_class, blocks)
        (count, _, width), more = self.T.shape, design.shape
        T = np.zeros((count + more[0], 6, width + more[2]))
        T[:count, :, :width], T[count:, :, width:] = self.T, design
        T.flags.writeable = False
        return replace(wider, scatter=scatter, T=T, blocks=blocks, block_class=block_class, block_number=groups[:, 2])

    @property
    def rows(self) -> Rows:
        """The rows as the noise-aware cost takes them."""
        return Rows(self.T, self.scatter, self.acceleration, self.wrench)

    def residual_map(self, linear: Array) -> Array:
        """Return K (6, Z), so that the wrench residual of a row is K z."""
        return np.asarray(residual_map_of(self.T, linear))

    def plus_bias_prior(self, matrix: Array) -> Array:
        """Return a matrix (p, p) of information with what is known of the bias added."""
        if not self.with_bias:
            return matrix
        out = matrix.copy()
        out[10:16, 10:16] += self.bias_prior.precision
        return out

    def plus_bias_pull(self, g: Array) -> Array:
        """Return the right side g (p,) that goes with `plus_bias_prior`."""
        if not self.with_bias:
            return g
        out = g.copy()
        out[10:16] += self.bias_prior.precision @ self.bias_prior.mean
        return out

    def weights_at(self, linear: Array) -> Array:
        """Return the weights (C, 6, 6) of the rows at the linear parameters (p,), noise of the acceleration counted."""
        return np.asarray(weights_at(self.residual_map(linear), self.acceleration, self.wrench))

    def information(self, linear: Array) -> tuple[Array, Array, Array]:
        """Return `noise_cost.information` (p, p) of all rows at the linear parameters (p,)."""
        return information(self.residual_map(linear), *self.rows)

    def reweighted(self, passes: int) -> Array:
        """Return the linear parameters (p,) of so many weighted solutions, each with the weights of the last."""
        return reweighted(*self.rows, passes)

    def fixed_weight_score(self, linear: Array, weights: Array) -> Array:
        """Return the variance (p, p) of the score of rows weighted by `weights` (C, 6, 6) under white noise.

        linear  (p,) the parameters, which carry the noise of the acceleration into the rows
        """
        noise = np.linalg.inv(self.weights_at(linear))
        return np.asarray(normal_equations(self.T, self.scatter, weights @ noise @ weights)[0])

    def normal_equations(self, weights: Array) -> tuple[Array, Array]:
        """Return H (p, p) and g (p,) of the rows weighted by `weights` (C, 6, 6), with what is known of the bias."""
        H, g = normal_equations(self.T, self.scatter, weights)
        return self.plus_bias_prior(H), self.plus_bias_pull(g)

    @property
    def with_bias(self) -> bool:
        """Whether a constant wrench bias is among the parameters."""
        return len(self.T) > 10

    @property
    def samples(self) -> float:
        """Rows in all."""
        return float(self.scatter[:, 18, 18].sum())

    def features(self, log: MotionLog) -> Array:
        """Return z (N, Z) of all rows of the log in order of time, as wide as this problem's statistic."""
        z = features(log)
        return z if self.columns is None else np.column_stack([z, self.columns])


def require_rows(rows: int) -> None:
    """Raise CannotAnswer where there are too few rows for anything."""
    if rows < FEWEST_ROWS:
        raise CannotAnswer(
            f"The log has {counted(rows, 'usable row')}, which cannot tell a weight from a bias. {ADD_POSES}."
        )


def without_drift(log: MotionLog, settling: float = STEADILY) -> MotionLog:
    """Return the log less a drift found by weighted least squares: what noise and rest are judged by."""
    loud = replace(log, noise_class=np.zeros(len(log), np.int64), noise=(Noise(np.zeros(6), EVERYDAY),))
    problem = Problem.of(Moments.of_log(loud, by_block=False), True).with_drift(loud, settling)
    linear = solve_scaled(*problem.normal_equations(np.diag(1 / EVERYDAY)[None]))
    return replace(log, wrench=log.wrench - np.outer(course(log, settling), linear[16:]))


def course(log: MotionLog, settling: float = STEADILY) -> Array:
    """Return how a drift goes from -1 to 1 (N,) over the log: in a line, or settling with a time constant [s]."""
    if log.time is None:
        raise CannotAnswer("A drifting bias needs a clock; the log has none. Record a time column.")
    return settled_course(log.time, settling)
