"""How long PartMasses takes on object folders: from a log in memory, and from the files."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from steelyard.bench.objects.cases import exact_rows, load_case, noisy_rows
from steelyard.bench.timing import thread_ms
from steelyard.datasets.known_object import KnownObject
from steelyard.errors import BadValue
from steelyard.identify.estimate import Estimate
from steelyard.identify.part_masses import PartMasses
from steelyard.io.object_folders import read_object, read_track
from steelyard.parts.parts import Parts
from steelyard.simulate.handling import with_noise

NOISE = "high"
TIMING = (
    "CPU time of the calling thread [ms], warm, median of the repeats, one log at noise 'high': free_ms, averaged_ms = "
    "log in memory to Estimate with parts; log_file_ms = from the file: motion.npz read and checked, then Estimate, "
    "densities averaged, the parts in memory as a robot has them; read_ms = the whole folder read and checked (mesh "
    "closed, parts not overlapping, cloud, truth, motion), once per object; folder_ms = folder to Estimate. The files "
    "hold exact rows: their noise is drawn in between."
)


def timings(folders: Sequence[Path], repeats: int) -> dict[str, dict[str, float]]:
    """Return times [ms] per object folder."""
    return {folder.name: _times(folder, repeats) for folder in folders}


def _times(folder: Path, repeats: int) -> dict[str, float]:
    case = load_case(folder, "truth")
    if case is None:
        raise BadValue(f"{folder.name} has no parts to identify.")
    log = noisy_rows(case, NOISE, 0)
    free = partial(PartMasses(case.parts, bias="none", density="free").identify, log)
    averaged = partial(PartMasses(case.parts, bias="none").identify, log)
    return {
        "parts": len(case.parts),
        "free_ms": thread_ms(free, repeats),
        "averaged_ms": thread_ms(averaged, repeats),
        "log_file_ms": thread_ms(
            lambda: _from_rows(replace(case.known, track=read_track(folder / "motion.npz")), case.parts), repeats
        ),
        "read_ms": thread_ms(partial(read_object, folder), repeats),
        "folder_ms": thread_ms(partial(_from_folder, folder), repeats),
    }


def _from_folder(folder: Path) -> Estimate:
    known = read_object(folder)
    return _from_rows(known, known.parts_in_sensor)


def _from_rows(known: KnownObject, parts: Parts) -> Estimate:
    """Return the estimate from the object's rows; the files hold exact ones, and noise declared must be there."""
    log = with_noise(exact_rows(known), NOISE, np.random.default_rng(0))
    return PartMasses(parts, bias="none").identify(log)
