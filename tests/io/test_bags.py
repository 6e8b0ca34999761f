"""Bags: the same log as a table and as a bag, poses out of transforms, and what a wrong bag is told."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from refused import message
from rosbags import rosbag1, rosbag2
from rosbags.rosbag2.enums import StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

import steelyard as sy
from steelyard.errors import BadInput, MissingDependency
from steelyard.io.log_files import read_recording
from steelyard.io.recordings.stream_files import open_table
from steelyard.spatial import Pose, Rotation

ROS1, ROS2 = get_typestore(Stores.ROS1_NOETIC), get_typestore(Stores.ROS2_HUMBLE)
WRENCH, POSE, TF = "geometry_msgs/msg/WrenchStamped", "geometry_msgs/msg/PoseStamped", "tf2_msgs/msg/TFMessage"
IMU = "sensor_msgs/msg/Imu"
START = 1_700_000_000_000_000_000  # ns since 1970
Message = tuple[str, str, int, Any]  # topic, type, time of receipt, message


class Maker:
    """Messages of one generation of ROS."""

    def __init__(self, store: Any) -> None:
        self.types = store.types
        self.ros1 = store is ROS1

    def header(self, stamp: int, frame: str) -> Any:
        time = self.types["builtin_interfaces/msg/Time"](stamp // 10**9, stamp % 10**9)
        return self.types["std_msgs/msg/Header"](*((0,) if self.ros1 else ()), time, frame)

    def vector(self, values: Sequence[float], kind: str = "Vector3") -> Any:
        return self.types[f"geometry_msgs/msg/{kind}"](*map(float, values))

    def quaternion(self, turn: Rotation) -> Any:
        return self.types["geometry_msgs/msg/Quaternion"](*np.roll(turn.quaternion_wxyz(), -1).tolist())

    def wrench(self, stamp: int, force: Sequence[float], torque: Sequence[float]) -> Any:
        both = self.types["geometry_msgs/msg/Wrench"](self.vector(force), self.vector(torque))
        return self.types["geometry_msgs/msg/WrenchStamped"](self.header(stamp, "ft"), both)

    def imu(self, stamp: int) -> Any:
        no, turn = np.zeros(9), self.quaternion(Rotation.identity())
        rate, felt = self.vector([0, 0, 0]), self.vector([0, 0, 9.81])
        return self.types[IMU](self.header(stamp, "imu"), turn, no, rate, no, felt, no)

    def pose(self, stamp: int, pose: Pose) -> Any:
        kind = self.types["geometry_msgs/msg/Pose"]
        place = kind(self.vector(pose.position, "Point"), self.quaternion(pose.rotation))
        return self.types["geometry_msgs/msg/PoseStamped"](self.header(stamp, "base"), place)

    def transforms(self, stamp: int, poses: dict[tuple[str, str], Pose], named: str = TF) -> Any:
        kind, transform = self.types["geometry_msgs/msg/TransformStamped"], self.types["geometry_msgs/msg/Transform"]
        each = [
            kind(self.header(stamp, parent), child, transform(self.vector(p.position), self.quaternion(p.rotation)))
            for (parent, child), p in poses.items()
        ]
        return self.types[named](each)


def write_bag(path: Path, messages: Sequence[Message], plugin: StoragePlugin = StoragePlugin.MCAP) -> Path:
    """Write a bag; `.bag` is one of ROS 1. Returns what to name in a description."""
    ros1 = path.suffix == ".bag"
    store = ROS1 if ros1 else ROS2
    encode = store.serialize_ros1 if ros1 else store.serialize_cdr
    writer: Any = rosbag1.Writer(path) if ros1 else rosbag2.Writer(path, version=8, storage_plugin=plugin)
    with writer:
        kinds = dict.fromkeys((topic, kind) for topic, kind, *_ in messages)
        connections = {each: writer.add_connection(*each, typestore=store) for each in kinds}
        for topic, kind, received, message in messages:
            writer.write(connections[topic, kind], received, encode(message, kind))
    return path


MASS, COM = 1.2, np.array([0.01, -0.02, 0.09])


def turns(count: int) -> Rotation:
    """Return the turns of the sensor: eight attitudes, each held for an eighth of the time, moved between evenly."""
    attitudes = np.random.default_rng(4).normal(size=(9, 3))
    at = np.linspace(0, 8, count)
    share = np.clip(at % 1 * 3 - 2, 0, 1)[:, None]
    stop = np.minimum(at.astype(int), 7)
    return Rotation.exp((1 - share) * attitudes[stop] + share * attitudes[stop + 1])


def log_of(maker: Maker, count: int = 1600) -> tuple[list[Message], np.ndarray, Rotation]:
    """Return messages of a wrench and a pose at 100 Hz, the wrench (N, 6) that they hold, and the turns."""
    R = turns(count)
    force = MASS * R.inverse().apply(np.tile([0, 0, 9.81], (count, 1)))
    wrench = -np.concatenate([force, np.cross(COM, force)], 1)
    wrench += np.random.default_rng(5).normal(size=wrench.shape) * np.repeat([0.05, 0.002], 3)
    stamps = START + 10_000_000 * np.arange(count)
    out: list[Message] = []
    for n, stamp in enumerate(map(int, stamps)):
        out.append(("/ft", WRENCH, stamp + 500_000, maker.wrench(stamp, wrench[n, :3], wrench[n, 3:])))
        out.append(("/pose", POSE, stamp + 500_000, maker.pose(stamp, Pose(R[n], np.array([0.4, 0.0, 0.3])))))
    return out, wrench, R


DESCRIPTION = """
[log]
gravity = [0, 0, -9.81]
wrench = "on-sensor"
[[stream]]
path = "PATH"
topic = "/ft"
force = { columns = ["wrench.force"], unit = "N" }
torque = { columns = ["wrench.torque"], unit = "N*m" }
[[stream]]
path = "PATH"
topic = "/pose"
rotation = { columns = ["pose.orientation"], form = "quaternion-xyzw" }
position = { columns = ["pose.position"], unit = "m" }
"""


def describe(folder: Path, name: str, text: str = DESCRIPTION) -> Path:
    path = folder / "log.toml"
    path.write_text(text.replace("PATH", name))
    return path


@pytest.mark.parametrize("kind", ["folder", "run.mcap", "run.db3", "run.bag"])
def test_a_bag_reads_as_what_was_recorded(tmp_path: Path, kind: str) -> None:
    store = ROS1 if kind == "run.bag" else ROS2
    messages, wrench, R = log_of(Maker(store), 200)
    plugin = StoragePlugin.SQLITE3 if kind == "run.db3" else StoragePlugin.MCAP
    write_bag(tmp_path / ("run.bag" if kind == "run.bag" else "run"), messages, plugin)
    name = {"folder": "run", "run.bag": "run.bag"}.get(kind, f"run/{kind}")
    felt, seen = read_recording(describe(tmp_path, name)).streams
    assert (felt.name, seen.name) == (f"{name}:/ft", f"{name}:/pose")
    np.testing.assert_array_equal(felt.channels["force"], wrench[:, :3])
    np.testing.assert_array_equal(felt.channels["torque"], wrench[:, 3:])
    np.testing.assert_allclose(seen.channels["rotation"].reshape(-1, 3, 3), R.matrix, atol=1e-12)
    np.testing.assert_allclose(felt.time, 0.01 * np.arange(200), atol=1e-12)  # stamps, not times of receipt


def test_the_mass_of_a_bag(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2))[0])
    estimate = sy.identify(describe(tmp_path, "run"))
    assert abs(estimate.mass - MASS) < 4 * estimate.std[0]
    assert estimate.std[0] < 0.005


def test_a_pose_out_of_transforms(tmp_path: Path) -> None:
    """base -> arm moves, arm -> wrist at another rate, wrist -> tool is fixed, and so is world -> base."""
    maker = Maker(ROS2)
    fixed = Pose(Rotation.exp([0.1, 0.2, -0.3]), np.array([0.0, 0.0, 0.1]))
    world = Pose(Rotation.exp([0.0, 0.0, 1.0]), np.array([1.0, 2.0, 0.0]))
    shoulder = [Pose(Rotation.exp([0.0, 0.01 * n, 0.0]), np.array([0.0, 0.001 * n, 0.5])) for n in range(100)]
    wrist = [Pose(Rotation.exp([0.0, 0.0, 0.04 * n]), np.array([0.3, 0.0, 0.004 * n])) for n in range(25)]
    out: list[Message] = [
        ("/tf_static", TF, START, maker.transforms(0, {("wrist", "tool"): fixed, ("world", "base"): world}))
    ]
    for n in range(100):
        stamp = START + n * 10_000_000
        out.append(("/tf", TF, stamp, maker.transforms(stamp, {("base", "arm"): shoulder[n]})))
        if n % 4 == 0:
            out.append(("/tf", TF, stamp, maker.transforms(stamp, {("arm", "wrist"): wrist[n // 4]})))
    write_bag(tmp_path / "run", out)
    between = [Pose(Rotation.exp([0.0, 0.0, 0.01 * n]), np.array([0.3, 0.0, 0.001 * n])) for n in range(97)]
    for frames, expected in (
        (("base", "tool"), [shoulder[n] @ between[n] @ fixed for n in range(97)]),
        (("world", "tool"), [world @ shoulder[n] @ between[n] @ fixed for n in range(97)]),
        (("tool", "base"), [(shoulder[n] @ between[n] @ fixed).inverse() for n in range(97)]),
        (("arm", "tool"), [between[4 * n] @ fixed for n in range(25)]),
    ):
        text = f'topic = "/tf"\nframes = ["{frames[0]}", "{frames[1]}"]\n'
        table = _table(tmp_path / "run", frames)
        values = table.read(range(8), (0,))
        assert table.header.groups == {"position": (1, 2, 3), "rotation": (4, 5, 6, 7)}, text
        found = Pose(
            Rotation.from_quaternion_xyzw(np.stack([values[n] for n in range(4, 8)], 1)),
            np.stack([values[n] for n in range(1, 4)], 1),
        )
        np.testing.assert_allclose(found.matrix(), [p.matrix() for p in expected], atol=1e-9, err_msg=str(frames))
        assert values[0][0] == START


@pytest.mark.parametrize("moves", [True, False])
def test_where_a_slower_transform_was_lost_in_motion_there_is_no_pose(tmp_path: Path, moves: bool) -> None:
    maker = Maker(ROS2)
    out: list[Message] = []
    for n in range(400):  # base -> arm at 100 Hz, arm -> wrist at 50 Hz but for 2 s
        stamp = START + n * 10_000_000
        out.append(("/tf", TF, stamp, maker.transforms(stamp, {("base", "arm"): Pose.identity()})))
        if n % 2 == 0 and not 100 < n < 300:
            turn = Rotation.exp([0.0, 0.0, 0.01 * (n if moves else min(n, 100) + max(n - 300, 0))])
            told = {("arm", "wrist"): Pose(turn, np.zeros(3))}
            out.append(("/tf", TF, stamp, maker.transforms(stamp, told)))
    write_bag(tmp_path / "run", out)
    stamps = (_table(tmp_path / "run", ("base", "wrist")).read([0], (0,))[0] - START) // 10_000_000
    assert stamps.tolist() == ([*range(100), *range(300, 399)] if moves else [*range(399)])


def _table(path: Path, frames: tuple[str, str]) -> Any:
    return open_table(path, "/tf", frames)


def joints(stamp: int, names: Sequence[str], numbers: Sequence[float]) -> Message:
    kind, own = "sensor_msgs/msg/JointState", Maker(ROS2).header(stamp, "")
    values = np.array(numbers, np.float64)
    return "/joints", kind, START + stamp, ROS2.types[kind](own, list(names), values, np.zeros(0), -values)


def test_lists_are_called_by_the_names_that_messages_give(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", [joints(n, ("a", "b"), (n, 2 * n)) for n in range(1, 4)])
    table = open_table(tmp_path / "run", "/joints")
    names = table.header.names or ()
    assert names == ("stamp", "received", "position[a]", "position[b]", "effort[a]", "effort[b]")
    assert table.header.groups == {"position": (2, 3), "effort": (4, 5)}
    read = table.read([0, 1, 3, 4], (0, 1))
    assert [read[n].tolist() for n in (0, 1)] == [[1, 2, 3], [START + n for n in (1, 2, 3)]]
    assert [read[n].tolist() for n in (3, 4)] == [[2, 4, 6], [-1, -2, -3]]


def test_publishers_take_turns_on_a_topic(tmp_path: Path) -> None:
    """A gripper between messages of the arm, names in another order, and nothing at first."""
    out = [joints(1, (), ()), joints(2, ("a", "b"), (1, 2)), joints(3, ("grip",), (9,)), joints(4, ("b", "a"), (4, 3))]
    write_bag(tmp_path / "run", out)
    table = open_table(tmp_path / "run", "/joints")
    place = {name: n for n, name in enumerate(table.header.names or ())}
    read = table.read([0, place["position[a]"], place["position[b]"]], (0,))
    assert [column.tolist() for column in read.values()] == [[2, 4], [1, 3], [2, 4]]
    assert table.read([place["position[grip]"]])[place["position[grip]"]].tolist() == [9]


def test_a_state_without_its_numbers_is_passed_over(tmp_path: Path) -> None:
    write_bag(
        tmp_path / "run", [joints(1, ("a", "b"), (1, 2)), joints(2, ("a", "b"), ()), joints(3, ("a", "b"), (3, 4))]
    )
    table = open_table(tmp_path / "run", "/joints")
    assert [column.tolist() for column in table.read([0, 2, 3], (0,)).values()] == [[1, 3], [1, 3], [2, 4]]


def test_lists_of_unlike_lengths_are_named(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", [joints(1, (), (1, 2)), joints(2, (), (1, 2, 3))])
    with pytest.raises(BadInput, match='message 2 of topic "/joints" lists 3 numbers in "position", others 2'):
        open_table(tmp_path / "run", "/joints").read([0, 2], (0,))


def test_a_topic_is_bounded_by_its_messages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    write_bag(tmp_path / "run", [joints(n, ("a", "b"), (1, 2)) for n in range(1, 100)])
    monkeypatch.setattr("steelyard.io.contents.MOST_BYTES", 1000)
    with pytest.raises(BadInput, match="Give fewer rows"):
        open_table(tmp_path / "run", "/joints").read([0, 2], (0,))


def test_without_stamps_the_time_of_receipt_counts(tmp_path: Path) -> None:
    maker = Maker(ROS2)
    out: list[Message] = [("/ft", WRENCH, START + n, maker.wrench(0, (n, 0, 0), (0, 0, 0))) for n in range(3)]
    out += [
        ("/tf", TF, START + n, maker.transforms(0, {("base", "tool"): Pose(Rotation.identity(), np.full(3, n))}))
        for n in range(3)
    ]
    write_bag(tmp_path / "run", out)
    for table in (open_table(tmp_path / "run", "/ft"), _table(tmp_path / "run", ("base", "tool"))):
        assert table.read([0], (0,))[0].tolist() == [START, START + 1, START + 2]


def test_a_stamp_of_zero_among_others_is_one(tmp_path: Path) -> None:
    out: list[Message] = [("/ft", WRENCH, START + n, Maker(ROS2).wrench(n, (n, 0, 0), (0, 0, 0))) for n in range(3)]
    write_bag(tmp_path / "run", out)
    assert open_table(tmp_path / "run", "/ft").read([0], (0,))[0].tolist() == [0, 1, 2]


@pytest.mark.parametrize("kind", ["tf2_msgs/msg/TFMessage", "tf/msg/tfMessage"])
def test_transforms_of_ros_1(tmp_path: Path, kind: str) -> None:
    if kind not in ROS1.fielddefs:
        ROS1.register(get_types_from_msg("geometry_msgs/TransformStamped[] transforms", kind))
    out: list[Message] = []
    for n in range(3):
        pose = Pose(Rotation.exp([0.0, 0.0, 0.1 * n]), np.array([0.0, 0.0, n]))
        told = Maker(ROS1).transforms(START + n, {("/base", "/tool"): pose}, kind)
        out.append(("/tf", kind, START + n, told))
    write_bag(tmp_path / "run.bag", out)
    assert _table(tmp_path / "run.bag", ("base", "tool")).read([3])[3].tolist() == [0, 1, 2]
    assert 'topic    = "/tf"\nframes   = ["base_link", "tool0"]' in message(tmp_path / "run.bag")


def test_frames_beside_the_way_do_not_matter(tmp_path: Path) -> None:
    """A camera with two parents, and the fixed copy of a frame that moves."""
    maker = Maker(ROS2)
    bad = Pose(Rotation.identity(), np.array([9.0, 9.0, 9.0]))
    out: list[Message] = [("/tf_static", TF, START, maker.transforms(0, {("base", "tool"): bad}))]
    for n in range(3):
        pose = Pose(Rotation.identity(), np.array([0.0, 0.0, n]))
        told = {("base", "tool"): pose, ("tool", "camera"): bad, ("base", "camera"): bad}
        out.append(("/tf", TF, START + n, maker.transforms(START + n, told)))
    write_bag(tmp_path / "run", out)
    assert _table(tmp_path / "run", ("base", "tool")).read([3])[3].tolist() == [0, 1, 2]
    with pytest.raises(BadInput, match='frame "camera" has two parents, "tool" and "base"'):
        _table(tmp_path / "run", ("base", "camera")).read([3])


def test_of_fixed_transforms_the_last_counts_and_of_moving_ones_the_most_frequent(tmp_path: Path) -> None:
    """A calibration is sent again; the arm turns at a quarter of the rate of its tool."""
    maker, still = Maker(ROS2), Rotation.identity()
    out: list[Message] = []
    for height in (1.0, 2.0):
        told = {("wrist", "tool"): Pose(still, np.array([0.0, 0.0, height]))}
        out.append(("/robot/tf_static", TF, START, maker.transforms(START + int(height), told)))
    for n in range(41):
        told = {("arm", "wrist"): Pose(still, np.array([n, 0.0, 0.0]))}
        out.append(("/robot/tf", TF, START + n, maker.transforms(START + n, told)))
        if n % 4 == 0:
            told = {("base", "arm"): Pose(still, np.array([0.0, n, 0.0]))}
            out.append(("/robot/tf", TF, START + n, maker.transforms(START + n, told)))
    out.append(("/tf_static", TF, START, maker.transforms(START, {("base", "shelf"): Pose.identity()})))
    write_bag(tmp_path / "run", out)
    read = open_table(tmp_path / "run", "/robot/tf", ("base", "tool")).read(range(4))
    np.testing.assert_allclose(np.stack([read[n] for n in (1, 2, 3)], 1), [[n, n, 2.0] for n in range(41)], atol=1e-12)


def test_transforms_that_hold_no_motion(tmp_path: Path) -> None:
    maker, here = Maker(ROS2), Pose.identity()
    out: list[Message] = [("/tf_static", TF, START, maker.transforms(START, {("base", "tool"): here}))]
    for n in range(3):
        out.append(("/tf", TF, START + n, maker.transforms(START + n, {("base", "arm"): here})))
        out.append(("/tf", TF, START + n, maker.transforms(START + 10 + n, {("arm", "hand"): here})))
    write_bag(tmp_path / "run", out)
    with pytest.raises(BadInput, match='"tool" does not move in "base": all transforms between them are fixed'):
        _table(tmp_path / "run", ("base", "tool")).read([3])
    with pytest.raises(BadInput, match='transforms between "base" and "hand" have no time in common'):
        _table(tmp_path / "run", ("base", "hand")).read([3])


@pytest.mark.parametrize("bad", [1, 5])
def test_a_transform_without_a_turn_costs_itself_alone(tmp_path: Path, bad: int) -> None:
    maker, out = Maker(ROS2), []
    for n in range(20):
        told = maker.transforms(START + n, {("base", "tool"): Pose(Rotation.identity(), np.array([0.0, 0.0, n]))})
        if n in range(3, 3 + bad):
            told.transforms[0].transform.rotation = maker.types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 0.0)
        out.append(("/tf", TF, START + n, told))
    write_bag(tmp_path / "run", out)
    table = _table(tmp_path / "run", ("base", "tool"))
    if bad == 1:
        assert table.read([3])[3].tolist() == [0, 1, 2, *range(4, 20)]
    else:
        with pytest.raises(BadInput, match='transforms of "tool" in "base": the quaternion has norm zero'):
            table.read([3])


def test_a_folder_without_its_metadata(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2), 20)[0])
    (tmp_path / "run" / "metadata.yaml").unlink()
    said = "DIR/run: the folder of a bag, without its metadata.yaml. Name the file in it: run.mcap"
    assert message(describe(tmp_path, "run")) == said


def test_the_example_of_a_bag_with_joints_alone(tmp_path: Path) -> None:
    out = [m for m in log_of(Maker(ROS2), 20)[0] if m[0] == "/ft"]
    write_bag(tmp_path / "run", [*out, joints(1, ("a",), (1,))])
    said = message(tmp_path / "run")
    assert 'topic    = "/joints"\njoint_position = { columns = ["position"], unit = "rad" }\n' in said
    assert said.endswith('[robot]\nurdf        = "arm.urdf"   # put the file of your arm here\nsensor_link = "ft"\n')


LIST = "std_msgs/msg/Float64MultiArray"


def listed(topic: str, rows: np.ndarray) -> list[Message]:
    """Return messages that hold the rows as bare lists."""
    layout = ROS2.types["std_msgs/msg/MultiArrayLayout"]([], 0)
    return [(topic, LIST, START + 10_000_000 * n, ROS2.types[LIST](layout, row)) for n, row in enumerate(rows)]


@pytest.mark.parametrize("form", ["columns", "rows", "quaternion-xyzw"])
def test_a_bag_of_bare_lists_is_told_what_they_look_like(tmp_path: Path, form: str) -> None:
    _, wrench, R = log_of(Maker(ROS2), 1600)
    place = np.tile([0.4, 0.0, 0.3], (1600, 1))
    poses = np.tile(np.eye(4), (1600, 1, 1))
    poses[:, :3, :3], poses[:, :3, 3] = R.matrix, place
    held = {
        "columns": poses.transpose(0, 2, 1).reshape(-1, 16),
        "rows": poses.reshape(-1, 16),
        "quaternion-xyzw": np.concatenate([place, np.roll(R.quaternion_wxyz(), -1, -1)], 1),
    }[form]
    joints = np.zeros((1600, 7))
    messages = [*listed("/a/joints", joints[:, :6]), *listed("/b/joints", joints), *listed("/ee", held)]
    write_bag(tmp_path / "run", [*messages, *listed("/F_ext", wrench)])
    said = message(tmp_path / "run")
    (tmp_path / "log.toml").write_text(said[said.index("[log]") :])
    assert sy.identify(tmp_path / "log.toml").mass == pytest.approx(MASS, rel=2e-3)


def test_a_bag_with_nothing_of_use_is_told_where_to_put_what(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", listed("/joints", np.zeros((20, 7))))
    said = message(tmp_path / "run")
    assert 'topic    = "/wrench"   # put your topic here\n' in said
    assert 'topic    = "/tf"   # put your topic here\n' in said
    wrong = DESCRIPTION.replace("/ft", "/joints").replace("/pose", "/joints")
    assert "data[0..6], stamp, received." in message(describe(tmp_path, "run", wrong))


STREAM = 'log.toml, [[stream]] 1 ("run")'
TOPICS = "Topics here: /ft (20 WrenchStamped), /pose (20 PoseStamped)."
EXAMPLE = """\
[log]
# gravity = [0, 0, -9.81]    # that of your place, in the world frame W, m/s^2; else bars hold 0.15 % for it
wrench  = "on-sensor"        # or "on-object": what the robot applies to the object

[[stream]]
path     = "run"
topic    = "/ft"
force    = { columns = ["wrench.force"], unit = "N" }
torque   = { columns = ["wrench.torque"], unit = "N*m" }

[[stream]]
path     = "run"
topic    = "/pose"
rotation = { columns = ["pose.orientation"], form = "quaternion-xyzw" }   # S to W
position = { columns = ["pose.position"], unit = "m" }
"""
# What is wrong -> text of the description that is swapped, and all that is said of it.
WRONG = {
    "other topic": ('"/ft"', '"/fts"', f'DIR/run: there is no topic "/fts". Did you mean "/ft"? {TOPICS}'),
    "no topic": (
        'topic = "/ft"\n',
        "",
        f"DIR/run: a bag needs a description that says which topic is what. {TOPICS} "
        f"Write one beside the bag, for example:\n{EXAMPLE}",
    ),
    "other field": (
        '"wrench.force"',
        '"force"',
        f'{STREAM}, force: there is no column "force". Columns here: wrench.force, wrench.torque, stamp, received.',
    ),
    "frames of a wrench": (
        'topic = "/ft"',
        'topic = "/ft"\nframes = ["a", "b"]',
        'DIR/run: "frames" belongs to transforms; topic "/ft" holds geometry_msgs/msg/WrenchStamped.',
    ),
    "one frame": (
        'topic = "/ft"',
        'topic = "/ft"\nframes = ["a"]',
        f'{STREAM}: "frames" must name two frames, such as ["base_link", "tool0"]; got [\'a\'].',
    ),
    "frames of nothing": (
        'topic = "/ft"',
        'frames = ["a", "b"]',
        f'{STREAM}: "frames" belongs to a topic of transforms: topic = "/tf".',
    ),
}


@pytest.mark.parametrize(("old", "new", "said"), WRONG.values(), ids=WRONG.keys())
def test_wrong_descriptions(tmp_path: Path, old: str, new: str, said: str) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2), 20)[0])
    assert old in DESCRIPTION
    assert message(describe(tmp_path, "run", DESCRIPTION.replace(old, new, 1))) == said


def test_a_bare_bag_is_told_its_description(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2), 20)[0])
    assert message(tmp_path / "run").endswith(EXAMPLE)
    (tmp_path / "log.toml").write_text(EXAMPLE)
    assert len(read_recording(tmp_path / "log.toml").streams) == 2


def test_garbage_is_no_bag(tmp_path: Path) -> None:
    for name in ("run.mcap", "run.db3", "run.bag"):
        (tmp_path / name).write_bytes(b"\x89MCAP0\r\n" + bytes(99))
        said = message(describe(tmp_path, name))
        assert said.startswith(f"DIR/{name}: cannot be read as a bag (")
        assert "). What a recorder that was killed leaves, `ros2 bag reindex`, " in said


def test_a_bag_that_ends_early_is_named(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2), 400)[0])
    whole = (tmp_path / "run" / "run.mcap").read_bytes()
    (tmp_path / "cut.mcap").write_bytes(whole[: len(whole) // 2])
    said = message(describe(tmp_path, "cut.mcap"))
    assert said.startswith("DIR/cut.mcap: ")


def test_files_packed_as_a_whole_are_not_unpacked(tmp_path: Path) -> None:
    write_bag(tmp_path / "run", log_of(Maker(ROS2), 20)[0])
    metadata = tmp_path / "run" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("compression_mode: ''", "compression_mode: FILE"))
    assert message(describe(tmp_path, "run")).startswith("DIR/run: the files of this bag are packed as a whole.")


def test_frames_that_nothing_ties(tmp_path: Path) -> None:
    maker = Maker(ROS2)
    out: list[Message] = [("/tf", TF, START, maker.transforms(START, {("base", "arm"): Pose.identity()}))]
    write_bag(tmp_path / "run", out)
    text = DESCRIPTION.replace('topic = "/pose"', 'topic = "/tf"\nframes = ["base", "tool"]').replace("/ft", "/tf")
    with pytest.raises(BadInput) as error:
        _table(tmp_path / "run", ("base", "tool")).read([0])
    assert str(error.value).endswith('no transforms lead from "base" to "tool". Frames here: arm, base.'), text


@pytest.mark.parametrize(
    ("links", "base"),
    [
        ({("base", "ft"): Pose.identity()}, "base"),
        ({("arm", "ft"): Pose.identity(), ("panda_link0", "arm"): Pose.identity()}, "panda_link0"),
        ({("base_link", "ft"): Pose.identity(), ("map", "base_link"): Pose.identity()}, "base_link"),
        ({("base", "camera"): Pose.identity()}, "base_link"),
        ({("ft", "hand"): Pose.identity(), ("hand", "ft"): Pose.identity()}, "hand"),
    ],
)
def test_a_bare_bag_names_the_frame_of_its_wrench_and_of_the_base(
    tmp_path: Path, links: dict[tuple[str, str], Pose], base: str
) -> None:
    maker = Maker(ROS2)
    out = [m for m in log_of(maker, 20)[0] if m[0] == "/ft"]
    out.append(("/tf", TF, START, maker.transforms(START, links)))
    write_bag(tmp_path / "run", out)
    assert f'frames   = ["{base}", "ft"]   # the sensor in the base' in message(tmp_path / "run")


def test_a_bare_bag_says_where_its_wrench_is_in_the_axes_of_the_base(tmp_path: Path) -> None:
    """As franka_ros2 gives external_wrench_in_base_frame; the sensor is then another frame."""
    maker = Maker(ROS2)
    out = [m for m in log_of(maker, 20)[0] if m[0] == "/ft"]
    out.append(("/tf", TF, START, maker.transforms(START, {("ft", "hand"): Pose.identity()})))
    write_bag(tmp_path / "run", out)
    said = message(tmp_path / "run")
    assert 'force    = { columns = ["wrench.force"], unit = "N", frame = "W" }   # in the base\'s axes' in said
    assert 'frames   = ["ft", "tool0"]   # the sensor in the base: check both' in said


def test_bags_without_rosbags(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(__import__("sys").modules, "rosbags.rosbag1", None)
    (tmp_path / "run.mcap").write_bytes(b"\x89MCAP0\r\n")
    with pytest.raises(MissingDependency) as error:
        read_recording(describe(tmp_path, "run.mcap"))
    assert (
        str(error.value) == "Reading bags needs the package 'rosbags'. Install it with: pip install 'steelyard[bags]'"
    )


def test_messages_of_another_type_are_not_read(tmp_path: Path) -> None:
    """What a bag itself says of its types would be compiled."""
    maker = Maker(ROS2)
    write_bag(tmp_path / "run", [("/s", "std_msgs/msg/Float64", START, maker.types["std_msgs/msg/Float64"](1.0))])
    metadata = tmp_path / "run" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("std_msgs/msg/Float64", "own_msgs/msg/Strange"))
    text = DESCRIPTION.replace("/ft", "/s")
    assert 'topic "/s" holds own_msgs/msg/Strange, a type of message that is not read.' in message(
        describe(tmp_path, "run", text)
    )


def test_a_bare_bag_with_an_accelerometer_alone_is_read_by_it(tmp_path: Path) -> None:
    maker = Maker(ROS2)
    out = [m for m in log_of(maker, 20)[0] if m[0] == "/ft"]
    out += [("/imu", IMU, stamp, maker.imu(stamp)) for _, _, stamp, _ in out]
    write_bag(tmp_path / "run", out)
    said = message(tmp_path / "run")
    assert 'topic    = "/imu"\nspecific_force = { columns = ["linear_acceleration"], unit = "m/s^2" }' in said
    assert "/tf" not in said
