"""What the bench compares: a method answers from a log; the step from the compressed log is timed."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from steelyard.errors import BadValue
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.noise_aware import NoiseAware
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments

Answer = Callable[[MotionLog], InertialParameters]


@dataclass(frozen=True)
class Method:
    """One method of the bench; every function raises SteelyardError where there is no answer.

    identify      log -> the body in S: the scored answer
    compress      log -> what `solve` needs; not timed
    solve         compressed log -> the body in S: the timed step
    timed         what `solve` covers, in words
    slow          tens of milliseconds a call: timed on the first object only
    needs_noise   `solve` works only where the noise is declared
    """

    name: str
    identify: Answer
    compress: Callable[[MotionLog], Any]
    solve: Callable[[Any], InertialParameters]
    timed: str
    slow: bool = False
    needs_noise: bool = False


def own_methods() -> dict[str, Method]:
    """Return our estimators, with no bias to estimate: the simulated wrench has none."""
    estimators: dict[str, NoiseAware | LeastSquares | Geodesic] = {
        "noise-aware": NoiseAware(bias="none"),
        "least-squares": LeastSquares(bias="none"),
        "geodesic": Geodesic(bias="none"),
    }
    return {name: _own(name, estimator) for name, estimator in estimators.items()}


def _own(name: str, estimator: NoiseAware | LeastSquares | Geodesic) -> Method:
    return Method(
        name,
        identify=lambda log: estimator.identify(log).parameters,
        compress=Moments.of_log,
        solve=lambda moments: estimator.solve(moments).parameters,
        timed="moment matrix to Estimate",
        needs_noise=True,
    )


def choose(methods: dict[str, Method], names: Sequence[str]) -> dict[str, Method]:
    """Return the methods called `names` (all where empty), or say which there are."""
    for name in names:
        if name not in methods:
            raise BadValue(f"There is no method '{name}' here; there are: {', '.join(methods)}.")
    return {name: methods[name] for name in names or methods}
