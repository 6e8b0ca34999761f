"""What yields between the encoders and the numbers: the grip, the arm, the sensor's filter; bars hold what it changes.

* A load that sags in its grip: its centre of mass goes with gravity, and torque with the square of gravity. A grip that
  yields alike along all axes moves the centre along gravity, which makes no torque. What it yields more along one axis
  than along another does, and where a log's poses are lopsided it passes for another centre of mass.
* A soft arm: its structure lags behind the encoders, and accelerates the load more than they say. Below its first mode,
  at f0, a structure that is driven by a(t) moves the load by a - a''/(2 pi f0)^2, and so changes the wrench w to
  w - w''/(2 pi f0)^2. A slow filter of the force does the contrary. Either looks like inertia.
* A slow sensor: the filter that makes its wrench late makes it too small as well, where it is quick.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, about
from steelyard.identify.estimate import Estimate
from steelyard.inertia import forms
from steelyard.logs.clock import median_step
from steelyard.logs.conditioning import FILTERED, signal, taken_by_filter
from steelyard.logs.log import MotionLog
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.full_fit import Rows, moves

# A sag is said beyond so many standard deviations, by leaving out stretches, and where it leaves so much less of what
# lasts for a second: sound made logs keep 0.97, a real sensor's errors with the pose 0.62.
SAG_SURE, SAG_SLOWLY = 8.0, 0.5
# Combinations of compliances that a body and a bias mimic to this share of their squares are not told.
TOLD = 1e-3
_FEWEST_ROWS = 100
# Compliances that are not alike along all axes: symmetric matrices (5, 3, 3) without a trace.
_XX, _XY, _XZ, _YY, _YZ, _ZZ = forms.inertia_matrix(np.eye(10)[4:])
_UNEVEN = np.stack([_XX - _YY, _YY - _ZZ, _XY, _XZ, _YZ])

# Bending is said beyond so many standard deviations by leaving out stretches, and where it leaves less of the residual.
BEND_SURE, BEND_LEFT = 6.0, 0.995
# [Hz] the second derivative is taken below this; poses tell it no better.
SLOW = 8.0
# [s^2] Where none is seen, an arm may still have its first mode near 16 Hz, which moves an inertia by a bar of its own.
USUAL = 1e-4

# What a filter takes is said where it is so large beside the bars that are.
WORTH_SAYING = 1.0


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
    if found is None or found.sure < SAG_SURE or found.slowly > SAG_SLOWLY:
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


@dataclass(frozen=True, eq=False)
class Softness:
    """How the wrench follows its own second derivative.

    follows, std  [s^2] negative for a soft arm, positive for a slow filter, and its standard deviation
    left          squared residual beside that without
    moved         (10,) what the parameters are less with it
    """

    follows: float
    std: float
    left: float
    moved: Array

    @property
    def possible(self) -> float:
        """How far the wrench may follow [s^2], rms, beside what arms usually do."""
        share = USUAL**2 / (USUAL**2 + self.std**2)
        return float(np.hypot(share * self.follows, np.sqrt(share) * self.std))


def softness(log: MotionLog) -> Softness | None:
    """Return how soft the arm is that moved the load; None for too few moving rows, no clock or dead channels."""
    if log.time is None or not moves(log):
        return None
    rows, pick = Rows.of(log)
    once = rows.solve()
    even = np.arange(log.time[0], log.time[-1], 1 / (8 * SLOW))
    slow = signal(log.time, log.predicted(once.phi), SLOW).at(even)
    bends = np.gradient(np.gradient(slow, even, axis=0), even, axis=0)
    bends = signal(even, bends).at(log.time[pick])[:, :, None]
    fit = rows.solve(bends, jackknife=True)
    return Softness(float(fit.extra[0]), float(fit.extra_std[0]), fit.beside(once), once.phi - fit.phi)


def allow_softness(log: MotionLog, estimate: Estimate) -> Estimate:
    """Return the estimate with bars that hold what a soft arm or a slow filter moves it by.

    That is all of it where the log shows one, and else what a usual arm and the log leave possible.
    """
    found = softness(log)
    if found is None or found.follows == 0:
        return estimate
    if abs(found.follows) < BEND_SURE * found.std or found.left > BEND_LEFT:
        return estimate.allowing(found.moved * found.possible / found.follows)
    rate = 1 / (2 * np.pi * np.sqrt(abs(found.follows)))
    what = f"an arm with its first mode near {rate:.0f} Hz" if found.follows < 0 else "a slow filter of the force"
    return estimate.allowing(found.moved).noted(
        f"the wrench bends with the motion as with {what}; error bars hold what that changes"
    )


def allow_filter(log: MotionLog, estimate: Estimate, late: float) -> Estimate:
    """Return the estimate with bars that hold what a filter may take away which makes the wrench `late` [s]."""
    if late <= 0 or log.time is None or not moves(log):
        return estimate
    rows, pick = Rows.of(log)
    lost = taken_away(log.time, log.predicted(rows.solve().phi), late)
    moved = np.sqrt(FILTERED) * replace(rows, values=lost[pick]).solve().phi
    wider = estimate.allowing(moved)
    known = estimate.identified
    if not (wider.std[known] > np.hypot(1, WORTH_SAYING) * estimate.std[known]).any():
        return wider
    return wider.noted(
        f"the wrench is {about(1e3 * late)} ms late: a filter that makes it so takes of quick motion, too; error bars "
        "hold what that may change"
    )


def taken_away(time: Array, wrench: Array, late: float) -> Array:
    """Return what a filter of first order that is `late` [s] had taken away (N, 6) for `wrench` (N, 6) to be left."""
    step = median_step(time)
    even = np.arange(time[0], time[-1] + step / 2, step)
    values = signal(time, wrench).at(even)
    # There and back, so that the ends meet.
    loop = np.concatenate([values, values[::-1]])
    frequency = np.asarray(np.fft.rfftfreq(len(loop), step)[:, None], np.float64)
    lost = taken_by_filter(frequency, late)
    return signal(even, np.fft.irfft(lost * np.fft.rfft(loop, axis=0), len(loop), axis=0)[: len(even)]).at(time)
