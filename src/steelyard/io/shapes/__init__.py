"""Clouds, solids and objects as files beside PLY: PCD, parts, kept scans, other meshers."""
