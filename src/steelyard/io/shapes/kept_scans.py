"""What a scan said, beside the points of the cloud that it wrote: bytes of JSON, and one byte for every cell.

A file may come from a stranger: sizes are bounded, findings have codes of ours, and no text steers a terminal.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np

from steelyard.errors import BadFile, BadValue
from steelyard.findings import REMEDIES, Finding
from steelyard.io.in_file import in_file
from steelyard.shape.known_space import Kept, KeptSpace

# Of a PLY elements, of an NPZ arrays.
SCAN, CELLS = "scan", "cell_emptied"
_MOST_BYTES, _LONGEST = 100_000, 4000
_NUMBERS = ("unseen", "unsure_m3", "skin")


def bytes_of(kept: Kept) -> Any:
    """Return what a scan said, but for its cells, as bytes of JSON (B,)."""
    said: dict[str, Any] = {name: getattr(kept.space, name) for name in _NUMBERS}
    said |= {"place_std": list(kept.place_std), "findings": [finding.plain() for finding in kept.findings]}
    return np.frombuffer(json.dumps(said).encode(), np.uint8)


def kept_of(path: Path, said: Any, fifths: Any) -> Kept | None:
    """Return what `bytes_of` and the bytes of cells (T,) keep, None where a file has neither; raises BadFile."""
    if said is None or fifths is None:
        return None
    for name, values in ((SCAN, said), (CELLS, fifths)):
        if values.dtype != np.uint8 or values.ndim != 1:
            raise BadFile(f'{path}: "{name}" must be bytes (N,), uint8; found {values.dtype}, shape {values.shape}.')
    if len(said) > _MOST_BYTES:
        raise BadFile(f'{path}: "{SCAN}" has {len(said)} bytes; what a scan says is shorter.')
    try:
        values = json.loads(said.tobytes())
        numbers = {name: float(values[name]) for name in _NUMBERS}
        shift, turn = map(float, values["place_std"])
        findings = tuple(_finding(each) for each in values["findings"])
    except (ValueError, TypeError, KeyError, OverflowError, RecursionError, BadValue) as error:
        raise BadFile(
            f'{path}: "{SCAN}" is not what `steelyard scan` writes ({error!r}). Scan the object again.'
        ) from None
    return in_file(path, lambda: Kept(findings, KeptSpace(**numbers, fifths=fifths), (shift, turn)))


def _finding(said: Any) -> Finding:
    code, message, remedy = (said[name] for name in ("code", "message", "remedy"))
    texts = (message, remedy)
    if code not in REMEDIES or not all(isinstance(t, str) and t.isprintable() and len(t) < _LONGEST for t in texts):
        raise BadValue(f'no finding of ours: "{str(code)[:80]}"')
    return Finding(code, message, remedy)
