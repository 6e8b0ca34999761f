"""Robots: kinematics and joint torques of the arms that Steelyard knows by name."""

from steelyard.robots.delta import Delta
from steelyard.robots.omnid import Omnid
from steelyard.robots.serial import Joint, SerialArm

__all__ = ["Delta", "Joint", "Omnid", "SerialArm"]
