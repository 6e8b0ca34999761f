"""Whether each robot's forces have the sign that they should beside the others'.

What robots push against one another cancels in the sum over the team. Where one of them says what it feels instead of
what it applies, it adds up. Whether all together hold the payload up is for the fit to say, which leaves biases out.
Torques of one robot that have another sign, or another size, than its forces show in moments: without, all balance.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from steelyard.check import Array, Integers, Mask
from steelyard.findings import Finding
from steelyard.inertia.regressor import basis
from steelyard.team.payload.model import Group, scatter, unexplained

# What the motion leaves of the sum of forces must have so many times the variance that it has with the other sign.
FALLS = 4.0
# What is left of the moments must fall by this factor.
TORQUES_FALL = 16.0


def with_one_sign(
    groups: Sequence[Group], D: Array, names: Sequence[str], doubtful: Mask
) -> tuple[Array, tuple[Finding, ...]]:
    """Return D (6, 6 N), the sum of pushes at B, with a robot's sign turned where its forces ask for it, and why.

    doubtful  (N,) whose signs may be wrong: those of others are left as they are
    """
    total = [part.scatter.sum(0) for group in groups for part in group.parts]
    forces = D[3:].reshape(3, -1, 6)
    lifted = np.sum([np.einsum("aix,ixa->i", forces, S[12:-1, 3:6].reshape(-1, 6, 3)) for S in total], axis=0)
    each = np.sum([_beside_one_another(S, forces) for S in total], axis=0)
    wrong, found = odd_one_out(each, lifted, names, doubtful)
    if wrong is not None:
        D = D.copy()
        D[:, 6 * wrong : 6 * wrong + 6] *= -1
    return D, found


def odd_one_out(
    each: Array, lifted: Array, names: Sequence[str], doubtful: Mask | None = None
) -> tuple[int | None, tuple[Finding, ...]]:
    """Return the robot whose sign must be turned, and why; None where all are right.

    each  (N, N) products of what the motion leaves of the robots' forces     lifted  (N,) how far each pushes up
    doubtful  (N,) who is asked; all, if None
    """
    turned = each.sum() - 4 * (each.sum(1) - np.diag(each))
    asks = turned < each.sum() / FALLS
    asking = np.flatnonzero(asks if doubtful is None else asks & doubtful)
    if not len(asking):
        return None, ()
    # Of two robots each asks for it: it is the one that pulls down.
    wrong = int(asking[np.argmin(lifted[asking])])
    return wrong, (sign_finding(names[wrong]),)


def sign_finding(name: str) -> Finding:
    """Return the finding of a robot whose forces had the other sign."""
    text = f"What '{name}' and the others push against one another cancels only with its sign turned; it was."
    return Finding.of("wrench-sign-flipped", text)


def torque_sign_finding(name: str, turned: bool) -> Finding:
    """Return the finding of a robot whose torques have another sign than its forces, which were `turned` or not."""
    which, other = ("force", "torques") if turned else ("torque", "forces")
    text = (
        f"The torques of '{name}' fit one body only with the sign opposite to that of its forces: the sign of its "
        f"{which}s was turned, that of its {other} was not."
    )
    return Finding("wrench-sign-flipped", text, f"Turn the signs of the {which} columns of '{name}', and of no others.")


def _beside_one_another(S: Array, forces: Array) -> Array:
    """Return products (N, N) of what any motion and bias leave of the robots' forces; `forces` (3, N, 6) of pushes."""
    inner = np.r_[:12, len(S) - 1]
    pushes = S[12:-1, inner]
    left = S[12:-1, 12:-1] - pushes @ np.linalg.pinv(S[np.ix_(inner, inner)], 1e-9, hermitian=True) @ pushes.T
    count = forces.shape[1]
    one = np.einsum("aix,ixq->aiq", forces, left.reshape(count, 6, -1)).reshape(3, count, count, 6)
    return np.asarray(np.einsum("aijy,ajy->ij", one, forces))


def with_torque_sign(groups: Sequence[Group], D: Array) -> tuple[int | None, Array]:
    """Return the one robot whose torques must have the other sign for moments to balance, and D with it turned.

    D  (6, 6 N) sums the pushes at B
    """
    S = scatter(groups)
    left = {i: _moments_left(S, D, i, -1.0) for i in _with_torque_sensor(S)}
    if not left:
        return None, D
    robot = min(left, key=left.__getitem__)
    if left[robot] * TORQUES_FALL > _moments_left(S, D, robot, 1.0):
        return None, D
    return robot, _torque_taken(D, robot, -1.0)


def torque_factor(groups: Sequence[Group], D: Array) -> tuple[int, float] | None:
    """Return the one robot whose torques balance moments times a factor, and that factor; None where none does."""
    S, best = scatter(groups), []
    for i in _with_torque_sensor(S):
        none, given, turned = (_moments_left(S, D, i, times) for times in (0.0, 1.0, -1.0))
        bend = (given + turned) / 2 - none
        if bend > 0:
            times = (turned - given) / (4 * bend)
            best.append((_moments_left(S, D, i, times) / given, i, times))
    if not best or min(best)[0] * TORQUES_FALL > 1:
        return None
    return min(best)[1:]


def _with_torque_sensor(S: Array) -> Integers:
    """Return the robots that measure torques."""
    own = np.diag(S)[12:-1].reshape(-1, 6)[:, :3]
    return np.flatnonzero(own.any(1)).astype(np.int64)


def _moments_left(S: Array, D: Array, robot: int, times: float) -> float:
    """Return what a body leaves of the moments about B with one robot's torques taken so many times."""
    return unexplained(_torque_taken(D, robot, times)[:3], basis()[1:, :3], S)


def _torque_taken(D: Array, robot: int, times: float) -> Array:
    out = D.copy()
    out[:3, 6 * robot : 6 * robot + 3] *= times
    return out
