"""What a convex hull and a Delaunay complex stand on: exact signs, and the faces of a growing hull."""
