"""The tree of merges along seams: what a seam between two pieces costs, and which pieces are joined next."""
