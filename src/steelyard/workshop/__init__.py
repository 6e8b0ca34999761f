"""The embedded data set: twenty families of workshop tools as exact solids of real materials."""

from steelyard.workshop.tools import Tool

__all__ = ["Tool"]
