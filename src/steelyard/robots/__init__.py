"""Robots: kinematics and joint torques of the arms that Steelyard knows by name."""

from steelyard.robots.delta import Delta
from steelyard.robots.omnid import Omnid

__all__ = ["Delta", "Omnid"]
