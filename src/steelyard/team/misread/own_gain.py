"""One robot whose wrench is too large or too small, or of another sign, told from all the others'.

Such a gain makes another body of the payload, but for how loads move from robot to robot as the payload turns. It shows
in the products I (N, N) of what body and biases leave of the wrenches c_i = D_i s_i that robots add to the sum: a gain
of robot i leaves least where it is -(I 1)_i / I_ii. Noise of a sensor is in its column as well as in the sum, and would
explain itself. All that is left is 1^T I 1, whatever the colour of noise: each robot's share of that is taken off, so
that no size of noise must be known, and slow noise passes for no gain. Where a gain stands out it is taken out and the
payload fitted anew, to see it by the noise that is then left. The answer stays as it is; bars hold what the gain does.
Source: own.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array, Integers
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding, quoted, with_bar
from steelyard.team.definite import shown_axes
from steelyard.team.misread.forces import reread
from steelyard.team.misread.moment_places import loud
from steelyard.team.payload.fit import PayloadFit
from steelyard.team.payload.model import Group
from steelyard.team.payload.spectra import NO_LEVERS, SEEN, regressors

# Standard deviations from which a gain is looked into, and from which it counts by the noise of the fit without it.
ASKED, COUNTS = 3.5, 6.0
# Where a gain explains more than this share of what is left, that is no noise.
GROSS = 0.2
# And from which size on: smaller ones are axes that err each for itself.
LEAST = 0.02
# So many times, or as many times less, is no error of calibration.
FAR = 2.0
# Another robot may be the wrong one where that is less likely by no more than this, in squares of standard deviations.
ALIKE = 9.0
# A gain counts where noise is less than half of what tells it, and whether a robot's part of the noise is so many times
# larger or smaller than it seems: its noise may have another colour than that of others.
NOISY, UNLIKE = 0.5, 2.5
# Who has more than this share of all noise is loud, and nothing can be told of its gain.
LOUDEST = 0.995
# Gains are taken out until a step is below this share of its standard deviation, at most so many times.
SETTLED, ROUNDS = 0.2, 10
# Information below this share of the largest is rounding.
RANK = 1e-9

Fitted = Callable[[tuple[Group, ...]], PayloadFit]


@dataclass(frozen=True, eq=False)
class OwnGain:
    """One robot's wrench fits only so many `times`, with a standard deviation; and what else fits nearly as well.

    robots  who may be the wrong one, the likeliest first     more  (10, 10) covariance of parameters by these errors
    groups  recordings with that one's wrench taken so        fit   of these
    """

    robots: tuple[int, ...]
    times: float
    std: float
    more: Array
    groups: tuple[Group, ...]
    fit: PayloadFit

    def finding(self, names: Sequence[str]) -> Finding:
        """Return the robot and its apparent gain: as one that errs, or, far from one, as a wrench that is misread."""
        first, others = names[self.robots[0]], [names[i] for i in self.robots[1:]]
        doubt = f", or as well with the one of {quoted(others, ' or ')} changed instead" if others else ""
        who = quoted([first, *others], " or ")
        return Finding(
            "common-gain-unseen" if 1 / FAR < self.times < FAR else "wrench-unexplained",
            f"What the robots push carries one body only with the wrench of '{first}' taken "
            f"{with_bar(self.times, self.std)} times{doubt}. Nothing was changed; bars hold what that does.",
            f"Check unit, sign and calibration of the wrench of {who}: let each hold a known mass alone.",
        )


@dataclass(frozen=True, eq=False)
class _Seen:
    """What the wrenches say of each robot's gain.

    information  (N,) about it     pull  (N,) what it would take of all that is left
    noise        (N,) what of both is noise     loud  (N,) its share of the noise of all forces
    """

    information: Array
    noise: Array
    pull: Array
    loud: Array

    def gains(self, noise: Array) -> Array:
        """Return the gains (..., N) by so much noise (..., N).

        Where noise seems to be most of what is seen, the fit is rough, and steps are shorter.
        """
        return np.asarray((noise - self.pull) / self._clear)

    @property
    def std(self) -> Array:
        """Standard deviations (N,) of these gains."""
        return np.asarray(np.sqrt(self.information) / self._clear)

    @property
    def _clear(self) -> Array:
        return np.asarray(np.maximum(self.information - self.noise, 0.5 * self.information))

    @property
    def asked(self) -> Integers:
        """Which robots may have one: it stands out of the noise, or explains much of what is left."""
        far = np.abs(self.noise - self.pull) > ASKED * np.sqrt(self.information)
        return np.flatnonzero(far | (self.pull**2 > GROSS * self.pull.sum() * self.information)).astype(np.int64)

    @property
    def ends(self) -> Array:
        """Gains (2, N) by the least noise that each robot may have, and by the most."""
        return self.gains(np.array([self.noise / UNLIKE, np.minimum(self.noise * UNLIKE, self.pull.sum())]))


def own_gain(groups: tuple[Group, ...], fit: PayloadFit, fitted: Fitted, D: Array) -> OwnGain | None:
    """Return the gain that one robot's wrench has beyond doubt, None where none has.

    D  (6, 6 N) sums the pushes at B
    """
    given = _seen(fit, D)
    try:
        tried = [_Without.of(groups, given, fitted, D, int(robot)) for robot in given.asked]
    except CannotAnswer:
        return None
    sure = sorted((one for one in tried if one.sure), key=lambda one: one.left)
    if not sure:
        return None
    best, *others = (one for one in sure if one.left < sure[0].left + ALIKE)
    moved = np.array([one.fit.parameters - fit.parameters for one in (best, *others)])
    suspects = tuple(one.robot for one in (best, *others))
    return OwnGain(suspects, best.times, best.std, moved.T @ moved, best.groups, best.fit)


@dataclass(frozen=True, eq=False)
class _Without:
    """One robot's wrench taken so many `times`, with a standard deviation.

    ends   (2,) the same by the least noise that it may have, and by the most     begun  (2,) the first step likewise
    noisy  share of noise in what tells it     share   its own of the noise of all forces, as given
    """

    robot: int
    times: float
    std: float
    ends: Array
    begun: Array
    noisy: float
    share: float
    groups: tuple[Group, ...]
    fit: PayloadFit

    @classmethod
    def of(cls, groups: tuple[Group, ...], seen: _Seen, fitted: Fitted, D: Array, robot: int) -> _Without:
        """Return it as it fits the others, from what is `seen` of all as given; D and errors as of `own_gain`."""
        begun = seen.ends[:, robot]
        # Of what is far off, the part that noise explains is not known before the fit without it.
        times, share, step = 1.0, float(seen.loud[robot]), float(seen.gains(np.zeros_like(seen.pull))[robot])
        for _ in range(ROUNDS):
            times *= 1 + step
            read = reread(groups, robot, times * np.eye(6))
            fit = fitted(read)
            seen = _seen(fit, D)
            step, std = float(seen.gains(seen.noise)[robot]), float(seen.std[robot])
            if abs(step) < SETTLED * std:
                break
        noisy = float(seen.noise[robot] / seen.information[robot])
        ends = times * (1 + seen.ends[:, robot])
        return cls(robot, times, abs(times) * std, ends, begun, noisy, share, read, fit)

    @property
    def sure(self) -> bool:
        """Whether the gain is beyond doubt, whichever noise robots have."""
        least = max(COUNTS * self.std, LEAST)
        if self.noisy > NOISY or self.share > LOUDEST:
            return False
        # Who is merely loud would fit better if taken for less, and is then no longer loud: no noise turns a sign.
        sides = (
            (self.ends > 1 + least) & (self.begun > 0),
            (self.ends < 1 - least) & ((self.begun < 0) | (self.times < 0)),
        )
        return any(bool(side.all()) for side in sides)

    @property
    def left(self) -> float:
        """What is left of the wrenches, as twice a logarithm of how unlikely it is.

        Noise of a robot that is taken for larger is larger, too.
        """
        rows = [np.sum([part.rows for part in group.parts], axis=0) for group in self.fit.groups]
        noise = -sum(float(n @ np.linalg.slogdet(W)[1]) for n, W in zip(rows, self.fit.weights, strict=True))
        return noise - 6 * float(sum(n.sum() for n in rows)) * float(np.log1p(self.share * (self.times**2 - 1)))


def _seen(fit: PayloadFit, D: Array) -> _Seen:
    robots = D.shape[1] // 6
    H, own, T = np.zeros((10 + robots, 10 + robots)), np.zeros(robots), regressors(NO_LEVERS)
    old, bias, each = np.r_[:10, 16 : 16 + robots], np.s_[10:16], _noise(fit.groups[-1], robots)
    for whole, weights in zip(fit.groups, fit.weights, strict=True):
        group, W = loud(whole, weights)
        WD = W @ D
        both, across = D.T @ WD, T.transpose(0, 2, 1) @ WD[:, None]
        noise = each * np.einsum("kii->ki", both)
        # Noise of other bands is as much larger as that of the sum is.
        level = group.wrench_noise[:, 3:].mean(1)
        for one, part in zip(group.normals(D, W), group.parts, strict=True):
            pushes = part.scatter[:, 12:-1, 12:-1]
            all_of = np.zeros((16 + robots, 16 + robots))
            all_of[:16, :16] = one.H
            seen = (across * part.scatter[:, None, SEEN, 12:-1]).sum((0, 2)).reshape(16, robots, 6).sum(2)
            all_of[:16, 16:], all_of[16:, :16] = seen, seen.T
            all_of[16:, 16:] = (both * pushes).sum(0).reshape(robots, 6, robots, 6).sum((1, 3))
            H += _beside(all_of, bias, old)
            own += ((level * part.rows) @ noise).reshape(robots, 6).sum(1)
    information = _beside(H, np.s_[:10], np.arange(10, 10 + robots))
    noise = information.sum() * own / max(float(own.sum()), 1e-300)
    forces = each.reshape(robots, 6)[:, 3]
    return _Seen(np.diag(information), noise, information.sum(1), forces / max(float(forces.sum()), 1e-300))


def _beside(H: Array, out: slice, kept: Array) -> Array:
    """Return the information about `kept` beside what is left `out`."""
    axes, values = shown_axes(H[out, out], RANK)
    blind = H[kept, out] @ (axes / np.sqrt(values))
    return np.asarray(H[np.ix_(kept, kept)] - blind @ blind.T)


def _noise(group: Group, robots: int) -> Array:
    """Return the noise (6 N,) of every axis of the pushes but for a factor, alike of a robot's force and of its moment.

    It is what the motion leaves in the upper half of the bands, where robots hardly push against one another.
    """
    upper = len(group.wrench_noise) // 2
    S = np.sum([part.scatter[upper:] for part in group.parts], axis=0)
    seen = S[:, SEEN, 12:-1]
    inner = np.linalg.pinv(S[:, SEEN[:, None], SEEN], rcond=RANK, hermitian=True)
    left = np.einsum("kii->ki", S[:, 12:-1, 12:-1]) - np.einsum("kpi,kpq,kqi->ki", seen, inner, seen)
    power = (left / group.wrench_noise[upper:, 3:].mean(1)[:, None]).sum(0)
    return np.repeat(np.maximum(power, 0.0).reshape(2 * robots, 3).mean(1), 3)
