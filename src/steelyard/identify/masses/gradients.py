"""Parts whose density changes within: freed part by part where homogeneous parts cannot give the wrench.

phi = sum_k m_k b_k(u_k), the profile of part k tilted by u_k ~ N(0, T), masses with one common density. Masses and
tilts are fitted together, the evidence is Laplace's (`tilting`). Which parts are worth a fit is told by a score that
fits nothing; which of those are free, and how much, is averaged by evidence.
Source: own.
"""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from steelyard.check import Array
from steelyard.identify.bars.effective import Effective
from steelyard.identify.cost.linear import inverse_scaled
from steelyard.identify.masses import density_priors, tilting
from steelyard.identify.masses.models import Masses
from steelyard.identify.masses.profiles import FEATURES, Profile
from steelyard.parts.parts import Parts

# Standard deviations of the linear tilt; products of positions count half.
LADDER = (0.1, 0.3, 1.0)
MIDDLE, CONTENDER = 0.3, 7.0
QUADRATIC = 0.5
# How many parts of real tools are not homogeneous.
COMMON = 0.1
# Models this much less likely than the best do not count.
UNLIKELY = float(np.log(1e-2))


@dataclass(frozen=True, eq=False)
class Fit:
    """The mode of one model: which parts are free and how far, how far densities of parts differ.

    free         rows of the parts that are not homogeneous
    width        standard deviation of their linear tilts
    level        row of the spread of densities in `density_priors.LADDER`
    y, tilts     log densities (P,), tilts (f, F)
    J, hessian   d phi / d(y, tilts) (10, q), and (q, q) without what masses bend the cost by, `curve` (P,)
    evidence     log evidence, the chance of the model counted
    """

    free: tuple[int, ...]
    width: float
    level: int
    y: Array
    tilts: Array
    phi: Array
    J: Array
    hessian: Array
    curve: Array
    evidence: float


@dataclass(frozen=True, eq=False)
class Freed:
    """An answer with freed parts.

    vector, covariance   the ten parameters (10,) and (10, 10)
    masses               of the parts
    evidence             log evidence, the chance of the model counted
    free                 rows of the parts that are not homogeneous
    tilts                (P, F), zero where a part is homogeneous
    """

    vector: Array
    covariance: Array
    masses: Masses
    evidence: float
    free: tuple[int, ...]
    tilts: Array


@dataclass(frozen=True, eq=False)
class Search:
    """What all models of one log share: the data, the parts, and the profiles made so far."""

    data: Effective
    parts: Parts
    profiles: dict[int, Profile] = field(default_factory=dict)

    def even(self) -> list[Fit]:
        """Return the fits of homogeneous parts, one for each spread of densities."""
        start = np.full(len(self.parts), density_priors.CENTRE)
        return self.fits((), start, np.zeros((0, FEATURES)), MIDDLE, np.inf)

    def fits(
        self, free: tuple[int, ...], y: Array, tilts: Array, width: float, contender: float = CONTENDER
    ) -> list[Fit]:
        """Return the fits of one set of free parts over the spreads of densities, from the widest as far as likely.

        free       numbers of the parts whose density changes within them (F,)
        y, tilts   where to start: log densities (P,) and the slopes of free parts (F, FEATURES)
        width      how wide slopes may spread, a factor on their prior
        contender  how much less evidence than the best one a spread may have before narrower ones are left out
        """
        P, wide = len(self.parts), density_priors.WIDTH**2
        variance = np.tile(_widths(width) ** 2, len(free))
        chance = len(free) * np.log(COMMON) + (P - len(free)) * np.log(1 - COMMON)
        chance -= np.log(len(density_priors.LADDER)) + (np.log(len(LADDER)) if free else 0.0)
        freed = tilting.Free(np.array(free, np.int64), variance, *_stacked([self.profile(k) for k in free]))
        data = (self.data.information, self.data.pull, self.parts.per_mass, self.parts.volume)
        out: list[Fit] = []
        tilts = tilts.ravel()
        for level in range(len(density_priors.LADDER) - 1, -1, -1):
            near = density_priors.LADDER[level] ** 2
            precision = density_priors.apart(P, near, wide)
            seen = tilting.Seen(*data, precision, density_priors.CENTRE)
            y, tilts, cost, curve, hessian, J, phi = tilting.fitted(seen, freed, y, tilts)
            evidence = tilting.evidence_of(cost, hessian, curve, near, wide, P, variance) + chance
            out.append(
                Fit(free, width, level, y, tilts.reshape(len(free), FEATURES), phi, J, hessian, curve, float(evidence))
            )
            if evidence < max(fit.evidence for fit in out) - contender:
                break
        return out

    def worth(self, fits: list[Fit], base: tuple[int, ...] = ()) -> list[int]:
        """Return the rows of the parts that may explain what `fits` leave, by score: nothing is fitted.

        The tilt of a part is taken as linear about zero.
        """
        likely = _likely(fits)
        rows = [k for k in range(len(self.parts)) if k not in base]
        if not rows:
            return []
        slopes = np.stack([self.profile(k).tilted(np.zeros(FEATURES))[1] for k in rows])
        widths = np.stack([_widths(width) for width in LADDER])
        data = (self.data.information, self.data.pull)
        rise = []
        for fit in likely:
            state = (fit.phi, fit.J, fit.hessian, self._masses(fit)[rows])
            rise.append(tilting.scores(*data, *state, slopes, widths) + fit.evidence)
        log_chance = np.log(COMMON / (1 - COMMON)) - np.log(len(LADDER))
        odds = np.logaddexp.reduce(np.concatenate(rise), 0) + log_chance - total(likely)
        return [k for k, found in zip(rows, odds, strict=True) if found > 0]

    def profile(self, part: int) -> Profile:
        """Return the profile of a part, made when first needed."""
        if part not in self.profiles:
            self.profiles[part] = Profile.of(self.parts, part)
        return self.profiles[part]

    def answer(self, fit: Fit) -> Freed:
        """Return the answer of a fit."""
        masses, P = self._masses(fit), len(self.parts)
        full = fit.hessian.copy()
        full[range(P), range(P)] += fit.curve
        inverse = inverse_scaled(full)
        covariance = fit.J @ inverse @ fit.J.T
        tilts = np.zeros((P, fit.tilts.shape[1]))
        tilts[list(fit.free)] = fit.tilts
        spread = np.outer(masses, masses) * inverse[:P, :P]
        return Freed(fit.phi, 0.5 * (covariance + covariance.T), Masses(masses, spread), fit.evidence, fit.free, tilts)

    def _masses(self, fit: Fit) -> Array:
        return np.asarray(self.parts.volume * np.exp(fit.y))


def freed(search: Search, fits: list[Fit], enough: float) -> list[Fit]:
    """Return the likely fits with parts that are not homogeneous, most likely first; `fits` those of even parts.

    Parts are freed one by one, the best first, as long as the evidence rises and the misfit is above `enough`. Sets are
    compared at the middle of the ladder, and only those that could win are tried on all of it.
    """
    tried: list[Fit] = []
    best = -np.inf
    base = max(fits, key=_evidence)
    while rows := search.worth(fits, base.free):
        now = {k: search.fits(*_with(base, k), MIDDLE) for k in rows}
        limit = max(total(found) for found in now.values()) - CONTENDER
        for k, found in list(now.items()):
            if total(found) > limit:
                top = max(found, key=_evidence)
                for width in LADDER:
                    if width != MIDDLE:
                        now[k] = now[k] + search.fits(top.free, top.y, top.tilts, width)
        tried += [fit for found in now.values() for fit in found]
        fits = max(now.values(), key=total)
        base = max(fits, key=_evidence)
        if total(fits) < best or search.data.misfit(base.phi) < enough:
            break
        best = total(fits)
    return _likely(tried)


def _with(fit: Fit, part: int) -> tuple[tuple[int, ...], Array, Array]:
    """Return the free parts of a fit with one more, and where to start: log densities and tilts."""
    free = tuple(sorted((*fit.free, part)))
    return free, fit.y, np.insert(fit.tilts, free.index(part), 0.0, axis=0)


def _evidence(fit: Fit) -> float:
    return fit.evidence


def _likely(fits: list[Fit]) -> list[Fit]:
    """Return the likelier ones of the fits, the best first."""
    ordered = sorted(fits, key=lambda fit: -fit.evidence)
    return [fit for fit in ordered if fit.evidence > ordered[0].evidence + UNLIKELY]


def total(fits: list[Fit]) -> float:
    """Return the log of the summed evidence."""
    return float(np.logaddexp.reduce([fit.evidence for fit in fits]))


def _widths(width: float) -> Array:
    """Return the standard deviations (9,) of linear tilts and of products of positions."""
    return np.asarray(width * np.repeat([1.0, QUADRATIC], [3, 6]))


def _stacked(profiles: list[Profile]) -> tuple[Array, Array, Array]:
    """Return weight (f, N), features (f, N, F) and per_mass (f, N, 10), points of no weight added where fewer."""
    N = max((len(p.weight) for p in profiles), default=0)
    weight, features, per_mass = (
        np.zeros((len(profiles), N)),
        np.zeros((len(profiles), N, 9)),
        np.zeros((len(profiles), N, 10)),
    )
    for k, p in enumerate(profiles):
        n = len(p.weight)
        weight[k, :n], features[k, :n], per_mass[k, :n] = p.weight, p.features, p.per_mass
    return weight, features, per_mass
