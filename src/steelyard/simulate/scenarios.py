"""The embedded bench of ten box-made objects, three motions and four noise levels, by name.

Source: identify_bench.json beside this file; its `meaning` fields are what `motion` builds.
"""

from __future__ import annotations

import json
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters, solids
from steelyard.simulate.motions import Fourier, Motion, Step, StopAndGo
from steelyard.simulate.noise import Std
from steelyard.spatial import Pose, Rotation

STILL_SPEED = 0.005
STILL_ANGULAR_SPEED = 0.01


@dataclass(frozen=True, eq=False)
class BoxUnion:
    """Boxes with edges `size` (K, 3) [m], centres `centre` (K, 3) [m] in S and `density` (K,) [kg/m^3].

    Where boxes overlap both count, so that the masses simply add.
    """

    size: Array
    centre: Array
    density: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "size", check.vectors("box sizes", self.size))
        object.__setattr__(self, "centre", check.vectors("box centres", self.centre))
        object.__setattr__(self, "density", check.vectors("box densities", self.density, len(self.size)))
        if self.size.shape != self.centre.shape or self.size.ndim != 2 or not len(self.size):
            raise BadValue(f"box sizes and centres must both be (K, 3); got {self.size.shape}, {self.centre.shape}.")

    def parameters(self) -> InertialParameters:
        """Return the ten parameters about the origin of S."""
        total = InertialParameters(np.zeros(10))
        for size, centre, density in zip(self.size, self.centre, self.density, strict=True):
            box = solids.box(float(size[0]), float(size[1]), float(size[2]), float(density))
            total = total + box.in_frame(Pose(Rotation.identity(), centre))
        return total

    def bounds(self) -> Array:
        """Return the lower and upper corner (2, 3) [m] of the bounding box in S."""
        return np.stack([(self.centre - self.size / 2).min(0), (self.centre + self.size / 2).max(0)])


@cache
def bench() -> dict[str, Any]:
    """Return the embedded bench as it stands in its file."""
    text = resources.files(__package__).joinpath("identify_bench.json").read_text("utf-8")
    loaded: dict[str, Any] = json.loads(text)
    return loaded


def object_names() -> tuple[str, ...]:
    """Return the names of the ten objects."""
    return tuple(bench()["objects"])


def motion_names() -> tuple[str, ...]:
    """Return the names of the three motions."""
    return tuple(bench()["motions"])


def noise_names() -> tuple[str, ...]:
    """Return the names of the noise levels, weakest first."""
    return tuple(name for name in bench()["noise_std"] if name != "unit")


def _named(kind: str, name: str) -> Any:
    """Return the entry `name` of the section `kind`, or say which names there are."""
    entries = bench()[kind]
    if name not in entries or name == "unit":
        there = ", ".join(n for n in entries if n != "unit")
        raise BadValue(f"There is no '{name}' in the bench's {kind}; there are: {there}.")
    return entries[name]


@cache
def body(name: str) -> BoxUnion:
    """Return the object `name`."""
    boxes = _named("objects", name)
    columns = [np.array([box[key] for box in boxes], float) for key in ("size_m", "centre_m", "density_kg_m3")]
    return BoxUnion(*columns)


@cache
def motion(name: str) -> Motion:
    """Return the motion `name`."""
    entry = _named("motions", name)
    return _stop_and_go(entry) if entry["kind"] == "stop-and-go" else _fourier(entry)


def _stop_and_go(entry: dict[str, Any]) -> StopAndGo:
    keys = np.radians(np.array(entry["rotation_keys_deg"], float))
    moves = (Step(0.0, 1.0, np.array([0, 0, 0.15])), Step(5.0, 1.0, np.array([0.1, 0, 0])))
    return StopAndGo(keys, interval=10 / len(keys), duration=0.55, moves=moves)


def _fourier(entry: dict[str, Any]) -> Fourier:
    def table(name: str) -> Array:
        return np.array(entry[name], float)

    return Fourier(
        frequency=entry["base_frequency_hz"],
        rotation_amplitude=entry["rotation_amplitude_rad"],
        rotation_cos=table("rotation_cos"),
        rotation_sin=table("rotation_sin"),
        position_amplitude=entry["position_amplitude_m"],
        position_cos=table("position_cos"),
        position_sin=table("position_sin"),
    )


def noise_std(name: str) -> Std:
    """Return standard deviations of angular acceleration, acceleration, force, torque in SI units."""
    angular, linear, force, torque = (float(v) for v in _named("noise_std", name))
    return angular, linear, force, torque
