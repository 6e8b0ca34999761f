"""Joint positions of an arm: its URDF gives the pose of the sensor, and what a wrong one is told."""
# ruff: noqa: E501

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from refused import message

import steelyard as sy
from steelyard.io import read_team, write_team
from steelyard.io.log_files import read_recording
from steelyard.io.recordings.arm_joints import read_arm
from steelyard.simulate.team import simulate_team
from steelyard.simulate.team_cases import CASES, TeamScene
from steelyard.spatial import Pose, Rotation

# UR5e by its published Denavit-Hartenberg numbers: a [m], alpha [rad], d [m] of each joint.
UR5E = (
    (0.0, np.pi / 2, 0.1625),
    (-0.425, 0.0, 0.0),
    (-0.3922, 0.0, 0.0),
    (0.0, np.pi / 2, 0.1333),
    (0.0, -np.pi / 2, 0.0997),
    (0.0, 0.0, 0.0996),
)
JOINTS = ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")


def flange(q: np.ndarray) -> np.ndarray:
    """Return the pose (4, 4) of the flange in the base at joint angles (6,) [rad], as textbooks multiply it."""
    T = np.eye(4)
    for angle, (a, alpha, d) in zip(q, UR5E, strict=True):
        c, s, ca, sa = np.cos(angle), np.sin(angle), np.cos(alpha), np.sin(alpha)
        T = T @ [[c, -s * ca, s * sa, a * c], [s, c * ca, -c * sa, a * s], [0, sa, ca, d], [0, 0, 0, 1]]
    return T


def joint(name: str, kind: str, parent: str, child: str, a: float, alpha: float, d: float) -> str:
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{a!r} 0 {d!r}" rpy="{alpha!r} 0 0"/><axis xyz="0 0 2"/><limit lower="-7" upper="7" effort="1" velocity="1"/></joint>\n'
    )


def urdf() -> str:
    """Return the arm as a URDF, on a stand, with a finger beside the flange."""
    placed = [(0.0, 0.0, 0.0), *UR5E]
    rows = [joint("stand", "fixed", "world", "base", 0.0, 0.0, 0.8)]
    links = ["base", "a", "b", "c", "d", "e", "f"]
    rows += [joint(name, "revolute", links[k], links[k + 1], *placed[k]) for k, name in enumerate(JOINTS)]
    rows.append(joint("flange", "fixed", "f", "tool0", *placed[6]))
    rows.append(joint("finger", "prismatic", "tool0", "tip", 0.0, 0.0, 0.1))
    return f'<?xml version="1.0"?>\n<robot name="ur5e">\n{"".join(rows)}</robot>\n'


ANGLES = np.random.default_rng(1).uniform(-3, 3, (40, 6))


def test_the_pose_of_the_flange(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(urdf())
    expected = np.stack([flange(q) for q in ANGLES])
    np.testing.assert_allclose(
        read_arm(tmp_path / "arm.urdf", "tool0", "base").pose(ANGLES).matrix(), expected, atol=1e-12
    )
    expected[:, 2, 3] += 0.8
    np.testing.assert_allclose(read_arm(tmp_path / "arm.urdf", "tool0").pose(ANGLES).matrix(), expected, atol=1e-12)
    tip = read_arm(tmp_path / "arm.urdf", "tip", "tool0").pose(np.array([[0.02]]))
    np.testing.assert_allclose(tip.position, [[0.0, 0.0, 0.12]])


MASS, COM = 1.3, np.array([0.01, -0.02, 0.07])
TOML = """
[log]
gravity = [0, 0, -9.81]
[robot]
urdf = "arm.urdf"
sensor_link = "tool0"
[[stream]]
path = "log.csv"
kind = "poses"
force = { columns = ["fx", "fy", "fz"], unit = "N" }
torque = { columns = ["tx", "ty", "tz"], unit = "N*m" }
[[stream]]
path = "log.csv"
kind = "poses"
joint_position = { columns = ["wrist_1", "wrist_2", "wrist_3", "shoulder_pan", "shoulder_lift", "elbow"], unit = "deg" }
"""


def write(folder: Path, toml: str = TOML) -> Path:
    """Write forty still poses, named after their joints; returns the description."""
    (folder / "arm.urdf").write_text(urdf())
    pose = read_arm(folder / "arm.urdf", "tool0").pose(ANGLES)
    force = MASS * pose.rotation.inverse().apply(np.tile([0, 0, 9.81], (len(ANGLES), 1)))
    wrench = np.concatenate([force, np.cross(COM, force)], 1)
    wrench += np.random.default_rng(2).normal(size=wrench.shape) * np.repeat([0.05, 0.002], 3)
    header = "fx,fy,fz,tx,ty,tz," + ",".join(JOINTS)
    table = np.column_stack([wrench, np.rad2deg(ANGLES)])
    np.savetxt(folder / "log.csv", table, "%.12g", ",", header=header, comments="")
    (folder / "log.toml").write_text(toml)
    return folder / "log.toml"


def test_joints_are_taken_by_their_names(tmp_path: Path) -> None:
    _, posed = read_recording(write(tmp_path)).streams
    assert set(posed.channels) == {"rotation", "position"}
    first = flange(ANGLES[0])
    np.testing.assert_allclose(posed.channels["rotation"][0], first[:3, :3], atol=1e-9)
    np.testing.assert_allclose(posed.channels["position"][0], first[:3, 3] + [0, 0, 0.8], atol=1e-9)


def test_columns_without_their_names_stand_in_order(tmp_path: Path) -> None:
    expected = read_recording(write(tmp_path)).streams[1].channels
    columns = TOML[TOML.rindex("columns") : TOML.rindex(", unit")]
    found = read_recording(write(tmp_path, TOML.replace(columns, "columns = [6, 7, 8, 9, 10, 11]"))).streams[1].channels
    np.testing.assert_array_equal(found["rotation"], expected["rotation"])


def test_names_may_have_a_prefix_or_stand_in_a_path(tmp_path: Path) -> None:
    expected = read_recording(write(tmp_path)).streams[1].channels
    for named in ("left_{}", "/joint_states/{}/position"):
        toml = TOML
        for name in JOINTS:
            toml = toml.replace(f'"{name}"', f'"{named.format(name)}"')
        path = write(tmp_path, toml)
        header, _, rows = (tmp_path / "log.csv").read_text().partition("\n")
        header = ",".join(named.format(c) if c in JOINTS else c for c in header.split(","))
        (tmp_path / "log.csv").write_text(f"{header}\n{rows}")
        found = read_recording(path).streams[1].channels
        np.testing.assert_array_equal(found["rotation"], expected["rotation"])


def test_a_joint_whose_name_begins_like_another_is_told_from_it(tmp_path: Path) -> None:
    """wrist_1 and wrist_12: one name stands in the other."""
    expected = read_recording(write(tmp_path)).streams[1].channels
    path = write(tmp_path, TOML.replace('"wrist_3"', '"wrist_12"'))
    for name in ("log.csv", "arm.urdf"):
        (tmp_path / name).write_text((tmp_path / name).read_text().replace("wrist_3", "wrist_12"))
    np.testing.assert_array_equal(read_recording(path).streams[1].channels["rotation"], expected["rotation"])


def test_a_name_that_is_misspelt_is_not_taken_by_its_place(tmp_path: Path) -> None:
    path = write(tmp_path, TOML.replace('"elbow"', '"elbw"'))
    (tmp_path / "log.csv").write_text((tmp_path / "log.csv").read_text().replace("elbow", "elbw"))
    assert "columns are named after joints, but not one after each of the arm's" in message(path)


def test_a_urdf_that_xacro_wrote(tmp_path: Path) -> None:
    path = write(tmp_path)
    (tmp_path / "arm.urdf").write_text(urdf().replace("<robot ", '<robot xmlns:xacro="http://ros.org/wiki/xacro" '))
    assert len(read_recording(path).streams) == 2


def test_a_sliding_joint_is_in_metres_whatever_the_unit_of_angles(tmp_path: Path) -> None:
    path = write(tmp_path, TOML.replace('"tool0"', '"tip"\nbase_link = "tool0"').replace(f"[{ALL}]", '["finger"]'))
    header, *rows = (tmp_path / "log.csv").read_text().splitlines()
    rows = [f"{row},{k / 100}" for k, row in enumerate(rows)]
    (tmp_path / "log.csv").write_text("\n".join([f"{header},finger", *rows]) + "\n")
    found = read_recording(path).streams[1].channels["position"][:, 2]
    np.testing.assert_allclose(found, 0.1 + 0.01 * np.arange(len(rows)), atol=1e-12)


def test_the_mass_of_a_log_of_joints(tmp_path: Path) -> None:
    estimate = sy.identify(write(tmp_path))
    assert abs(estimate.mass - MASS) < 0.01
    np.testing.assert_allclose(estimate.com, COM, atol=1e-3)


STREAM = 'log.toml, [[stream]] 2 ("log.csv")'
ALL = ", ".join(f'"{name}"' for name in ("wrist_1", "wrist_2", "wrist_3", "shoulder_pan", "shoulder_lift", "elbow"))
LINKS = "Links here: a, b, base, c, d, e, f, tip, tool0, world."
WRONG = {
    "radians": ('unit = "deg" }', 'unit = "rad" }', f'{STREAM}, joint_position: joints turn by up to LARGEST rad, more than two turns. They are probably in degrees: set unit = "deg".'),
    "one too few": (f"[{ALL}]", '["wrist_1"]', f"{STREAM}, joint_position: columns are named after joints, but not one after each of the arm's: {', '.join(JOINTS)}. Named are wrist_1."),
    "others, too few": (f"[{ALL}]", '["fx", "fy"]', f"{STREAM}, joint_position: the arm has 6 joints from base to sensor ({', '.join(JOINTS)}); 2 columns are given. Give theirs in this order, or columns with their names."),
    "no arm": ('[robot]\nurdf = "arm.urdf"\nsensor_link = "tool0"\n', "", f'{STREAM}: "joint_position" needs the arm. Add [robot] with urdf = "arm.urdf" and sensor_link = ".."; or give the orientation of the sensor, as rotation = {{ columns = [..], form = .. }}.'),
    "no link": ('sensor_link = "tool0"\n', "", 'log.toml, [robot]: "sensor_link" is missing. Example: sensor_link = "tool0"'),
    "other link": ('"tool0"', '"tool"', f'DIR/arm.urdf: there is no link "tool". Did you mean "tool0"? {LINKS}'),
    "other base": ('sensor_link = "tool0"', 'sensor_link = "c"\nbase_link = "d"', f'DIR/arm.urdf: link "c" does not hang on link "d", but on "world". {LINKS}'),
    "fixed": ('sensor_link = "tool0"', 'sensor_link = "base"', 'DIR/arm.urdf: no joint moves link "base" against "world". Name the link of the sensor.'),
    "pose twice": ("joint_position", 'position = { columns = ["fx", "fy", "fz"] }\njoint_position', f'{STREAM}: "joint_position" tells the position, too. Give one of them.'),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), WRONG.values(), ids=WRONG.keys())
def test_wrong_descriptions(tmp_path: Path, old: str, new: str, said: str) -> None:
    assert old in TOML
    path = write(tmp_path, TOML.replace(old, new, 1))
    largest = np.loadtxt(tmp_path / "log.csv", delimiter=",", skiprows=1)[:, 6:]
    assert message(path) == said.replace("LARGEST", f"{np.abs(largest).max():.4g}")


def test_one_joint_in_degrees_among_radians_is_named(tmp_path: Path) -> None:
    path = write(tmp_path, TOML.replace('unit = "deg" }', 'unit = "rad" }', 1))
    header, *rows = (tmp_path / "log.csv").read_text().splitlines()
    table = np.array([row.split(",") for row in rows], float)
    joints = [k for k, name in enumerate(header.split(",")) if name in JOINTS and name != "elbow"]
    table[:, joints] = np.radians(table[:, joints])
    lines = [header, *(",".join(f"{x:.9f}" for x in row) for row in table)]
    (tmp_path / "log.csv").write_text("\n".join(lines) + "\n")
    said = 'set unit = "deg". Only elbow does: where the others are in rad, convert elbow in the file.'
    assert message(path).endswith(said)


def test_radians_declared_as_degrees(tmp_path: Path) -> None:
    path = write(tmp_path)
    header, *rows = (tmp_path / "log.csv").read_text().splitlines()
    table = np.array([row.split(",") for row in rows], float)
    table[:, 6:] = ANGLES
    np.savetxt(tmp_path / "log.csv", table, "%.12g", ",", header=header, comments="")
    largest = f"{np.abs(ANGLES).max():.4g}"
    wanted = f'joint is ever beyond {largest} deg. They are probably in radians: set unit = "rad".'
    assert message(path).startswith(f"{STREAM}, joint_position: ")
    assert message(path).endswith(wanted)


FILES = {
    "no XML": ("<robot", "<<robot", "DIR/arm.urdf: expected a URDF; this is not valid XML (not well-formed (invalid token): line 2, column 1)."),
    "xacro": ("<robot ", '<xacro:property name="a" value="b"/><robot ', "DIR/arm.urdf: this is a xacro, not a URDF yet. Write it out first: xacro arm.urdf > arm.urdf"),
    "entities": ("<robot ", '<!DOCTYPE r [<!ENTITY a "b">]>\n<robot ', "DIR/arm.urdf: defines entities, which no URDF needs and which may unpack to any size. Remove them."),
    "SDF": ("robot", "sdf", "DIR/arm.urdf: expected a URDF, whose root is <robot>; found <sdf>."),
    "two numbers": ('xyz="0.0 0 0.8"', 'xyz="0.0 0.8"', 'DIR/arm.urdf: joint "stand" needs three numbers as xyz; got "0.0 0.8".'),
    "planar joint": ('"stand" type="fixed"', '"stand" type="planar"', 'DIR/arm.urdf: joint "stand" is of type "planar". Read are revolute, continuous, prismatic, fixed; name a base_link behind it.'),
    "no axis": ('<axis xyz="0 0 2"/><limit', '<axis xyz="0 0 0"/><limit', 'DIR/arm.urdf: joint "wrist_3" has an axis of length zero.'),
    "circle": ('<parent link="world"/>', '<parent link="f"/>', 'DIR/arm.urdf: the joints before link "tool0" go round in a circle.'),
    "carried twice": ('<child link="tip"/>', '<child link="tool0"/>', 'DIR/arm.urdf: joints "flange" and "finger" both carry "tool0".'),
    "mimic": ('<axis xyz="0 0 2"/><limit', '<mimic joint="elbow"/><axis xyz="0 0 2"/><limit', 'DIR/arm.urdf: joint "flange" mimics another. Name a link before it as the sensor\'s.'),
    "letters": ('xyz="0.0 0 0.8"', 'xyz="0.0 0 high"', 'DIR/arm.urdf: joint "stand" needs three numbers as xyz; got "0.0 0 high".'),
    "no child": ('<child link="tool0"/>', "", 'DIR/arm.urdf: joint "flange" names no child link.'),
}  # fmt: skip


@pytest.mark.parametrize(("old", "new", "said"), FILES.values(), ids=FILES.keys())
def test_wrong_arms(tmp_path: Path, old: str, new: str, said: str) -> None:
    path = write(tmp_path)
    assert old in urdf()
    (tmp_path / "arm.urdf").write_text(urdf().replace(old, new))
    assert message(path) == said


def test_pinocchio_agrees(tmp_path: Path) -> None:
    pin = pytest.importorskip("pinocchio", reason="pin is not installed")
    (tmp_path / "arm.urdf").write_text(
        urdf().replace(
            "</robot>",
            "".join(f'<link name="{n}"/>' for n in ("world", "base", *"abcdef", "tool0", "tip")) + "</robot>",
        )
    )
    model = pin.buildModelFromUrdf(str(tmp_path / "arm.urdf"))
    data, poses = model.createData(), []
    for q in ANGLES:
        pin.framesForwardKinematics(model, data, np.append(q, 0.0))
        poses.append(data.oMf[model.getFrameId("tool0")].homogeneous)
    np.testing.assert_allclose(read_arm(tmp_path / "arm.urdf", "tool0").pose(ANGLES).matrix(), poses, atol=1e-12)


def test_a_prismatic_joint_slides_along_its_axis() -> None:
    from steelyard.robots import Joint, SerialArm

    turned = Pose(Rotation.exp([0.0, np.pi / 2, 0.0]), np.array([0.1, 0.0, 0.0]))
    arm = SerialArm((Joint("slide", "prismatic", turned, np.array([0.0, 0.0, 1.0])),))
    np.testing.assert_allclose(arm.pose([[0.5]]).position, [[0.6, 0.0, 0.0]], atol=1e-12)


GANTRY = ("slide_x", "slide_y", "slide_z", "yaw", "pitch", "roll")
AXES = ("1 0 0", "0 1 0", "0 0 1", "0 0 1", "0 1 0", "1 0 0")


def gantry() -> str:
    rows = [
        f'<joint name="{name}" type="{"prismatic" if k < 3 else "continuous"}"><parent link="l{k}"/>'
        f'<child link="l{k + 1}"/><axis xyz="{axis}"/></joint>'
        for k, (name, axis) in enumerate(zip(GANTRY, AXES, strict=True))
    ]
    return f'<robot name="gantry">{"".join(rows)}</robot>'


def test_a_team_of_arms_says_where_it_holds_by_its_joints(tmp_path: Path) -> None:
    """Each robot is a gantry with three turns: its joints are the position and roll, pitch, yaw of its grasp."""
    scene = TeamScene(CASES["B"], grasp_samples=60, motion_samples=60, still_samples=10)
    path = write_team(simulate_team(scene, 3).log, tmp_path / "team.toml")
    expected = read_team(path)
    (tmp_path / "gantry.urdf").write_text(gantry())
    for table in (tmp_path / "team").glob("*.csv"):
        header = table.read_text().splitlines()[0].split(",")
        rows = np.loadtxt(table, delimiter=",", skiprows=1)
        q = rows[:, [header.index(name) for name in ("qw", "qx", "qy", "qz")]]
        p = rows[:, [header.index(name) for name in "xyz"]]
        turns = Rotation.from_quaternion_wxyz(q / np.linalg.norm(q, axis=1, keepdims=True)).rpy()[:, ::-1]
        both = np.column_stack([rows, p, np.rad2deg(turns)])
        np.savetxt(table, both, "%.12g", ",", header=",".join([*header, *GANTRY]), comments="")
    text = path.read_text()
    names = ", ".join(f'"{name}"' for name in reversed(GANTRY))
    text = re.sub(r"rotation = \{.*\}\n", f'joint_position = {{ columns = [{names}], unit = "deg" }}\n', text)
    text = re.sub(r" {4}position = \{.*\}\n", "", text)
    path.write_text(re.sub(r'(name = "robot\d"\n)', r'\1urdf = "gantry.urdf"\nsensor_link = "l6"\n', text))
    found = read_team(path)
    for before, after in zip(expected.recordings, found.recordings, strict=True):
        for name, track in before.tracks.items():
            for channel in ("rotation", "position", "force"):
                there = after.tracks[name].channels[channel]
                np.testing.assert_allclose(there, track.channels[channel], atol=1e-7, err_msg=f"{name} {channel}")
