"""Which error of the lens explains where its views see the table: in the focal length, or in the principal point.

Every levelled view says where the table lies as its camera measures it: a direction and a distance. A focal length
that is wrong tilts that by half sin(2 e) of its share at an elevation e, a principal point by cos(e)^2, a camera
turned at the wrist by the same angle everywhere. Views of different elevations tell them apart.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.shape.scans.common_table import ACROSS
from steelyard.shape.scans.scene import Scene
from steelyard.shape.views import Intrinsics
from steelyard.spatial import Pose, Rotation

_SURE = 5.0  # standard errors of a focal length that is believed
_PASSES = 3.0  # of the tilts that are left: so much may errors of an arm that go with its posture pass for
_LEAST = 0.01  # of the focal length: a lens that errs less is as good
_ROUGH = 1e-3  # of heights [m]: beyond it a view counts less
_BLOCKS = 10  # of views one after the other, whose errors may hang together
_FEW = 12  # views that can tell
# Of the unknowns: logarithm of the focal length given over the true one, principal point as the tangent of the angle
# that it is off, turn [rad] and shift [m] of the camera at the wrist, slopes and height [m] of the table.
_FOCAL, _POINT, _TURN, _SHIFT, _SLOPE, _HEIGHT = 0, slice(1, 3), slice(3, 6), slice(6, 9), slice(9, 11), 11
_LENS = slice(0, 3)
_STD = np.array([0.3, 0.1, 0.1, *[0.3] * 3, *[0.02] * 3, 0.1, 0.1, 0.1])  # of them, before anything is known


def lens_by_table(scene: Scene) -> Intrinsics | None:
    """Return the lens with which the views, just levelled, have one table; None where the given one is as good."""
    if len(scene.R) < _FEW:
        return None
    given = scene.X_WT.inverse() @ scene.views.X_WC
    seen = Tables(given, scene.R[:, 2], scene.p[:, 2], ACROSS * scene.distance)
    free = np.ones(len(_STD), bool)
    for _ in range(2):  # the second time with what the first found of the lens, and nothing else
        found, left, std = seen.explained(free)
        off = np.abs(found[_LENS])
        free[_LENS] &= off > np.maximum(np.maximum(_SURE * std[_LENS], _LEAST), _PASSES * left / seen.across)
    lens = found[_LENS] * free[_LENS]
    return _corrected(scene.views.intrinsics, *lens) if lens.any() else None


def _corrected(lens: Intrinsics, log_focal: float, x: float, y: float) -> Intrinsics | None:
    """Return the lens put right; None where no camera has its principal point there: then it is something else."""
    k, cx, cy = np.exp(-log_focal), lens.cx + x * lens.fx, lens.cy + y * lens.fy
    if not (0 <= cx <= lens.width - 1 and 0 <= cy <= lens.height - 1):
        return None
    return replace(lens, fx=float(k * lens.fx), fy=float(k * lens.fy), cx=float(cx), cy=float(cy))


@dataclass(frozen=True, eq=False)
class Tables:
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
        """Return by how much the views measure the table apart from one that all share (V, 4) [m], by unknowns x."""
        R, p = self.given.rotation.matrix, self.given.position
        up = np.append(x[_SLOPE], 1.0) / np.sqrt(1 + x[_SLOPE] @ x[_SLOPE])
        # What is measured at (x, y, z) is at (k (x - ex z), k (y - ey z), z): so planes m become M m.
        k, (ex, ey) = np.exp(x[_FOCAL]), x[_POINT]
        M = np.array([[k, 0, 0], [0, k, 0], [-k * ex, -k * ey, 1]])
        normal = up @ R @ Rotation.exp(x[_TURN]).matrix @ M.T
        long = np.linalg.norm(normal, axis=1)
        height = ((p + R @ x[_SHIFT]) @ up - x[_HEIGHT]) / long
        return np.column_stack([self.across * (normal / long[:, None] - self.normal), height - self.height])

    def explained(self, free: Array) -> tuple[Array, float, Array]:
        """Return the unknowns (12,) that explain most, what they leave, rms [m], and standard errors (12,).

        free (12,) which are not held at zero. The errors are of blocks of views, since those of an arm hang together.
        """
        from scipy.optimize import least_squares

        def spread(y: Array) -> Array:
            x = np.zeros(len(free))
            x[free] = y
            return x

        def residual(y: Array) -> Array:
            return np.append(self.apart(spread(y)).ravel(), _ROUGH * y / _STD[free])

        fit = least_squares(residual, np.zeros(int(free.sum())), loss="soft_l1", f_scale=_ROUGH)
        rest = self.apart(spread(fit.x))
        std = _jackknifed(fit.jac, rest)
        return spread(fit.x), float(np.sqrt((rest**2).sum(1).mean())), spread(std)


def _jackknifed(J: Array, rest: Array) -> Array:
    """Return standard errors of what J leaves as `rest` (V, 4): by how much it would be other without a block of views.

    J  Jacobian, weighed as the rows were, of all `rest` and of what was known before
    """
    # SciPy's rows of a soft loss are scaled by this to the power of -0.75, a gradient has -0.5.
    weigh = (1 + (rest / _ROUGH) ** 2) ** 0.25
    block = np.arange(len(rest)) * _BLOCKS // len(rest)
    rows, H = J[: rest.size].reshape(len(rest), 4, -1), J.T @ J
    without = []
    for b in range(_BLOCKS):
        own = rows[block == b].reshape(-1, J.shape[1])
        without.append(np.linalg.solve(H - own.T @ own, own.T @ (weigh * rest)[block == b].ravel()))
    return np.asarray(np.sqrt((1 - 1 / _BLOCKS) * np.square(without).sum(0)))
