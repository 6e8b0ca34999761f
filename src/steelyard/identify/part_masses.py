"""PartMasses: the ten parameters through the masses of homogeneous parts, noise-aware, with priors on their densities.

phi = B m, one column per part. The statistic enters once as the effective information about phi; everything else is
small algebra in the masses, so that averaging over hundreds of models of "which parts share a density" costs
milliseconds. Errors of the shape and of the grasp are carried through to the answer.
Source: "The Sum of Its Parts", section III, for the model; the estimator is our own.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from steelyard.check import Array
from steelyard.errors import BadValue, CannotAnswer
from steelyard.findings import Finding, other_than
from steelyard.identify.bars.correlated import score_in_time
from steelyard.identify.bars.effective import Effective
from steelyard.identify.bars.widened import widened
from steelyard.identify.conclude import conclude
from steelyard.identify.estimate import Estimate
from steelyard.identify.fit import Bias, prepared, problem_of
from steelyard.identify.masses.findings import elsewhere, named_materials, part_findings, zero_masses
from steelyard.identify.masses.loosened import loosened
from steelyard.identify.masses.models import Masses, averaged_masses, free_masses, material_masses, weighed
from steelyard.identify.masses.placement import consistent, misplaced, with_mass
from steelyard.identify.masses.recentred import apart, followed, recentred
from steelyard.identify.masses.shape_error import MEASURED, ShapeError, misdrawn
from steelyard.identify.masses.uneven import Uneven, suspicious, uneven
from steelyard.identify.problem import Problem
from steelyard.identify.rest import without_noise_of_rest
from steelyard.identify.solution import Solution
from steelyard.inertia import InertialParameters
from steelyard.logs.log import MotionLog
from steelyard.logs.moments import Moments
from steelyard.parts.material import Material
from steelyard.parts.parts import Parts

# The weights depend on the answer, and settle in so many rounds.
RENEWALS = 2


@dataclass(frozen=True)
class PartMasses:
    """Options of the part-mass estimator.

    parts        the parts, in the frame of the sensor
    bias         "free", "none" or a Bias
    density      "averaged": one common density and groups of equal density, averaged by evidence; "free": every part
                 its own mass, not below zero
    materials    densities to choose from, one per part; they take the place of `density`
    shape_error  how wrong shape and grasp may be
    tool         what of the load is no part: a gripper weighed by itself
    """

    parts: Parts
    bias: Bias | str = "free"
    density: Literal["averaged", "free"] = "averaged"
    materials: tuple[Material, ...] = ()
    shape_error: ShapeError = MEASURED
    tool: Estimate | None = None

    def __post_init__(self) -> None:
        if self.density not in ("averaged", "free"):
            raise BadValue(f"density must be averaged or free; got {self.density!r}.")

    def identify(self, log: MotionLog) -> Estimate:
        """Return the estimate of a log with the mass of every part.

        Raises CannotAnswer where the log shows no weight.
        """
        return self.answered(*prepared(log, Bias.of(self.bias), without_noise_of_rest))

    def answered(self, log: MotionLog, problem: Problem) -> Estimate:
        """Return the estimate of a log that carries its noise, and of its `problem`."""
        start = self._start(problem)
        first = self._conclude(problem, start, None)
        if log.time is None:
            return first
        bias = len(problem.T) - 10
        linear = np.concatenate([first.parameters.vector, first.wrench_bias[:bias]])
        if bias > 6:  # an Estimate has no place for the drift
            linear = self._data(problem, start, None).linear_at(first.parameters.vector)
        score = score_in_time(log, problem, Solution.unconstrained(self._loaded(linear)))
        return self._conclude(problem, linear, score.variance).noted(*score.notes)

    def solve(self, moments: Moments) -> Estimate:
        """Return the estimate from a statistic that carries its noise."""
        problem = self.problem(moments)
        return self._conclude(problem, self._start(problem), None)

    def seen(self, problem: Problem) -> tuple[Effective, InertialParameters]:
        """Return what a statistic says of the whole body, and the body that the parts make of it."""
        data = self._data(problem, self._start(problem), None)
        body = self.parts.whole(self._masses(data, self.parts.whole(self.parts.volume), listed=False).mean)
        return self._data(problem, data.linear_at(body.vector), None), body

    def problem(self, moments: Moments) -> Problem:
        """Return the problem of a statistic that carries its noise."""
        return problem_of(moments, Bias.of(self.bias))

    def _start(self, problem: Problem) -> Array:
        """Return the linear parameters (p,) of ten free numbers: the first weights come from them."""
        linear = problem.reweighted(2)
        if not linear[0] > 0:
            raise CannotAnswer("The log shows no weight: the mass comes out at zero or below. Check the wrench sign.")
        return self._loaded(linear, times=-1.0)

    def _loaded(self, linear: Array, times: float = 1.0) -> Array:
        """Return the linear parameters (p,) of the object with so many times those of the tool added."""
        if self.tool is None:
            return linear
        return linear + times * np.pad(self.tool.parameters.vector, (0, len(linear) - 10))

    def _data(self, problem: Problem, linear: Array, score: Array | None) -> Effective:
        """Return what the log says of the object, with the weights at `linear` (p,): the object's phi and the bias."""
        data = Effective.of(problem, self._loaded(linear), score)
        return data if self.tool is None else data.beside(self.tool.parameters.vector, self.tool.covariance)

    def _conclude(self, problem: Problem, linear: Array, score: Array | None) -> Estimate:
        """Return the Estimate after a few rounds: weights depend on the answer.

        Where homogeneous parts cannot give the wrench, densities are freed within parts. Where that does not help
        either, the shape is trusted less, step by step, until it can: the answer then moves off the shape as far as
        the log says.
        """
        data = self._data(problem, linear, score)
        # Weights hardly depend on how the whole is shared among parts.
        masses = self._masses(data, InertialParameters(linear[:10]), listed=False)
        body = with_mass(self.parts, masses.mean, data)
        data = self._data(problem, data.linear_at(body.vector), score)
        there = self
        if self.shape_error.grasp_steps():
            there, data, body = self._where_seen(problem, data, body, score)
        return (
            there._of_scan(problem, data, body) if self.shape_error.doubtful else there._answered(problem, data, body)
        )

    def _where_seen(
        self, problem: Problem, data: Effective, body: InertialParameters, score: Array | None
    ) -> tuple[PartMasses, Effective, InertialParameters]:
        """Return parts, log and body for where the log sees the object, as far as its grasp allows.

        What a grasp does to the parameters bends with its turn: it is judged from where it likely is.
        """
        error = self.shape_error
        X = error.likeliest_grasp(body, data.pull - data.information @ body.vector, data.information)
        if X is None:
            return self, data, body
        body = body.in_frame(X)
        for _ in range(RENEWALS):
            centred = recentred(data, body, error.with_grasp(body)).body
            data = self._data(problem, data.linear_at(centred.vector), score)
        return replace(self, parts=self.parts.in_frame(X)), data, body

    def _of_scan(self, problem: Problem, data: Effective, body: InertialParameters) -> Estimate:
        """Return the Estimate with a scan that is as much worse than it says as the log's centre of mass lies off it.

        What is wrong with the centre is wrong with the inertia. Source: scale factor of the Particle Data Group.
        """
        drawn = with_mass(self.parts, self._masses(data, body).mean, data)
        times = apart(data, drawn, self.shape_error.with_grasp(drawn))
        if times <= 1:
            return self._answered(problem, data, body)
        found = replace(self, shape_error=self.shape_error.scaled(times))._answered(problem, data, body)
        words = f"and log see the centre of mass {times:.1f} standard deviations apart"
        found = found.noted(f"shape {words}: the shape was trusted as much less than it says")
        # Judged by what the scan says of itself: trusted less, it would hide that it lies elsewhere.
        where = elsewhere(data, drawn, self.parts, self.shape_error)
        if not where or any(where in finding.message for finding in found.findings):
            return found
        text = f"{where} Shape {words}: an inertia that leans on the shape is then wrong, too."
        return replace(found, findings=(Finding.of("part-not-homogeneous", text), *found.findings))

    def _answered(self, problem: Problem, data: Effective, body: InertialParameters) -> Estimate:
        masses = self._masses(data, body)
        body = with_mass(self.parts, masses.mean, data)
        first = self._estimate(problem, data, masses)
        # Judged where the shape puts the body, as far as a scan says: what a wrong grasp moves must not hide a misfit.
        if self.shape_error.doubtful:
            body = recentred(data, body, self.shape_error.covariance(body)).body
        seen = data.blurred(self.shape_error.with_grasp(body))
        findings = part_findings(first, body, self.parts, seen, masses.choices, self.materials)
        if not self.materials and suspicious(seen, body.vector, self.parts):
            found = uneven(seen, self.parts)
            if found is not None:
                # Masses have changed: which are zero is asked anew.
                others = other_than(findings, "part-not-homogeneous", "part-zero-mass")
                text = " ".join(filter(None, (misplaced(seen, self.parts), found.message)))
                uneven_part = Finding.of("part-not-homogeneous", text)
                freed = self._with_freed(problem, data, found)
                return freed.with_findings(*zero_masses(freed, self.parts), *others, uneven_part)
        contradicted = any(f.code == "part-not-homogeneous" for f in findings)
        if self.shape_error.doubtful and not contradicted:
            words = elsewhere(data, self.parts.whole(masses.mean), self.parts, self.shape_error)
            findings += [Finding.of("part-not-homogeneous", words)] if words else []
        if not any(f.code == "part-not-homogeneous" for f in findings):
            return first.with_findings(*findings)
        # Masses of parts that cannot be right say nothing of which is zero.
        return self._loosened(problem, data).with_findings(*other_than(findings, "part-zero-mass"))

    def _with_freed(self, problem: Problem, data: Effective, found: Uneven) -> Estimate:
        """Return the Estimate with densities freed within parts."""
        body = InertialParameters(found.vector)
        return self._built(problem, data, found.masses, *self._placed(data, body, found.covariance, blurred=True))

    def _loosened(self, problem: Problem, data: Effective) -> Estimate:
        """Return the Estimate with the shape trusted less; raises NoMasses where that does not help."""
        found = loosened(data, self.parts, self.shape_error, self._model)
        masses = (
            misdrawn(data, self.parts, found.masses, self.shape_error) if self.shape_error.doubtful else found.masses
        )
        return self._built(problem, data, masses, found.body, found.covariance, found.follows).noted(found.note)

    @property
    def _model(self) -> Callable[[Effective, Parts], Masses]:
        """What gives the masses where no materials are listed."""
        return averaged_masses if self.density == "averaged" else free_masses

    def _masses(self, data: Effective, body: InertialParameters, listed: bool = True) -> Masses:
        """Return the masses by the chosen model, without the list of materials where it is not `listed`.

        A list of materials is sharp enough for a shape error of a tenth of a millimetre to decide between two of them,
        so that the log is blurred by it; a smooth average over densities is better off without, unless the shape is a
        scan: then masses would bend to put right what the shape has wrong.
        """
        listed = listed and bool(self.materials)
        if listed or self.shape_error.movable:
            data = data.blurred(self.shape_error.with_grasp(consistent(self.parts, body)))
        if listed:
            return material_masses(data, self.parts, self.materials)
        return self._model(data, self.parts)

    def _estimate(self, problem: Problem, data: Effective, masses: Masses) -> Estimate:
        """Return the Estimate: evidence from the log, covariance from the masses, shape and grasp.

        phi = B m + e with e ~ N(0, G) the error of the shape. The answer stays with a measured shape (e = 0): letting a
        log move it lost more in the thin axes than it won in the others. A scan, and mass and centre of an object whose
        grasp is uncertain, move as far as the log says.
        """
        body, B = self.parts.whole(masses.mean), self.parts.per_mass
        spread = B @ masses.covariance @ B.T
        if self.shape_error.doubtful:
            masses = misdrawn(data, self.parts, masses, self.shape_error)
        placed = self._placed(data, body, spread, blurred=self.shape_error.movable)
        return self._built(problem, data, masses, *placed)

    def _placed(
        self, data: Effective, body: InertialParameters, spread: Array, blurred: bool
    ) -> tuple[InertialParameters, Array, Array]:
        """Return the body where shape, grasp and log together see it, its covariance, and how it follows the log.

        spread   (10, 10) of the body by its masses
        blurred  whether these are by the log as blurred by the error of shape and grasp
        """
        error = self.shape_error.with_grasp(body)
        if not self.shape_error.movable:
            return body, spread + error, spread @ data.left_by(error) if blurred else spread
        placed = (followed if self.shape_error.doubtful else recentred)(data, body, error)
        return placed.known(data, spread, error)

    def _built(
        self, problem: Problem, data: Effective, masses: Masses, body: InertialParameters, covariance: Array,
        follows: Array,
    ) -> Estimate:  # fmt: skip
        """Return the Estimate of a body that is known up to `covariance` (10, 10), with the masses of its parts.

        follows  (10, 10) how it follows the log: without a block it would lie elsewhere by this times the block's score
        """
        solution = Solution.unconstrained(self._loaded(data.linear_at(body.vector)))
        if self.tool is not None:
            solution = replace(solution, known=self.tool.parameters.vector)
        names = named_materials(len(self.parts), masses.choices, self.materials)
        estimate = conclude(problem, solution, "part-masses", response=data.response(follows))
        found = replace(
            estimate,
            parameters=body,
            covariance=0.5 * (covariance + covariance.T),
            part_covariance=masses.covariance,
            parts=weighed(self.parts, masses.mean, masses.covariance, names),
            identified=np.ones(10, np.bool_),
        )
        return widened(found)
