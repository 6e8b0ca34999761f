"""A load that sags in its grip: its centre of mass goes with gravity, and torque with the square of gravity.

A grip that yields alike along all axes moves the centre along gravity, which makes no torque. What it yields more along
one axis than along another does, and where a log's poses are lopsided it passes for another centre of mass.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.estimate import Estimate
from steelyard.inertia import forms
from steelyard.logs.log import MotionLog
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import Rows

# It is said beyond so many standard deviations, by leaving out stretches, and where it leaves so much less of what
# lasts for a second: sound made logs keep 0.97, a real sensor's errors with the pose 0.62.
SURE, SLOWLY = 8.0, 0.5
# Combinations of compliances that a body and a bias mimic to this share of their squares are not told.
TOLD = 1e-3
_FEWEST_ROWS = 100
# Compliances that are not alike along all axes: symmetric matrices (5, 3, 3) without a trace.
_XX, _XY, _XZ, _YY, _YZ, _ZZ = forms.inertia_matrix(np.eye(10)[4:])
_UNEVEN = np.stack([_XX - _YY, _YY - _ZZ, _XY, _XZ, _YZ])


@dataclass(frozen=True, eq=False)
class Sag:
    """How a load yields to its weight.

    uneven  [m] how much more its centre of mass goes with gravity along the axis that yields most than along the least
    sure    the largest of its terms in standard deviations, by leaving out stretches
    slowly  squared residual of means over a second, beside that of a stiff grip
    moved   (10,) what the parameters are less with it
    """

    uneven: float
    sure: float
    slowly: float
    moved: Array


def sag(log: MotionLog) -> Sag | None:
    """Return how the load sags; None without a clock, for too short a log or channels that do not measure."""
    if log.time is None or log.dead.any() or len(log) < _FEWEST_ROWS:
        return None
    rows, _ = Rows.of(log)
    if not rows.split:
        return None
    once = rows.solve()
    columns = _yielding(rows.log, float(once.phi[0]))
    told = rows.told(columns, TOLD)
    slow = rows.slowly(once)
    if not told.size or not slow:
        return None
    columns = columns @ told
    fit = rows.solve(columns, jackknife=True)
    sure = float((np.abs(fit.extra) / np.maximum(fit.extra_std, 1e-300)).max())
    yields = np.linalg.eigvalsh(np.einsum("k,kij->ij", told @ fit.extra, _UNEVEN))
    uneven = float(yields[2] - yields[0]) * float(np.linalg.norm(log.gravity, axis=1).mean())
    return Sag(uneven, sure, rows.slowly(fit, columns) / slow, once.phi - fit.phi)


def allow_sag(log: MotionLog, estimate: Estimate, known: tuple[Finding, ...]) -> Estimate:
    """Return the estimate with bars that hold what a load that sags in its grip moves it by, where the log shows it.

    known  what was found before: where motion or wrench are no body's, a sag is not looked for
    """
    if stands_aside("sag", known):
        return estimate
    found = sag(log)
    if found is None or found.sure < SURE or found.slowly > SLOWLY:
        return estimate
    return estimate.allowing(found.moved).noted(
        f"the load sags in its grip as gravity turns, {1e3 * found.uneven:.2g} mm more along one axis than along "
        "another; error bars hold what that changes"
    )


def _yielding(log: MotionLog, mass: float) -> Array:
    """Return the wrench (N, 6, 5) of a mass [kg] whose centre goes with gravity, one compliance after the other."""
    out = np.zeros((len(log.gravity), 6, len(_UNEVEN)))
    moved = np.einsum("kij,nj->nki", _UNEVEN, log.gravity)
    borne = mass * (log.acceleration - log.gravity)
    out[:, :3] = np.swapaxes(np.cross(moved, borne[:, None]), 1, 2)
    return out
