"""The answers at every size of bias and gain on a ladder, biases integrated out, and how likely each size is.

The bias of a recording is b_r = c + d_r: c ~ N(0, V) is common to all recordings, d_r ~ N(0, S_r) is drawn anew. Gains
that last for a session pull by their share of the mean force: its mean over the recordings belongs to c, what is left
to d_r. Given c, recordings are apart, and c costs one more elimination.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from steelyard.check import Array, Integers
from steelyard.team.definite import definite, inverses, logarithms
from steelyard.team.payload.gain_sight import GainSight
from steelyard.team.payload.model import RANK, SHOWN, Normal, Shown

# [N] bias of a force axis: from none to as much as a light payload weighs. Error of its gain: from none to 10 %.
BIAS = np.geomspace(1e-3, 10.0, 13)
# [N] the part that all recordings share. With one recording it cannot be told from that recording's own.
COMMON = np.array([1e-6, *np.geomspace(1e-2, 10.0, 7)])
# With several recordings every other size of their own is enough.
OWN = BIAS[::2]
# That gains have no error at all is beforehand as likely as so many other sizes together.
NO_GAIN_ERROR = 3.0
# A common bias and gains that last look like mass where the payload hardly tilts: beforehand none of either is so many
# times as likely as any one size.
NO_COMMON, NO_LASTING = 1000.0, 1000.0
GAIN = np.array([0.0, 3e-4, 1e-3, 3e-3, 0.01, 0.03, 0.1])
# Sizes with less than this share of the likeliest's have none: what they would add to a variance is rounding.
NOTHING = 1e-15


def ladder_of(recordings: int, with_gain: bool) -> Array:
    """Return the sizes (L, 4) that are tried: common bias, bias, gain drawn anew, gain that lasts; one gain at most."""
    anew = [(gain, 0.0) for gain in (GAIN if with_gain else GAIN[:1])]
    if recordings < 2:
        return np.array([(0.0, bias, *gain) for bias in BIAS for gain in anew])
    lasting = [(0.0, gain) for gain in GAIN[1:]] if with_gain else []
    return np.array([(common, bias, *gain) for common in COMMON for bias in OWN for gain in (*anew, *lasting)])


def ladder_chances(evidence: Array, ladder: Array) -> Array:
    """Return the logarithm (L,) of evidence times what every size of the ladder (L, 4) is worth beforehand; none in the
    gain is the likeliest.
    """
    chance = evidence + np.where(ladder[:, 2:].any(1), 0.0, np.log(NO_GAIN_ERROR))
    chance -= np.where(ladder[:, 0] > COMMON[0], np.log(NO_COMMON), 0.0)
    # In one recording a gain that is drawn anew is one that lasts.
    lasting = ladder[:, 3] if ladder[:, 0].any() else ladder[:, 2]
    return np.asarray(chance - np.where(lasting > 0, np.log(NO_LASTING), 0.0))


def shares(chance: Array) -> Array:
    """Return the share (L,) of every size by the logarithms (L,) of its chance; what would change nothing has none."""
    weight = np.exp(chance - chance.max())
    weight[weight < NOTHING] = 0.0
    return np.asarray(weight / weight.sum())


@dataclass(frozen=True, eq=False)
class Recordings:
    """Parameters phi (P,) with covariance (P, P) at one size, and the bias (R, B) of every recording beside them.

    inner  (R, B, B) covariance of a bias beside a known body     mean (R, B) bias beside a body that weighs nothing
    blind  (R, P, B) how phi's information takes up a bias: H_pb H_bb^-1
    """

    phi: Array
    covariance: Array
    inner: Array
    mean: Array
    blind: Array

    def solution(self, recording: int) -> Array:
        """Return [phi, bias] (P + B,) of one recording."""
        return np.concatenate([self.phi, self.mean[recording] - self.blind[recording].T @ self.phi])

    @property
    def biases(self) -> Array:
        """The bias of every recording (R, B) beside phi."""
        return np.asarray(self.mean - np.einsum("rpb,p->rb", self.blind, self.phi))

    def doubt(self, recording: int) -> Array:
        """Return their covariance (P + B, P + B)."""
        blind = self.blind[recording]
        cross = -blind.T @ self.covariance
        return np.block([[self.covariance, cross.T], [cross, self.inner[recording] - cross @ blind]])


@dataclass(frozen=True, eq=False)
class Models:
    """The answers at L sizes (`ladder_of`): P parameters, B of a bias, R recordings.

    ladder (L, 4)
    phi (L, P)     covariance, information (L, P, P)     chi2 (L,)
    share   (L,) of every size by evidence; phi and covariance are zero where it is
    evidence  logarithm of that of all sizes together, by what each is worth beforehand
    H, g    of the recordings (R, P + B, P + B), (R, P + B)
    narrow  (L', R, B, B) inverse spread of the biases drawn anew, one per kind, `kind` (L,) says which
    common  (L, B, B) V of the common bias, where there is more than one recording
    noise   (P, P) what noise in the motion adds to the information
    gains   (R,) what changes of the forces say of the gains of every recording, where that was asked
    """

    ladder: Array
    phi: Array
    covariance: Array
    information: Array
    share: Array
    evidence: float
    chi2: Array
    H: Array
    g: Array
    narrow: Array
    kind: Integers
    common: Array
    noise: Array
    gains: tuple[GainSight, ...]

    @classmethod
    def of(cls, normals: Sequence[Normal], C: Array, ladder: Array, scale: Array) -> Models:
        """Return the models at every size of the ladder (L, 4); C (B, B) of a unit bias, scale (P,) units."""
        size = len(scale)
        H, g = np.stack([n.H for n in normals]), np.stack([n.g for n in normals])
        pulls = np.stack([n.pulls for n in normals])
        mean = pulls.mean(0)
        anew, rest = (p @ p.swapaxes(1, 2) for p in (pulls, pulls - mean))
        (kinds, kind), (shared, which) = _distinct(ladder.tobytes())
        bias, gain, lasting = np.square(kinds.T)[..., None, None, None]
        narrow, wide = inverses(bias * C + gain * anew + lasting * rest)
        inner, held = inverses(H[:, size:, size:] + narrow)
        blind = H[:, :size, size:] @ inner
        plain = (H[:, :size, :size].sum(0) - (blind @ H[:, size:, :size]).sum(1))[kind]
        right = (g[:, :size].sum(0) - (blind @ g[:, size:, None])[..., 0].sum(1))[kind]
        taken = np.einsum("ri,lrij,rj->l", g[:, size:], inner, g[:, size:])[kind]
        told = (wide + held).sum(1)[kind]
        common = np.square(shared[:, 0])[:, None, None] * C + np.square(shared[:, 1])[:, None, None] * (mean @ mean.T)
        if len(normals) > 1 and ladder[:, 0].any():
            known, cross, pull = _common(H, g, inner @ narrow)
            root = np.linalg.cholesky(common)[which]
            held, more = inverses(np.eye(len(C)) + root.swapaxes(1, 2) @ known[kind] @ root)
            held = root @ held @ root.swapaxes(1, 2)
            cross, pull = cross[kind], pull[kind][..., None]
            plain = plain - cross @ held @ cross.swapaxes(1, 2)
            right = right - (cross @ held @ pull)[..., 0]
            taken = taken + (pull * (held @ pull)).sum((1, 2))
            told = told + more
        unit = np.outer(scale, scale)
        full = plain * unit
        ridge = 1e-12 * np.trace(full, axis1=1, axis2=2)[:, None, None] * np.eye(size)
        seen = (inverses(full + ridge)[0] @ (scale * right)[..., None])[..., 0]
        chi2 = sum(n.constant for n in normals) - taken - np.einsum("lp,lp->l", seen, scale * right)
        gains = tuple(n.gains for n in normals if n.gains is not None)
        seen_gains = _gain_evidence(gains, ladder)
        chance = ladder_chances(-0.5 * (chi2 + logarithms(np.eye(size) + full) + told) + seen_gains, ladder)
        share, evidence = shares(chance), float(np.logaddexp.reduce(chance))
        told_of = np.flatnonzero(share)
        noise = sum((n.noise for n in normals), np.zeros((size, size)))
        phi, covariance = np.zeros((len(ladder), size)), np.zeros((len(ladder), size, size))
        phi[told_of], covariance[told_of] = _answers(full[told_of], noise * unit, (scale * right)[told_of])
        return cls(
            ladder, scale * phi, unit * covariance, plain, share, evidence, np.asarray(chi2), H, g, narrow, kind,
            common[which], noise, gains,
        )  # fmt: skip

    @property
    def best(self) -> int:
        """The likeliest size."""
        return int(np.argmax(self.share))

    @property
    def gain(self) -> float:
        """Rms share by which gains err, drawn anew or lasting: mean over sizes by their evidence."""
        return float(np.sqrt(self.share @ np.square(self.ladder[:, 2:]).sum(1)))

    @property
    def gain_squares(self) -> tuple[Array, Array]:
        """Mean products of the gains' errors given what is seen: drawn anew (R, F, F), and lasting (F, F)."""
        axes = len(self.gains[0].right)
        anew, lasting = np.zeros((len(self.gains), axes, axes)), np.zeros((axes, axes))
        every = _all_of(self.gains)
        for size in GAIN[1:]:
            own, lasts = (float(self.share[self.ladder[:, column] == size].sum()) for column in (2, 3))
            if own:
                anew += own * np.array([one.squares(size) for one in self.gains])
            if lasts:
                lasting += lasts * every.squares(size)
        return anew, lasting

    @property
    def gainless(self) -> float:
        """Share of the evidence that gains do not err at all."""
        return float(self.share[~self.ladder[:, 2:].any(1)].sum())

    def shown(self, scale: Array) -> Shown:
        """Return which directions, in units of `scale` (P,), the rows show at the likeliest size."""
        unit = np.outer(scale, scale)
        return Shown.of(self.information[self.best] * unit, self.noise * unit)

    def mean(self) -> Array:
        """Return the parameters (P,), averaged over sizes by their evidence."""
        return np.asarray(self.share @ self.phi)

    def covariance_about(self, phi: Array) -> Array:
        """Return the covariance (P, P) of parameters told as `phi` (P,): that of every size, and how they differ."""
        off = self.phi - phi
        apart = np.einsum("l,lp,lq->pq", self.share, off, off)
        return np.asarray(np.tensordot(self.share, self.covariance, 1) + apart)

    def recordings(self, model: int) -> Recordings:
        """Return the biases of all recordings in one model."""
        size = self.phi.shape[1]
        H_pb, H_bb, g_b = self.H[:, :size, size:], self.H[:, size:, size:], self.g[:, size:]
        narrow = self.narrow[self.kind[model]]
        inner = inverses(H_bb + narrow)[0]
        mean, blind = (inner @ g_b[..., None])[..., 0], H_pb @ inner
        if self.common[model].any():
            share = inner @ narrow
            known = (H_bb @ share).sum(0)
            common = np.linalg.inv(np.linalg.inv(self.common[model]) + 0.5 * (known + known.T))
            inner = inner + share @ common @ share.swapaxes(1, 2)
            mean = mean + share @ (common @ np.einsum("rij,ri->j", share, g_b))
            blind = blind + (H_pb @ share).sum(0) @ common @ share.swapaxes(1, 2)
        return Recordings(self.phi[model], self.covariance[model], inner, mean, blind)


@lru_cache(maxsize=8)
def _distinct(ladder: bytes) -> tuple[tuple[Array, Integers], tuple[Array, Integers]]:
    """Return the kinds of own biases (L', 3) and of common ones (L'', 2) on a ladder, and which each size has (L,)."""
    rows = np.frombuffer(ladder).reshape(-1, 4)
    own, common = (np.unique(rows[:, chosen], axis=0, return_inverse=True) for chosen in ([1, 2, 3], [0, 3]))
    return (own[0], own[1]), (common[0], common[1])


def _gain_evidence(gains: Sequence[GainSight], ladder: Array) -> Array:
    """Return how likely (L,), as a logarithm, the changes of forces are at every size against gains without error."""
    if not gains or not ladder[:, 2:].any():
        return np.zeros(len(ladder))
    own, lasts = (np.unique(ladder[:, column], return_inverse=True) for column in (2, 3))
    anew = np.sum([one.evidence(own[0]) for one in gains], axis=0)
    return np.asarray(anew[own[1]] + _all_of(gains).evidence(lasts[0])[lasts[1]])


def _all_of(gains: Sequence[GainSight]) -> GainSight:
    """Return what all recordings together say of gains that last."""
    if len(gains) == 1:
        return gains[0]
    return GainSight(np.sum([one.information for one in gains], axis=0), np.sum([one.right for one in gains], axis=0))


def _common(H: Array, g: Array, share: Array) -> tuple[Array, Array, Array]:
    """Return a common bias's information (L, B, B), that with the parameters (L, P, B), and its right side (L, B).

    share  (L, R, B, B) of a common bias that a recording's own leaves to be seen
    """
    size = H.shape[1] - share.shape[-1]
    known = (H[:, size:, size:] @ share).sum(1)
    cross = (H[:, :size, size:] @ share).sum(1)
    return 0.5 * (known + known.swapaxes(1, 2)), cross, np.einsum("lrij,ri->lj", share, g[:, size:])


def _answers(full: Array, noise: Array, right: Array) -> tuple[Array, Array]:
    """Return phi (L, P) and covariance (L, P, P) in units of `scale`.

    What noise in the motion adds to the information is taken out. A lost direction stays at zero, as unsure as a body
    of this mass and size can be.
    """
    known, all_of = full - noise, np.eye(len(noise))
    least = np.maximum(SHOWN**-2.0, RANK * np.trace(known, axis1=1, axis2=2))[:, None, None]
    if definite(known - noise).all() and definite(known - least * all_of).all():
        # Every direction is shown, whichever they are.
        inverse = inverses(known)[0]
        return (inverse @ right[..., None])[..., 0], inverse @ full @ inverse
    shown = Shown.of(full, noise)
    inverse, lost = shown.inverse, shown.vectors * ~shown.told[:, None]
    covariance = inverse @ full @ inverse + lost @ lost.swapaxes(1, 2)
    return (inverse @ right[..., None])[..., 0], covariance
