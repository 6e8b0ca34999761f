"""Each step of the team paper can be called alone: lists will do, and wrong arrays have their one clear error."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from steelyard.errors import BadInput, CannotAnswer
from steelyard.spatial import Pose, Rotation, Twist
from steelyard.team.grasp_kinematics import pair
from steelyard.team.inertia_matrix import inertia, moment_about
from steelyard.team.mass_and_com import mass_and_com

RNG = np.random.default_rng(0)
TWIST = RNG.normal(size=(20, 6))
GRAVITY = 9.81 * Rotation.exp(RNG.normal(size=(20, 3))).apply([0.0, 0.0, -1.0])
WRENCH = np.concatenate([np.cross([0.1, 0.2, 0.3], -3 * GRAVITY), -3 * GRAVITY], 1)
OMEGA, ALPHA = RNG.normal(size=(2, 20, 3))
MOMENT = 2 * ALPHA
HOLE = np.where(np.arange(20)[:, None] == 7, np.nan, TWIST)

WRONG: dict[str, tuple[Callable[[], object], str]] = {
    "turned": (lambda: pair(TWIST.T, TWIST.T), "twist_i must have shape (T, 6), one row per sample; got (6, 20)."),
    "longer": (lambda: pair(TWIST[1:], TWIST), "twist_j has 20 rows, twist_i has 19; they must agree."),
    "a hole": (lambda: pair(TWIST, HOLE), "twist_j must be finite; 6 entries are not, the first at index (7, 0)."),
    "one row": (
        lambda: mass_and_com(GRAVITY[0], WRENCH[0]),
        "gravity must have shape (T, 3), one row per sample; got (3,).",
    ),
    "forces alone": (
        lambda: mass_and_com(GRAVITY, WRENCH[:, 3:]),
        "wrench must have shape (T, 6), one row per sample; got (20, 3).",
    ),
    "words": (
        lambda: inertia("fast", ALPHA, MOMENT),  # type: ignore[arg-type]
        "omega must be numbers; got str (could not convert string to float: 'fast').",
    ),
    "other moments": (lambda: inertia(OMEGA, ALPHA, MOMENT[:5]), "moment has 5 rows, omega has 20; they must agree."),
    "other turns": (lambda: inertia(OMEGA, ALPHA[:5], MOMENT), "alpha has 5 rows, omega has 20; they must agree."),
    "no wrench": (
        lambda: moment_about(MOMENT, [0, 0, 0]),  # type: ignore[arg-type]
        "wrench must have shape (T, 6), one row per sample; got (20, 3).",
    ),
}


@pytest.mark.parametrize("wrong", WRONG)
def test_wrong_arrays_have_one_clear_error(wrong: str) -> None:
    make, text = WRONG[wrong]
    with pytest.raises(BadInput) as caught:
        make()
    assert str(caught.value) == text


def test_no_rows_at_rest_are_told() -> None:
    with pytest.raises(CannotAnswer, match="need rows at rest; there are none"):
        mass_and_com(GRAVITY[:0], WRENCH[:0])


def test_lists_are_arrays() -> None:
    X = Pose(Rotation.exp([0.1, 0.2, 0.3]), [0.5, 0.0, 0.1])
    twist = (X @ Twist.from_array(TWIST)).array()
    assert pair(twist.tolist(), TWIST.tolist()).pose.position == pytest.approx(X.position)  # type: ignore[arg-type]
    assert mass_and_com(GRAVITY.tolist(), WRENCH.tolist()).mass == pytest.approx(3)  # type: ignore[arg-type]
    flat = np.array([OMEGA, ALPHA, 2 * ALPHA]).tolist()
    assert inertia(*flat).matrix == pytest.approx(2 * np.eye(3), abs=1e-9)
