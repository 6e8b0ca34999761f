"""TeamEstimate: an Estimate in the reference grasp, with every grasp, clock offset and principal frame."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.spatial import Pose
from steelyard.team.misread.readings import in_few_words


@dataclass(frozen=True, eq=False)
class GraspEstimate:
    """Pose X_RG of one grasp in the reference grasp R.

    covariance  (6, 6) of its rotation vector and position, both in R's axes [rad, m]: the true rotation is
                exp(error) times the one found
    lost        directions (k, 6) in the same coordinates that the motion does not show; empty when it shows all
    """

    pose: Pose
    covariance: Array
    lost: Array = field(default_factory=lambda: np.zeros((0, 6)))

    @property
    def std(self) -> Array:
        """Standard deviations (6,) [rad, m] along R's axes."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0))

    @property
    def std_deg(self) -> Array:
        """Standard deviations (3,) of the rotation about R's axes [deg]."""
        return np.rad2deg(self.std[:3])

    @property
    def std_m(self) -> Array:
        """Standard deviations (3,) of the position [m]."""
        return self.std[3:]

    def away_from(self, true: Pose) -> tuple[float, float]:
        """Return distance [mm] and angle [deg] from the true grasp."""
        turn = (true.rotation.inverse() @ self.pose.rotation).angle()
        return 1e3 * float(np.linalg.norm(self.pose.position - true.position)), float(np.rad2deg(turn))


@dataclass(frozen=True, eq=False)
class BodyEstimate:
    """One of two bodies with a hinge between them, as far as any motion tells it, in the reference grasp's axes.

    robots             who holds it
    hinge_moment       moment of inertia about the hinge [kg m^2], with standard deviation; NaN where not shown
    first_moment       (3,) mass times the way from the hinge's line to the centre of mass [kg m], across the hinge,
                       with the hinge at zero; with standard deviations (3,), NaN where not shown
    lever_std          standard deviation of its length [kg m]
    mass_range         (2,) [kg] least and most that a body with these moments can weigh; NaN where not shown
    Mass alone, and the place of the centre of mass along the hinge, no motion tells: see `hinge.rows`.
    """

    robots: tuple[str, ...]
    hinge_moment: float
    hinge_moment_std: float
    first_moment: Array
    first_moment_std: Array
    lever_std: float
    mass_range: Array


@dataclass(frozen=True, eq=False)
class HingeEstimate:
    """The hinge between two bodies, in the reference grasp, and the bodies: that of the reference first.

    axis    (3,) unit vector, point (3,) [m] nearest to the middle of the grasps; largest standard deviations of both
    swing   how far it turned to either side of its mean, which counts as zero [rad]
    """

    axis: Array
    point: Array
    axis_std_deg: float
    point_std_m: float
    swing: float
    bodies: tuple[BodyEstimate, BodyEstimate]


@dataclass(frozen=True, eq=False, repr=False)
class TeamEstimate(Estimate):
    """What the team found: the ten parameters about the origin of the reference grasp R, and where everybody holds.

    reference           name of the robot whose grasp is R
    grasps              pose of every grasp in R, by name; the reference's own is exact
    clock_offsets_s     by how much each robot's stamps are late, against the reference; empty where not estimated
    clock_offset_std_s  their standard deviations
    wrench_biases       by recording: moment and force (6,) [N m, N] in R that the sensors of all robots together read
                        too much; none where the bias is not estimated
    wrench_maps         of robots whose wrench was taken otherwise than given, as with its sign turned: from moment and
                        force as given to what they were taken for (6, 6)
    hinge               where the payload is two bodies with a hinge: then everything above is for both together, with
                        the hinge at the mean of its angles; None for one body
    """

    reference: str = ""
    grasps: Mapping[str, GraspEstimate] = field(default_factory=dict)
    clock_offsets_s: Mapping[str, float] = field(default_factory=dict)
    clock_offset_std_s: Mapping[str, float] = field(default_factory=dict)
    wrench_biases: Mapping[str, Array] = field(default_factory=dict)
    wrench_maps: Mapping[str, Array] = field(default_factory=dict)
    hinge: HingeEstimate | None = None

    @property
    def wrenches_taken(self) -> dict[str, str]:
        """By robot whose wrench was taken otherwise than given, how, in a few words."""
        return {name: in_few_words(taken) for name, taken in self.wrench_maps.items()}

    @property
    def at_rest(self) -> str:
        """How many rows are of still recordings, in words; rests in motions are not counted."""
        return f"{self.evidence.still_samples} in still recordings"

    def poses_of(self, names: Sequence[str]) -> Pose:
        """Return the poses (N,) of these robots' grasps in R."""
        return Pose.stacked([self.grasps[name].pose for name in names])

    def away_from(self, true: Mapping[str, Pose]) -> tuple[float, float]:
        """Return mean distance [mm] and angle [deg] from the true grasps, of the robots other than the reference."""
        each = [self.grasps[name].away_from(grasp) for name, grasp in true.items() if name != self.reference]
        gap, turn = np.mean(each, axis=0).tolist()
        return gap, turn

    @cached_property
    def principal_moments(self) -> Array | None:
        """Principal moments (3,), rising [kg m^2]; None where the data do not fix the inertia."""
        return self.parameters.principal()[0] if self.inertia_com is not None else None

    @cached_property
    def principal_frames(self) -> dict[str, Pose]:
        """Pose of the principal frame, at the centre of mass, in every grasp; empty without an inertia."""
        if self.inertia_com is None:
            return {}
        frame = self.parameters.principal()[1]
        return {name: grasp.pose.inverse() @ frame for name, grasp in self.grasps.items()}
