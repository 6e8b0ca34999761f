"""Steelyard tells a robot what it holds: mass, centre of mass and inertia, with honest error bars.

    import steelyard as sy
    estimate = sy.identify("log.toml")
    print(estimate.mass, estimate.com, estimate.std)

Names are imported on first use, so that `import steelyard` is quick.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

_HOME = {
    "identify": "steelyard.api",
    "identify_team": "steelyard.api",
    "compare": "steelyard.api",
    "recording": "steelyard.io.arrays",
    "read_recording": "steelyard.io",
    "read_team": "steelyard.io",
    "write_result": "steelyard.io",
    "read_result": "steelyard.io",
    "Recording": "steelyard.logs.recording",
    "Stream": "steelyard.logs.recording",
    "MotionLog": "steelyard.logs.log",
    "Noise": "steelyard.logs.log",
    "TeamLog": "steelyard.logs.team_log",
    "Moments": "steelyard.logs.moments",
    "InertialParameters": "steelyard.inertia",
    "solids": "steelyard.inertia",
    "Pose": "steelyard.spatial",
    "Rotation": "steelyard.spatial",
    "Wrench": "steelyard.spatial",
    "Twist": "steelyard.spatial",
    "Acceleration": "steelyard.spatial",
    "Estimate": "steelyard.identify.estimate",
    "TeamEstimate": "steelyard.team.estimate",
    "Finding": "steelyard.findings",
    "NoiseAware": "steelyard.identify.noise_aware",
    "LeastSquares": "steelyard.identify.least_squares",
    "Geodesic": "steelyard.identify.geodesic",
    "Options": "steelyard.pipelines.options",
    "SteelyardError": "steelyard.errors",
    "BadInput": "steelyard.errors",
    "CannotAnswer": "steelyard.errors",
}

__all__ = ["__version__", *sorted(_HOME)]

if TYPE_CHECKING:
    from steelyard.api import compare as compare
    from steelyard.api import identify as identify
    from steelyard.api import identify_team as identify_team
    from steelyard.errors import BadInput as BadInput
    from steelyard.errors import CannotAnswer as CannotAnswer
    from steelyard.errors import SteelyardError as SteelyardError
    from steelyard.findings import Finding as Finding
    from steelyard.identify.estimate import Estimate as Estimate
    from steelyard.identify.geodesic import Geodesic as Geodesic
    from steelyard.identify.least_squares import LeastSquares as LeastSquares
    from steelyard.identify.noise_aware import NoiseAware as NoiseAware
    from steelyard.inertia import InertialParameters as InertialParameters
    from steelyard.inertia import solids as solids
    from steelyard.io import read_recording as read_recording
    from steelyard.io import read_result as read_result
    from steelyard.io import read_team as read_team
    from steelyard.io import write_result as write_result
    from steelyard.io.arrays import recording as recording
    from steelyard.logs.log import MotionLog as MotionLog
    from steelyard.logs.log import Noise as Noise
    from steelyard.logs.moments import Moments as Moments
    from steelyard.logs.recording import Recording as Recording
    from steelyard.logs.recording import Stream as Stream
    from steelyard.logs.team_log import TeamLog as TeamLog
    from steelyard.pipelines.options import Options as Options
    from steelyard.spatial import Acceleration as Acceleration
    from steelyard.spatial import Pose as Pose
    from steelyard.spatial import Rotation as Rotation
    from steelyard.spatial import Twist as Twist
    from steelyard.spatial import Wrench as Wrench
    from steelyard.team.estimate import TeamEstimate as TeamEstimate


def __getattr__(name: str) -> Any:
    if name not in _HOME:
        raise AttributeError(f"module 'steelyard' has no attribute {name!r}; it has {', '.join(__all__)}")
    home = import_module(_HOME[name])
    return getattr(home, name, None) or import_module(f"{home.__name__}.{name}")


def __dir__() -> list[str]:
    return list(__all__)
