"""The laws of rigid bodies, judged once: the same report answers yes or no and words the error."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.inertia import forms


@dataclass(frozen=True)
class ValidityReport:
    """Which laws of rigid bodies are broken; `problems` words each one with its numbers."""

    problems: tuple[str, ...]

    @property
    def consistent(self) -> bool:
        """Whether some body, with mass nowhere negative and not all in one plane, has these parameters."""
        return not self.problems

    def __str__(self) -> str:
        return "physically consistent" if self.consistent else "; ".join(self.problems)


def report(phi: Array) -> ValidityReport:
    """Judge the parameters (..., 10) and word the worst offence of a batch.

    The laws are m > 0 and, of the rising principal moments, J1 > 0 and J1 + J2 > J3. Together they say that
    the pseudo-inertia is positive definite (Wensing, Kim, Slotine 2018).
    """
    bodies = phi.reshape(-1, 10)
    mass = bodies[:, 0]
    moments = np.full((len(bodies), 3), np.nan)
    heavy = mass > 0
    moments[heavy] = np.linalg.eigvalsh(forms.inertia_com(bodies[heavy]))
    sound = heavy & (moments[:, 0] > 0) & (moments[:, 0] + moments[:, 1] > moments[:, 2])
    if sound.all():
        return ValidityReport(())
    offenders = np.flatnonzero(~sound)
    worst = int(offenders[np.argmin(_margin(bodies[offenders]))])
    return ValidityReport((_where(worst, phi.shape[:-1], offenders.size) + _law(mass[worst], moments[worst]),))


def _margin(bodies: Array) -> Array:
    """Return the least eigenvalue of each pseudo-inertia over its largest in size."""
    values = np.linalg.eigvalsh(forms.pseudo_inertia(bodies))
    return np.asarray(values[:, 0] / np.maximum(np.abs(values).max(-1), np.finfo(float).tiny))


def _where(index: int, batch: tuple[int, ...], offenders: int) -> str:
    """Name the worst body of a batch; a single body needs no name."""
    if not batch:
        return ""
    place = tuple(int(i) for i in np.unravel_index(index, batch))
    return f"{offenders} of {int(np.prod(batch))} bodies break a law, the worst at index {place}: "


def _law(mass: float, moments: Array) -> str:
    """Word the first law that one body breaks."""
    if mass <= 0:
        return f"mass must be above zero, it is {mass:.6g} kg"
    shown = ", ".join(f"{m:.6g}" for m in moments)
    if moments[0] <= 0:
        return f"principal moments must be above zero, they are {shown} kg m^2"
    return (
        "the triangle inequality is broken: the largest principal moment must be below the sum of the other "
        f"two, they are {shown} kg m^2 ({moments[2]:.6g} >= {moments[0] + moments[1]:.6g})"
    )
