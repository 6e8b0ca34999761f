"""Points of a surface: how dense, how noisy, thinned, and freed of what is no object."""
