"""The verbs of `import steelyard as sy` say of a wrong kind of argument what would be right."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import steelyard as sy
from steelyard.api import shape_of
from steelyard.logs.team_log import TeamRecording
from steelyard.simulate import scenarios
from steelyard.simulate.handling import motion_arrays

BODY = scenarios.body("wrench").parameters()
MADE = motion_arrays(body=BODY)


def recording(**changed: Any) -> sy.Recording:
    given = {
        "time": MADE["time"],
        "force": MADE["force_sensor"],
        "torque": MADE["torque_sensor"],
        "rotation": MADE["rotation_world_from_sensor"],
        "position": MADE["position_world"],
    }
    return sy.recording(**(given | changed))


WRONG: dict[str, tuple[Callable[..., object], str]] = {
    "place": (
        lambda: sy.identify(recording(), parts="mesh.ply", pose_in_sensor=np.eye(4)),  # type: ignore[arg-type]
        "pose_in_sensor must be a Pose, a TOML file or its inline table; got ndarray. A 4 x 4 matrix becomes one with "
        "sy.Pose.from_matrix(T).",
    ),
    "tool": (
        lambda: sy.identify(recording(), tool={"mass_kg": 1}),  # type: ignore[arg-type]
        "tool must be a path, a Recording, an Estimate or InertialParameters; got dict.",
    ),
    "parts": (
        lambda: sy.identify(recording(), parts=[1, 2], pose_in_sensor=sy.Pose.identity()),  # type: ignore[arg-type]
        "parts must be a path (mesh.ply, parts.npz) or Parts; got list.",
    ),
    "points": (
        lambda: shape_of(np.zeros((50, 3))),  # type: ignore[arg-type]
        "scan must be a path, a Cloud, Views or a Shape; got ndarray. Points become one with Cloud(xyz, rgb) of "
        "steelyard.shape.cloud.",
    ),
    "team": (lambda: sy.identify_team({}), "log must be a path or a TeamLog; got dict."),  # type: ignore[arg-type]
    "track": (
        lambda: TeamRecording("motion", {"left": {"time": [0, 1]}}),  # type: ignore[dict-item]
        "'recording' needs a Track of each robot: Track.of(time, rotation=.., ..); that of 'left' is dict.",
    ),
    "result": (lambda: sy.compare(1, 2), "a result must be a path or an Estimate; got int."),  # type: ignore[arg-type]
    "size": (lambda: sy.Options(object_size="5 cm"), "object_size must be a number; got '5 cm'."),  # type: ignore[arg-type]
}


@pytest.mark.parametrize("wrong", WRONG)
def test_a_wrong_kind_has_one_clear_error(wrong: str) -> None:
    call, text = WRONG[wrong]
    with pytest.raises(sy.BadInput) as caught:
        call()
    assert str(caught.value) == text


def test_a_tool_may_be_a_body_that_is_known() -> None:
    tool = sy.InertialParameters.from_com(0.1, [0, 0, 0.02], 1e-5 * np.eye(3))
    both = motion_arrays(body=BODY + tool)
    found = sy.identify(recording(force=both["force_sensor"], torque=both["torque_sensor"]), tool=tool)
    assert found.mass == pytest.approx(BODY.mass, rel=1e-3)
    assert found.com == pytest.approx(BODY.com, abs=1e-3)
    with pytest.raises(sy.BadInput, match="not those of a rigid body"):
        sy.identify(recording(), tool=BODY - BODY - tool)


def test_results_are_compared_as_files_or_values(tmp_path: Path) -> None:
    one = sy.identify(recording())
    sy.write_result(one, tmp_path / "one.json")
    assert sy.compare(one, tmp_path / "one.json").same
    heavier = replace(one, parameters=sy.InertialParameters(1.5 * one.parameters.vector))
    assert not sy.compare(one, heavier).same
    with pytest.raises(sy.BadInput, match=r'the second result in "left": places in them cannot be compared'):
        sy.compare(one, replace(one, frame="left"))
