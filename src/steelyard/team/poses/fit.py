"""Joint maximum likelihood over all grasps from poses, for bases that stand still.

Every robot i reports the pose T_i(t) of its grasp in its own home. With the homes Z_i and the payload X(t) in the home
of the reference robot and the grasps G_i in the reference grasp,
    T_i(t) = Z_i^-1 X(t) G_i exp(e_i),   e_i ~ N(0, W_i^-1),
so that every loop closes by construction. A Gauss-Newton step has six unknowns per row of time, which are eliminated
row by row (Schur complement), and thirteen per robot: grasp, home and how late its clock is. Residuals live in each
grasp's own axes and gradients are exact, so that neither the reference nor the homes nor the order of the robots move
the optimum.
Source: own; the paper fits twists of pairs (eq. 1-8) and refines them (section III-B2).
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from steelyard.check import Array, Integers
from steelyard.spatial import Pose, Rotation, cross_matrix
from steelyard.team.adjoint import adjoint_inverse
from steelyard.team.definite import inverses
from steelyard.team.poses import rows as pose_rows
from steelyard.team.poses.measured import Team, TeamMotion
from steelyard.team.poses.noise import noise_of_scatter
from steelyard.team.poses.solver import OWN, Shown, Solver, pattern_information

STEPS = 25
# Noise to begin with [rad, m].
GUESS = 1e-3
# Steps after which grasps are near enough for noise to be judged, and for the information to stay as it is.
NEAR = 2


@dataclass(frozen=True)
class Close:
    """When a fit is done: a step lowers chi^2 by less than `chi2`, and noise changes by a smaller share than `noise`.

    A chi^2 of x is a step of sqrt(x) standard deviations. The information is taken anew where the noise has changed by
    the share `renewed`: what it is off by is left over from every step, which a fit that ends early can bear.
    """

    chi2: float
    noise: float
    renewed: float


# NEARLY is for clocks: rows are read anew between noisy stamps, so that clocks which depend on the reference by more
# than 1e-4 standard deviations would make the answer do so too.
EXACT, NEARLY, ROUGHLY = Close(1e-13, 1e-7, 0.02), Close(1e-8, 1e-5, 0.05), Close(1e-2, 1e-2, 0.2)


@dataclass(frozen=True, eq=False)
class Rows:
    """The rows where everything is at `team`, of which the motion fits them best.

    apart   (T, N, 6) residuals from predicted to measured, in the payload's axes
    """

    data: TeamMotion
    team: Team
    apart: Array

    def __post_init__(self) -> None:
        self.apart.flags.writeable = False

    @classmethod
    def settled(cls, data: TeamMotion, team: Team, noise: Array, sweeps: int = 1) -> Rows:
        """Return the rows when the motion has followed grasps and homes; noise (N, 2) [rad, m]."""
        G, Z, X = team.grasps, team.homes, team.motion
        W, inverse, pattern = _weights(data, team, noise)
        turns, places, apart = pose_rows.settled(
            data.poses.rotation.matrix, data.poses.position, data.valid, G.rotation.matrix, G.position,
            Z.rotation.matrix, Z.position, X.rotation.matrix, X.position, data.twist, team.delays, W, inverse,
            pattern, sweeps,
        )  # fmt: skip
        return cls(data, replace(team, motion=Pose.trusted(Rotation.trusted(turns), places)), apart)

    @cached_property
    def residual(self) -> Array:
        """Residuals (T, N, 6) in each grasp's own axes."""
        return pose_rows.in_own(self.apart, self.team.grasps.rotation.matrix)

    def noise(self, noise: Array) -> Array:
        """Return the noise (N, 2) that residuals of rows in which all robots speak show, from one to begin with."""
        whole = self.data.complete
        rows = (self.apart if whole.all() else self.apart[whole]).reshape(-1, 6 * self.data.count)
        J = np.zeros((self.data.count, 6, 6))
        J[:, range(6), range(6)] = 1.0
        J[:, 3:, :3] = -cross_matrix(self.team.grasps.position)
        return noise_of_scatter(rows.T @ rows, float(len(rows)), J, noise)

    def pull(self, noise: Array) -> Array:
        """Return half the gradient of chi^2 (13 N,), sign turned."""
        return np.asarray(self.pulls(noise, len(self.data.valid))[0])

    def pulls(self, noise: Array, rows: int) -> Array:
        """Return what every so many rows add to half the gradient of chi^2 (T / rows, 13 N), sign turned."""
        G, Z, X = self.team.grasps, self.team.homes, self.team.motion
        W, inverse, pattern = _weights(self.data, self.team, noise)
        return pose_rows.pulled(
            self.apart, self.data.valid, G.rotation.matrix, G.position, Z.rotation.matrix, Z.position,
            X.rotation.matrix, X.position, self.data.twist, W, inverse, pattern, self.data.shares, rows,
        )  # fmt: skip


def _weights(data: TeamMotion, team: Team, noise: Array) -> tuple[Array, Array, Integers]:
    """Return weights (N, 2), the inverse information about the motion per pattern (C, 6, 6), and patterns (T,)."""
    W, (found, place) = np.asarray(noise**-2.0), data.patterns
    return W, inverses(pose_rows.held(team.grasps.position, W, found))[0], place


def information(data: TeamMotion, grasps: Pose, noise: Array) -> Array:
    """Return what all rows say of all parameters (13 N, 13 N), the motion eliminated."""
    J, weight = adjoint_inverse(grasps), np.repeat(noise**-2.0, 3, axis=1)
    out = np.zeros((OWN * data.count, OWN * data.count))
    for S, seen in zip(data.scatter, data.patterns[0], strict=True):
        if seen.any():
            out += pattern_information(S, J, weight * seen[:, None])
    return out


@dataclass(frozen=True, eq=False)
class Known:
    """Information (13 N, 13 N) at some noise (N, 2), what holds the sum of delays at zero [s^-2], and their solver."""

    noise: Array
    information: Array
    common: float
    solver: Solver

    @classmethod
    def of(cls, data: TeamMotion, grasps: Pose, noise: Array, unknown: Integers) -> Known:
        """Return what the rows say of the unknown parameters near these grasps."""
        H = information(data, grasps, noise)
        # What all clocks have in common moves the motion along itself and shows in nothing: the sum of the delays,
        # unlike any one robot's, is the same whoever is the reference.
        common = float(np.diag(H)[OWN - 1 :: OWN].mean())
        held, timed = H[np.ix_(unknown, unknown)], unknown % OWN == OWN - 1
        held[np.ix_(timed, timed)] += common
        return cls(noise, H, common, Solver.of(held, unknown, noise, len(data.valid)))

    def holds(self, noise: Array, close: Close) -> bool:
        """Return whether the noise is still so near that steps from here lead to the optimum."""
        return bool(np.abs(np.log(noise / self.noise)).max() <= close.renewed)


@dataclass(frozen=True, eq=False)
class PoseFit:
    """The optimum: its rows, what they say, noise (N, 2) [rad, m], which parameters were unknown.

    left  how long another step would be, in standard deviations: next to nothing unless STEPS were too few
    """

    reference: int
    rows: Rows
    known: Known
    noise: Array
    unknown: Integers
    left: float

    @cached_property
    def solved(self) -> Shown:
        """Covariance of the unknown parameters for white noise, and what is lost."""
        return self.known.solver.all_shown()

    @property
    def doubt(self) -> Array:
        """Standard deviations (N,) of the delays for white noise [s]; empty where they were not estimated."""
        return np.sqrt(self.known.solver.variance(self.unknown % OWN == OWN - 1))

    @property
    def team(self) -> Team:
        """Where everything is."""
        return self.rows.team

    @property
    def grasps(self) -> Pose:
        """Where robots hold (N,), in the reference grasp."""
        return self.team.grasps


def fit_poses(
    data: TeamMotion,
    start: Team,
    reference: int,
    noise: Array | None = None,
    close: Close = EXACT,
    known: Known | None = None,
) -> PoseFit:
    """Return the optimum near `start`; the noise of every robot is estimated along the way.

    Delays, which sum to zero, are estimated where the data have twists. `known` is the information of a fit to nearly
    the same rows, if there is one: it decides the way to the optimum, not where that is.
    """
    count = data.count
    own = np.arange(OWN if len(data.twist) else OWN - 1)
    unknown = np.concatenate([OWN * i + (own if i != reference else own[OWN - 1 :]) for i in range(count)])
    timed, near = unknown % OWN == OWN - 1, 0 if noise is not None else NEAR
    team = start
    noise = np.full((count, 2), GUESS) if noise is None else noise
    step_number = 0
    while True:
        here = Rows.settled(data, team, noise)
        # Far from the optimum, a robot that starts out badly would be taken for a noisy one and stay where it is.
        new = here.noise(noise) if step_number >= near else noise
        quiet = step_number >= near and bool(np.abs(np.log(new / noise)).max() < close.noise)
        noise = new
        if known is None or not known.holds(noise, close) or step_number == near > 0:
            known = Known.of(data, team.grasps, noise, unknown)
        pull = here.pull(noise)[unknown] - known.common * timed * team.delays.sum()
        step = known.solver.step(pull)
        step_number += 1
        if step_number == STEPS or (quiet and float(step @ pull) < close.chi2):
            return PoseFit(reference, here, known, noise, unknown, float(np.sqrt(max(step @ pull, 0.0))))
        full = np.zeros(OWN * count)
        full[unknown] = step
        team = here.team.moved(full.reshape(-1, OWN))
