"""Delta: a parallel mechanism of three driven links whose platform moves without turning.

The base frame has its origin in the plane of the three joint axes, z towards the platform. Arm k stands at azimuth
2 pi k / 3; its joint angle is the elevation of the driven link above that plane. Batch-first, closed forms throughout.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.spatial import cross

_AZIMUTH = 2 * np.pi * np.arange(3) / 3
_OUT = np.column_stack([np.cos(_AZIMUTH), np.sin(_AZIMUTH), np.zeros(3)])
_SIDE = np.column_stack([-np.sin(_AZIMUTH), np.cos(_AZIMUTH), np.zeros(3)])
_UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class Delta:
    """Link sizes [m]: radii of base and platform, driven link, upper link (joint to joint)."""

    base_radius: float = 0.180
    platform_radius: float = 0.062
    driven_link: float = 0.200
    upper_link: float = 0.368

    def position(self, angles: ArrayLike) -> Array:
        """Return the platform centre (..., 3) [m] in the base frame from joint angles (..., 3) [rad].

        The centre lies where three balls of the upper link's length meet, above their centres.
        Raises BadValue where they do not meet.
        """
        knees = self._knees(check.vectors("joint angles", angles))
        first = knees[..., 0, :]
        a, b = knees[..., 1, :] - first, knees[..., 2, :] - first
        normal = cross(a, b)
        square = _dot(normal, normal)
        middle = cross(_dot(a, a)[..., None] * b - _dot(b, b)[..., None] * a, normal) / (2 * square[..., None])
        height = self.upper_link**2 - _dot(middle, middle)
        if (height < 0).any():
            raise BadValue(
                f"joint angles must be ones the Delta can close on; {int((height < 0).sum())} of {height.size} leave "
                "the upper links too short to meet."
            )
        return np.asarray(first + middle + np.sqrt(height / square)[..., None] * normal)

    def angles(self, position: ArrayLike) -> Array:
        """Return joint angles (..., 3) [rad], elbows out, from the platform centre (..., 3) [m].

        Raises BadValue where the platform is out of reach.
        """
        found = self._elbows_out(check.vectors("platform position", position))
        out = np.isnan(found).any(-1)
        if out.any():
            where = np.argwhere(out)[0]
            place = np.asarray(position)[tuple(where)]
            raise BadValue(
                f"platform positions must be within reach of the Delta; {int(out.sum())} of {out.size} are not, the "
                f"first at ({place[0]:.3f}, {place[1]:.3f}, {place[2]:.3f}) m."
            )
        return found

    def reaches(self, position: ArrayLike) -> np.ndarray[tuple[int, ...], np.dtype[np.bool_]]:
        """Return where (...) the platform centre (..., 3) [m] can be reached at all, whatever the joint limits."""
        return np.asarray(np.isfinite(self._elbows_out(check.vectors("platform position", position))).all(-1))

    def jacobian(self, angles: ArrayLike) -> Array:
        """Return d position / d angles (..., 3, 3) [m/rad].

        Each upper link keeps its length: s_k . dp = L (s_k . t_k) d angle_k, with s_k along the upper link and t_k the
        direction in which the knee moves. Raises BadValue at a singular configuration.
        """
        links, lever = self._links(angles)
        flat = np.abs(np.linalg.det(links)) < 1e-9 * self.upper_link**3
        if flat.any():
            raise BadValue(f"the Delta is singular in {int(flat.sum())} of {flat.size} rows: upper links in one plane.")
        return np.asarray(np.linalg.solve(links, lever[..., None] * np.eye(3)))

    def force(self, angles: ArrayLike, torques: ArrayLike) -> Array:
        """Return the force (..., 3) [N] that the platform applies, f = J^-T tau, from joint torques (..., 3) [N m].

        Raises BadValue where an upper link is in line with its driven link and its torque says nothing.
        Source: "Cooperative Payload Estimation by a Team of Mocobots", IV-B.
        """
        links, lever = self._links(angles)
        dead = np.abs(lever) < 1e-6 * self.upper_link * self.driven_link
        if dead.any():
            raise BadValue(
                f"forces need bent elbows; in {int(dead.any(-1).sum())} of {dead[..., 0].size} rows an upper link is "
                "in line with its driven link."
            )
        return np.asarray(np.einsum("...ki,...k->...i", links, check.vectors("joint torques", torques) / lever))

    def torques(self, angles: ArrayLike, force: ArrayLike) -> Array:
        """Return the joint torques (..., 3) [N m], tau = J^T f, that hold the platform's force (..., 3) [N]."""
        return np.asarray(np.einsum("...ik,...i->...k", self.jacobian(angles), check.vectors("force", force)))

    def _knees(self, angles: Array) -> Array:
        """Return the balls' centres (..., 3, 3): the knees, moved inwards by the platform's radius."""
        out = self.base_radius - self.platform_radius + self.driven_link * np.cos(angles)
        return np.asarray(out[..., None] * _OUT + (self.driven_link * np.sin(angles))[..., None] * _UP)

    def _links(self, angles: ArrayLike) -> tuple[Array, Array]:
        """Return the upper links (..., 3, 3), one a row, and how far each joint pushes along its link (..., 3)."""
        q = check.vectors("joint angles", angles)
        links = self.position(q)[..., None, :] - self._knees(q)
        moves = -np.sin(q)[..., None] * _OUT + np.cos(q)[..., None] * _UP
        return links, self.driven_link * _dot(links, moves)

    def _elbows_out(self, position: Array) -> Array:
        """Return joint angles (..., 3), NaN where an arm cannot reach."""
        out = position @ _OUT.T - (self.base_radius - self.platform_radius)
        side, up = position @ _SIDE.T, position[..., 2:]
        longest = np.hypot(out, up)
        reach = (out**2 + side**2 + up**2 + self.driven_link**2 - self.upper_link**2) / (2 * self.driven_link)
        with np.errstate(invalid="ignore", divide="ignore"):
            return np.asarray(np.arctan2(up, out) - np.arccos(reach / longest))


def _dot(a: Array, b: Array) -> Array:
    return np.asarray((a * b).sum(-1))
