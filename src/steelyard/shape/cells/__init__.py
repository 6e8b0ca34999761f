"""Cells of a Delaunay complex: made, judged, cut in two, and freed of islands."""
