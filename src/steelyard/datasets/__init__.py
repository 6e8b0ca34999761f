"""Objects of data sets: their shape, their parts, the truth about them, and an exact motion of each."""
