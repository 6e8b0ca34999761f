"""Seventeen parameters of two bodies with a hinge from all recordings at once, bias and gain as in `payload.fit`.

The noise of a band is that of the force axes, all alike, and what the motion's noise makes; bias of either body's
robots and gain are integrated out, averaged over their sizes by evidence.
What can be told of each body, and what a body with these moments can weigh, follows from the seventeen.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, quoted
from steelyard.inertia import InertialParameters
from steelyard.spatial import Pose
from steelyard.team.adjoint import exp
from steelyard.team.estimate import BodyEstimate, TeamEstimate
from steelyard.team.hinge.rows import BIAS, COUNT, EXCHANGED, SECOND, SEVEN, WHOLE, Bands, Sums, noisy
from steelyard.team.payload.bias_models import Recordings, ladder_of
from steelyard.team.payload.fit import Round, settled
from steelyard.team.payload.gain_sight import of_force
from steelyard.team.payload.model import LEAST_MASS, SHOWN, Normal, least_noise, units_of_body
from steelyard.team.split import hinge_words

# Noise has settled where it changes by less than this share.
SETTLED = 0.01


@dataclass(frozen=True, eq=False)
class Kind:
    """Recordings at rest, or in motion, with common bands.

    motion_noise  (K, 7, 7) of H's accelerations and the hinge's     wrench_noise  (K,) variance of a force axis [N^2]
    """

    parts: tuple[Bands, ...]
    motion_noise: Array
    wrench_noise: Array


@dataclass(frozen=True, eq=False)
class HingedPayload:
    """Parameters (17,) in H with covariance (17, 17), and how they came about.

    lost      directions (17, L) in units of `scale` that the rows do not show
    gainless  share of the evidence that gains do not err
    kept      (17, 17) inverse information in the directions that they do
    """

    parameters: Array
    covariance: Array
    lost: Array
    scale: Array
    kept: Array
    condition: float
    gain: float
    gainless: float
    chi2: float
    kinds: tuple[Kind, ...]
    weights: tuple[Array, ...]
    blind: tuple[tuple[Array, ...], ...]
    sums: Sums

    def moved(self, column: Callable[[Bands, int], Array]) -> Array:
        """Return how the parameters (17, J) move when the rows' wrench does by column(recording, band) (n, 7, J)."""
        right = 0.0
        for kind, weights, blinds in zip(self.kinds, self.weights, self.blind, strict=True):
            for part, blind in zip(kind.parts, blinds, strict=True):
                for band, (z, W) in enumerate(zip(part.z, weights, strict=True)):
                    seen = W @ (z[..., :COUNT] - z[..., COUNT:-1] @ blind.T)
                    made = column(part, band)
                    right = right + seen.reshape(-1, COUNT).T @ made.reshape(-1, made.shape[-1])
        return np.asarray(self.kept @ right)

    @property
    def residual(self) -> Array:
        """Rms (2,) of what is left per row of the summed moment and force, as far as force noise makes it."""
        noise = np.concatenate([kind.wrench_noise for kind in self.kinds])
        rows = np.concatenate(
            [sum(p.rows for p in kind.parts) * np.ones_like(kind.wrench_noise) for kind in self.kinds]
        )
        force = float(noise @ rows / rows.sum())
        unit = self.sums.seven[:6] ** 2 @ _forces(self.sums)
        return np.asarray(np.sqrt(force * unit.reshape(2, 3).mean(1)))


def _forces(sums: Sums) -> Array:
    """Return which of the pushes (6 N,) are forces."""
    return of_force(sums.seven.shape[1]).astype(np.float64)


def fit_hinged_payload(
    kinds: tuple[Kind, ...], sums: Sums, axes: Array, size: float, with_gain: bool = True
) -> HingedPayload:
    """Return the fit.

    axes  (6 N,) noise of every push in units of a force axis': 1, `size` for moments of six-axis wrists, else 0
    size  of the team [m]
    """
    # Biases are those of every recording alone here: one that lasts for the session is asked of rigid payloads only.
    ladder = ladder_of(1, with_gain)
    unit = sums.seven * axes
    V = unit @ unit.T
    V[range(7), range(7)] += 1e-6 * np.diag(V)
    both = np.concatenate([sums.first, sums.second]) * axes
    C = both @ both.T
    C[range(BIAS), range(BIAS)] += 1e-6 * np.where(of_force(BIAS), 1.0, size**2)
    equations = _Equations(sums, V)
    phi, kinds = _start(kinds, equations, C, ladder, size)
    scale = _units(max(abs(float(phi[0])), LEAST_MASS), size)
    found = settled(kinds, phi, equations, C, ladder, scale, SETTLED)
    phi, models, kinds = found.phi, found.models, found.groups
    shown = models.shown(scale)
    rows = 7 * sum(float(p.rows.sum()) for k in kinds for p in k.parts)
    return HingedPayload(
        phi, models.covariance_about(phi), shown.lost, scale, np.outer(scale, scale) * shown.inverse, shown.condition,
        models.gain, models.gainless, float(models.chi2[models.best]) / max(rows - COUNT, 1.0), kinds, found.weights,
        found.blind, sums,
    )  # fmt: skip


def _units(mass: float, size: float) -> Array:
    # Of the second body's seven, two are first moments.
    return np.concatenate([units_of_body(mass, size), np.repeat([mass * size, mass * size**2], [2, 5])])


def _start(
    kinds: tuple[Kind, ...], equations: _Equations, C: Array, ladder: Array, size: float
) -> tuple[Array, tuple[Kind, ...]]:
    """Return phi as if the motion had no noise, and the noise of force axes that is then left."""
    loud = tuple(Kind(k.parts, np.zeros_like(k.motion_noise), np.ones(len(k.wrench_noise))) for k in kinds)
    first = Round.of(loud, np.zeros(COUNT), equations, C, ladder, _units(1.0, size))
    left = zip(kinds, first.renewed, strict=True)
    return first.phi, tuple(replace(kind, wrench_noise=new.wrench_noise) for kind, new in left)


@dataclass(frozen=True, eq=False)
class _Equations:
    """Those of two bodies with a hinge; V (7, 7) is what a unit of noise on every force axis makes of a row."""

    sums: Sums
    V: Array

    def weights(self, kind: Kind, phi: Array) -> Array:
        M = np.einsum("ijp,p->ij", noisy(), phi)
        noise = kind.wrench_noise[:, None, None] * self.V + M @ kind.motion_noise @ M.T
        return np.asarray(np.linalg.inv(noise))

    def normals(self, kind: Kind, W: Array) -> list[Normal]:
        return [_normal(part, kind, W, self.sums) for part in kind.parts]

    def judged(self, kind: Kind, W: Array, beside: Recordings, start: int) -> Kind:
        """Return the kind with the noise of force axes renewed: one step of expectation maximisation per band."""
        seen, size = np.zeros(len(kind.wrench_noise)), np.zeros(len(kind.wrench_noise))
        phi = beside.phi
        for k, part in enumerate(kind.parts):
            solution, doubt = beside.solution(start + k), beside.doubt(start + k)
            values, vectors = np.linalg.eigh(doubt)
            factor = vectors * np.sqrt(np.maximum(values, 0.0))
            for band, z in enumerate(part.z):
                # At rest the means are mostly bias.
                z = z[1:] if part.still and band == 0 else z
                left = np.concatenate([(z[..., -1] - z[..., :-1] @ solution)[..., None], z[..., :-1] @ factor], axis=-1)
                pulled = W[band] @ left
                seen[band] += float(np.einsum("nip,ij,njp->", pulled, self.V, pulled, optimize=True))
                size[band] += len(z) * float(np.trace(W[band] @ self.V))
        share = np.where(size > 0, seen / np.maximum(size, 1e-300), 1.0)
        return replace(kind, wrench_noise=np.maximum(kind.wrench_noise * share, least_noise(phi)))


def _normal(part: Bands, kind: Kind, W: Array, sums: Sums) -> Normal:
    """Return the normal equations of one recording in [parameters (17), bias (12)]."""
    wide = COUNT + BIAS
    S, noise, N = np.zeros((wide + 1, wide + 1)), np.zeros((COUNT, COUNT)), noisy()
    for z, weight, motion, rows in zip(part.z, W, kind.motion_noise, part.rows, strict=True):
        flat = (np.linalg.cholesky(weight).T @ z).reshape(-1, wide + 1)
        S += flat.T @ flat
        noise += rows * np.einsum("ijp,ik,jl,klq->pq", N, weight, motion, N, optimize=True)
    each = np.concatenate([sums.first, sums.second]) * (_forces(sums) * part.mean)
    return Normal(S[:wide, :wide], S[:wide, -1], noise, float(S[-1, -1]), each)


# Of ten parameters, the seven that the hinge shows, and mass, first and second moment along it, which it does not.
FROM_TEN, FROM_ALONG = np.split(np.linalg.inv(np.column_stack([SEVEN, EXCHANGED])), [SECOND])
# Difference quotients of the least mass are taken over this share of its standard deviations.
SLIGHT = 1e-3


def least_mass(seven: Array) -> float:
    """Return the least mass [kg] of a body with these moments (7,) across the hinge, zero where no body has them.

    Mass at a distance makes a second moment: [[Sigma, h], [h^T, m]] must be no less than zero, so m >= h^T Sigma^-1 h.
    """
    spread = np.array([[seven[2], -seven[4]], [-seven[4], seven[3]]])
    if np.linalg.eigvalsh(spread)[0] <= 0:
        return 0.0
    return float(seven[:2] @ np.linalg.solve(spread, seven[:2]))


def second_body(parameters: Array) -> Array:
    """Return ten parameters (10,) of the second body that go with the seventeen (17,), all in the hinge's frame H.

    Its mass is in the middle of its range.

    How far it reaches along the hinge, which nothing shows, is taken from how far the whole does.
    """
    least = [least_mass(map_ @ parameters) for map_ in seven_rows()]
    mass = 0.5 * (least[1] + max(float(parameters[0]) - least[0], least[1]))
    share = mass / max(float(parameters[0]), 1e-300)
    along = FROM_ALONG @ parameters[:WHOLE]
    return np.asarray(SEVEN @ parameters[WHOLE:] + EXCHANGED @ (share * along))


def seen_from(ten: Array) -> Array:
    """Return how the ten parameters of a body move (10, 6) with a small motion of the frame that they are seen from."""
    steps = SLIGHT**2 * np.eye(6)
    sides = [InertialParameters(ten).in_frame(exp(sign * steps)).vector for sign in (-1, 1)]
    return np.asarray((sides[0] - sides[1]).T / (2 * SLIGHT**2))


def seven_rows() -> tuple[Array, Array]:
    """Return what makes the seven of the first and of the second body of the seventeen, (7, 17) each."""
    second = np.zeros((SECOND, COUNT))
    second[:, WHOLE:] = np.eye(SECOND)
    first = -second
    first[:, :WHOLE] = FROM_TEN
    return first, second


def both_bodies(
    parameters: Array,
    spreads: Sequence[tuple[Array, Array]],
    variance: float,
    scale: Array,
    frame: Pose,
    robots: tuple[tuple[str, ...], ...],
) -> tuple[BodyEstimate, BodyEstimate]:
    """Return the first and the second body from the seventeen parameters in H.

    spreads   covariance (7, 7) of what is told of each, and of its first moment in R's axes (3, 3)
    variance  of the mass of both [kg^2]
    scale    (17,) units of mass and size     frame X_RH     robots who holds each
    """
    maps = seven_rows()
    least = [_least(map_ @ parameters, spread) for map_, (spread, _) in zip(maps, spreads, strict=True)]
    mass, mass_std = float(parameters[0]), float(np.sqrt(max(variance, 0.0)))
    across = frame.rotation.matrix[:, :2]
    made = []
    for k, (map_, names) in enumerate(zip(maps, robots, strict=True)):
        values, (spread, vector) = map_ @ parameters, spreads[k]
        moment, std = float(values[2] + values[3]), float(np.sqrt(max(spread[2:4, 2:4].sum(), 0.0)))
        first, first_std = across @ values[:2], np.sqrt(np.maximum(np.diag(vector), 0))
        along = first / max(float(np.linalg.norm(first)), 1e-300)
        lever_std = float(np.sqrt(max(float(along @ vector @ along), 0.0)))
        turned = 2 * std < SHOWN * scale[WHOLE + 2]
        levered = 2 * float(np.sqrt(max(float(np.linalg.eigvalsh(vector)[-1]), 0.0))) < SHOWN * scale[WHOLE]
        (low, low_std), (other, other_std) = least[k], least[1 - k]
        most = mass - other + 2 * float(np.hypot(mass_std, other_std))
        weighs = np.array([np.maximum(low - 2 * low_std, 0.0), most])
        made.append(
            BodyEstimate(
                names, moment if turned else np.nan, std if turned else np.nan, np.where(levered, first, np.nan),
                np.where(levered, first_std, np.nan), lever_std if levered else np.nan,
                np.where(turned and levered, weighs, np.nan),
            )
        )  # fmt: skip
    return made[0], made[1]


def hinge_findings(team: TeamEstimate) -> list[Finding]:
    """Return payload-jointed: who holds which body, the hinge, what is known of each, and what to move for the rest."""
    if team.hinge is None:
        return []
    hinge = team.hinge
    holders = [quoted(body.robots) for body in hinge.bodies]
    said = hinge_words(holders, hinge.axis, hinge.point, hinge.swing, team.reference)
    said += " What is given is for both together with the hinge at the mean of its angles. "
    if np.isnan([body.mass_range[0] for body in hinge.bodies]).any():
        said += "Too little is shown of each body: open and close the hinge faster while tilting the payload."
    else:
        ranges = (f"{body.mass_range[0]:.3g} to {body.mass_range[1]:.3g} kg" for body in hinge.bodies)
        said += (
            f"No motion tells how their mass is shared: {' and '.join(ranges)} are possible. Weigh one body by itself."
        )
    return [Finding.of("payload-jointed", said)]


def _least(seven: Array, covariance: Array) -> tuple[float, float]:
    """Return the least mass and its standard deviation."""
    value, slope = least_mass(seven), np.zeros(SECOND)
    step = SLIGHT * np.sqrt(np.maximum(np.diag(covariance), 0))
    for k in np.flatnonzero(step > 0):
        moved = np.array([least_mass(seven + sign * step[k] * np.eye(SECOND)[k]) for sign in (1, -1)])
        slope[k] = (moved[0] - moved[1]) / (2 * step[k])
    return value, float(np.sqrt(max(float(slope @ covariance @ slope), 0.0)))
