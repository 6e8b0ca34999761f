"""ShapeError: how wrong the given shape and grasp may be, and what that does to the answer."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.models import Masses
from steelyard.inertia import InertialParameters, forms
from steelyard.inertia.people import half_trace_com, parameter_jacobian
from steelyard.parts.parts import Parts
from steelyard.spatial import Pose, Rotation

# How far the centre of mass of a scan errs along an axis, over the stretch of its radius of gyration.
LEAN = 0.2
# What a hidden core may take from a second moment across a long body, as a share of it (one standard deviation).
CORE = 0.15
# What is thought solid and is hollow has up to half as much again of each second moment about its centre (a shell, for
# one that is three quarters empty).
HOLLOW = 0.35
# A scan puts the centroids of its parts off by so much, one standard deviation per axis [m].
DRAWN = 1e-3
# Masses of a scan's parts need not sum to the whole closer than this share: a sum that is known a thousand times better
# than its parts makes a valley too narrow and bent for Newton's method. The whole then goes where the log sees it.
LOOSE = 1e-3
# A grasp within so many of the standard deviations that it was given is where the log sees it.
LIKELY = 3.5


@dataclass(frozen=True)
class ShapeError:
    """Standard deviations of what is taken as known.

    com_m           of the centre of mass that the shape gives, per axis [m]
    inertia_share   of every entry of the inertia alike, as a share of half its trace: that of a measured mesh
    stretch         of the second moments, each as a share of itself: that of a scan, in place of the former. Such a
                    shape may hide a core (CORE), and leans by a share of that along each axis, in radii of gyration
    turn_rad        of the whole shape about its centre of mass, per axis [rad]
    grasp_m, grasp_rad   of the pose of the object in the sensor, per axis [m, rad]
    grasp_at        the origin of the object's frame in the sensor's [m], about which that turn is
    hollow          parts of the body that may be hollow, as if they were solid: each errs by itself, by HOLLOW
    """

    com_m: float = 0.0
    inertia_share: float = 0.0
    stretch: float = 0.0
    turn_rad: float = 0.0
    grasp_m: float = 0.0
    grasp_rad: float = 0.0
    grasp_at: tuple[float, float, float] = (0.0, 0.0, 0.0)
    hollow: tuple[InertialParameters, ...] = ()

    def __post_init__(self) -> None:
        values = (self.com_m, self.inertia_share, self.stretch, self.turn_rad, self.grasp_m, self.grasp_rad)
        if not all(np.isfinite(v) and v >= 0 for v in values):
            raise BadValue(f"standard deviations of shape and grasp must not be negative; got {values}.")

    @property
    def doubtful(self) -> bool:
        """Whether the shape may be worse than a measured mesh."""
        return self.com_m > MEASURED.com_m or self.stretch > 0

    @property
    def movable(self) -> bool:
        """Whether the object may lie elsewhere than its shape says."""
        return self.doubtful or bool(self.grasp_steps())

    def at_least(self, com_m: float, stretch: float, turn_rad: float = 0.0) -> ShapeError:
        """Return the error with its shape part no less than this."""
        turn = max(self.turn_rad, turn_rad)
        return replace(self, com_m=max(self.com_m, com_m), stretch=max(self.stretch, stretch), turn_rad=turn)

    def scaled(self, factor: float) -> ShapeError:
        """Return the error with its shape part `factor` times as large, not below that of a measured shape."""
        com, share = max(self.com_m, MEASURED.com_m), max(self.inertia_share, MEASURED.inertia_share)
        stretch, turn = factor * self.stretch, factor * self.turn_rad
        return replace(self, com_m=factor * com, inertia_share=factor * share, stretch=stretch, turn_rad=turn)

    def laid(self, std_m: float, std_rad: float) -> ShapeError:
        """Return the error of a shape that is shifted and turned as a whole by these standard deviations, too."""
        return replace(self, com_m=float(np.hypot(self.com_m, std_m)), turn_rad=float(np.hypot(self.turn_rad, std_rad)))

    def placed(self, std_m: float, std_rad: float, at: Array | None = None) -> ShapeError:
        """Return the error with a place in S that is less sure by these standard deviations, about `at` (3,) [m]."""
        x, y, z = self.grasp_at if at is None else (float(v) for v in at)
        grasp_m, grasp_rad = float(np.hypot(self.grasp_m, std_m)), float(np.hypot(self.grasp_rad, std_rad))
        return replace(self, grasp_m=grasp_m, grasp_rad=grasp_rad, grasp_at=(x, y, z))

    def grasp_steps(self) -> list[Pose]:
        """Return displacements of one standard deviation along and about each axis that has one."""
        at, still = np.array(self.grasp_at), Rotation.identity()
        shifts = [Pose(still, self.grasp_m * axis) for axis in np.eye(3) if self.grasp_m]
        turns = [Rotation.exp(self.grasp_rad * axis) for axis in np.eye(3) if self.grasp_rad]
        return shifts + [Pose(turn, at - turn.apply(at)) for turn in turns]

    def likeliest_grasp(self, body: InertialParameters, pull: Array, information: Array) -> Pose | None:
        """Return how the object likely lies beside its place; None where that is far beyond what the grasp allows.

        pull, information  F (phi_hat - phi) (10,) and F (10, 10) of the log at the parameters phi of the body
        """
        slopes = np.stack([self._moved(body, X)[0] for X in self.grasp_steps()])
        u = slopes @ np.linalg.solve(np.eye(10) + information @ self.with_grasp(body), pull)
        if np.abs(u).max() > LIKELY:
            return None
        # Along the axes and about them, as the steps are.
        along = self.grasp_m * u[:3] if self.grasp_m else np.zeros(3)
        turn = Rotation.exp(self.grasp_rad * u[-3:] if self.grasp_rad else np.zeros(3))
        at = np.array(self.grasp_at)
        return Pose(turn, at - turn.apply(at) + along)

    def covariance(self, body: InertialParameters) -> Array:
        """Return the covariance (10, 10) that a wrong shape gives the parameters of a body."""
        phi, inner = body.vector.copy(), np.zeros((10, 10))
        inner[range(1, 4), range(1, 4)] = self.com_m**2
        if self.stretch:
            slope = _stretched(body.inertia_com, self.stretch)
            inner[0, 0] = (LOOSE * float(body.mass)) ** 2
            inner[1:4, 1:4] += (LEAN * self.stretch) ** 2 * _second_moments(body.inertia_com) / body.mass
            inner[4:, 4:] = slope @ slope.T
        else:
            inner[4:, 4:] = (self.inertia_share * half_trace_com(phi)) ** 2 * np.eye(6)
        if self.turn_rad:
            slope = _turned(body.inertia_com)
            inner[4:, 4:] += self.turn_rad**2 * slope @ slope.T
        back = parameter_jacobian(phi)
        shells = sum(ShapeError(stretch=HOLLOW).covariance(part) for part in self.hollow)
        return np.asarray(back @ inner @ back.T + shells)

    def with_grasp(self, body: InertialParameters) -> Array:
        """Return the covariance (10, 10) that a wrong shape and a wrong grasp give the parameters of a body.

        A turn u of unit variance moves phi by u a + u^2 b: beside a a^T, E u^4 = 3 times b b^T.
        """
        out = self.covariance(body)
        for X in self.grasp_steps():
            off, bend = self._moved(body, X)
            out += np.outer(off, off) + 3 * np.outer(bend, bend)
        return out

    @staticmethod
    def _moved(body: InertialParameters, X: Pose) -> tuple[Array, Array]:
        """Return what a displacement does to phi (10,) in first and in second order."""
        there, back = body.in_frame(X).vector, body.in_frame(X.inverse()).vector
        return (there - back) / 2, (there + back) / 2 - body.vector


def misdrawn(data: Effective, parts: Parts, masses: Masses, error: ShapeError) -> Masses:
    """Return the masses of parts with what borders that a scan drew a little off add to their covariance.

    error  of the shape as a whole, by which the log was blurred for the masses

    To first order: a part k that is shifted by d misses m_k dB_k of phi, and C B^T F m_k dB_k of it goes to the
    masses. The whole does not feel it: the log alone holds that.
    """
    blurred = data.blurred(error.with_grasp(parts.whole(masses.mean)))
    gain = masses.covariance @ parts.per_mass.T @ blurred.information
    shifted = (parts.in_frame(Pose(Rotation.identity(), DRAWN * axis)).per_mass for axis in np.eye(3))
    steps = [gain @ ((moved - parts.per_mass) * masses.mean) for moved in shifted]
    return replace(masses, covariance=masses.covariance + sum(step @ step.T for step in steps))


def _second_moments(inertia: Array) -> Array:
    """Return the second moments (3, 3) of a body with this inertia, about the same point."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def _turned(inertia: Array) -> Array:
    """Return what small turns about each axis do to the inertia about the centre of mass (6, 3), per radian."""
    cross = np.cross(np.eye(3), np.eye(3)[:, None])  # (3, 3, 3): cross[k] @ v = e_k x v
    change = cross @ inertia - inertia @ cross
    return forms.upper(change).T


def _stretched(inertia: Array, stretch: float) -> Array:
    """Return what six independent strains of one standard deviation do to the inertia about the centre of mass (6, 6).

    The second moments S = 1/2 tr(I) 1 - I become S + S^1/2 E S^1/2. Of the symmetric E the entries on the diagonal have
    the variance `stretch` squared and those beside it half of that, so that no axes are preferred; each entry errs by a
    share of what it comes from. Across a long body, where no scan sees whether a tang runs through the grip, the
    diagonal's are larger by CORE: the small moments are those of the skin, and what is inside may lie at the middle.
    """
    moments, axes = np.linalg.eigh(_second_moments(inertia))
    moments = np.maximum(moments, 0)
    root = axes * np.sqrt(moments)
    across = CORE * (1 - np.sqrt(moments / max(float(moments[-1]), 1e-300)))
    out = np.empty((6, 6))
    for k, (i, j) in enumerate(forms.UPPER):
        E = np.zeros((3, 3))
        E[i, j] = E[j, i] = np.hypot(stretch, across[i]) if i == j else stretch * np.sqrt(0.5)
        change = root @ E @ root.T
        out[:, k] = forms.upper(np.trace(change) * np.eye(3) - change)
    return out


EXACT = ShapeError()
# What a mesh of a real tool is wrong by even when it is right.
MEASURED = ShapeError(com_m=1e-4, inertia_share=3e-3)
