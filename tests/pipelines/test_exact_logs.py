"""Logs without any noise, as simulators write them, are answered like others."""

from __future__ import annotations

from pathlib import Path

import pytest

import steelyard as sy
from steelyard.io.object_folders import write_object
from steelyard.simulate.workshop import known_object
from steelyard.workshop.catalogue import build


@pytest.mark.parametrize("name", ["screwdriver", "allen-key"])
def test_a_log_of_which_nothing_is_left_over_is_answered(name: str, tmp_path: Path) -> None:
    """Light tools: the residuals are rounding, which may be zero."""
    known = known_object(build(name), 0, "slow")
    write_object(known, tmp_path / name)
    found = sy.identify(tmp_path / name / "log.toml")
    assert found.mass == pytest.approx(float(known.truth.mass), rel=1e-5)
    assert found.com == pytest.approx(known.truth.com, abs=1e-5)
    assert not {"base-tilted", "channel-stuck"} & set(found.codes())
