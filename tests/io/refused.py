"""What a reader is told of a description that is refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from steelyard.errors import BadInput
from steelyard.io import read_recording


def message(path: Path, error: type[BadInput] = BadInput, data: Path | None = None) -> str:
    """Return the text of the error, with the folder written as DIR."""
    with pytest.raises(error) as caught:
        read_recording(path, data)
    return str(caught.value).replace(str(path.parent), "DIR")
