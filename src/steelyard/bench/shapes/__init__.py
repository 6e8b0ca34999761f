"""What clusters, hulls and segments are held against: plain Python, sets of points, the table."""
