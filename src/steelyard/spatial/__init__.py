"""Rotations, poses and six-vectors: batch-first, angular part first, SI units."""

from steelyard.spatial.pose import Pose as Pose
from steelyard.spatial.rotation import Rotation as Rotation
from steelyard.spatial.vectors import Acceleration as Acceleration
from steelyard.spatial.vectors import Twist as Twist
from steelyard.spatial.vectors import Wrench as Wrench
from steelyard.spatial.vectors import area_vectors as area_vectors
from steelyard.spatial.vectors import axial_vector as axial_vector
from steelyard.spatial.vectors import classical_acceleration as classical_acceleration
from steelyard.spatial.vectors import cross as cross
from steelyard.spatial.vectors import cross_matrix as cross_matrix
from steelyard.spatial.vectors import lever_acceleration as lever_acceleration
from steelyard.spatial.vectors import lever_matrix as lever_matrix
from steelyard.spatial.vectors import signed_axes as signed_axes
from steelyard.spatial.vectors import signed_columns as signed_columns
from steelyard.spatial.vectors import summed as summed
from steelyard.spatial.vectors import unit_vectors as unit_vectors
