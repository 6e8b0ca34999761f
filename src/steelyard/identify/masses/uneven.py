"""Parts that are not homogeneous: whether the log says so, the answer with their densities freed, and words for it."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.identify.bars.effective import Effective
from steelyard.identify.masses.findings import misfit_limit
from steelyard.identify.masses.gradients import Freed, Search, freed, total
from steelyard.identify.masses.models import Masses
from steelyard.identify.masses.profiles import Profile
from steelyard.identify.mixture import mixture
from steelyard.parts.parts import Parts

# Worth a look: a chi-square that right, homogeneous parts exceed once in so many logs.
SUSPICIOUS = 1e-2
# Freed parts must be so many times likelier than homogeneous ones, what is common among tools counted: strong evidence
# by the usual word (Kass and Raftery 1995).
ODDS = 20.0
# How the words go on that say which density explains a log.
_CENTRE = "its centre of mass lies"
# A part is named where it is freed with at least this probability, and as sure where with that.
NAMED, SURE = 0.2, 0.9


@dataclass(frozen=True, eq=False)
class Uneven:
    """The answer with freed parts: ten parameters (10,) with covariance (10, 10), part masses, and what to say."""

    vector: Array
    covariance: Array
    masses: Masses
    message: str


def suspicious(data: Effective, vector: Array, parts: Parts) -> bool:
    """Say whether the misfit of homogeneous parts, whose whole is `vector` (10,), is worth a look."""
    return data.misfit(vector) > misfit_limit(data, len(parts), SUSPICIOUS)


def uneven(data: Effective, parts: Parts) -> Uneven | None:
    """Return the answer averaged over freed parts, None where homogeneous ones are likely enough or nothing fits."""
    search = Search(data, parts)
    homogeneous = search.even()
    fits = freed(search, homogeneous, misfit_limit(data, len(parts), SUSPICIOUS))
    if not fits or total(fits) - total(homogeneous) < np.log(ODDS):
        return None
    models = [search.answer(fit) for fit in fits]
    weight = np.exp(np.array([model.evidence for model in models]) - total(fits))
    vector, covariance = mixture(weight, [m.vector for m in models], [m.covariance for m in models])
    if data.misfit(vector) > misfit_limit(data, 1):
        return None
    masses = Masses(*mixture(weight, [m.masses.mean for m in models], [m.masses.covariance for m in models]))
    return Uneven(vector, covariance, masses, _message(parts, search, models, weight))


def explains(findings: Iterable[Finding]) -> bool:
    """Tell whether one of the findings is a density that changes within a part, which explains the log."""
    return any(f.code == "part-not-homogeneous" and _CENTRE in f.message for f in findings)


def _message(parts: Parts, search: Search, models: list[Freed], weight: Array) -> str:
    """Return which parts are not homogeneous, and how."""
    chance = np.array([sum(w for m, w in zip(models, weight, strict=True) if k in m.free) for k in range(len(parts))])
    named = [k for k in np.argsort(-chance, kind="stable") if chance[k] > NAMED] or [int(chance.argmax())]
    if chance[named[0]] > SURE:
        named = [k for k in named if chance[k] > SURE]
        labels = " and ".join(str(parts.label[k]) for k in named)
        who = (
            f"Parts {labels} are not of one density each" if len(named) > 1 else f"Part {labels} is not of one density"
        )
    else:
        who = "Part " + " or ".join(f"{parts.label[k]} ({100 * chance[k]:.0f} %)" for k in named)
        who += " is not of one density"
    falls = [_fall(search.profile(k), _shift(k, search.profile(k), models, weight)) for k in named]
    how = [f"part {parts.label[k]}: {text}" for k, text in zip(named, falls, strict=True)]
    return f"{who}; {'; '.join(how)}."


def _shift(part: int, profile: Profile, models: list[Freed], weight: Array) -> Array:
    """Return the mean shift (3,) of the centre of mass of a part, where it is freed, in standard deviations."""
    told = [(w, m.tilts[part]) for m, w in zip(models, weight, strict=True) if part in m.free]
    return np.asarray(sum(w * profile.shift(tilt) for w, tilt in told) / sum(w for w, _ in told))


def _fall(profile: Profile, shift: Array) -> str:
    """Return words for a shift: how far, where to, and the linear fall of density that would give it."""
    moved = profile.axes @ (profile.size * shift)
    distance = float(np.linalg.norm(moved))
    along = profile.place @ (shift / max(float(np.linalg.norm(shift)), 1e-12))
    share = float(np.linalg.norm(shift) * np.ptp(along))
    toward = ", ".join(f"{value:.2f}" for value in moved / max(distance, 1e-12))
    fall = f"by {100 * share:.0f} %" if share < 1.5 else "to a small part"
    return (
        f"{_CENTRE} {1e3 * distance:.1f} mm from its centroid toward ({toward}) in the sensor's axes, "
        f"as if its density fell {fall} from one end to the other"
    )
