"""Object folders: ours round trip, the published ones read with their truth, each wrong one has one clear error."""

# ruff: noqa: E501  (the full text of an error stands on one line)

from __future__ import annotations

import json
import pickle
import shutil
import zipfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from steelyard.api import identify
from steelyard.datasets.known_object import KnownObject
from steelyard.datasets.track import Track
from steelyard.errors import BadFile, BadValue
from steelyard.inertia import InertialParameters
from steelyard.io.object_folders import object_folders, read_object, read_track, write_object
from steelyard.io.ply_files import read_mesh, write_mesh
from steelyard.logs.log import MotionLog
from steelyard.shape.mesh import TriangleMesh
from steelyard.simulate.workshop import known_object
from steelyard.workshop.catalogue import build

PUBLISHED = (
    "allen-key", "c-clamp", "clamp", "electronic-caliper", "hammer", "measuring-tape", "pliers", "rubber-mallet", "ruler",
    "screwdriver",
)  # fmt: skip


@pytest.fixture(scope="module")
def known() -> KnownObject:
    return known_object(build("screwdriver"))


@pytest.fixture(scope="module")
def good(known: KnownObject, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("objects") / "screwdriver"
    write_object(known, folder)
    return folder


@pytest.fixture
def folder(good: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(good, tmp_path / "DIR"))


def predicted(track: Track, body: InertialParameters) -> np.ndarray:
    """The wrench [tau, f] that Newton and Euler ask for."""
    log = MotionLog(
        wrench=np.concatenate([track.torque, track.force], axis=1),
        gravity=track.gravity,
        acceleration=track.acceleration,
        angular_velocity=track.angular_velocity,
        angular_acceleration=track.angular_acceleration,
    )
    return log.predicted(body.vector) - log.wrench


def test_a_folder_comes_back_as_it_was(known: KnownObject, good: Path) -> None:
    again = read_object(good)
    assert sorted(path.name for path in good.iterdir()) == [
        "log.toml",
        "mesh.ply",
        "motion.npz",
        "points.npz",
        "truth.json",
    ]
    assert [path.name for path in good.parent.iterdir()] == [good.name]
    assert (again.name, again.part_names, again.part_materials) == (known.name, known.part_names, known.part_materials)
    for name in ("vertices", "triangles", "part", "rgb"):
        np.testing.assert_array_equal(getattr(again.mesh, name), getattr(known.mesh, name))
    for name in ("xyz", "rgb", "label"):
        np.testing.assert_array_equal(getattr(again.cloud, name), getattr(known.cloud, name))
    assert again.track is not None
    assert known.track is not None
    for name, values in known.track.columns().items():
        np.testing.assert_array_equal(again.track.columns()[name], values)
    np.testing.assert_allclose(again.truth.vector, known.truth.vector, rtol=1e-12, atol=1e-18)
    np.testing.assert_allclose(again.part_masses, known.part_masses, rtol=1e-14)
    np.testing.assert_array_equal(again.parts.moments, known.parts.moments)
    np.testing.assert_array_equal(again.X_SO.matrix(), known.X_SO.matrix())
    np.testing.assert_array_equal(again.box, known.box)


def test_the_motion_of_a_folder_obeys_newton_and_euler(good: Path) -> None:
    read = read_object(good)
    assert read.track is not None
    assert np.abs(predicted(read.track, read.truth)).max() < 1e-12
    up = read.track.rotation @ read.track.gravity[..., None]
    np.testing.assert_allclose(up[..., 0], np.tile([0, 0, -9.81], (len(read.track), 1)), atol=1e-12)


def test_a_folder_is_written_over_an_older_one(known: KnownObject, folder: Path) -> None:
    write_object(replace(known, name="other"), folder)
    assert json.loads((folder / "truth.json").read_text())["slug"] == "other"


def test_nothing_half_written_is_left(known: KnownObject, tmp_path: Path) -> None:
    (tmp_path / "taken").write_text("a file")
    with pytest.raises(BadFile, match=r"taken: cannot be written \(.*\)\.$"):
        write_object(known, tmp_path / "taken")
    with pytest.raises(BadValue) as caught:
        write_object(replace(known, track=None), tmp_path / "new")
    assert str(caught.value) == "screwdriver: an object folder needs a motion and the masses of all parts."
    assert [path.name for path in tmp_path.iterdir()] == ["taken"]


def test_without_motion_two_files_and_the_truth_do(folder: Path) -> None:
    (folder / "motion.npz").unlink()
    assert read_object(folder, motion=False).track is None


def test_folders_are_found_by_their_truth(good: Path, tmp_path: Path) -> None:
    assert object_folders(good) == [good]
    assert object_folders(good.parent) == [good]
    with pytest.raises(BadFile) as caught:
        object_folders(tmp_path)
    assert str(caught.value) == (
        f"{tmp_path}: no object folder is here. Each has the files mesh.ply, points.npz, motion.npz, truth.json."
    )


def test_a_part_without_points_is_a_finding(folder: Path) -> None:
    points = dict(np.load(folder / "points.npz"))
    points["label"] = np.zeros_like(points["label"])
    np.savez(folder / "points.npz", **points)
    (finding,) = read_object(folder).findings
    assert (finding.code, finding.message) == (
        "part-unseen", "No point of the cloud lies on part 1: it is hidden or too small to be seen.",
    )  # fmt: skip


def change_truth(key: str, value: object) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        truth = json.loads((folder / "truth.json").read_text())
        if value is None:
            del truth[key]
        else:
            truth[key] = value
        (folder / "truth.json").write_text(json.dumps(truth))

    return edit


def change_part(key: str, value: object) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        truth = json.loads((folder / "truth.json").read_text())
        truth["parts"][1][key] = value
        (folder / "truth.json").write_text(json.dumps(truth))

    return edit


def change_mesh(make: Callable[[TriangleMesh], TriangleMesh]) -> Callable[[Path], None]:
    return lambda folder: write_mesh(make(read_mesh(folder / "mesh.ply")), folder / "mesh.ply")


def change_array(name: str, key: str, value: object) -> Callable[[Path], None]:
    def edit(folder: Path) -> None:
        arrays = dict(np.load(folder / name))
        if value is None:
            del arrays[key]
        else:
            arrays[key] = np.asarray(value)
        np.savez(folder / name, **arrays)

    return edit


def stray(name: str, key: str) -> Callable[[Path], None]:
    """Put a text where the array `key` was."""

    def edit(folder: Path) -> None:
        change_array(name, key, None)(folder)
        with zipfile.ZipFile(folder / name, "a") as archive:
            archive.writestr(key, "read me")

    return edit


def pickled(folder: Path) -> None:
    np.savez(folder / "points.npz", xyz=np.array([Trap()], object), allow_pickle=True)


class Trap:
    """Fails the test when it is unpickled."""

    def __reduce__(self) -> tuple[Callable[[str], None], tuple[str]]:
        return pytest.fail, ("a pickle was opened",)


def open_part(mesh: TriangleMesh) -> TriangleMesh:
    keep = np.ones(len(mesh), bool)
    keep[np.flatnonzero(mesh.part == 1)[0]] = False
    return TriangleMesh(mesh.vertices, mesh.triangles[keep], mesh.part[keep])


def inside_out(mesh: TriangleMesh) -> TriangleMesh:
    turned = np.where((mesh.part == 1)[:, None], mesh.triangles[:, ::-1], mesh.triangles)
    return TriangleMesh(mesh.vertices, turned, mesh.part)


def overlapping(mesh: TriangleMesh) -> TriangleMesh:
    handle = mesh.of_part(1)
    shifted = handle.vertices + np.array([0, 0.004, 0])
    both = np.concatenate([handle.triangles, handle.triangles + len(handle.vertices)])
    return TriangleMesh(np.concatenate([handle.vertices, shifted]), both, np.repeat([0, 1], len(handle)))


FILES = "An object folder has the files mesh.ply, points.npz, motion.npz, truth.json."
KEYS = "mass_kg, com_mesh_m, inertia_com_mesh_kgm2, T_mesh_from_grasp, reference_extents_sensor_m"
BAD: dict[str, tuple[Callable[[Path], None], str]] = {
    "no mesh": (lambda d: (d / "mesh.ply").unlink(), f"DIR: mesh.ply is missing. {FILES}"),
    "no points": (lambda d: (d / "points.npz").unlink(), f"DIR: points.npz is missing. {FILES}"),
    "no motion": (lambda d: (d / "motion.npz").unlink(), f"DIR: motion.npz is missing. {FILES}"),
    "no truth": (lambda d: (d / "truth.json").unlink(), f"DIR: truth.json is missing. {FILES}"),
    "not json": (lambda d: (d / "truth.json").write_text("mass = 1") and None, f"DIR/truth.json: not the truth of an object: not valid JSON (Expecting value: line 1 column 1 (char 0)). It needs {KEYS}."),
    "json list": (lambda d: (d / "truth.json").write_text("[]") and None, f"DIR/truth.json: not the truth of an object: expected one JSON object. It needs {KEYS}."),
    "no mass": (change_truth("mass_kg", None), f'DIR/truth.json: "mass_kg" is missing. It needs {KEYS}.'),
    "mass in words": (change_truth("mass_kg", "heavy"), 'DIR/truth.json: "mass_kg" must be one finite number; found something else.'),
    "short com": (change_truth("com_mesh_m", [0, 1]), 'DIR/truth.json: "com_mesh_m" must be 3 finite numbers; found something else.'),
    "no rotation": (change_truth("T_mesh_from_grasp", (2 * np.eye(4) - np.diag([0, 0, 0, 1])).tolist()), "DIR/truth.json: rotation matrix must be orthonormal; it is off by 3 in R^T R (tolerance 1e-06)."),
    "parts in words": (change_truth("parts", "two"), 'DIR/truth.json: "parts" must be a list of objects, one per part with its "label".'),
    "parts of numbers": (change_truth("parts", [1, 2]), 'DIR/truth.json: "parts" must be a list of objects, one per part with its "label".'),
    "volume in words": (change_part("solid_volume_m3", "small"), "DIR/truth.json: \"solid_volume_m3\" of a part must be a finite number; got 'small'."),
    "mass of a part in words": (change_part("mass_kg", "light"), "DIR/truth.json: \"mass_kg\" of a part must be a finite number; got 'light'."),
    "list for a label": (change_part("label", [1]), 'DIR/truth.json: "label" of a part must be a finite number; got [1].'),
    "long number": (change_truth("mass_kg", 10**400), 'DIR/truth.json: "mass_kg" must be one finite number; found something else.'),
    "mass in quotes": (change_truth("mass_kg", "0.7"), 'DIR/truth.json: "mass_kg" must be one finite number; found something else.'),
    "text beside arrays": (stray("points.npz", "label"), 'DIR/points.npz: array "label" is missing. It needs xyz, rgb, label.'),
    "negative volume in truth": (change_part("solid_volume_m3", -1e-6), "DIR/truth.json: part 1 has a volume of -1e-06 m^3; it must be above zero."),
    "zero volume in truth": (change_part("solid_volume_m3", 0.0), "DIR/truth.json: part 1 has a volume of 0 m^3; it must be above zero."),
    "negative mass": (change_part("mass_kg", -0.1), "DIR/truth.json: the masses of parts must be finite and not below zero."),
    "mesh is text": (lambda d: (d / "mesh.ply").write_text("hello") and None, 'DIR/mesh.ply: expected a PLY file, which starts with "ply"; found something else.'),
    "open mesh": (change_mesh(open_part), "DIR/mesh.ply: part 1 is not closed: 3 edges lack a neighbour that runs the other way. Close the surface, weld equal vertices, and turn all triangles outward."),
    "inside out": (change_mesh(inside_out), "DIR/mesh.ply: part 1 has a volume of -1.27e-05 m^3, below zero, and lies in no other part. Turn its triangles outward."),
    "overlap": (change_mesh(overlapping), "DIR/mesh.ply: parts 0 and 1 share 7.4 cm^3 of space (58.4 % of the smaller, 29.2 % of the whole). Cut one out of the other, so that they only touch."),
    "points are no npz": (lambda d: (d / "points.npz").write_text("x y z") and None, "DIR/points.npz: expected an NPZ file (a zip of arrays); found something else. Save it with numpy.savez."),
    "pickle": (pickled, 'DIR/points.npz: array "xyz" holds pickled Python objects, which can run code when opened; it was not opened. Save it as plain numbers (float64).'),
    "no labels": (change_array("points.npz", "label", None), 'DIR/points.npz: array "label" is missing. It needs xyz, rgb, label.'),
    "few labels": (change_array("points.npz", "label", [0, 1]), "DIR/points.npz: a cloud of 2000 points needs labels of shape (2000,); got (2,)."),
    "strange label": (change_array("points.npz", "label", np.full(2000, 9)), "DIR/points.npz: points carry the label 9, and mesh.ply has no such part."),
    "words for labels": (change_array("points.npz", "label", np.full(2000, "a")), 'DIR/points.npz: array "label" must hold real numbers; it holds <U1.'),
    "no torque": (change_array("motion.npz", "torque_sensor", None), 'DIR/motion.npz: array "torque_sensor" is missing. It needs time, rotation_world_from_sensor, position_world, linear_velocity_sensor, angular_velocity_sensor, linear_acceleration_sensor, angular_acceleration_sensor, gravity_sensor, force_sensor, torque_sensor.'),
    "short force": (change_array("motion.npz", "force_sensor", np.zeros((5, 3))), "DIR/motion.npz: every column of a motion needs 1000 rows; force has 5."),
    "nan force": (change_array("motion.npz", "force_sensor", np.full((1000, 3), np.nan)), "DIR/motion.npz: force must be finite; 3000 entries are not, the first at index (0, 0)."),
}  # fmt: skip


@pytest.mark.parametrize("case", BAD)
def test_each_wrong_folder_has_one_clear_error(folder: Path, case: str) -> None:
    spoil, text = BAD[case]
    spoil(folder)
    with pytest.raises(BadFile) as caught:
        read_object(folder)
    assert str(caught.value).replace(str(folder), "DIR") == text


def test_the_trap_would_have_sprung() -> None:
    with pytest.raises(pytest.fail.Exception):
        pickle.loads(pickle.dumps(Trap()))


@pytest.mark.parametrize("name", PUBLISHED)
def test_published_objects_are_read_and_their_truth_closes(data_dir: Path, name: str) -> None:
    if not (data_dir / "workshop-tools" / name).is_dir():
        pytest.skip(f"workshop-tools/{name} is not here")
    read = read_object(data_dir / "workshop-tools" / name)
    assert read.part_masses is not None
    assert read.track is not None
    said = {row["label"]: row.get("solid_volume_m3") for row in read.facts["parts"] if row["kind"] == "solid"}
    assert read.parts.label.tolist() == list(said)
    np.testing.assert_allclose(read.parts.volume, list(said.values()), rtol=1e-5)
    whole, truth = read.parts_in_sensor.whole(read.part_masses), read.truth
    scale = np.diag(truth.inertia_com).mean()
    assert float(whole.mass) == pytest.approx(float(truth.mass), rel=3.3e-3)
    assert np.abs(whole.com - truth.com).max() < 0.29e-3
    assert np.abs(whole.inertia_com - truth.inertia_com).max() < 5.4e-3 * scale
    np.testing.assert_allclose(truth.vector, read.facts["phi_sensor"], rtol=1e-9, atol=1e-12)
    assert np.abs(predicted(read.track, truth)).max() < 1e-5
    assert read.half == (
        "uniform" if read.facts["uniform_density_reference"]["com_offset_from_truth_mm"] < 0.5 else "mixed"
    )


def test_the_published_clamp_has_a_void(data_dir: Path) -> None:
    if not (data_dir / "workshop-tools" / "clamp").is_dir():
        pytest.skip("workshop-tools/clamp is not here")
    read = read_object(data_dir / "workshop-tools" / "clamp")
    assert 1 not in read.parts.label
    assert [finding.code for finding in read.findings] == ["parts-overlap"]


def test_the_motion_is_read_alone_as_with_the_folder(good: Path) -> None:
    whole, alone = read_object(good).track, read_track(good / "motion.npz")
    assert whole is not None
    for name, column in alone.columns().items():
        np.testing.assert_array_equal(column, whole.columns()[name])


def test_a_folder_is_a_log_as_it_stands(good: Path, known: KnownObject) -> None:
    estimate = identify(good / "log.toml", parts=good / "mesh.ply")
    np.testing.assert_allclose(estimate.mass, known.truth.mass, rtol=1e-4)
    np.testing.assert_allclose(estimate.com, known.truth.com, atol=1e-5)
    inertia = known.truth.inertia_com
    np.testing.assert_allclose(estimate.parameters.inertia_com, inertia, atol=2e-3 * inertia.max())
    assert {part.label for part in estimate.parts} == set(known.parts.label.tolist())


def test_a_motion_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(BadFile) as caught:
        read_track(tmp_path / "motion.npz")
    assert str(caught.value) == f"{tmp_path}/motion.npz: cannot be read (No such file or directory)."
