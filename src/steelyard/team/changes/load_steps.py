"""A payload that is another one from some time on: a thing put on it, taken from it, or let go by a robot nobody logs.

What the fit leaves of a recording in motion is asked for a step of mass and first moment at every time, beside those of
the whole recording, a bias, and a drift:

    left(t) = Y(t) d + b + c t + Y(t) D [t >= s]

A step of the sensors' bias at the same time must explain less: it does not turn with gravity. Either part may be the
body that the other recordings weigh; alone, the longer one is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.inertia.regressor import motion_map
from steelyard.team.changes.contact import MARGIN_S, mean_left
from steelyard.team.payload.body_rows import BodyRows, PayloadRows, Run
from steelyard.team.payload.fit import Fitted, Weighing
from steelyard.team.payload.model import weight

# Wrenches are averaged over BLOCK_S, and either part lasts LEAST_S [s].
BLOCK_S, LEAST_S = 0.5, 3.0
# The mass must step by this share and so many standard deviations (blocks are taken as independent, and are not), and
# what is left must fall to this share.
SHARE, BEYOND, LEAVES = 0.08, 12.0, 0.7
# The shorter part is the payload where recordings then disagree less by this factor.
BETTER = 2.0
# Of ten parameters: mass and first moments.
WEIGHING = np.eye(10)[:4]


@dataclass(frozen=True)
class LoadStep:
    """From time `at` [s] after the first row of a recording on, the payload weighs `more` [kg]."""

    at: float
    more: float


def with_one_load(
    rows: PayloadRows, fit: Weighing, fitted: Fitted, size: float, highest_hz: float
) -> tuple[PayloadRows, Weighing, tuple[Finding, ...]]:
    """Return rows and fit without the part of each recording in which the payload was another, and what is said of it.

    Where forces are misread nothing is asked, and nothing is left out that the parameters hang on. size  of the team
    """
    found = list[Finding]()
    for k, (body, left) in enumerate(rows):
        step = None if fit.read or body.still else load_step(body, fit, size)
        if step is None:
            continue
        parts = []
        for later in (False, True):
            kept = body.without([_gone(body, run, step.at, later) for run in body.runs], highest_hz)
            tried = [*rows[:k], (kept, left), *rows[k + 1 :]]
            try:
                again = fitted(tried)
            except CannotAnswer:
                continue
            if again.payload.lost.shape[1] <= fit.payload.lost.shape[1]:
                parts.append((sum(len(run.motion) for run in kept.runs), later, tried, again))
        if not parts:
            continue
        _, later, rows, fit = max(parts, key=lambda part: part[0])
        for _, other, tried, again in parts:
            if BETTER * _disagree(again, size) < _disagree(fit, size):
                later, rows, fit = other, tried, again
        found.append(_finding(body, step, later))
    return rows, fit, tuple(found)


def load_step(body: BodyRows, fit: Weighing, size: float) -> LoadStep | None:
    """Return when the payload of a recording surely becomes another, None where it does not."""
    blocks = [_blocks(run, fit, size) for run in body.runs]
    if not blocks:
        return None
    time, left, weighing = (np.concatenate(each) for each in zip(*blocks, strict=True))
    order = np.argsort(time)
    time, left, weighing = time[order], left[order], weighing[order]
    bias = np.broadcast_to(np.eye(6), (len(time), 6, 6))
    drift = bias * ((time - time.mean()) / max(np.ptp(time), 1e-9))[:, None, None]
    always = np.concatenate([weighing, bias, drift], axis=2)
    allowed = (time - time[0] >= LEAST_S) & (time[-1] - time >= LEAST_S)
    if not allowed.any():
        return None
    squares, H, steps, whole = _steps(left, always, weighing)
    jumps, *_ = _steps(left, always, bias)
    at = int(np.where(allowed, squares, np.inf).argmin())
    noise = squares[at] / max(left.size - always.shape[2] - 4, 1)
    more = float(steps[at, 0])
    std = float(np.sqrt(max(np.linalg.pinv(H[at], hermitian=True)[0, 0], 0.0) * noise))
    heavy = weight(fit.payload.parameters) * SHARE
    sure = abs(more) > BEYOND * std and weight(np.eye(10)[0] * abs(more)) > heavy
    if not sure or squares[at] > LEAVES * whole or jumps[allowed].min() < squares[at]:
        return None
    return LoadStep(float(time[at]) - 0.5 * BLOCK_S, more)


def _blocks(run: Run, fit: Weighing, size: float) -> tuple[Array, Array, Array]:
    """Return by blocks of a run time (B,) [s], what is left (B, 6) and what masses and first moments make (B, 6, 4).

    Moments are over size.
    """
    length = max(1, round(BLOCK_S * run.rate))
    count = len(run.motion) // length
    motion, pushed = (x[: count * length].reshape(count, length, -1).mean(1) for x in (run.motion, run.pushed))
    unit = np.repeat([size, 1.0], 3)
    left = (pushed @ fit.D.T - motion @ motion_map(fit.payload.parameters).T) / unit
    made = np.stack([motion @ motion_map(one).T for one in WEIGHING], axis=2) / unit[:, None]
    return (run.rows.start + length * (np.arange(count) + 0.5)) / run.rate, left, made


def _steps(left: Array, always: Array, steps: Array) -> tuple[Array, Array, Array, float]:
    """Return what steps from every block on leave: squares (B,), information (B, S, S), sizes (B, S); and none at all.

    left  (B, 6)     always  (B, 6, P) what is fitted beside     steps  (B, 6, S)
    """
    inverse = np.linalg.pinv(np.einsum("bip,biq->pq", always, always), hermitian=True)
    known = inverse @ np.einsum("bip,bi->p", always, left)
    rest = left - always @ known
    after = [
        np.cumsum(x[::-1], axis=0)[::-1]
        for x in (
            np.einsum("bip,bis->bps", always, steps), np.einsum("bir,bis->brs", steps, steps),
            np.einsum("bis,bi->bs", steps, rest),
        )
    ]  # fmt: skip
    H = after[1] - np.einsum("bps,pq,bqr->bsr", after[0], inverse, after[0])
    sizes = np.einsum("bsr,br->bs", np.linalg.pinv(H, rcond=1e-9, hermitian=True), after[2])
    whole = float((rest**2).sum())
    return whole - np.einsum("bs,bs->b", sizes, after[2]), H, sizes, whole


def _gone(body: BodyRows, run: Run, at: float, later: bool) -> Mask:
    """Return the rows (T,) of a run that are left out where the part after the step is kept, or that before it."""
    time = (run.rows.start + np.arange(len(run.motion))) / run.rate
    return np.asarray(time < at + MARGIN_S if later else time > at - MARGIN_S)


def _disagree(fit: Weighing, size: float) -> float:
    """Return by how much [N] recordings disagree on the payload: the rms of what each leaves on average."""
    parts = [part for group in fit.groups for part in group.parts]
    return float(np.sqrt((mean_left(fit.payload.parameters, parts, fit.D, size) ** 2).mean()))


def _finding(body: BodyRows, step: LoadStep, later: bool) -> Finding:
    """Return load-changed where the robots bear more than what is weighed, contact where they bear less."""
    more = -step.more if later else step.more
    size = f"{weight(WEIGHING[0] * abs(more)):.2g} N"
    when = f"Up to {step.at:.1f} s of '{body.name}'" if later else f"From {step.at:.1f} s of '{body.name}' on"
    if more > 0:
        what = f"{when} robots bear {size} more than the payload weighs, as where something lies on it"
    else:
        what = f"{when} robots bear {size} less than the payload weighs, as where it stands on something or was lighter"
    return Finding.of("load-changed" if more > 0 else "contact", f"{what}; their wrenches were left out meanwhile.")
