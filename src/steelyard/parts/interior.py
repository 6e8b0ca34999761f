"""Interior: where the volume of parts is, for what their ten moments do not say."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

from steelyard.check import Array
from steelyard.shape.inside import inside
from steelyard.shape.mesh import TriangleMesh
from steelyard.spatial import Pose


@dataclass(frozen=True, eq=False)
class Interior:
    """The inside of P parts, filled with points only when asked, and once.

    mesh      closed surfaces in their own frame M
    surfaces  (P,) labels of the surfaces around each part, voids among them
    X_AM      pose of M in the frame A of the parts
    """

    mesh: TriangleMesh
    surfaces: tuple[tuple[int, ...], ...]
    X_AM: Pose = field(default_factory=Pose.identity)
    # Points in M that were asked for: they do not depend on the frame of the parts.
    filled: dict[tuple[int, int], tuple[Array, Array]] = field(default_factory=dict, repr=False)

    def points(self, part: int, count: int) -> tuple[Array, Array]:
        """Return about `count` points (K, 3) in part number `part` (its row) in A [m], and the volume (K,) of each."""
        if (part, count) not in self.filled:
            self.filled[part, count] = inside(self.mesh.of_part(*self.surfaces[part]), count)
        points, volume = self.filled[part, count]
        return self.X_AM.apply(points), volume

    def in_frame(self, X_BA: Pose) -> Interior:
        """Return the same inside seen from frame B."""
        return replace(self, X_AM=X_BA @ self.X_AM)

    def merged(self, groups: Sequence[Sequence[int]]) -> Interior:
        """Return the inside of parts joined: each group is a list of rows."""
        joined = tuple(tuple(k for row in g for k in self.surfaces[row]) for g in groups)
        return replace(self, surfaces=joined, filled={})
