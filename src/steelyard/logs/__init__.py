"""Logs: raw streams on their own clocks, one aligned log, and its sufficient statistic."""
