"""Contact and load change: named and left out where they are, never named where they are not."""

from __future__ import annotations

import re
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

from steelyard.identify.noise_aware import NoiseAware
from steelyard.io.log_files import read_recording
from steelyard.logs.alignment import align
from steelyard.logs.log import MotionLog, Noise
from steelyard.sanity.holding.contact import untouched
from steelyard.simulate import scenarios
from steelyard.simulate.logs import simulate_log
from steelyard.spatial import Pose, Rotation

MOTIONS = ("stop_go", "dyn_slow", "dyn_fast")
SHARES = (0.05, 0.2, 0.55)
SHAPES = ("half-sine", "constant", "ramp", "smooth")
OBJECTS = ("hammer", "wrench", "bottle", "c_clamp", "box_tool", "mallet", "drill")
BIAS = [0.1, -0.2, 0.05, 4.0, -2.0, 6.0]


def made(name: str, motion: str, level: str, seed: int, *, bias: bool = True, spectrum: str = "white") -> MotionLog:
    log, _ = simulate_log(name, motion, level, seed, shuffled=False, spectrum=spectrum, bias=BIAS if bias else None)
    return log


def mass_of(name: str) -> float:
    return float(scenarios.body(name).parameters().mass)


@cache
def rotation(motion: str, rows: int) -> Rotation:
    return scenarios.motion(motion).at(np.arange(rows) / 100).rotation


def pushed(
    log: MotionLog, R_WS: Rotation, share: float, shape: str, newton: float, rng: np.random.Generator
) -> tuple[MotionLog, np.ndarray]:
    """The log with a hand pushing in W at a point fixed to the object for a share of the time; the rows touched."""
    span = log.time[-1] - log.time[0]
    start = log.time[0] + rng.uniform(0, span * (1 - share))
    phase = (log.time - start) / (share * span)
    touched = (phase >= 0) & (phase <= 1)
    way = rng.normal(size=3)
    waves = sum(np.outer(np.sin(np.pi * k * phase), rng.normal(size=3) / k) for k in range(1, 5))
    force = {
        "half-sine": np.outer(np.sin(np.pi * phase), way),
        "constant": np.outer(np.ones_like(phase), way),
        "ramp": np.outer(phase, way),
        "smooth": waves,
    }[shape]
    force = force * touched[:, None]
    force = R_WS.inverse().apply(force * (newton / np.linalg.norm(force, axis=1).max()))
    point = np.array([0.0, 0.0, 0.15]) + 0.08 * rng.normal(size=3)
    hand = np.concatenate([np.cross(point, force), force], 1)
    return replace(log, wrench=log.wrench - hand), touched


def codes(log: MotionLog, with_bias: bool = True) -> list[str]:
    mask, findings = untouched(log, with_bias)
    assert mask.all() == (not findings)
    return [f.code for f in findings]


@pytest.mark.parametrize("share", SHARES)
@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("shape", SHAPES)
def test_a_push_is_named_and_left_out(share: float, motion: str, shape: str) -> None:
    key = [SHARES.index(share), MOTIONS.index(motion), SHAPES.index(shape)]
    rng = np.random.default_rng(key)
    name = OBJECTS[sum(key) % len(OBJECTS)]
    level = ("low", "moderate", "high")[(key[1] + key[2]) % 3]
    newton = max(float(rng.uniform(3, 20)), 0.3 * 9.81 * mass_of(name))
    log, touched = pushed(made(name, motion, level, 1), rotation(motion, 1000), share, shape, newton, rng)
    log = replace(log, noise=None)
    mask, findings = untouched(log, True)
    assert [f.code for f in findings] == ["contact"]
    assert (~mask & touched).sum() > 0.85 * touched.sum()
    assert (mask & touched).sum() < 0.1 * mask.sum()
    assert (~mask & ~touched).mean() < 0.2
    assert NoiseAware().identify(log.rows(mask)).parameters.mass == pytest.approx(mass_of(name), rel=0.04)


# The mallet is so light that 7 % of its weight do not stand out of the noise.
@pytest.mark.parametrize("name", sorted({*OBJECTS} - {"mallet"}))
def test_a_weak_hand_is_named_where_gravity_lay_alike_without_it(name: str) -> None:
    once = made(name, "stop_go", "low", 1)
    rows, force = len(once), 0.07 * 9.81 * mass_of(name)
    log = replace(once.rows(np.tile(np.arange(rows), 2)), noise=None, time=np.append(once.time, once.time + 10))
    assert codes(log) == []
    hand = np.zeros((2 * rows, 6))
    hand[(log.time > 12) & (log.time < 14)] = [0.1 * force, 0, 0, 0, -force, 0]
    touched = hand.any(1)
    mask, (finding,) = untouched(replace(log, wrench=log.wrench - hand), True)
    assert finding.code == "contact"
    assert not mask[touched].any()
    assert mask[~touched].mean() > 0.9
    # Attitudes of the touched time that no other has: an error that hangs on the pose would look alike.
    alone = ~touched.reshape(2, rows)[1]
    both = np.append(alone, np.ones(rows, np.bool_))
    assert codes(replace(log, wrench=log.wrench - hand).rows(both)) == []


def test_a_push_that_is_constant_in_the_sensor_says_that_it_could_be_either() -> None:
    log = made("hammer", "stop_go", "moderate", 0)
    touched = (log.time > 2) & (log.time < 7.5)
    log = replace(log, wrench=log.wrench + touched[:, None] * [0.3, 0.5, 0.0, 3.0, -5.0, 2.0])
    mask, findings = untouched(log, True)
    assert [f.code for f in findings] == ["contact"]
    assert "either way" in findings[0].message
    assert "tared" not in findings[0].message
    assert (mask & touched).sum() < 0.1 * mask.sum()
    assert NoiseAware().identify(log.rows(mask)).parameters.mass == pytest.approx(mass_of("hammer"), rel=0.04)


@pytest.mark.parametrize("first", [True, False])
def test_a_tare_in_between_is_thought_of(first: bool) -> None:
    log = made("hammer", "stop_go", "moderate", 0)
    before = (log.time < 4.0) if first else (log.time > 6.0)
    log = replace(log, wrench=log.wrench + before[:, None] * [0.3, 0.5, 0.0, 3.0, -5.0, 2.0])
    mask, (finding,) = untouched(log, True)
    assert finding.code == "contact"
    assert finding.message.endswith("It reaches an end of the log, as where the sensor was tared in between.")
    assert NoiseAware().identify(log.rows(mask)).parameters.mass == pytest.approx(mass_of("hammer"), rel=0.01)


def test_the_message_has_time_share_and_size() -> None:
    log = made("hammer", "stop_go", "low", 0)
    phase = (log.time - 3) / 2
    push = 10 * np.where((phase > 0) & (phase < 1), np.sin(np.pi * phase), 0)
    log = replace(log, wrench=log.wrench + push[:, None] * [0, 0, 0, 0, 1, 0])
    _, (finding,) = untouched(log, True)
    words = re.fullmatch(
        r"Something else than the robot touched the object at (.+) to (.+) s, with up to (.+) N and (.+) N m; "
        r"(.+) % of the time was left out\.",
        finding.message,
    )
    assert words is not None
    first, last, force, torque, share = map(float, words.groups())
    assert 2.7 <= first <= 3.2
    assert 4.8 <= last <= 5.3
    assert force == pytest.approx(10, rel=0.1)
    assert torque < 0.3
    assert share == pytest.approx(10 * (last - first), abs=1.5)


def test_what_misses_one_body_in_most_of_a_log_is_not_called_a_hand() -> None:
    """Half of the weight is taken away, none of the inertia."""
    log = made("hammer", "stop_go", "moderate", 0)
    body = scenarios.body("hammer").parameters().vector.copy()
    body[4:] = 0
    at_rest = replace(
        log,
        acceleration=0 * log.acceleration,
        angular_velocity=0 * log.angular_velocity,
        angular_acceleration=0 * log.angular_acceleration,
    )
    mask, (finding,) = untouched(replace(log, wrench=log.wrench - 0.5 * at_rest.predicted(body)), True)
    assert finding.code == "contact"
    assert finding.message.startswith("The wrench does not fit one body in")
    assert "controller compensates" in finding.remedy
    assert log.still[mask].mean() > log.still.mean()


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow"])
def test_errors_everywhere_are_named_and_nothing_is_left_out(motion: str) -> None:
    """Errors of the wrench that vary smoothly with where gravity points return with the pose; a hand does not."""
    log = made("drill", motion, "low", 0)
    down = log.gravity / 9.81
    smooth = np.concatenate([np.sin(2 * down), down**2, np.sin(3 * down)], 1)
    off = (smooth - smooth.mean(0)) @ np.random.default_rng(0).normal(size=(9, 6)) * ([0.1] * 3 + [1.0] * 3)
    mask, (finding,) = untouched(replace(log, wrench=log.wrench + off), True)
    assert mask.all()
    assert finding.message.startswith("The wrench does not fit one body in")
    assert finding.message.endswith("the rest fits hardly better, so nothing was left out.")
    assert "left out" not in finding.remedy


@pytest.mark.parametrize(("slip", "noise"), [(0.05, "low"), (0.05, "high"), (0.08, "low")])
@pytest.mark.parametrize("seed", [0, 1, 2])
def test_a_slip_is_named_with_its_time(slip: float, noise: str, seed: int) -> None:
    log = made("hammer", "stop_go", noise, seed)
    body = scenarios.body("hammer").parameters()
    moved = body.in_frame(Pose(Rotation.identity(), np.array([0.0, slip, 0.0]))).vector - body.vector
    late = log.time >= 5.0
    mask, (finding,) = untouched(replace(log, wrench=log.wrench + late[:, None] * log.predicted(moved)), True)
    assert finding.code == "load-changed"
    said = finding.message.split("its centre of mass moved by ")[1]
    assert float(said.split(" mm")[0]) == pytest.approx(1e3 * slip, rel=0.25)
    assert float(finding.message.split()[1]) == pytest.approx(5.0, abs=0.3)
    assert not (mask & late).any() or not (mask & ~late).any()


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize(("name", "level"), [("hammer", "moderate"), ("bottle", "low"), ("drill", "high")])
@pytest.mark.parametrize("extra", ["denser", "added"])
def test_a_load_change_is_named_with_its_time(motion: str, name: str, level: str, extra: str) -> None:
    log = made(name, motion, level, 2)
    body = scenarios.body(name).parameters().vector
    added = 0.3 * body
    if extra == "added":  # 30 % more mass as one lump
        point = np.array([0.03, -0.02, 0.2])
        inertia = added[0] * (point @ point * np.eye(3) - np.outer(point, point))
        added = np.concatenate([added[:1], added[0] * point, inertia[np.triu_indices(3)]])
    late = log.time >= 5.0
    log = replace(log, wrench=log.wrench + late[:, None] * log.predicted(added))
    mask, findings = untouched(log, True)
    assert [f.code for f in findings] == ["load-changed"]
    assert float(findings[0].message.split()[1]) == pytest.approx(5.0, abs=0.3)
    assert not (mask & late).any() or not (mask & ~late).any()
    assert mask.mean() > 0.4
    true = body[0] * (1.3 if late[mask].any() else 1.0)
    assert NoiseAware().identify(log.rows(mask)).parameters.mass == pytest.approx(true, rel=0.04)


@pytest.mark.parametrize("motion", ["stop_go", "dyn_slow"])
@pytest.mark.parametrize(("at", "lost"), [(6.5, True), (3.5, True), (6.5, False), (3.5, False)])
def test_of_a_load_picked_up_or_put_down_the_loaded_side_is_kept(motion: str, at: float, lost: bool) -> None:
    body = scenarios.body("hammer").parameters().vector
    for seed in range(4):
        log = made("hammer", motion, "low", seed)
        empty = (log.time >= at) == lost
        # The sensor leaks 1 % of the other axes into each: that of nothing is nothing.
        leaks = np.kron(np.eye(2), 0.01 * (np.roll(np.eye(3), 1, 0) - np.roll(np.eye(3), 2, 0)))
        more = log.predicted(body) @ leaks - empty[:, None] * (log.predicted(body) @ (np.eye(6) + leaks))
        mask, findings = untouched(replace(log, wrench=log.wrench + more), True)
        assert [f.code for f in findings] == ["load-changed"]
        said = f"the load of {body[0]:.2f}"[:-1], "was put down or lost" if lost else "was picked up"
        assert all(words in findings[0].message for words in said)
        assert not mask[empty].any()
        assert mask.mean() > 0.8 * (1 - empty.mean())


@pytest.mark.parametrize(("name", "first"), [("hammer", 6.0), ("hammer", 13.0), ("drill", 12.0)])
def test_of_two_loads_with_a_pause_between_one_is_kept(name: str, first: float) -> None:
    once, other = made(name, "stop_go", "low", 1), made("bottle", "stop_go", "low", 2)
    twice = np.tile(np.arange(len(once)), 2)
    log = replace(once.rows(twice), noise=None, time=np.append(once.time, once.time + 10))
    time = log.time[:, None]
    wrench = np.where(time < first + 2, BIAS, other.rows(twice).wrench)
    log = replace(log, wrench=np.where(time < first, log.wrench, wrench))
    mask, (finding, *more) = untouched(log, True)
    assert not more
    assert finding.code == "load-changed"
    assert "was put down or lost" in finding.message
    assert "was picked up" in finding.message
    at = sorted(float(t) for t in re.findall(r"at (\d+\.\d) s", finding.message.lower()))
    assert at == pytest.approx([first, first + 2], abs=0.3)
    kept = name if first > 9 else "bottle"
    assert NoiseAware().identify(log.rows(mask)).parameters.mass == pytest.approx(mass_of(kept), rel=0.01)


def test_of_two_changes_one_may_be_of_the_grip() -> None:
    once, other = made("hammer", "stop_go", "low", 1), made("bottle", "stop_go", "low", 2)
    twice = np.tile(np.arange(len(once)), 2)
    log = replace(once.rows(twice), noise=None, time=np.append(once.time, once.time + 10))
    body, time = scenarios.body("bottle").parameters(), log.time[:, None]
    moved = body.in_frame(Pose(Rotation.identity(), np.array([0.04, 0.0, 0.01]))).vector - body.vector
    second = other.rows(twice)
    wrench = np.where(time < 8, second.wrench, second.wrench + second.predicted(moved))
    _, (finding,) = untouched(replace(log, wrench=np.where(time < 4, log.wrench, wrench)), True)
    assert finding.code == "load-changed"
    assert re.match(r"At 8\.0 s the load of 0\.92\d kg was gripped elsewhere \(and at 4\.0 s ", finding.message)


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("spectrum", ["white", "2hz"])
@pytest.mark.parametrize("level", ["none", "low", "moderate", "high"])
def test_clean_logs_stay_whole(motion: str, spectrum: str, level: str) -> None:
    for seed, name in enumerate(("hammer", "screwdriver", "pan")):
        log = made(name, motion, level, seed, spectrum=spectrum)
        assert codes(log) == []
        assert codes(replace(log, noise=None)) == []
        assert codes(made(name, motion, level, seed, bias=False, spectrum=spectrum), with_bias=False) == []


@pytest.mark.parametrize("motion", MOTIONS)
@pytest.mark.parametrize("level", ["none", "low", "high"])
def test_a_model_that_is_a_little_wrong_is_no_contact(motion: str, level: str) -> None:
    for name in ("hammer", "screwdriver", "drill"):
        log = made(name, motion, level, 3)
        rng = np.random.default_rng(4)
        late = np.stack([np.interp(log.time - 0.005, log.time, column) for column in log.wrench.T], 1)
        assert codes(replace(log, wrench=late)) == []
        crossed = np.eye(6) + 0.03 * rng.uniform(-1, 1, (6, 6)) * np.block(
            [[np.ones((3, 3)), np.full((3, 3), 0.1)], [np.full((3, 3), 3.0), np.ones((3, 3))]]
        )
        assert codes(replace(log, wrench=log.wrench @ crossed.T)) == []
        down = 9.81 * np.array([np.sin(np.radians(2)), 0, -np.cos(np.radians(2))])
        assert codes(replace(log, gravity=rotation(motion, 1000).inverse().apply(down))) == []


def test_rows_without_time_stay() -> None:
    log, _ = simulate_log("hammer", "stop_go", "moderate", 0)
    mask, findings = untouched(log, True)
    assert mask.all()
    assert mask.shape == (len(log),)
    assert findings == ()


def test_short_logs_stay() -> None:
    assert codes(made("hammer", "dyn_fast", "low", 0).rows(slice(0, 150))) == []


def test_the_order_of_rows_does_not_matter() -> None:
    rng = np.random.default_rng(0)
    log, _ = pushed(made("hammer", "dyn_slow", "low", 0), rotation("dyn_slow", 1000), 0.3, "half-sine", 8, rng)
    order = rng.permutation(len(log))
    mask, findings = untouched(log, True)
    shuffled, same = untouched(log.rows(order), True)
    assert (mask[order] == shuffled).all()
    assert findings == same
    unknown = replace(log, noise=(Noise(log.noise[0].acceleration, np.zeros(6)),))
    assert (untouched(unknown, True)[0] == mask).all()


@pytest.mark.parametrize("run", [1, 2])
def test_real_logs_are_clean_until_a_hand_comes(run: int, data_dir: Path, examples_dir: Path) -> None:
    aligned = align(read_recording(examples_dir / f"kuka_run{run}.toml", data_dir))
    assert codes(aligned.log) == []
    for share, shape, newton in ((0.15, "half-sine", 6.0), (0.3, "constant", 8.0), (0.5, "smooth", 12.0)):
        rng = np.random.default_rng(run)
        log, touched = pushed(aligned.log, aligned.rotation, share, shape, newton, rng)
        mask, findings = untouched(log, True)
        assert [f.code for f in findings] == ["contact"]
        assert (~mask & touched).sum() > 0.9 * touched.sum()
