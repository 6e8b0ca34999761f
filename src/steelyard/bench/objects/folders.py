"""The object folders that a bench is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from steelyard.bench.asked import require_known
from steelyard.io.object_folders import object_folders


def chosen_folders(data: Path | str, names: Sequence[str]) -> list[Path]:
    """Return the object folders in `data` called `names`, all where none is named; raises BadValue for others."""
    there = {folder.name: folder for folder in object_folders(data)}
    require_known("object", names, tuple(there))
    return [there[name] for name in names or there]
