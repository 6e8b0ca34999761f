"""Shapes: closed surfaces of triangles, their exact moments and how their parts lie in one another."""

from steelyard.shape.mesh import TriangleMesh

__all__ = ["TriangleMesh"]
