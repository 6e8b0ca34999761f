"""Object folders written: mesh.ply, points.npz, motion.npz, truth.json and log.toml, all or none."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.check import Array
from steelyard.datasets.known_object import KnownObject
from steelyard.errors import BadValue
from steelyard.inertia import InertialParameters
from steelyard.io.ply_files import write_mesh
from steelyard.io.recordings.recording_files import object_table
from steelyard.io.tables.array_table import npz
from steelyard.io.view_folders import write_views
from steelyard.logs.recording import KNOWN_PLACE
from steelyard.shape.views import Views
from steelyard.spatial import Pose
from steelyard.whole_files import whole_folder, write_bytes, write_text

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
        "parts": [_part(known, k) for k in range(len(known.parts))],
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


def _part(known: KnownObject, k: int) -> dict[str, Any]:
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
