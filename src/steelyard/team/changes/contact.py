"""Something beside the robots that bears the payload or pushes it: a table before the lift, a hand, a thing on top.

Rows in which robots bear less than half of what they bear in the rest of a recording in motion are asked for before
anything is fitted: left in, they make a force look as if its sign were wrong, or leave no mass at all. Sensors that
were tared under load read next to nothing as well: whether weight is missing, the fit to all other rows decides.

What the fit leaves of the sum of wrenches is noise and slow errors, much the same throughout; a hand that comes and
goes leaves many times as much while it is there. The motion is measured all the same, so that only wrenches are lost.

What a recording leaves on average is bias, and much the same in all; those that leave many times as much as all others,
once the fit is to the others alone, are another body's, and left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import binary_dilation

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.logs.middles import median, quantile
from steelyard.spatial import unit_vectors
from steelyard.team.payload.body_rows import BodyRows, PayloadRows, Run, averaged
from steelyard.team.payload.fit import Fitted, PayloadFit, Weighing, fit_payload
from steelyard.team.payload.model import Group, weight
from steelyard.team.payload.spectra import Spectra

# What robots push is averaged over MEAN_S; rows within MARGIN_S [s] of what is left out are left out, too.
MEAN_S, MARGIN_S = 0.5, 0.75
# What robots bear is little below this share of what they bear in a tenth of the rows, and the payload is propped where
# so much of its weight is missing.
LITTLE, USUAL, MISSING = 0.5, 0.9, 0.25
# A touch leaves so many times the usual (median) and this share of the weight.
TIMES, SHARE = 8.0, 0.03
# Where more of a recording is touched, it is left out if there are others. What is usual in it is at most so many times
# what it is in another.
MOST, UNLIKE = 0.4, 2.0
# A recording is odd that leaves so many times what others do (rms), and SHARE of the weight; it is looked into where it
# already leaves SUSPECT times what the middle one does, with all in the fit.
ODD, SUSPECT = 8.0, 3.0
# Recordings that there must be, so that the others can agree, and the share of them that may be odd.
FEWEST, MOST_ODD = 4, 1 / 3


def unpropped(
    rows: PayloadRows, fitted: Fitted, D: Array, highest_hz: float
) -> tuple[PayloadRows, tuple[Finding, ...]]:
    """Return the rows without those in which something else bears the payload, and what is said of them.

    D  (6, 6 N) sums the pushes at B
    """
    asked = {k: little for k, (body, _) in enumerate(rows) if (little := _little_borne(body, D)) is not None}
    if not asked:
        return rows, ()
    kept = [(body.without(asked[k], highest_hz) if k in asked else body, left) for k, (body, left) in enumerate(rows)]
    try:
        fit = fitted(kept)
    except CannotAnswer:
        return rows, ()
    out, found = list(rows), list[Finding]()
    for k, little in asked.items():
        body = rows[k][0]
        missing = _missing(body, little, fit)
        if missing > MISSING * weight(fit.payload.parameters):
            out[k] = kept[k]
            text = (
                f"For {body.seconds(little):.1f} s of '{body.name}' robots bear {missing:.3g} N less than the payload "
                "weighs, as where it stands on something; its wrenches were left out meanwhile."
            )
            found.append(Finding.of("contact", text))
    return out, tuple(found)


def _little_borne(body: BodyRows, D: Array) -> tuple[Mask, ...] | None:
    """Return the rows of each run of a recording in motion in which robots bear far less than in others, if any."""
    if body.still or not body.runs:
        return None
    borne = [averaged(_borne(run, D), MEAN_S, run.rate) for run in body.runs]
    least = LITTLE * float(quantile(np.concatenate(borne), USUAL))
    little = tuple(_around(each < least, run.rate) for each, run in zip(borne, body.runs, strict=True))
    some = least > 0 and any(each.any() for each in little) and not all(each.all() for each in little)
    return little if some else None


def _missing(body: BodyRows, little: Sequence[Mask], fit: Weighing) -> float:
    """Return how much less [N] robots bear in these rows than in the others, beside what the payload needs."""
    needed = motion_map(fit.payload.parameters)[3:].T
    less = np.concatenate([_borne(run, fit.given) - _along_weight(run.motion @ needed, run) for run in body.runs])
    rows = np.concatenate(little)
    return float(np.median(less[~rows]) - np.median(less[rows]))


def _borne(run: Run, D: Array) -> Array:
    """Return the force (T,) [N] with which robots push against gravity, and what accelerates the payload along it."""
    return _along_weight(run.pushed @ D[3:].T, run)


def _along_weight(force: Array, run: Run) -> Array:
    return np.asarray(np.einsum("ti,ti->t", force, unit_vectors(run.motion[:, 3:6])))


def untouched(
    rows: PayloadRows, fit: Weighing, fitted: Fitted, size: float, highest_hz: float
) -> tuple[PayloadRows, Weighing, tuple[Finding, ...]]:
    """Return rows and fit without those in which something touched the payload, and what is said of that.

    Nothing is left out that the parameters hang on. size  of the team [m]
    """
    kept, touched = _without_touched(rows, fit, size, highest_hz)
    if not touched:
        return rows, fit, ()
    try:
        fewer = fitted(kept)
    except CannotAnswer:
        return rows, fit, ()
    if fewer.payload.lost.shape[1] > fit.payload.lost.shape[1]:
        return rows, fit, ()
    return kept, fewer, tuple(touched)


def unpushed(
    rows: PayloadRows, fit: Weighing, as_given: Fitted, fitted: Fitted, size: float, highest_hz: float
) -> tuple[PayloadRows, Weighing, tuple[Finding, ...]]:
    """Return what `untouched` does where a touch alone made forces look misread: without it they are not.

    as_given  the fit with forces as they are given
    """
    if fit.read:
        kept, fewer, touched = untouched(rows, as_given(rows), fitted, size, highest_hz)
        if touched and not fewer.read:
            return kept, fewer, touched
    return rows, fit, ()


def _without_touched(
    rows: PayloadRows, fit: Weighing, size: float, highest_hz: float
) -> tuple[PayloadRows, list[Finding]]:
    """Return recordings without rows in which the payload was touched, and for how long and how hard that was."""
    phi = fit.payload.parameters
    pushes = [[] if body.still else [_unneeded(run, phi, fit.given, size) for run in body.runs] for body, _ in rows]
    sizes = [[np.sqrt(np.einsum("ti,ti->t", push, push)) for push in each] for each in pushes]
    usual = [float(median(np.concatenate(each))) if each else np.inf for each in sizes]
    out, found = list(rows), list[Finding]()
    for k, (body, left) in enumerate(rows):
        if not pushes[k]:
            continue
        others = min(usual[:k] + usual[k + 1 :], default=np.inf)
        least = max(TIMES * min(usual[k], UNLIKE * others), SHARE * weight(phi))
        each = zip(sizes[k], body.runs, strict=True)
        touched = [_around(_inner(size > least, run.rate), run.rate) for size, run in each]
        share = float(np.concatenate(touched).mean())
        if not share or (share > MOST and not np.isfinite(others)):
            continue
        if share > MOST:
            touched = [np.ones_like(some) for some in touched]
        out[k] = (body.without(touched, highest_hz), left)
        newtons = max(float(np.linalg.norm(push[:, 3:], axis=1).max()) for push in pushes[k])
        text = (
            f"For {body.seconds(touched):.1f} s of '{body.name}' robots push up to {newtons:.2g} N that the payload "
            "does not need, as where a hand pushes it; its wrenches were left out meanwhile."
        )
        found.append(Finding.of("contact", text))
    return out, found


def _unneeded(run: Run, phi: Array, D: Array, size: float) -> Array:
    """Return what is pushed (T, 6) and not needed, averaged over MEAN_S and less a constant [N, moments over size]."""
    left = (run.pushed @ D.T - run.motion @ motion_map(phi).T) / np.repeat([size, 1.0], 3)
    smooth = averaged(left, MEAN_S, run.rate)
    return np.asarray(smooth - median(smooth.T))


def _inner(rows: Mask, rate: float) -> Mask:
    """Return rows (T,) but for those at the ends, whose accelerations are told from one side: these say nothing."""
    edge, inner = round(MEAN_S * rate), rows.copy()
    inner[:edge] = inner[len(rows) - edge :] = False
    return inner


def _around(rows: Mask, rate: float) -> Mask:
    """Return rows (T,) with those within MARGIN_S."""
    return np.asarray(binary_dilation(rows, iterations=max(1, round(MARGIN_S * rate)))) if rows.any() else rows


def without_odd(
    payload: PayloadFit, groups: tuple[Group, ...], D: Array, C: Array, size: float, with_gain: bool
) -> tuple[PayloadFit, tuple[Finding, ...]]:
    """Return the fit without recordings that leave far more than all others, and what is said of them.

    Arguments as in `fit_payload`
    """
    parts = [part for group in groups for part in group.parts]
    heavy, odd, fit = weight(payload.parameters), list[int](), payload
    left = mean_left(payload.parameters, parts, D, size)
    if len(parts) < FEWEST or left.max() < max(SHARE * heavy / 2, SUSPECT * float(np.median(left))):
        return payload, ()
    while len(odd) + 1 <= MOST_ODD * len(parts):
        odd.append(int(np.argmax(np.where(np.isin(np.arange(len(parts)), odd), 0.0, left))))
        fit = fit_payload(_without(groups, [parts[k] for k in odd]), D, C, size, with_gain)
        left = mean_left(fit.parameters, parts, D, size)
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


def mean_left(phi: Array, parts: Sequence[Spectra], D: Array, size: float) -> Array:
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
