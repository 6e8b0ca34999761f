"""Estimate: the one result type, with its error bars, evidence and findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Self

import numpy as np

from steelyard.check import Array
from steelyard.evidence import Evidence, PartMass
from steelyard.findings import Finding, by_cause, codes, other_than
from steelyard.inertia import InertialParameters
from steelyard.inertia.people import people_jacobian
from steelyard.tables.words import in_a_line, in_words


@dataclass(frozen=True, eq=False)
class Estimate:
    """Parameters (10,) about the origin of `frame`, with covariance (10, 10) and everything said about them.

    identified   (10,) of mass, com x y z, inertia about the CoM xx xy xz yy yz zz
    wrench_bias  (6,) [tau, f] in the recording's own sign and in S: what to subtract from the wrench, once that is in S
    bias_covariance  (6, 6) of the same
    parts        mass of every part, where the object was given in parts; part_covariance (P, P) of them
    cross_covariance  (10, 6) of the parameters with the bias: needed where two runs share one bias
    """

    parameters: InertialParameters
    covariance: Array
    method: str
    evidence: Evidence
    identified: np.ndarray[Any, np.dtype[np.bool_]]
    wrench_bias: Array = field(default_factory=lambda: np.zeros(6))
    bias_covariance: Array = field(default_factory=lambda: np.zeros((6, 6)))
    cross_covariance: Array = field(default_factory=lambda: np.zeros((10, 6)))
    frame: str = "S"
    delays_s: Mapping[str, float] = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()
    parts: tuple[PartMass, ...] = ()
    part_covariance: Array | None = None
    notes: tuple[str, ...] = ()

    def __str__(self) -> str:
        """Return the table that the command prints."""
        return in_words(self)

    def __repr__(self) -> str:
        """Return mass, centre of mass, method and codes in one line."""
        return in_a_line(self)

    @cached_property
    def people_covariance(self) -> Array:
        """Covariance (10, 10) of mass, com, inertia about the CoM (first order)."""
        jacobian = people_jacobian(self.parameters.vector.copy())
        return np.asarray(jacobian @ self.covariance @ jacobian.T)

    @cached_property
    def std(self) -> Array:
        """Standard deviations (10,) of mass [kg], com [m], inertia about the CoM [kg m^2]."""
        return np.sqrt(np.maximum(np.diag(self.people_covariance), 0))

    @property
    def at_rest(self) -> str:
        """How many rows are at rest, in words."""
        return f"{self.evidence.still_samples} at rest"

    @property
    def wrench_bias_std(self) -> Array:
        """Standard deviations (6,) of the wrench bias [N m, N]."""
        return np.sqrt(np.maximum(np.diag(self.bias_covariance), 0))

    @property
    def mass(self) -> float:
        """Mass [kg]."""
        return float(self.parameters.mass)

    @property
    def com(self) -> Array:
        """Centre of mass (3,) in `frame` [m]."""
        return self.parameters.com

    @property
    def inertia_com(self) -> Array | None:
        """Inertia about the centre of mass (3, 3) [kg m^2], None where the data do not fix all of it."""
        return self.parameters.inertia_com if bool(self.identified[4:].all()) else None

    def with_findings(self, *findings: Finding) -> Estimate:
        """Return the estimate with more findings, one of each code and message."""
        if not findings:
            return self
        seen = {(f.code, f.message): f for f in (*self.findings, *findings)}
        return replace(self, findings=tuple(seen.values()))

    def without_inertia(self, message: str) -> Estimate:
        """Return the estimate with its inertia called not identified, and `inertia-not-identified` with that message.

        Said already of all of it, it is not said again.
        """
        known = self.identified.copy()
        if not known[4:].any():
            return self
        known[4:] = False
        told = replace(self, identified=known, findings=other_than(self.findings, "inertia-not-identified"))
        return told.with_findings(Finding.of("inertia-not-identified", message))

    def with_remedies(self, remedies: Mapping[str, str]) -> Self:
        """Return the estimate with the remedies that `remedies` have for the codes of its findings."""
        return replace(self, findings=tuple(finding.instead(remedies) for finding in self.findings))

    def by_cause(self) -> Self:
        """Return the estimate with causes before what follows from them among its findings."""
        return replace(self, findings=by_cause(self.findings))

    def allowing(self, *moved: Array) -> Self:
        """Return the estimate with bars that also hold errors which move the parameters by each of `moved` (10,)."""
        return replace(self, covariance=self.covariance + sum(np.outer(by, by) for by in moved))

    def noted(self, *notes: str) -> Self:
        """Return the estimate with more notes."""
        return replace(self, notes=(*self.notes, *notes))

    def codes(self) -> set[str]:
        """Return the codes of all findings."""
        return codes(self.findings)


def known_body(parameters: InertialParameters) -> Estimate:
    """Return a body that is known, as from a data sheet, as an exact estimate; raises BadValue for no rigid body."""
    no_data = Evidence(rank=0, condition=0.0, samples=0, still_samples=0, residual_force_N=0.0, residual_torque_Nm=0.0)
    return Estimate(parameters.require_consistent(), np.zeros((10, 10)), "given", no_data, np.ones(10, np.bool_))
