"""The ten inertial parameters of a rigid body, their forms and laws, and closed-form solids."""

from steelyard.inertia.parameters import InertialParameters
from steelyard.inertia.validity import ValidityReport

__all__ = ["InertialParameters", "ValidityReport"]
