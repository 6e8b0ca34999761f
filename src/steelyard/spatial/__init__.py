"""Rotations, poses and six-vectors: batch-first, angular part first, SI units."""

from steelyard.spatial.pose import Pose
from steelyard.spatial.rotation import Rotation
from steelyard.spatial.vectors import (
    Acceleration,
    Twist,
    Wrench,
    area_vectors,
    axial_vector,
    classical_acceleration,
    cross,
    cross_matrix,
    lever_acceleration,
    lever_matrix,
    signed_axes,
    signed_columns,
    summed,
    unit_vectors,
)

__all__ = [
    "Acceleration",
    "Pose",
    "Rotation",
    "Twist",
    "Wrench",
    "area_vectors",
    "axial_vector",
    "classical_acceleration",
    "cross",
    "cross_matrix",
    "lever_acceleration",
    "lever_matrix",
    "signed_axes",
    "signed_columns",
    "summed",
    "unit_vectors",
]
