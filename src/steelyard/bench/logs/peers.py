"""Other packages on the same logs in the same run: Pinocchio and rigeo (with CVXPY and Clarabel).

The only module that imports them, and only when asked; what is not installed has no rows. They get what the
rules of the bench give everyone: the rows of the log, the sensor's noise (each row divided by it, except in
plain OLS) and no shape. None estimates a bias.
"""

from __future__ import annotations

import importlib.util
import warnings
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np

from steelyard.bench.logs.methods import Method
from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.inertia import InertialParameters, solids
from steelyard.logs.log import MotionLog
from steelyard.spatial import Pose, Rotation

PRIOR_RADIUS_M = 0.05
PRIOR_WEIGHT = 3e-3

# Pinocchio keeps the inertia as xx xy yy xz yz zz.
_OURS_FROM_PINOCCHIO = [0, 1, 2, 3, 4, 5, 7, 6, 8, 9]


@dataclass(frozen=True, eq=False)
class System:
    """A stacked linear system A phi = b of all rows, as it is or divided by the sensor's noise.

    matrix  (6 N, 10) or, once compressed by QR, (10, 10); vector likewise; samples N
    """

    matrix: Array
    vector: Array
    samples: int

    def compressed(self) -> System:
        """Return the equal system of ten rows (QR); the cost keeps its shape, up to a constant."""
        q, r = np.linalg.qr(self.matrix)
        return System(r, q.T @ self.vector, self.samples)


def peer_methods() -> tuple[dict[str, Method], tuple[str, ...]]:
    """Return the methods of the peers that are installed, and one sentence per peer that is not."""
    methods: dict[str, Method] = {}
    notes = []
    if _installed("pinocchio"):
        methods |= _pinocchio_methods()
    else:
        notes.append("Pinocchio is not installed, so its rows are left out (pip install 'steelyard[peers]').")
    if _installed("rigeo", "cvxpy", "clarabel"):
        methods |= _rigeo_methods()
    else:
        notes.append("rigeo is not installed, so its rows are left out (pip install 'steelyard[peers]').")
    return methods, tuple(notes)


def _installed(*modules: str) -> bool:
    return all(importlib.util.find_spec(name) is not None for name in modules)


def _pinocchio_methods() -> dict[str, Method]:
    plain, whitened = "stacked rows to parameters (lstsq)", "QR-compressed rows to parameters"
    rows = [
        _peer("pinocchio-ols", _pinocchio_plain, _ordinary, plain),
        _peer("pinocchio-log-cholesky", _pinocchio_whitened, _log_cholesky, whitened),
    ]
    return {row.name: row for row in rows}


def _rigeo_methods() -> dict[str, Method]:
    timed = "QR-compressed rows to parameters, CVXPY's own work included"
    return {
        name: _peer(name, _rigeo_whitened, partial(_rigeo, weight), timed, slow=True)
        for name, weight in (("rigeo-psd", 0.0), ("rigeo-entropic", PRIOR_WEIGHT))
    }


def _peer(
    name: str,
    compress: Callable[[MotionLog], System],
    solve: Callable[[System], InertialParameters],
    timed: str,
    slow: bool = False,
) -> Method:
    return Method(name, lambda log: solve(compress(log)), compress, solve, timed, slow)


def _stacked(log: MotionLog, regressor: Callable[[Array, Array, Array], Array], whiten: bool) -> System:
    """Stack regressor(omega, a - g, alpha) -> (6, 10) of [tau, f], one call per row as the peers offer."""
    gravity_free = log.acceleration - log.gravity
    rows = zip(log.angular_velocity, gravity_free, log.angular_acceleration, strict=True)
    blocks = np.array([regressor(*row) for row in rows])
    std = np.ones((len(log), 6))
    if whiten and log.noise is not None:
        std = np.sqrt(np.array([noise.wrench for noise in log.noise]))[log.noise_class]
    matrix = (blocks / std[..., None]).reshape(-1, 10)
    return System(matrix, (log.wrench / std).ravel(), len(log))


def _pinocchio_row(omega: Array, acceleration: Array, alpha: Array) -> Array:
    """Return Pinocchio's regressor, rows [tau, f]; at zero linear velocity its acceleration is classical."""
    import pinocchio

    motion = pinocchio.Motion(np.zeros(3), omega)
    block = np.asarray(pinocchio.bodyRegressor(motion, pinocchio.Motion(acceleration, alpha)))
    return block[[3, 4, 5, 0, 1, 2]][:, _OURS_FROM_PINOCCHIO]


def _pinocchio_plain(log: MotionLog) -> System:
    return _stacked(log, _pinocchio_row, whiten=False)


def _pinocchio_whitened(log: MotionLog) -> System:
    return _stacked(log, _pinocchio_row, whiten=True).compressed()


def _ordinary(system: System) -> InertialParameters:
    return InertialParameters(np.asarray(np.linalg.lstsq(system.matrix, system.vector)[0], np.float64))


def _prior(system: System) -> InertialParameters:
    """Return a homogeneous ball of 5 cm with the mass and centre of least squares: no shape is known."""
    free = _ordinary(system)
    ball = solids.sphere(PRIOR_RADIUS_M, 1.0)
    here = InertialParameters(ball.vector * max(abs(float(free.mass)), 1e-3) / ball.mass)
    return here.in_frame(Pose(Rotation.identity(), free.com))


def _log_cholesky(system: System) -> InertialParameters:
    """Minimise over Pinocchio's log-Cholesky coordinates with its Jacobian, by Levenberg-Marquardt."""
    import pinocchio
    from scipy.optimize import least_squares

    order = _OURS_FROM_PINOCCHIO

    def residual(theta: Array) -> Array:
        phi = np.asarray(pinocchio.LogCholeskyParameters(theta).toDynamicParameters())[order]
        return np.asarray(system.matrix @ phi - system.vector)

    def jacobian(theta: Array) -> Array:
        return np.asarray(system.matrix @ np.asarray(pinocchio.LogCholeskyParameters(theta).calculateJacobian())[order])

    with warnings.catch_warnings(), np.errstate(all="ignore"):
        warnings.simplefilter("ignore")
        found = least_squares(residual, _prior(system).log_cholesky(), jacobian, method="lm")
    phi = np.asarray(pinocchio.LogCholeskyParameters(found.x).toDynamicParameters())[order]
    if not np.isfinite(phi).all():
        raise CannotAnswer("Levenberg-Marquardt left the finite numbers; give it another start.")
    return InertialParameters(phi)


def _rigeo_row(omega: Array, acceleration: Array, alpha: Array) -> Array:
    """Return rigeo's regressor; its spatial vectors are angular first, its inertia in our order."""
    from rigeo import SV, RigidBody

    velocity, change = SV(linear=np.zeros(3), angular=omega), SV(linear=acceleration, angular=alpha)
    return np.asarray(RigidBody.regressor(velocity, change))


def _rigeo_whitened(log: MotionLog) -> System:
    return _stacked(log, _rigeo_row, whiten=True).compressed()


def _rigeo(weight: float, system: System) -> InertialParameters:
    """Solve rigeo's identification problem over a positive semidefinite pseudo-inertia J, with Clarabel.

    |A phi - b|^2 / 2N + weight (-log det J + tr(J0^-1 J)), the objective of its IdentificationProblem,
    written in axes where the prior J0 is the identity: without them Clarabel fails on half of the slow logs.
    """
    import cvxpy
    from rigeo.constraint import pim_must_equal_vec, pim_psd

    phi: Any = cvxpy.Variable(10)
    pseudo = pim_must_equal_vec(phi)
    cost = 0.5 / system.samples * cvxpy.sum_squares(system.matrix @ phi - system.vector)
    if weight:
        whiten = np.linalg.inv(np.linalg.cholesky(_prior(system).pseudo_inertia))
        seen = whiten @ pseudo @ whiten.T
        divergence = cvxpy.trace(seen) - cvxpy.log_det((seen + seen.T) / 2)
        cost += weight * divergence
    problem = cvxpy.Problem(cvxpy.Minimize(cost), pim_psd(pseudo))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            problem.solve(solver=cvxpy.CLARABEL)
    except cvxpy.error.SolverError as error:
        raise CannotAnswer(f"Clarabel failed: {error}") from None
    if phi.value is None or problem.status not in ("optimal", "optimal_inaccurate"):
        raise CannotAnswer(f"Clarabel says {problem.status}.")
    return InertialParameters(phi.value)
