"""Hierarchical tetrahedra clustering in one compiled function: what a merge costs, which is next, small hulls."""
