"""One self-contained page about one result: numbers, the parts in 3D, residuals, findings."""

from steelyard.report.contents import Report, Residuals, Truth
from steelyard.report.page import render, write_report
from steelyard.report.scene import Scene, scene_of_mesh, scene_of_solid

__all__ = ["Report", "Residuals", "Scene", "Truth", "render", "scene_of_mesh", "scene_of_solid", "write_report"]
