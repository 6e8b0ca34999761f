"""A payload that is another one from some time on: a thing put on it, taken from it, or let go by a robot nobody logs.

What robots push in a recording in motion is asked for a step D of mass and first moment at every time, beside the ten
parameters of the whole recording, a bias, and a drift:

    pushed(t) = Y(t) phi + b + c t + Y(t) D [t >= s]

A step of the sensors' bias at the same time must explain less: it does not turn with gravity. Either part may be the
body that the other recordings weigh; alone, the longer one is.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Mask
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.inertia.regressor import basis
from steelyard.logs.recording import ROUNDED_GRAVITY
from steelyard.team.changes.contact import MARGIN_S, mean_left
from steelyard.team.payload.body_rows import BodyRows, PayloadRows, Run
from steelyard.team.payload.fit import Fitted, Weighing

# Wrenches are averaged over BLOCK_S, and either part lasts LEAST_S [s].
BLOCK_S, LEAST_S = 0.5, 3.0
# The mass must step by this share and so many standard deviations (blocks are taken as independent, and are not), and
# what is left must fall to this share.
SHARE, BEYOND, LEAVES = 0.08, 12.0, 0.7
# The shorter part is the payload where recordings then disagree less by this factor.
BETTER = 2.0


@dataclass(frozen=True)
class LoadStep:
    """From time `at` [s] after the first row of a recording on, the payload weighs `more` [kg]."""

    at: float
    more: float


def with_one_load(
    rows: PayloadRows, fit: Weighing, fitted: Fitted, D: Array, size: float, highest_hz: float
) -> tuple[PayloadRows, Weighing, tuple[Finding, ...]]:
    """Return rows and fit without the part of each recording in which the payload was another, and what is said of it.

    Another load may make forces look misread, and is believed where they then are not; nothing is left out that the
    parameters hang on. D  (6, 6 N) sums the pushes at B as they are given     size  of the team [m]
    """
    found = list[Finding]()
    for k, (body, left) in enumerate(rows):
        step = None if body.still else load_step(body, D, size)
        if step is None:
            continue
        parts = []
        for later in (False, True):
            kept = body.without([_gone(run, step.at, later) for run in body.runs], highest_hz)
            tried = [*rows[:k], (kept, left), *rows[k + 1 :]]
            try:
                again = fitted(tried)
            except CannotAnswer:
                continue
            if not again.read and again.payload.lost.shape[1] <= fit.payload.lost.shape[1]:
                parts.append((sum(len(run.motion) for run in kept.runs), later, tried, again))
        if not parts:
            continue
        _, later, rows, fit = max(parts, key=lambda part: part[0])
        for _, other, tried, again in parts:
            if BETTER * _disagree(again, D, size) < _disagree(fit, D, size):
                later, rows, fit = other, tried, again
        found.append(_finding(body, step, later))
    return rows, fit, tuple(found)


def load_step(body: BodyRows, D: Array, size: float) -> LoadStep | None:
    """Return when the payload of a recording surely becomes another, None where it does not.

    D  (6, 6 N) sums the pushes at B     size  of the team [m]
    """
    blocks = [_blocks(run, D, size) for run in body.runs]
    if not blocks:
        return None
    time, pushed, needed = (np.concatenate(each) for each in zip(*blocks, strict=True))
    allowed = (time - time[0] >= LEAST_S) & (time[-1] - time >= LEAST_S)
    if not allowed.any():
        return None
    bias = np.broadcast_to(np.eye(6), (len(time), 6, 6))
    drift = bias * ((time - time.mean()) / np.ptp(time))[:, None, None]
    always = np.concatenate([needed, bias, drift], axis=2)
    left, H, steps, whole = _steps(pushed, always, needed[..., :4])
    at = int(np.where(allowed, left, np.inf).argmin())
    noise = left[at] / max(pushed.size - always.shape[2] - 4, 1)
    more = float(steps[at, 0])
    std = float(np.sqrt(max(np.linalg.pinv(H[at], hermitian=True)[0, 0], 0.0) * noise))
    heavy = SHARE * float(np.sqrt((pushed[:, 3:] ** 2).sum(1).mean()))
    sure = abs(more) > BEYOND * std and ROUNDED_GRAVITY * abs(more) > heavy
    if not sure or left[at] > LEAVES * whole:
        return None
    jumps, *_ = _steps(pushed, always, bias)
    if jumps[allowed].min() < left[at]:
        return None
    return LoadStep(float(time[at]) - 0.5 * BLOCK_S, more)


def _blocks(run: Run, D: Array, size: float) -> tuple[Array, Array, Array]:
    """Return by blocks of a run time (B,) [s], what is pushed (B, 6), and what each parameter needs (B, 6, 10).

    Moments are over size.
    """
    length = max(1, round(BLOCK_S * run.rate))
    count = len(run.motion) // length
    motion, pushed = (x[: count * length].reshape(count, length, -1).mean(1) for x in (run.motion, run.pushed))
    unit = np.repeat([size, 1.0], 3)
    needed = np.tensordot(motion, basis(), (1, 2)).swapaxes(1, 2) / unit[:, None]
    return (run.rows.start + length * (np.arange(count) + 0.5)) / run.rate, pushed @ D.T / unit, needed


def _steps(pushed: Array, always: Array, steps: Array) -> tuple[Array, Array, Array, float]:
    """Return what steps from every block on leave: squares (B,), information (B, S, S), sizes (B, S); and none at all.

    pushed  (B, 6)     always  (B, 6, P) what is fitted beside     steps  (B, 6, S)
    """
    flat, beside = always.reshape(-1, always.shape[2]), steps.swapaxes(1, 2)
    inverse = np.linalg.pinv(flat.T @ flat, hermitian=True)
    rest = pushed - always @ (inverse @ (flat.T @ pushed.ravel()))
    each = beside @ always, beside @ steps, (beside @ rest[..., None])[..., 0]
    after = [np.cumsum(x[::-1], axis=0)[::-1] for x in each]
    H = after[1] - after[0] @ inverse @ after[0].swapaxes(1, 2)
    sizes = np.einsum("bsr,br->bs", np.linalg.pinv(H, rcond=1e-9, hermitian=True), after[2])
    whole = float((rest**2).sum())
    return whole - np.einsum("bs,bs->b", sizes, after[2]), H, sizes, whole


def _gone(run: Run, at: float, later: bool) -> Mask:
    """Return the rows (T,) of a run that are left out where the part after the step is kept, or that before it."""
    time = (run.rows.start + np.arange(len(run.motion))) / run.rate
    return np.asarray(time < at + MARGIN_S if later else time > at - MARGIN_S)


def _disagree(fit: Weighing, D: Array, size: float) -> float:
    """Return by how much [N] recordings disagree on the payload: the rms of what each leaves on average."""
    parts = [part for group in fit.groups for part in group.parts]
    return float(np.sqrt((mean_left(fit.payload.parameters, parts, D, size) ** 2).mean()))


def _finding(body: BodyRows, step: LoadStep, later: bool) -> Finding:
    """Return load-changed where the robots bear more than what is weighed, contact where they bear less."""
    more = -step.more if later else step.more
    size = f"{ROUNDED_GRAVITY * abs(more):.2g} N"
    when = f"Up to {step.at:.1f} s of '{body.name}'" if later else f"From {step.at:.1f} s of '{body.name}' on"
    if more > 0:
        what = f"{when} robots bear {size} more than the payload weighs, as where something lies on it"
    else:
        what = f"{when} robots bear {size} less than the payload weighs, as where it stands on something or was lighter"
    return Finding.of("load-changed" if more > 0 else "contact", f"{what}; their wrenches were left out meanwhile.")
