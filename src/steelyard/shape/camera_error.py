"""Which one error of the camera explains how its views have the table: focal lengths, how it sits at the wrist.

Every levelled view says where the table lies as its camera measures it: a direction and a distance. A wrong focal
length tilts that the more the more obliquely the camera looks, half sin(2 e) of its share at an elevation e; a camera
turned at the wrist tilts it by the same angle everywhere. Views of different elevations tell the two apart.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.shape.common_table import ACROSS
from steelyard.shape.scene import Scene
from steelyard.shape.views import Intrinsics
from steelyard.spatial import Pose, Rotation

_SURE = 6.0  # standard errors of what is named: those of so few blocks are too small by half
_LENS = 0.02  # of the focal length: less is hardly worth a word, and passes for errors of the arm
_TURN = np.radians(0.2)  # at the wrist, likewise
_EXPLAINED = 0.5  # of what is left without it: so little must be left with it
_ROUGH = 1e-3  # of heights [m]: beyond it a view counts less
_BLOCKS = 10  # of views one after the other, whose errors may hang together
_LEAST = 12  # views that can tell
# Columns of the unknowns: log of the focal length, turn and shift at the wrist, slope and height of the table.
_FOCAL, _WRIST, _PLACE, _SLOPE, _HEIGHT = 0, slice(1, 4), slice(4, 7), slice(7, 9), 9
_PRIOR = np.array([0.3, *[0.3] * 3, *[0.02] * 3, 0.1, 0.1, 0.1])  # standard deviations, of parts, rad, m and slopes


@dataclass(frozen=True)
class CameraError:
    """What is wrong with the camera by the table that its views share; 1 and 0 where nothing is.

    focal   true focal length over the given one
    turned  angle by which the camera sits turned at the wrist [rad]
    """

    focal: float = 1.0
    turned: float = 0.0

    def said(self, lens: Intrinsics) -> str:
        """Return a sentence on it to whom gave the lens; "" where nothing is wrong."""
        causes = []
        if self.focal != 1.0:
            causes.append(
                f"with focal lengths times {self.focal:.3f} (fx {self.focal * lens.fx:.0f}, fy "
                f"{self.focal * lens.fy:.0f} in camera.json)"
            )
        if self.turned:
            causes.append(
                f"with a camera turned by {np.degrees(self.turned):.1f} degrees at the wrist (calibrate hand to eye "
                "anew)"
            )
        return f"{' and '.join(causes).capitalize()} the views would have one table." if causes else ""


def camera_error(scene: Scene) -> CameraError:
    """Return what the views, just levelled, say against focal length and hand-eye calibration."""
    if len(scene.R) < _LEAST:
        return CameraError()
    given = scene.X_WT.inverse() @ scene.views.X_WC
    seen = _Tables(given, scene.R[:, 2], scene.p[:, 2], ACROSS * scene.distance)
    free = np.ones(len(_PRIOR), bool)
    found, left, std = seen.explained(free)
    lens = bool(abs(found[_FOCAL]) > max(_SURE * std[_FOCAL], _LENS))
    free[_FOCAL], free[_WRIST], free[_PLACE] = lens, False, False
    turned = float(np.linalg.norm(found[_WRIST]))
    turns = turned > _TURN and left < _EXPLAINED * seen.explained(free)[1]
    return CameraError(float(np.exp(-found[_FOCAL])) if lens else 1.0, turned if turns else 0.0)


@dataclass(frozen=True, eq=False)
class _Tables:
    """The table as V views have it.

    given   their poses in the table's frame, as reported
    normal  (V, 3) of the table in the camera's axes      height  (V,) of the camera over it [m]
    across  length that makes angles of normals heights [m]
    """

    given: Pose
    normal: Array
    height: Array
    across: float

    def apart(self, x: Array) -> Array:
        """Return by how much the views measure the table apart from one that all share (V, 4) [m].

        x (10,) of the camera: logarithm of the focal length over the true one, turn [rad] and shift [m] at the
        wrist; of the table: two slopes and a height [m].
        """
        R, p = self.given.rotation.matrix, self.given.position
        up = np.append(x[_SLOPE], 1.0) / np.sqrt(1 + x[_SLOPE] @ x[_SLOPE])
        # A focal length k times too long has all points k times too near the axis, so normals lean k times as far.
        lens = np.exp(x[_FOCAL]) * np.array([1.0, 1.0, 0.0]) + np.array([0.0, 0.0, 1.0])
        normal = (up @ R @ Rotation.exp(x[_WRIST]).matrix) * lens
        long = np.linalg.norm(normal, axis=1)
        height = ((p + R @ x[_PLACE]) @ up - x[_HEIGHT]) / long
        return np.column_stack([self.across * (normal / long[:, None] - self.normal), height - self.height])

    def explained(self, free: Array) -> tuple[Array, float, Array]:
        """Return the unknowns (10,) that explain most, what they leave, rms [m], and standard errors (10,).

        free (10,) which are not held at zero. The errors are of blocks of views, since those of an arm hang together.
        """
        from scipy.optimize import least_squares

        def spread(y: Array) -> Array:
            x = np.zeros(len(free))
            x[free] = y
            return x

        def residual(y: Array) -> Array:
            return np.append(self.apart(spread(y)).ravel(), _ROUGH * y / _PRIOR[free])

        fit = least_squares(residual, np.zeros(int(free.sum())), loss="soft_l1", f_scale=_ROUGH)
        rest = self.apart(spread(fit.x))
        J = fit.jac[: rest.size].reshape(len(rest), 4, -1)
        pulls = np.einsum("vri,vr->vi", J, rest)
        block = np.arange(len(rest)) * _BLOCKS // len(rest)
        summed = np.stack([pulls[block == b].sum(0) for b in range(_BLOCKS)])
        inverse = np.linalg.inv(fit.jac.T @ fit.jac)
        return spread(fit.x), float(np.sqrt((rest**2).sum(1).mean())), spread(np.linalg.norm(summed @ inverse, axis=0))
