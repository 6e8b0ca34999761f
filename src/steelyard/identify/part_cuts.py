"""PartCuts: which cut of a solid into parts explains the wrench, and the answer averaged over those that do.

Shape and colour offer several cuts, from few parts to many; the log then says which of them the forces ask for.
Evidence weighs each: parts that the data cannot tell apart cost nothing but their prior, parts they need are found.
Where the cut does not matter for the answer, the average is as good as the best; where it does, the spread between cuts
is in the error bars.
How sure the place of the object is may be left to the log in the same way: where it is off, the log sees that across
the object, and the spread that explains it also holds what it does not see along it.
Source: the choice of parts by the identification is the paper's future work (section VI).
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import OTHER_FRAME, Finding, counted
from steelyard.identify.bars.effective import Effective
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias, prepared
from steelyard.identify.masses.models import log_evidence
from steelyard.identify.masses.placement import ELSEWHERE, misplaced
from steelyard.identify.masses.shape_error import MEASURED, ShapeError
from steelyard.identify.mixture import mixture
from steelyard.identify.part_masses import PartMasses
from steelyard.identify.problem import Problem
from steelyard.identify.rest import without_noise_of_rest
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts

# A cut in a place with less weight than this is left out of the average.
LEAST_WEIGHT = 0.02


@dataclass(frozen=True, eq=False)
class PartCuts:
    """Options of the estimator over several cuts.

    cuts    each the whole object in parts, in the frame of the sensor
    prior   (K,) log weight of each cut before the log is seen; equal where None
    places  (S) standard deviations [m], [rad] of where the object sits in the sensor, from the surest on: beside those
            of the shape's error, and equally likely before the log is seen

    The others as in PartMasses.
    """

    cuts: tuple[Parts, ...]
    prior: Array | None = None
    bias: Bias | str = "free"
    materials: tuple[Material, ...] = ()
    shape_error: ShapeError = MEASURED
    places: tuple[tuple[float, float], ...] = (KNOWN_PLACE,)
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
        problem = self._of(0, 0).problem(moments)
        return self._answered(problem, lambda parts: parts.solve(moments))[0]

    def weighed(self, log: MotionLog) -> tuple[Estimate, Array]:
        """Return the estimate and the weight (K, S) of every cut in every place."""
        log, problem = prepared(log, Bias.of(self.bias), without_noise_of_rest)
        return self._answered(problem, lambda parts: parts.answered(log, problem))

    def _of(self, cut: int, place: int) -> PartMasses:
        error = self.shape_error.placed(*self.places[place])
        return PartMasses(self.cuts[cut], self.bias, materials=self.materials, shape_error=error, tool=self.tool)

    def _weights(self, data: Effective, errors: list[Array]) -> Array:
        """Return the weight (K, S) of every cut in every place by prior and evidence; small ones are zero."""
        evidence = self._evidence(data, errors) + np.log(self._chance())
        if self.prior is not None:
            evidence = evidence + np.asarray(self.prior)[:, None]
        weight = np.asarray(softmax(evidence))
        weight[weight < LEAST_WEIGHT] = 0.0
        return np.asarray(weight / weight.sum())

    def _chance(self) -> Array:
        """Return how likely each place is (S,) before the log: the first, the surest, as much as all others."""
        others = len(self.places) - 1
        return np.repeat([1.0, 1 / max(others, 1)], [1, others]) / (1 + bool(others))

    def _evidence(self, data: Effective, errors: list[Array]) -> Array:
        """Return the log evidence (K, S) of every cut in every place."""
        cost = np.array([data.cost_of(error) for error in errors])
        blurred = [data.blurred(error) for error in errors]
        found = [[log_evidence(seen, cut) for seen in blurred] for cut in self.cuts]
        return np.asarray(np.array(found) - (cost - cost[0]))

    def _seen(self, problem: Problem) -> tuple[Effective, list[Array]]:
        """Return what the log says of the whole body, and what errors (10, 10) of shape and place do to that."""
        data, body = self._of(self._finest, -1).seen(problem)
        return data, [self._of(self._finest, s).shape_error.with_grasp(body) for s in range(len(self.places))]

    @property
    def _finest(self) -> int:
        return max(range(len(self.cuts)), key=lambda k: len(self.cuts[k]))

    def _answered(self, problem: Problem, answer: Callable[[PartMasses], Estimate]) -> tuple[Estimate, Array]:
        """Return the mean of the answers and the weights (K, S); cuts whose parts explain nothing count no more."""
        if len(self.cuts) * len(self.places) == 1:
            return answer(self._of(0, 0)), np.ones((1, 1))
        data, errors = self._seen(problem)
        weight, estimates, refused = self._weights(data, errors), dict[tuple[int, int], Estimate](), None
        tried = weight.any(1)
        for k, s in np.argwhere(weight).tolist():
            try:
                estimates[k, s] = answer(self._of(k, s))
            except CannotAnswer as error:
                weight[k, s], refused = 0.0, error
        if not estimates and refused is not None:
            raise refused
        left_out = [
            f"the cut into {counted(len(self.cuts[k]), 'part')} explains nothing and was left out"
            for k in np.flatnonzero(tried & ~weight.any(1))
        ]
        weight = weight / weight.sum()
        found = self._averaged(weight, estimates).noted(*left_out)
        if len(self.places) > 1 and not weight[:, 0].any() and "part-not-homogeneous" not in found.codes():
            found = found.with_findings(*self._off(data.blurred(errors[0])))
        return found, weight

    def _off(self, seen: Effective) -> list[Finding]:
        """Return the finding on a place that the log contradicts by millimetres, though the answer holds that."""
        words = misplaced(seen, self.cuts[self._finest], ELSEWHERE)
        if not words:
            return []
        return [Finding.of("part-not-homogeneous", f"{words} The answer allows for that.").instead(OTHER_FRAME)]

    def _averaged(self, weight: Array, estimates: dict[tuple[int, int], Estimate]) -> Estimate:
        """Return the mean of the estimates with the spread between them; the rest is the best one's."""
        best = max(estimates, key=lambda each: float(weight[each]))
        found = estimates[best]
        if len(estimates) > 1:
            chosen, answers = np.array([weight[each] for each in estimates]), estimates.values()
            vectors, covariances = [e.parameters.vector for e in answers], [e.covariance for e in answers]
            mean, covariance = mixture(chosen, vectors, covariances)
            found = replace(found, parameters=InertialParameters(mean), covariance=covariance)
            same = [s for k, s in estimates if k == best[0]]
            found = _with_masses(found, weight[best[0], same], [estimates[best[0], s] for s in same])
        return found.noted(*self._said(weight))

    def _said(self, weight: Array) -> list[str]:
        """Return what the log made of the cuts, and of how sure the place is."""
        of_cuts, of_places, out = weight.sum(1), weight.sum(0), []
        if np.count_nonzero(of_cuts) > 1:
            cuts = _shares(of_cuts, [counted(len(cut), "part") for cut in self.cuts])
            out.append(f"averaged over cuts of the shape by what the log says of them: {cuts}")
        if len(self.places) > 1:
            places = _shares(of_places, [_words(*place) for place in self.places])
            out.append(f"how sure the object's place in the sensor is, by what the log says of it: {places}")
        return out


def _with_masses(found: Estimate, weight: Array, answers: list[Estimate]) -> Estimate:
    """Return the estimate with the masses of its parts averaged over answers of the same parts."""
    if len(answers) == 1:
        return found
    masses = [np.array([part.mass for part in answer.parts]) for answer in answers]
    covariances = [answer.part_covariance for answer in answers]
    mean, covariance = mixture(weight / weight.sum(), masses, [c for c in covariances if c is not None])
    std = np.sqrt(np.maximum(np.diag(covariance), 0))
    rows = zip(found.parts, mean, std, strict=True)
    parts = tuple(replace(part, mass=float(m), std=float(s)) for part, m, s in rows)
    return replace(found, parts=parts, part_covariance=covariance)


def _shares(share: Array, words: list[str]) -> str:
    """Return what has which share, largest first."""
    order = np.argsort(-share, kind="stable")
    return ", ".join(f"{words[k]} {100 * share[k]:.0f} %" for k in order if share[k] > 0)


def _words(std_m: float, std_rad: float) -> str:
    """Return how sure a place is, in words."""
    return f"{1e3 * std_m:g} mm and {np.degrees(std_rad):.2g}°" if std_m or std_rad else "exact"
