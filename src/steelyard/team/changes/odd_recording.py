"""Recordings that another body explains: the payload stood on something in them, or something lay on it.

What a recording leaves of the sum of wrenches on average is bias, and much the same in all; those that leave many times
as much as all others, once the fit is to the others alone, are left out.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.team.payload.fit import PayloadFit, fit_payload
from steelyard.team.payload.model import Group, weight
from steelyard.team.payload.spectra import Spectra

# A recording is odd that leaves so many times what others do (rms), and this share of the weight; it is looked into
# where it already leaves SUSPECT times what the middle one does, with all in the fit.
ODD, SHARE, SUSPECT = 8.0, 0.03, 3.0
# Recordings that there must be, so that the others can agree, and the share of them that may be odd.
FEWEST, MOST = 4, 1 / 3


def without_odd(
    payload: PayloadFit, groups: tuple[Group, ...], D: Array, C: Array, size: float, with_gain: bool
) -> tuple[PayloadFit, tuple[Finding, ...]]:
    """Return the fit without recordings that leave far more than all others, and what is said of them.

    Arguments as in `fit_payload`
    """
    parts = [part for group in groups for part in group.parts]
    heavy, odd, fit = weight(payload.parameters), list[int](), payload
    left = _left(payload.parameters, parts, D, size)
    if len(parts) < FEWEST or left.max() < max(SHARE * heavy / 2, SUSPECT * float(np.median(left))):
        return payload, ()
    while len(odd) + 1 <= MOST * len(parts):
        odd.append(int(np.argmax(np.where(np.isin(np.arange(len(parts)), odd), 0.0, left))))
        fit = fit_payload(_without(groups, [parts[k] for k in odd]), D, C, size, with_gain)
        left = _left(fit.parameters, parts, D, size)
        others = float(np.sqrt((np.delete(left, odd) ** 2).mean()))
        if fit.lost.shape[1] > payload.lost.shape[1]:
            break
        if left[odd].min() > max(SHARE * heavy, ODD * others):
            return fit, tuple(_finding(fit.parameters, parts[k], D) for k in sorted(odd))
    return payload, ()


def _without(groups: tuple[Group, ...], odd: list[Spectra]) -> tuple[Group, ...]:
    """Return the groups without some of their recordings."""
    kept = (replace(g, parts=tuple(p for p in g.parts if not any(p is one for one in odd))) for g in groups)
    return tuple(group for group in kept if group.parts)


def _left(phi: Array, parts: list[Spectra], D: Array, size: float) -> Array:
    """Return the size (R,) [N] of the mean wrench that every recording leaves, moments over the team's size."""
    each = np.array([_mean_wrench(phi, part, D) for part in parts])
    return np.asarray(np.linalg.norm(each / np.repeat([size, 1.0], 3), axis=1))


def _mean_wrench(phi: Array, part: Spectra, D: Array) -> Array:
    """Return the mean of what is pushed less what the payload needs (6,) [N m, N]."""
    mean = part.scatter.sum(0)[:, -1]
    return np.asarray((D @ mean[12:-1] - motion_map(phi) @ mean[:12]) / max(float(mean[-1]), 1e-300))


def _finding(phi: Array, part: Spectra, D: Array) -> Finding:
    """Return contact where the robots bear less than the payload weighs, load-changed where they bear more."""
    mean = part.scatter.sum(0)[:, -1]
    needed = (motion_map(phi) @ mean[:12])[3:]
    more = float(_mean_wrench(phi, part, D)[3:] @ needed / np.linalg.norm(needed))
    moment, force = (float(np.linalg.norm(x)) for x in np.split(_mean_wrench(phi, part, D), 2))
    if abs(more) < 0.5 * force:
        size = f"{force:.3g} N and {moment:.2g} N m"
        what = f"robots push {size} that the payload does not need, as where something leans on it"
    elif more < 0:
        what = f"robots bear {-more:.3g} N less than the payload weighs, as where it stands on something"
    else:
        what = f"robots bear {more:.3g} N more than the payload weighs, as where something lies on it"
    code = "load-changed" if more > 0.5 * force else "contact"
    return Finding.of(code, f"In '{part.name}' {what}; its wrenches were left out.")
