"""Stretches of a recording in motion in which something bears the payload: it stands on a table before it is lifted.

Robots then bear less than half of what they bear in the rest of the recording. Left in, these rows make a force look as
if its sign were wrong, or leave no mass at all, so that they are asked for before anything is fitted. Sensors that were
tared under load read next to nothing as well: whether weight is missing, the fit to all other rows decides.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.logs.log import Mask
from steelyard.spatial import unit_vectors
from steelyard.team.changes.touched import MEAN_S, around
from steelyard.team.payload.body_rows import BodyRows, Run, averaged

# What robots bear is averaged over MEAN_S. It is little below this share of what they bear in a tenth of the rows, and
# the payload is propped where so much of its weight is missing.
LITTLE, USUAL, MISSING = 0.5, 0.9, 0.25


@dataclass(frozen=True, eq=False)
class Propped:
    """Rows of one recording (number) that may be propped: masks (T,), one for each of its runs."""

    number: int
    rows: tuple[Mask, ...]

    def missing(self, body: BodyRows, phi: Array, D: Array) -> float:
        """Return how much less [N] robots bear in these rows than in the others, beside what a payload phi needs."""
        needed = motion_map(phi)[3:].T
        less = np.concatenate([_borne(run, D) - _along_weight(run.motion @ needed, run) for run in body.runs])
        rows = np.concatenate(self.rows)
        return float(np.median(less[~rows]) - np.median(less[rows]))

    def finding(self, body: BodyRows, missing: float) -> Finding:
        """Return what is said of it."""
        return Finding.of(
            "contact",
            f"For {body.seconds(self.rows):.1f} s of '{body.name}' robots bear {missing:.3g} N less than the payload "
            "weighs, as where it stands on something; its wrenches were left out meanwhile.",
        )


def maybe_propped(rows: Sequence[BodyRows], D: Array) -> list[Propped]:
    """Return the rows of every recording in motion in which robots bear far less than in others of it.

    D  (6, 6 N) sums the pushes at B
    """
    out = []
    for number, body in enumerate(rows):
        if body.still or not body.runs:
            continue
        borne = [averaged(_borne(run, D), MEAN_S, run.rate) for run in body.runs]
        least = LITTLE * float(np.quantile(np.concatenate(borne), USUAL))
        little = tuple(around(each < least, run.rate) for each, run in zip(borne, body.runs, strict=True))
        if least > 0 and any(each.any() for each in little) and not all(each.all() for each in little):
            out.append(Propped(number, little))
    return out


def _borne(run: Run, D: Array) -> Array:
    """Return the force (T,) [N] with which robots push against gravity, and what accelerates the payload along it."""
    return _along_weight(run.pushed @ D[3:].T, run)


def _along_weight(force: Array, run: Run) -> Array:
    return np.asarray(np.einsum("ti,ti->t", force, unit_vectors(run.motion[:, 3:6])))
