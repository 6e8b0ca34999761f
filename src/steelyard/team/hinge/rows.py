"""The equations of motion of two bodies with a hinge, row by row, and which of their parameters they can show.

H is fixed to the first body, its origin on the hinge and its z axis along it; H' is the same of the second body, so
that H' is H turned by the hinge's angle q. About H:
    what all robots push = L(x1) phi1 + Rz(q) L(x2) phi2                        moment and force, six equations
    what robots of the second body push, about z = the same of L(x2) phi2       a hinge without friction bears no moment
Mass on the line of the hinge turns with both bodies alike: its mass, first and second moment along the line can be
moved from one body to the other and no wrench changes. Three of the twenty parameters are so beyond any motion, and the
seventeen others are: ten of the whole with the hinge at zero, seven of the second body.
Whether forces have the sign that they should is told as in `misread.forces`: what robots push against one another
through the hinge cancels in the sum of forces too. Beside the first body's motion, that of the second, turned by the
hinge's angle, is taken out of every force, and so is a bias that turns.
Source: Atkeson, An, Hollerbach 1986 for L; Ayusawa, Venture, Nakamura 2014 for what floating trees of bodies show.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.inertia.regressor import basis
from steelyard.spatial import Pose, Rotation
from steelyard.team.hinge.poses import Hinged
from steelyard.team.misread.signs import sign_finding
from steelyard.team.payload.body_rows import BodyRows, Run, from_poses, summing
from steelyard.team.payload.spectra import as_frequencies, bands, frequencies
from steelyard.team.stacked import Stretch

WHOLE, SECOND, BIAS = 10, 7, 12
COUNT = WHOLE + SECOND
# Ten parameters of the second body (in H') per each of its seven: h_x, h_y, second moments of mass xx and yy (which
# turn up in I_yy and I_zz, I_xx and I_zz), I_xy, I_xz, I_yz.
SEVEN = np.zeros((10, SECOND))
for _column, _entries in enumerate(((1,), (2,), (7, 9), (4, 9), (5,), (6,), (8,))):
    SEVEN[list(_entries), _column] = 1.0
# What may be moved from one body to the other: mass, first and second moment along the hinge.
EXCHANGED = np.zeros((10, 3))
EXCHANGED[0, 0] = EXCHANGED[3, 1] = EXCHANGED[4, 2] = EXCHANGED[7, 2] = 1.0
# Columns before the robots' forces: motion of the first body, of the second, that turned, means and means turned.
MOTION = 12
INNER = 4 * MOTION + 3
# What the motion leaves of the sum of forces must have so many times the variance that it has with the other sign.
FALLS = 4.0


def hinge_frame(team: Hinged) -> Pose:
    """Return X_RH: on the hinge where it is nearest to the middle of the grasps, z along it."""
    across = np.linalg.svd(team.axis[None])[2][1:]
    axes = np.column_stack([across[0], np.cross(team.axis, across[0]), team.axis])
    middle = team.grasps.position.mean(0) - team.point
    return Pose(Rotation(axes), team.point + team.axis * float(team.axis @ middle))


@dataclass(frozen=True, eq=False)
class Sums:
    """How pushes (6 N) of moment and force in the grasps add up about H, for each body: (6, 6 N), zero elsewhere."""

    first: Array
    second: Array

    @classmethod
    def of(cls, team: Hinged) -> Sums:
        """Return the sums with the hinge at zero."""
        every = summing(hinge_frame(team).inverse() @ team.grasps)
        held = np.repeat(team.second, 6)
        return cls(every * ~held, every * held)

    @property
    def seven(self) -> Array:
        """Sums (7, 6 N) with the hinge at zero: all moments and forces, then the second body's moment about z."""
        return np.concatenate([self.first + self.second, self.second[2:3]])


def about_z(angle: Array) -> Array:
    """Return (T, 6, 6): moment and force turned about z."""
    turn = Rotation.exp(angle[:, None] * [0.0, 0.0, 1.0]).matrix
    out = np.zeros((len(angle), 6, 6))
    out[:, :3, :3] = out[:, 3:, 3:] = turn
    return out


def equations(first: Array, second: Array, angle: Array) -> Array:
    """Return the equations (T, 7, 17) from motions x1, x2 (T, 12) in H and H' and the angle (T,) of the hinge."""
    own = np.einsum("kix,tx->tik", basis(), second) @ SEVEN
    whole = np.einsum("kix,tx->tik", basis(), first)
    out = np.zeros((len(angle), 7, COUNT))
    out[:, :6, :WHOLE] = whole
    out[:, :6, WHOLE:] = about_z(angle) @ own - whole @ SEVEN
    out[:, 6, WHOLE:] = own[:, 2]
    return out


def noisy() -> Array:
    """Return how the equations (7, 7, 17) move with angular acceleration and acceleration of H, and that of the angle.

    With the hinge at zero.
    """
    E = np.moveaxis(basis()[..., :6], 2, 0)
    E = np.swapaxes(E, 1, 2)
    out = np.zeros((7, 7, COUNT))
    out[:6, :6, :WHOLE] = E
    out[:6, 6, WHOLE:] = E[:, 2] @ SEVEN
    out[6, :6, WHOLE:] = E[2] @ SEVEN
    out[6, 6, WHOLE:] = E[2, 2] @ SEVEN
    return out


@dataclass(frozen=True, eq=False)
class Bands:
    """One recording as frequencies, in bands: rows (n, 7, 17 + 12 + 1) of [equations, bias, wrench] per band.

    pushed  (n, 6 N) per band     second  x2 (n, 12) per band
    rows    (K,) how many rows each band has     samples  rows of the recording
    """

    still: bool
    z: tuple[Array, ...]
    pushed: tuple[Array, ...]
    second: tuple[Array, ...]
    rows: Array
    samples: int

    @property
    def mean(self) -> Array:
        """Mean (6 N,) of every push: bias and pushes turn up alike where there is nothing but means."""
        ones, pushed = self.z[0][:, 0, COUNT], self.pushed[0]
        return np.asarray(ones @ pushed / max(float(ones @ ones), 1e-300))


def bodies_of(part: Stretch, team: Hinged, gravity: Array, highest_hz: float) -> tuple[BodyRows, BodyRows]:
    """Return the rows of one recording for H and for H'; `team` with the motion of its rows."""
    frame = hinge_frame(team)
    known = np.asarray(part.seen[:, team.second].any(1) & part.seen[:, ~team.second].any(1))
    first = team.motion @ frame
    turned = Pose(Rotation.exp(team.angle[:, None] * [0.0, 0.0, 1.0]), np.zeros((len(part), 3)))
    one, two = (from_poses(part, path, known, gravity, highest_hz) for path in (first, first @ turned))
    return one, two


def gathered(one: BodyRows, two: BodyRows, team: Hinged, sums: Sums, edges: Array, highest_hz: float) -> Bands:
    """Return one recording in the bands that end at `edges` (K,) [Hz]."""
    parts: list[list[Array]] = [[] for _ in edges]
    for run, other in zip(one.runs, two.runs, strict=True):
        hz = frequencies(run, highest_hz)
        z = as_frequencies([_rows(run, other, team, sums)], run, highest_hz, not one.still)
        for band, chosen in enumerate(bands(hz, edges)):
            parts[band].append(z[chosen])
    joined = [np.concatenate(some) for some in parts]
    wide = 7 * (COUNT + BIAS + 1)
    samples = sum(len(run.motion) for run in one.runs)
    return Bands(
        one.still, tuple(z[:, :wide].reshape(len(z), 7, -1) for z in joined), tuple(z[:, wide:-12] for z in joined),
        tuple(z[:, -12:] for z in joined), np.array([float(len(z)) for z in joined]), samples,
    )  # fmt: skip


def _rows(run: Run, other: Run, team: Hinged, sums: Sums) -> Array:
    """Return rows (T, 7 * 30 + 6 N + 12): equations, bias and wrench, pushes, x2."""
    angle = team.angle[run.rows]
    turn = about_z(angle)
    both = np.zeros((len(angle), 7, COUNT + BIAS + 1))
    both[..., :COUNT] = equations(run.motion, other.motion, angle)
    both[:, :6, COUNT : COUNT + 6] = np.eye(6)
    both[:, :6, COUNT + 6 : -1] = turn
    both[:, 6, COUNT + 8] = 1.0
    own = run.pushed @ sums.second.T
    both[:, :6, -1] = run.pushed @ sums.first.T + np.einsum("tij,tj->ti", turn, own)
    both[:, 6, -1] = own[:, 2]
    return np.concatenate([both.reshape(len(angle), -1), run.pushed, other.motion], axis=1)


def robot_of_other_sign(
    made: Sequence[tuple[Hinged, BodyRows, BodyRows]], sums: Sums, names: Sequence[str], highest_hz: float
) -> tuple[int | None, tuple[Finding, ...]]:
    """Return the robot whose sign must be turned, None where all are right, and the finding that says so.

    What robots push against one another cancels in the sum over the team; of one with the other sign it adds up.
    made  of every recording, where everything is and the rows of either body
    """
    count = len(names)
    each, lifted = np.zeros((count, count)), np.zeros(count)
    for still in (True, False):
        some = [_scatter(team, one, two, sums, highest_hz) for team, one, two in made if one.still == still]
        if some:
            S = np.sum(some, axis=0)
            inner, pushes = S[:INNER, :INNER], S[INNER:, :INNER]
            left = S[INNER:, INNER:] - pushes @ np.linalg.pinv(inner, 1e-9, hermitian=True) @ pushes.T
            each += np.einsum("aiaj->ij", left.reshape(3, count, 3, count))
            lifted += np.einsum("aia->i", pushes[:, 3:6].reshape(3, count, 3))
    turned = each.sum() - 4 * (each.sum(1) - np.diag(each))
    asking = np.flatnonzero(turned < each.sum() / FALLS)
    if not len(asking):
        return None, ()
    # Of two robots each asks for it: it is the one that pulls down.
    wrong = int(asking[np.argmin(lifted[asking])])
    return wrong, (sign_finding(names[wrong]),)


def _scatter(team: Hinged, one: BodyRows, two: BodyRows, sums: Sums, highest_hz: float) -> Array:
    """Return the scatter of motion and forces of one recording, as far as frequencies are used."""
    count = len(team.second)
    out = np.zeros((INNER + 3 * count, INNER + 3 * count))
    # (N, 3, 6): the force that each robot's push adds, with the hinge at zero.
    forces = np.split((sums.first + sums.second)[3:], count, axis=1)
    for run, other in zip(one.runs, two.runs, strict=True):
        turn = about_z(team.angle[run.rows])[:, 3:, 3:]
        pushed = np.split(run.pushed, count, axis=1)
        force = np.stack([own @ F.T for own, F in zip(pushed, forces, strict=True)], axis=2)
        force[..., team.second] = turn @ force[..., team.second]
        cos, sin = turn[:, :1, 0], turn[:, 1:2, 0]
        seen = [run.motion, other.motion, cos * other.motion, sin * other.motion, np.ones_like(cos), cos, sin]
        z = as_frequencies([*seen, force.reshape(len(force), -1)], run, highest_hz, not one.still)
        out += z.T @ z
    return out
