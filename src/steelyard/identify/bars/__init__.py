"""Error bars: correlated noise, errors that come back with the pose, answers without one pose."""
