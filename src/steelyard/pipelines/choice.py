"""Which estimator answers, and what there is to say about the choice."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias
from steelyard.identify.geodesic import Geodesic
from steelyard.identify.least_squares import LeastSquares
from steelyard.identify.masses.shape_error import ShapeError
from steelyard.identify.noise_aware import NoiseAware
from steelyard.identify.part_cuts import PartCuts
from steelyard.logs.log import MotionLog
from steelyard.parts.parts import Parts
from steelyard.pipelines.options import Options

# A ball's radius of gyration per axis is its diameter times this.
BALL = 0.5 / np.sqrt(5)


class Placed(NamedTuple):
    """What is known of an object's shape, where it sits in the sensor.

    cuts    ways to cut it into parts, seen from S
    prior   (K,) log weight of each beforehand; equal where None
    error   how wrong the shape may be
    places  (S) standard deviations [m], [rad] of its place, from the surest on; the log weighs them
    """

    cuts: tuple[Parts, ...]
    prior: Array | None
    error: ShapeError
    places: tuple[tuple[float, float], ...]

    @property
    def finest(self) -> Parts:
        """The cut into most parts."""
        return max(self.cuts, key=len)

    @property
    def loosest(self) -> ShapeError:
        """How wrong shape and place may be at most."""
        return self.error.placed(*self.places[-1])


def estimator_for(
    options: Options,
    log: MotionLog,
    bias: Bias,
    shape: Placed | None,
    tool: Estimate | None,
) -> tuple[NoiseAware | LeastSquares | Geodesic | PartCuts, tuple[str, ...]]:
    """Return the estimator and what there is to say about the choice."""
    if shape is not None and options.method != "auto":
        raise BadValue(f'method "{options.method}" knows no shape: leave it "auto", or leave parts and scan out.')
    if shape is not None:
        cuts = shape.cuts
        given = f"was scanned, in {len(cuts)} cuts" if len(cuts) > 1 else f"is given in {_counted(len(cuts[0]))}"
        why = f"method: auto chose part-masses, because the shape {given}"
        return PartCuts(cuts, shape.prior, bias, options.materials, shape.error, shape.places, tool), (why,)
    if options.method == "least-squares":
        return LeastSquares(bias=bias), ()
    if options.method == "geodesic":
        return Geodesic(bias=bias), ("geodesic: the prior is a ball of 5 cm at the centre that least squares found",)
    size = 0.1 if options.object_size is None else options.object_size
    estimator = NoiseAware(bias=bias, size=float(BALL * size))
    prior = f"the weak prior is a ball about {100 * size:.0f} cm across, " + (
        "the default" if options.object_size is None else "as given"
    )
    if options.method == "noise-aware":
        return estimator, (prior,)
    moving = not bool(log.still.all())
    why = (
        "noise in the acceleration of the moving rows would bias least squares"
        if moving
        else "all rows used are at rest, where it is weighted least squares kept physically consistent"
    )
    return estimator, (f"method: auto chose noise-aware, because {why}", prior)


def _counted(parts: int) -> str:
    """Return how many parts, in words that say what one part means."""
    return f"{parts} parts" if parts > 1 else "one part, taken to be of one density"
