"""PartCuts: which cut of a solid into parts explains the wrench, and the answer averaged over those that do.

Shape and colour offer several cuts, from few parts to many; the log then says which of them the forces ask for.
Evidence weighs each: parts that the data cannot tell apart cost nothing but their prior, parts they need are found.
Where the cut does not matter for the answer, the average is as good as the best; where it does, the spread between cuts
is in the error bars.
Source: the choice of parts by the identification is the paper's future work (section VI).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import counted
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias, prepared
from steelyard.identify.masses.models import mixture
from steelyard.identify.masses.shape_error import MEASURED, ShapeError
from steelyard.identify.part_masses import PartMasses
from steelyard.identify.problem import Problem
from steelyard.identify.rest import without_noise_of_rest
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts

# A cut with less weight than this is left out of the average.
LEAST_WEIGHT = 0.02


@dataclass(frozen=True, eq=False)
class PartCuts:
    """Options of the estimator over several cuts.

    cuts    each the whole object in parts, in the frame of the sensor
    prior   (K,) log weight of each cut before the log is seen; equal where None

    The others as in PartMasses.
    """

    cuts: tuple[Parts, ...]
    prior: Array | None = None
    bias: Bias | str = "free"
    materials: tuple[Material, ...] = ()
    shape_error: ShapeError = MEASURED
    tool: Estimate | None = None

    def __post_init__(self) -> None:
        if not self.cuts:
            raise BadValue("at least one cut of the object into parts is needed; got none.")
        if self.prior is not None and np.shape(self.prior) != (len(self.cuts),):
            raise BadValue(f"{len(self.cuts)} cuts need as many prior weights; got shape {np.shape(self.prior)}.")

    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log averaged over cuts; parts and findings are those of the best cut."""
        return self.weighed(log)[0]

    def solve(self, moments: Moments) -> Estimate:
        """Return the estimate from a statistic that carries its noise."""
        weight = self._weights(self._of(0).problem(moments))
        return self._answered(weight, lambda cut: cut.solve(moments))[0]

    def weighed(self, log: MotionLog) -> tuple[Estimate, Array]:
        """Return the estimate and the weight (K,) of every cut."""
        log, problem = prepared(log, Bias.of(self.bias), without_noise_of_rest)
        return self._answered(self._weights(problem), lambda cut: cut.answered(log, problem))

    def _of(self, cut: int) -> PartMasses:
        return PartMasses(
            self.cuts[cut], self.bias, materials=self.materials, shape_error=self.shape_error, tool=self.tool
        )

    def _weights(self, problem: Problem) -> Array:
        """Return the weight (K,) of every cut by prior and evidence; small ones are zero."""
        if len(self.cuts) == 1:
            return np.ones(1)
        finest = max(range(len(self.cuts)), key=lambda k: len(self.cuts[k]))
        data = self._of(finest).seen(problem)
        evidence = np.stack([self._of(k).log_evidence(data) for k in range(len(self.cuts))])
        if self.prior is not None:
            evidence = evidence + np.asarray(self.prior)[:, None]
        weight = np.exp(evidence - evidence.max(0))
        weight = (weight / weight.sum(0)).mean(1)
        weight[weight < LEAST_WEIGHT] = 0.0
        return np.asarray(weight / weight.sum())

    def _answered(self, weight: Array, answer: Callable[[PartMasses], Estimate]) -> tuple[Estimate, Array]:
        """Return the mean of the answers and the weights (K,); cuts whose parts explain nothing count no more."""
        estimates, refused, left_out = [], None, []
        for k in np.flatnonzero(weight):
            try:
                estimates.append(answer(self._of(int(k))))
            except CannotAnswer as error:
                weight[k], refused = 0.0, error
                left_out.append(f"the cut into {counted(len(self.cuts[k]), 'part')} explains nothing and was left out")
        if not estimates and refused is not None:
            raise refused
        weight = weight / weight.sum()
        mean = self._averaged(weight, estimates)
        return replace(mean, notes=(*mean.notes, *left_out)), weight

    def _averaged(self, weight: Array, estimates: list[Estimate]) -> Estimate:
        """Return the mean of the estimates with the spread between them; the rest is the best one's."""
        chosen = weight[weight > 0]
        best = estimates[int(np.argmax(chosen))]
        if len(estimates) == 1:
            return best
        mean, covariance = mixture(chosen, [e.parameters.vector for e in estimates], [e.covariance for e in estimates])
        return replace(
            best,
            parameters=InertialParameters(mean),
            covariance=covariance,
            notes=(*best.notes, self._said(weight)),
        )

    def _said(self, weight: Array) -> str:
        """Return what the log made of the cuts."""
        order = np.argsort(-weight, kind="stable")
        shares = ", ".join(
            f"{counted(len(self.cuts[k]), 'part')} {100 * weight[k]:.0f} %" for k in order if weight[k] > 0
        )
        return f"averaged over cuts of the shape by what the log says of them: {shares}"
