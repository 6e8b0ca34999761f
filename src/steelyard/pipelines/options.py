"""What a caller may choose of how a held object is identified, and what the answer says of such choices."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from steelyard import check
from steelyard.errors import BadValue
from steelyard.parts.material import Material

METHODS = ("auto", "noise-aware", "least-squares", "geodesic")
# How the note begins that says that the bias may drift.
DRIFT_ALLOWED = "the bias may drift"


@dataclass(frozen=True)
class Options:
    """How to identify.

    method       one of METHODS
    bias         "free": the sensor's constant bias is estimated; "none": it is known to be tared
    drift        the bias may grow linearly over the log; it does so by itself where the log shows it
    gravity      "given": its direction in W is trusted, unless the log shows a clear tilt; "unknown": it is estimated
    object_size  rough longest dimension of the object [m], used only where the data leave the inertia open
    materials    what the object's parts may be made of; none: any density. A body without parts has none
    """

    method: Literal["auto", "noise-aware", "least-squares", "geodesic"] = "auto"
    bias: Literal["free", "none"] = "free"
    drift: bool = False
    gravity: Literal["given", "unknown"] = "given"
    object_size: float | None = None
    materials: tuple[Material, ...] = ()

    def __post_init__(self) -> None:
        choices = {"method": METHODS, "bias": ("free", "none"), "drift": (False, True), "gravity": ("given", "unknown")}
        for name, known in choices.items():
            if getattr(self, name) not in known:
                raise BadValue(f"{name} must be one of {', '.join(map(str, known))}; got {getattr(self, name)!r}.")
        if self.object_size is not None and not 0.005 <= check.number("object_size", self.object_size) <= 5:
            raise BadValue(f"object_size must be 0.005 to 5 m; got {self.object_size}.")


DEFAULTS = Options()
