"""The team bench's laws: what every motion is said to show is what it can, and labels change nothing."""

from __future__ import annotations

import numpy as np
import pytest

from steelyard.bench.teams import laws
from steelyard.bench.teams.table import _laws
from steelyard.spatial import Pose, Rotation


@pytest.mark.parametrize("sensed", laws.SENSED)
@pytest.mark.parametrize("motion", ["ball_joint", "one_axis", "one_axis_pivot", "one_axis_translation"])
def test_what_a_motion_shows(motion: str, sensed: str) -> None:
    row = laws.lost_trial((sensed, motion, laws.FIRST_SEED))
    shows = laws.MOTIONS[motion].shows
    assert row["shown"] == [shows, shows]
    assert row["named"] == (shows < 6)
    assert row["deg"] < 0.1
    assert row["mm"] < 1


@pytest.mark.parametrize("session", laws.SESSIONS)
def test_labels_references_and_homes_change_nothing(session: str) -> None:
    apart = laws.same_trial((session, laws.FIRST_SEED))
    assert {"relabelled", "another_reference"} <= apart.keys()
    assert ("moved_homes" in apart) == (session == "joints")
    assert max(max(both) for both in apart.values()) < 1e-8


def test_a_turn_that_nobody_sees_is_no_error_of_what_is_seen() -> None:
    found = Pose(Rotation.identity(), np.array([1.0, 0.0, 0.0]))
    about = Pose(Rotation.exp(np.array([0, 0, 2.0])), np.zeros(3))
    np.testing.assert_allclose(laws._error(found, about @ found), [0, 0, 2, 0, 2, 0], atol=1e-12)


def test_the_laws_have_lines() -> None:
    motion = {"asked": 5, "shown": [5, 5], "named": 6, "wrench_rank": [7, 7], "deg": 0.01, "mm": 0.1}
    same = {"joints": {"relabelled": {"grasps": 3e-13, "parameters": 1e-12}}}
    lines = _laws({"trials": 6, "motions": {"poses": {"one_axis": motion}}, "same": same})
    assert lines[0].startswith("poses, one axis: shows 5 of 6 (told 5 to 5, named in 6 of 6), wrench rank 7 to 7;")
    assert lines[1] == "joints, largest difference of grasps and of parameters: relabelled 3e-13, 1e-12"
