"""Object folders: mesh.ply, points.npz, motion.npz and truth.json, as the published data set has them.

They are written with a log.toml, all or none.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.datasets.known_object import KnownObject, unseen_finding
from steelyard.datasets.track import MOTION, Track
from steelyard.errors import BadFile, BadValue
from steelyard.findings import Finding
from steelyard.inertia import InertialParameters
from steelyard.io.contents import Shape, array_of, in_file, load_json
from steelyard.io.entries import is_number
from steelyard.io.ply_files import read_mesh, write_mesh
from steelyard.io.recordings.recording_files import object_table
from steelyard.io.tables.array_table import ArrayTable, npz, read_numbers
from steelyard.io.view_folders import write_views
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.parts.from_mesh import parts_of_mesh
from steelyard.parts.parts import Parts
from steelyard.shape.cloud import Cloud
from steelyard.shape.mesh import TriangleMesh
from steelyard.shape.nesting import Solids, overlap_finding, solids_of
from steelyard.shape.views import Views
from steelyard.spatial import Pose
from steelyard.whole_files import whole_folder, write_bytes, write_text

FILES = ("mesh.ply", "points.npz", "motion.npz", "truth.json")
_PART_NUMBERS = ("solid_volume_m3", "mass_kg", "mass_fitted_kg")
# The published folders keep the physical wrench (gravity down) beside one in a world whose gravity points up.
_DOWN = {"gravity": "gravity_sensor_down", "force": "force_sensor_gdown", "torque": "torque_sensor_gdown"}

PARTS_NOTE = (
    "Exact integrals over the closed solids of the mesh; material, density and mass are the truth from which the whole "
    "is summed. The *_fitted keys repeat them under the names of the published set."
)
GRADED_NOTE = (
    " Where homogeneous is false the density changes within the part as grading says: density is its mean, and the "
    "whole is exact for the density as it is."
)
# A motion as a log, so that `steelyard identify log.toml --parts mesh.ply` runs as it stands.
_LOG = """[log]
gravity = [0, 0, -9.81]   # in the world frame W, m/s^2
wrench  = "on-object"     # {said}

[[stream]]
path = "{path}"
time = {{ columns = ["time"], unit = "s" }}
rotation = {{ columns = ["rotation_world_from_sensor"], form = "matrix" }}
position = {{ columns = ["position_world"], unit = "m" }}
force = {{ columns = ["force_sensor"], unit = "N" }}
torque = {{ columns = ["torque_sensor"], unit = "N*m" }}
"""
NOISELESS = "exact: no noise, no bias"


def object_folders(folder: Path | str) -> list[Path]:
    """Return the object folders in `folder` by name, or the folder itself if it is one; raises BadFile if none."""
    folder = Path(folder)
    if (folder / "truth.json").is_file():
        return [folder]
    found = sorted(path.parent for path in folder.glob("*/truth.json"))
    if not found:
        raise BadFile(f"{folder}: no object folder is here. Each has the files {', '.join(FILES)}.")
    return found


def read_object(folder: Path | str, *, motion: bool = True) -> KnownObject:
    """Read an object folder, ours or a published one; nothing in it is ever unpickled.

    motion  whether motion.npz is read too

    Of a published folder the physical wrench is taken (gravity down). Raises BadFile where a file is missing or
    wrong, a part is open, flat or inside out, or two parts share much volume.
    """
    folder = Path(folder)
    for name in FILES:
        if (motion or name != "motion.npz") and not (folder / name).is_file():
            raise BadFile(f"{folder}: {name} is missing. An object folder has the files {', '.join(FILES)}.")
    mesh = read_mesh(folder / "mesh.ply")
    facts = read_truth(folder / "truth.json")
    solids: Solids = in_file(folder / "mesh.ply", lambda: solids_of(mesh))
    parts: Parts = in_file(folder / "mesh.ply", lambda: parts_of_mesh(mesh, solids))
    overlapping: Finding | None = in_file(folder / "mesh.ply", lambda: overlap_finding(mesh, solids))
    cloud = _cloud(folder / "points.npz", mesh)
    truth, X_SO = truth_in_sensor(folder / "truth.json", facts)
    unseen = unseen_finding(parts, cloud)
    said = {row.get("label"): row for row in facts.get("parts", [])}
    rows = [said.get(label, {}) for label in parts.label.tolist()]
    names, gradings = (tuple(str(row.get(key, "")) for row in rows) for key in ("name", "grading"))
    return KnownObject(
        name=str(facts.get("slug", folder.resolve().name)),
        mesh=mesh,
        parts=parts,
        part_masses=_masses(folder / "truth.json", rows),
        part_materials=tuple(str(row.get("material_fitted") or "") for row in rows),
        truth=truth,
        X_SO=X_SO,
        cloud=cloud,
        box=np.asarray(facts["reference_extents_sensor_m"], float),
        track=read_track(folder / "motion.npz") if motion else None,
        part_names=names if all(names) else (),
        gradings=gradings if any(gradings) else (),
        facts=facts,
        findings=tuple(finding for finding in (overlapping, unseen) if finding),
    )


def read_truth(path: Path) -> dict[str, Any]:
    """Return truth.json with the entries every object needs; raises BadFile."""
    needed: dict[str, Shape] = {
        "mass_kg": (), "com_mesh_m": (3,), "inertia_com_mesh_kgm2": (3, 3), "T_mesh_from_grasp": (4, 4),
        "reference_extents_sensor_m": (3,),
    }  # fmt: skip
    facts = load_json(path, "the truth of an object", f"It needs {', '.join(needed)}.")
    for key, shape in needed.items():
        if key not in facts:
            raise BadFile(f'{path}: "{key}" is missing. It needs {", ".join(needed)}.')
        array_of(path, facts, key, shape)
    _require_parts(path, facts.get("parts", []))
    return facts


def _require_parts(path: Path, rows: Any) -> None:
    """Raise BadFile where the parts of truth.json are no list of objects with a label, masses and a volume."""
    if not isinstance(rows, list) or not all(isinstance(row, dict) for row in rows):
        raise BadFile(f'{path}: "parts" must be a list of objects, one per part with its "label".')
    for row in rows:
        for key in ("label", *_PART_NUMBERS):
            if row.get(key) is not None and not is_number(row[key]):
                raise BadFile(f'{path}: "{key}" of a part must be a finite number; got {row[key]!r}.')
        volume = row.get("solid_volume_m3")
        if volume is not None and volume <= 0:
            raise BadFile(f"{path}: part {row.get('label')} has a volume of {volume:g} m^3; it must be above zero.")


def truth_in_sensor(path: Path, facts: dict[str, Any]) -> tuple[InertialParameters, Pose]:
    """Return the true object in S and the pose X_SO of its mesh; raises BadFile where no rigid body is like that."""

    def made() -> tuple[InertialParameters, Pose]:
        X_SO = Pose.from_matrix(facts["T_mesh_from_grasp"]).inverse()
        whole = InertialParameters.from_com(facts["mass_kg"], facts["com_mesh_m"], facts["inertia_com_mesh_kgm2"])
        return whole.require_consistent().in_frame(X_SO), X_SO

    return in_file(path, made)


def _masses(path: Path, rows: list[dict[str, Any]]) -> Array | None:
    """Return the true mass (P,) of each part where all are known."""
    masses = [row.get("mass_kg", row.get("mass_fitted_kg")) for row in rows]
    if any(mass is None for mass in masses):
        return None
    values = np.asarray(masses, float)
    if not np.isfinite(values).all() or (values < 0).any():
        raise BadFile(f"{path}: the masses of parts must be finite and not below zero.")
    return values


def _cloud(path: Path, mesh: TriangleMesh) -> Cloud:
    """Return the points; every label must be one of the mesh."""
    arrays = read_numbers(path, ("xyz", "rgb", "label"))
    cloud: Cloud = in_file(path, lambda: Cloud(arrays["xyz"], arrays["rgb"], arrays["label"]))
    strange = np.setdiff1d(cloud.labels, mesh.labels)
    if len(strange):
        raise BadFile(f"{path}: points carry the label {strange[0]}, and mesh.ply has no such part.")
    return cloud


def read_track(path: Path | str) -> Track:
    """Read motion.npz: the exact motion with the physical wrench, where a published file holds two; raises BadFile."""
    path = Path(path)
    down = set(_DOWN.values()) <= set(ArrayTable.open(path).header.groups)
    names = {**MOTION, **(_DOWN if down else {})}
    arrays = read_numbers(path, tuple(names.values()))
    return in_file(path, lambda: Track(**{field: arrays[name] for field, name in names.items()}))


def write_object(
    known: KnownObject, folder: Path | str, sensed: Mapping[str, Array] | None = None, said: str = NOISELESS
) -> None:
    """Write an object folder; it appears complete or not at all. Raises BadFile.

    The wrench is the physical one (gravity down), what the sensor applies to the object. `log.toml` describes the
    motion as a log and says where the mesh sits in the sensor.

    sensed  columns of the log as sensors would show them, written beside the exact motion and described in its place;
            `said` tells in one line how they differ
    """
    folder = Path(folder)
    if known.track is None or known.part_masses is None:
        raise BadValue(f"{known.name}: an object folder needs a motion and the masses of all parts.")
    with whole_folder(folder) as new:
        write_mesh(known.mesh, new / "mesh.ply")
        cloud = known.cloud
        points = {"xyz": cloud.xyz, "rgb": cloud.rgb, "label": cloud.labels.astype(np.int32)}
        write_bytes(new / "points.npz", npz(points))
        write_bytes(new / "motion.npz", npz(known.track.columns()))
        write_text(new / "truth.json", json.dumps(truth_dict(known), indent=1) + "\n")
        if sensed is not None:
            write_bytes(new / "log.npz", npz(sensed))
        log = _LOG.format(path="motion.npz" if sensed is None else "log.npz", said=said)
        write_text(new / "log.toml", f"{log}\n{object_table(known.X_SO, KNOWN_PLACE)}")


def write_object_views(views: Views, X_SW: Pose, folder: Path | str) -> None:
    """Write posed RGB-D views of an object, and `object.toml`: where their world W sits in the sensor. Raises BadFile.

    `steelyard identify log.toml --scan FOLDER --pose-in-sensor FOLDER/object.toml` then runs as it stands.
    """
    write_views(views, folder, {"object.toml": object_table(X_SW, KNOWN_PLACE, of="the world of the views")})


def truth_dict(known: KnownObject) -> dict[str, Any]:
    """Return the truth of a known object under the keys of the published set, in SI units."""
    X_OS = known.X_SO.inverse()
    in_mesh = known.truth.in_frame(X_OS)
    return {
        "name": known.name.replace("-", " ").title(),
        "slug": known.name,
        "units": "SI (m, kg, kg m^2)",
        **_body(in_mesh),
        "inertia_convention": "tensor with off-diagonal = -integral(x_i x_j dm); about the COM, axes of the mesh frame",
        "T_mesh_from_grasp": X_OS.matrix().tolist(),
        "grasp_frame_note": "pose of the grasp frame G in the mesh frame, p_M = T_mesh_from_grasp @ p_G; S = G",
        "phi_sensor": known.truth.vector.tolist(),
        "phi_order": "m, m*cx, m*cy, m*cz, Ixx, Ixy, Ixz, Iyy, Iyz, Izz about the sensor origin, sensor axes (G = S)",
        "points_aabb_mesh_m": [known.cloud.xyz.min(0).tolist(), known.cloud.xyz.max(0).tolist()],
        "reference_extents_sensor_m": known.box.tolist(),
        "volume_cad_m3": float(known.parts.volume.sum()),
        "mesh_volume_signed_m3": float(known.parts.volume.sum()),
        "uniform_density_reference": _uniform(known, float(in_mesh.mass)),
        "wrench_note": "force_sensor, torque_sensor: sensor on object, gravity_sensor points down; no noise",
        "parts": [_true_part(known, k) for k in range(len(known.parts))],
        "parts_note": PARTS_NOTE + (GRADED_NOTE if any(known.gradings) else ""),
        "parts_fit_error": {"mass_percent": 0.0, "com_max_mm": 0.0, "inertia_max_percent_of_mean_diag": 0.0},
        "source": {"made_by": "steelyard workshop build"},
    }


def _body(body: InertialParameters) -> dict[str, Any]:
    return {
        "mass_kg": float(body.mass),
        "com_mesh_m": body.com.tolist(),
        "inertia_com_mesh_kgm2": body.inertia_com.tolist(),
    }


def _uniform(known: KnownObject, mass: float) -> dict[str, Any]:
    """Return the same shape with uniform density and the true mass."""
    moments = known.parts.moments.sum(0)
    body = _body(InertialParameters(mass / moments[0] * moments))
    del body["mass_kg"]
    return {**body, "com_offset_from_truth_mm": 1e3 * known.uniform_offset}


def _true_part(known: KnownObject, k: int) -> dict[str, Any]:
    """Return what is known of part number `k`."""
    parts, label = known.parts, int(known.parts.label[k])
    masses = known.part_masses if known.part_masses is not None else np.full(len(parts), np.nan)
    material, mass, volume = known.part_materials[k], float(masses[k]), float(parts.volume[k])
    return {
        "label": label,
        "name": known.part_names[k] if known.part_names else "",
        "n_points": int((known.cloud.labels == label).sum()),
        "mesh_volume_m3": volume,
        "centroid_mesh_m": parts.centroid[k].tolist(),
        "kind": "solid",
        "solid_volume_m3": volume,
        "solid_centroid_mesh_m": parts.centroid[k].tolist(),
        "material": material,
        "density_kg_m3": mass / volume,
        "mass_kg": mass,
        "material_fitted": material,
        "density_fitted_kg_m3": mass / volume,
        "mass_fitted_kg": mass,
        "material_alternatives_not_excluded": [],
        **({"homogeneous": not known.gradings[k], "grading": known.gradings[k]} if any(known.gradings) else {}),
    }
