"""A recording in which the payload stood on something, or something lay on it, is named and left out."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.team.joint import JointTeam


def loaded(log: TeamLog, factor: float, *numbers: int) -> TeamLog:
    """Return the log with forces in some recordings taken so many times."""
    return log.with_recordings(
        *(
            replace(r, tracks={n: replace(t, channels=_pushed(t.channels, factor)) for n, t in r.tracks.items()})
            if k in numbers
            else r
            for k, r in enumerate(log.recordings)
        )
    )


def _pushed(channels: object, factor: float) -> dict[str, np.ndarray]:
    return {n: v * factor if n in ("force", "torque") else v for n, v in dict(channels).items()}  # type: ignore[call-overload]


@pytest.mark.parametrize("case", ["B", "D"])
@pytest.mark.parametrize(("factor", "code", "words"), [(0.5, "contact", "less"), (1.15, "load-changed", "more")])
def test_a_pose_with_another_load_is_named_and_left_out(case: str, factor: float, code: str, words: str) -> None:
    made = simulate_team(TeamScene(CASES[case], motion_samples=2000), 100)
    found = JointTeam().identify(loaded(made.log, factor, 2))
    (said,) = (f for f in found.findings if f.code == code)
    assert said.message.startswith("In 'still-2' robots bear ")
    newtons = float(said.message.split(" bear ")[1].split(" N ")[0])
    assert newtons == pytest.approx(abs(factor - 1) * 12 * 9.81, rel=0.1)
    assert f" N {words} than the payload weighs" in said.message
    right = JointTeam().identify(made.log)
    assert abs(found.mass - 12) < 4 * found.std[0]
    assert found.std[0] < 2 * right.std[0]


def test_two_of_six_recordings() -> None:
    made = simulate_team(TeamScene(CASES["B"], motion_samples=2000), 101)
    found = JointTeam().identify(loaded(made.log, 1.1, 3, 4))
    assert [f.message.split("'")[1] for f in found.findings if f.code == "load-changed"] == ["still-3", "still-4"]
    assert abs(found.mass - 12) < 4 * found.std[0]


def test_half_of_the_recordings_are_not_called_odd() -> None:
    made = simulate_team(TeamScene(CASES["B"], motion_samples=2000), 101)
    found = JointTeam().identify(loaded(made.log, 1.3, 2, 3, 4))
    assert not {"load-changed", "contact"} & found.codes()
    # Bars then hold either: none is believed.
    assert abs(found.mass - 12) < 4 * found.std[0]


@pytest.mark.parametrize("case", CASES)
def test_recordings_that_differ_by_bias_are_all_kept(case: str) -> None:
    for seed in range(20, 26):
        found = JointTeam().identify(simulate_team(TeamScene(CASES[case], motion_samples=1500), seed).log)
        assert not {"load-changed", "contact"} & found.codes()
