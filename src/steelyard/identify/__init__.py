"""Estimators of the ten parameters and the one result type."""
