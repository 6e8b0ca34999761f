"""A file that is missing is told with whole folders."""

from pathlib import Path

import pytest

from steelyard.errors import BadFile
from steelyard.io.tables.files import find_file


def test_the_folder_here_is_named_in_full(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.delenv("STEELYARD_DATA", raising=False)
    with pytest.raises(BadFile) as caught:
        find_file("boxx.csv", Path("."), None)
    assert f'"boxx.csv" was not found. Searched: {tmp_path}. ' in str(caught.value)
