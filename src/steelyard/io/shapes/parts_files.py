"""parts.npz: a solid of tetrahedra with the part of each cell and the tree its parts were cut from.

A file may come from a stranger: nothing is unpickled, sizes are bounded before anything is read, and what is written
twice (volumes, centroids) must agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from steelyard import check
from steelyard.check import Array, Integers
from steelyard.errors import BadFile, BadValue
from steelyard.io.contents import in_file
from steelyard.io.tables.array_table import npz, read_arrays
from steelyard.parts.hierarchy import Hierarchy
from steelyard.parts.parts import Parts
from steelyard.shape.tets import TetMesh
from steelyard.whole_files import write_bytes

MOST_BYTES = 512 * 1024**2
MOST_CELLS = 4_000_000
_LONGEST_M = 100.0
_LONGEST_NAME = 80
_AGREE = 1e-6
_SAME = 1e-4  # volumes of one part, computed twice
_TREE = ("merges", "cost", "piece")


@dataclass(frozen=True, eq=False)
class SavedParts:
    """A solid in P parts, in the object's frame O.

    solid   its T cells
    labels  (T,) part of each cell, 0..P-1, each used
    rgb     (P, 3) mean colours 0..255, None where they are not known
    tree    the tree that the parts were cut from, None where there is none
    names   (P,) what each part is called, empty where nothing says
    com_std, stretch, turn_std   how wrong the shape may be, as in `Parts`; 0 where nothing says
    """

    solid: TetMesh
    labels: Integers
    rgb: Array | None = None
    tree: Hierarchy | None = None
    names: tuple[str, ...] = ()
    com_std: float = 0.0
    stretch: float = 0.0
    turn_std: float = 0.0

    def __post_init__(self) -> None:
        labels = check.whole("labels", self.labels)
        if labels.shape != (len(self.solid),):
            raise BadValue(f"each of the {len(self.solid)} cells needs one label; got {labels.shape}.")
        used = np.unique(labels)
        if not np.array_equal(used, np.arange(len(used))):
            raise BadValue("labels must be 0, 1, 2 ... with at least one cell each; these leave numbers out.")
        object.__setattr__(self, "labels", labels)
        if self.rgb is not None:
            rgb = check.vectors("part colours", self.rgb)
            if rgb.shape != (self.count, 3) or rgb.min() < 0 or rgb.max() > 255:
                raise BadValue(f"{self.count} parts need one colour 0..255 each (P, 3); got shape {rgb.shape}.")
            object.__setattr__(self, "rgb", rgb)
        if self.names and len(self.names) != self.count:
            raise BadValue(f"{self.count} parts need one name each; got {len(self.names)}.")
        if self.tree is not None and len(self.tree.piece) != len(self.solid):
            raise BadValue(f"the tree is of {len(self.tree.piece)} cells, the solid has {len(self.solid)}.")

    @property
    def count(self) -> int:
        """Number P of parts."""
        return int(self.labels.max()) + 1

    @cached_property
    def parts(self) -> Parts:
        """The parts with their exact moments; raises BadValue where one has no volume."""
        moments = self.solid.moments(self.labels, self.count)
        unsure = (self.com_std, self.stretch, self.turn_std)
        return Parts(np.arange(self.count), moments, self.rgb, None, *unsure)

    def recut(self, volumes: Sequence[float]) -> SavedParts:
        """Return the solid in the parts of these volumes (K,) [m^3]: part k is the node of the tree with volume k.

        A log may choose another cut of the tree than shape and colour did; a result tells it by the volumes. Raises
        BadValue where no cut of this solid has them.
        """
        if np.shape(volumes) == (self.count,) and np.allclose(volumes, self.parts.volume, rtol=_SAME, atol=0):
            return self
        total = 1e6 * float(np.sum(volumes))
        other = BadValue(
            f"no cut of these parts has the {len(volumes)} volumes of the result, {total:.4g} cm^3 in all; the parts "
            f"have {1e6 * self.solid.volume:.4g} cm^3. Give the file that the result was made with."
        )
        if self.tree is None:
            raise other
        node = np.asarray(self.tree.of_cells(self.tree.piece, self.solid.volumes).volume)
        matching = [np.flatnonzero(np.isclose(node, volume, rtol=_SAME, atol=0)) for volume in volumes]
        if not all(len(found) for found in matching):
            raise other
        try:
            labels = self.tree.cut_at(int(found[0]) for found in matching)
        except BadValue:
            raise other from None
        largest_first = np.argsort(-np.bincount(labels, self.solid.volumes))
        number = np.empty(len(volumes), np.int64)
        number[largest_first] = np.argsort(-np.asarray(volumes), kind="stable")
        rgb = self._mean_colours(number[labels], len(volumes))
        return replace(self, labels=number[labels], rgb=rgb, names=())

    def _mean_colours(self, labels: Integers, count: int) -> Array | None:
        """Return the mean colours (K, 3) of other parts of the same solid."""
        if self.rgb is None:
            return None
        cells = self.rgb[self.labels] * self.solid.volumes[:, None]
        sums = [np.bincount(labels, column, count) for column in (*cells.T, self.solid.volumes)]
        return np.stack(sums[:3], axis=1) / sums[3][:, None]


def write_parts(saved: SavedParts, path: Path | str) -> None:
    """Write parts.npz; the file appears complete or not at all. Raises BadFile."""
    parts = saved.parts
    arrays: dict[str, Any] = {
        "vertices": saved.solid.vertices,
        "tets": saved.solid.tets.astype(np.int32),
        "labels": saved.labels.astype(np.int32),
        "volume_m3": parts.volume,
        "centroid_m": parts.centroid,
        "com_std_m": np.float64(saved.com_std),
        "stretch": np.float64(saved.stretch),
        "turn_std_rad": np.float64(saved.turn_std),
    }
    if saved.rgb is not None:
        arrays["rgb"] = saved.rgb
    if saved.names:
        arrays["names"] = np.array(saved.names)
    if saved.tree is not None:
        arrays |= {name: getattr(saved.tree, name) for name in _TREE}
    write_bytes(Path(path), npz(arrays))


def read_parts(path: Path | str) -> SavedParts:
    """Return the parts of a parts.npz; raises BadFile.

    `vertices`, `tets` and `labels` are needed; colours and tree may be missing. Volumes and centroids are computed
    anew, and those in the file must agree with them.
    """
    path = Path(path)
    arrays = _arrays(path)
    for name in ("vertices", "tets", "labels"):
        if name not in arrays:
            raise BadFile(
                f'{path}: array "{name}" is missing, so this is no file of parts. A cloud is given with --scan; '
                "parts are written by: steelyard segment CLOUD -o parts.npz."
            )
    if len(arrays["tets"]) > MOST_CELLS:
        raise BadFile(f"{path}: {len(arrays['tets'])} cells are more than the {MOST_CELLS} that can be handled.")
    return in_file(path, lambda: _saved(path, arrays))


def _saved(path: Path, arrays: dict[str, Any]) -> SavedParts:
    """Return the parts of these arrays; raises BadFile or BadValue."""
    solid = TetMesh(arrays["vertices"], arrays["tets"])
    if float(np.ptp(solid.vertices, axis=0).max()) > _LONGEST_M:
        raise BadValue(f"the solid is over {_LONGEST_M:g} m long. Vertices are in metres; are these millimetres?")
    tree = None
    if all(name in arrays for name in _TREE):
        tree = Hierarchy(arrays["piece"], arrays["merges"], arrays["cost"])
    names = tuple(str(name)[:_LONGEST_NAME] for name in _texts(path, arrays, len(solid)))
    unsure = (_number(path, arrays, name) for name in ("com_std_m", "stretch", "turn_std_rad"))
    saved = SavedParts(solid, arrays["labels"], arrays.get("rgb"), tree, names, *unsure)
    _agree(saved, arrays)
    return saved


def _arrays(path: Path) -> dict[str, Any]:
    """Return the arrays of numbers in the file, sizes bounded first."""
    found = read_arrays(path, most=MOST_BYTES)
    for name, array in found.items():
        kinds, wanted = ("U", "text") if name == "names" else ("fiub", "real numbers")
        if array.dtype.kind not in kinds:
            raise BadFile(f'{path}: array "{name}" must hold {wanted}; it holds {array.dtype}.')
    return found


def _texts(path: Path, arrays: dict[str, Array], cells: int) -> Array:
    """Return the names (P,), none where they are missing; each becomes a value, so they are counted first."""
    names = arrays.get("names", np.array([], "U1"))
    if names.size > cells:
        raise BadFile(f'{path}: array "names" holds {names.size} names for {cells} cells.')
    return names.ravel()


def _number(path: Path, arrays: dict[str, Array], name: str) -> float:
    """Return an array of one number; 0 where it is missing."""
    array = arrays.get(name, np.zeros(()))
    if array.size != 1:
        raise BadFile(f'{path}: array "{name}" must hold one number; it has the shape {array.shape}.')
    return float(array.ravel()[0])


def _agree(saved: SavedParts, arrays: dict[str, Array]) -> None:
    """Raise BadValue where volumes or centroids in the file are not those of the cells."""
    parts = saved.parts
    scale = float(np.ptp(saved.solid.vertices, axis=0).max())
    for name, own, size in (
        ("volume_m3", parts.volume, float(parts.volume.sum())),
        ("centroid_m", parts.centroid, scale),
    ):
        if name not in arrays:
            continue
        given = check.finite(name, arrays[name])
        if given.shape != own.shape or np.abs(given - own).max() > _AGREE * size:
            raise BadValue(f'"{name}" is not that of the cells and labels in the file. Save the file again.')
