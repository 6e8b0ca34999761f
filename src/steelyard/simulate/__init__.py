"""Ground truth: bodies made of boxes, exact motions, noise, and the logs they give."""

from steelyard.simulate.logs import bounds, log_of, simulate_log

__all__ = ["bounds", "log_of", "simulate_log"]
