"""Homogeneous parts of an object."""

from steelyard.parts.parts import Parts

__all__ = ["Parts"]
