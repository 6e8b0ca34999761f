"""What a table shows of an answer: estimates of one arm and of a team are such values, and know their own table."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol, runtime_checkable

from steelyard.check import Array, Mask
from steelyard.evidence import Evidence, PartMass
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters


class Weighed(Protocol):
    """An estimate of one body."""

    @property
    def parameters(self) -> InertialParameters:
        """The ten parameters about the origin of `frame`."""

    @property
    def people_covariance(self) -> Array:
        """(10, 10) of mass, com, inertia about it."""

    @property
    def std(self) -> Array:
        """(10,) of the same."""

    @property
    def identified(self) -> Mask:
        """(10,) of the same: what the data fix."""

    @property
    def inertia_com(self) -> Array | None:
        """(3, 3) [kg m^2], None unless all of it is identified."""

    @property
    def wrench_bias(self) -> Array:
        """(6,) torque [N m], force [N]."""

    @property
    def bias_covariance(self) -> Array:
        """(6, 6) of the bias."""

    @property
    def method(self) -> str:
        """The estimator."""

    @property
    def frame(self) -> str:
        """S, or the grasp of a team."""

    @property
    def evidence(self) -> Evidence:
        """What the data had to say."""

    @property
    def at_rest(self) -> str:
        """How many rows are at rest, in words."""

    @property
    def delays_s(self) -> Mapping[str, float]:
        """By stream [s]."""

    @property
    def findings(self) -> tuple[Finding, ...]:
        """What must be known about the answer."""

    @property
    def parts(self) -> tuple[PartMass, ...]:
        """Masses of the parts."""

    @property
    def notes(self) -> tuple[str, ...]:
        """What was chosen and assumed."""


@runtime_checkable
class Carried(Weighed, Protocol):
    """An estimate of what a team carries."""

    @property
    def reference(self) -> str:
        """The robot in whose grasp frame the answer is."""

    @property
    def grasps(self) -> Mapping[str, Any]:
        """By robot: pose, std_m, std_deg."""

    @property
    def clock_offsets_s(self) -> Mapping[str, float]:
        """By robot [s]."""

    @property
    def clock_offset_std_s(self) -> Mapping[str, float]:
        """Their standard deviations [s]."""

    @property
    def wrenches_taken(self) -> Mapping[str, str]:
        """By robot whose wrench was taken otherwise than given, how."""

    @property
    def hinge(self) -> Any:
        """Two bodies with a hinge, None for one."""
