"""What a report can hold; everything but the title and the estimate may be missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.identify.estimate import Estimate
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.report.scene import Scene
from steelyard.spatial import Pose


@dataclass(frozen=True, eq=False)
class Residuals:
    """What the answer leaves unexplained: measured less predicted wrench, row by row.

    time    (N,) [s]
    force   (N, 3) [N] in S
    torque  (N, 3) [N m] in S
    still   (N,) whether the row was at rest
    """

    time: Array
    force: Array
    torque: Array
    still: np.ndarray[Any, np.dtype[np.bool_]]

    @classmethod
    def of(cls, log: MotionLog, left: Array) -> Residuals | None:
        """Return what is left (N, 6) [N m, N] of the rows of a log; None where they have no time."""
        return None if log.time is None else cls(log.time, left[:, 3:], left[:, :3], log.still)

    def __post_init__(self) -> None:
        object.__setattr__(self, "time", check.finite("time", self.time))
        object.__setattr__(self, "force", check.vectors("force residuals", self.force))
        object.__setattr__(self, "torque", check.vectors("torque residuals", self.torque))
        object.__setattr__(self, "still", np.array(self.still, np.bool_))
        rows = self.time.shape
        if len(rows) != 1 or not rows[0]:
            raise BadValue(f"residuals need at least one row of time (N,); got {rows}.")
        for name in ("force", "torque", "still"):
            if getattr(self, name).shape[:1] != rows:
                raise BadValue(f"residuals need {rows[0]} rows of {name}; got {getattr(self, name).shape[:1]}.")


@dataclass(frozen=True, eq=False)
class Truth:
    """What the object really is.

    body    the whole, in S
    masses  of its parts [kg], where they are known
    grasps  of a team: X_RG by robot
    """

    body: InertialParameters
    masses: Mapping[int, float] = field(default_factory=dict)
    grasps: Mapping[str, Pose] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Report:
    """One result and what stands beside it.

    title       what is held
    scene       its parts in 3D
    residuals   of the log
    rivals      name -> what another method makes of the same log
    truth       where it is known
    names       label of a part -> its name
    provenance  name -> value: command, seed, files
    says        label of a body without a mass -> a line about it
    """

    title: str
    estimate: Estimate
    scene: Scene | None = None
    residuals: Residuals | None = None
    rivals: Mapping[str, Estimate] = field(default_factory=dict)
    truth: Truth | None = None
    names: Mapping[int, str] = field(default_factory=dict)
    provenance: Mapping[str, str] = field(default_factory=dict)
    says: Mapping[int, str] = field(default_factory=dict)

    def name_of(self, label: int) -> str:
        """Return the name of a part."""
        return self.names.get(label) or f"part {label}"
