"""Forces behind a filter or a slow driver: how late they are is found, named and put right, and bars hold the rest."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import butter, lfilter, lfilter_zi

from steelyard.check import Array
from steelyard.logs.team_log import TeamLog
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import RATE_HZ, TeamNoise, TeamScene, case
from steelyard.team.estimate import TeamEstimate
from steelyard.team.joint import JointTeam

ARMS = TeamNoise(force_white_N=0.3, torque_white_Nm=0.02, pose_rad=2e-4, pose_m=1e-4)
SENSORS = TeamNoise(force_white_N=0.5, torque_white_Nm=0.03, rate_rad_s=4e-3, velocity_m_s=2e-3)
SCENES = {
    "gimbals": case("B"),
    "two arms": TeamScene(ARMS, 2, "poses", frozenset({0, 1})),
    "moving bases": TeamScene(SENSORS, 3, "twists", frozenset({0, 1, 2}), bases_move=True),
}


def behind(log: TeamLog, change: Callable[[Array], Array], robots: set[str]) -> TeamLog:
    """The log with forces and torques of some robots as a filter leaves them."""

    def changed(channels: dict[str, Array]) -> dict[str, Array]:
        return {n: change(values) if n in ("force", "torque") else values for n, values in channels.items()}

    return log.with_recordings(
        *(
            replace(
                r,
                tracks={
                    n: replace(t, channels=changed(dict(t.channels))) if n in robots else t for n, t in r.tracks.items()
                },
            )
            for r in log.recordings
        )
    )


def lowpass(hz: float, order: int) -> Callable[[Array], Array]:
    b, a = butter(order, 2 * hz / RATE_HZ)

    def change(values: Array) -> Array:
        return np.asarray(lfilter(b, a, values, axis=0, zi=lfilter_zi(b, a)[:, None] * values[0])[0])

    return change


def delayed(rows: int) -> Callable[[Array], Array]:
    return lambda values: np.concatenate([np.repeat(values[:1], rows, axis=0), values[:-rows]])


def late_ms(found: TeamEstimate) -> dict[str, float]:
    """What the finding says, by robot."""
    said = next(f.message for f in found.findings if f.code == "stream-delayed")
    parts = said.split("forces are ")[1].split(" (corrected")[0].split(", ")
    return {p.split("'")[1]: float(p.split("' ")[1].split(" ")[0]) for p in parts}


def off(found: TeamEstimate, truth: Array) -> Array:
    """Errors of the ten parameters in standard deviations, each by itself."""
    return np.asarray(np.abs(found.parameters.vector - truth) / np.sqrt(np.diag(found.covariance)))


@pytest.mark.parametrize("scene", SCENES)
def test_a_delay_of_one_robots_forces_is_found_and_put_right(scene: str) -> None:
    made = simulate_team(SCENES[scene], 31)
    sound = JointTeam().identify(made.log)
    found = JointTeam().identify(behind(made.log, delayed(3), {"robot1"}))
    assert "stream-delayed" not in sound.codes()
    said = late_ms(found)
    assert set(said) == {"robot1"}
    assert said["robot1"] == pytest.approx(30, abs=2)
    assert found.mass == pytest.approx(sound.mass, rel=3e-4)
    np.testing.assert_allclose(found.com, sound.com, atol=5e-4)
    np.testing.assert_allclose(found.principal_moments, sound.principal_moments, rtol=5e-3)


@pytest.mark.parametrize("hz", [2.0, 5.0, 10.0])
@pytest.mark.parametrize("scene", SCENES)
def test_every_robots_driver_filters_its_forces(scene: str, hz: float) -> None:
    """As late as the filter is slow; 16 % of the inertia had been lost at 2 Hz, 1.3 % and five bars at 10 Hz."""
    made = simulate_team(SCENES[scene], 32)
    found = JointTeam().identify(behind(made.log, lowpass(hz, 2), set(made.log.names)))
    said = late_ms(found)
    assert set(said) == set(made.log.names)
    for late in said.values():
        assert late == pytest.approx(1e3 * np.sqrt(2) / (2 * np.pi * hz), rel=0.15)
    np.testing.assert_allclose(found.principal_moments, made.truth.moments, rtol=0.02 if hz == 2.0 else 0.006)
    assert off(found, made.truth.body.vector).max() < 3.5


@pytest.mark.parametrize("robots", [{"robot1"}, {"robot0", "robot1", "robot2"}])
def test_bars_hold_what_a_filter_of_first_order_takes(robots: set[str]) -> None:
    scene = TeamScene(ARMS, 3, "poses", frozenset({0, 1, 2}))
    squares = []
    for seed in range(4):
        made = simulate_team(scene, 33 + seed)
        found = JointTeam().identify(behind(made.log, lowpass(5.0, 1), robots))
        assert "stream-delayed" in found.codes()
        squares.append(off(found, made.truth.body.vector) ** 2)
    assert np.sqrt(np.mean(squares)) < 2.0


def test_a_late_force_of_the_other_sign_is_put_right_in_both() -> None:
    made = simulate_team(SCENES["gimbals"], 34)
    turned = behind(made.log, lambda values: -delayed(3)(values), {"robot2"})
    found = JointTeam().identify(turned)
    assert {"stream-delayed", "wrench-sign-flipped"} <= found.codes()
    assert late_ms(found)["robot2"] == pytest.approx(30, abs=3)
    np.testing.assert_allclose(found.principal_moments, made.truth.moments, rtol=0.01)


def test_a_late_clock_is_no_late_force() -> None:
    made = simulate_team(replace(SCENES["gimbals"], late_s={1: 0.03}), 35)
    found = JointTeam().identify(made.log)
    assert "clock-offset" in found.codes()
    assert "stream-delayed" not in found.codes()
