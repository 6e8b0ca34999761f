"""Bars that hold what a soft arm may do where a log does not show it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from sound_hammer import hammer_answer
from steelyard.identify.estimate import Estimate
from steelyard.sanity.fitted import yielding
from steelyard.sanity.fitted.yielding import USUAL, Softness, allow_softness

MOVED = np.array([0.0, 0, 0, 0, 2e-4, 0, 0, 1e-4, 0, 2e-4])


@pytest.fixture(scope="module")
def estimate() -> Estimate:
    return hammer_answer()


def widened(estimate: Estimate, found: Softness, monkeypatch: pytest.MonkeyPatch) -> np.ndarray:
    """Return how much variance (10,) is added for such a softness."""
    monkeypatch.setattr(yielding, "softness", lambda log: found)
    return np.diag(allow_softness(None, estimate).covariance - estimate.covariance)  # type: ignore[arg-type]


def test_a_softness_that_is_not_seen_counts_as_far_as_arms_have_it(
    estimate: Estimate, monkeypatch: pytest.MonkeyPatch
) -> None:
    loose = Softness(follows=1e-6, std=1.0, left=1.0, moved=MOVED)  # a log that tells nothing of it
    np.testing.assert_allclose(widened(estimate, loose, monkeypatch), (MOVED * USUAL / 1e-6) ** 2, rtol=1e-6)
    told = replace(loose, std=1e-7)  # and one that tells that there is next to none
    assert (widened(estimate, told, monkeypatch) <= 1.02 * MOVED**2).all()


def test_a_softness_that_is_seen_counts_whole_and_is_said(estimate: Estimate, monkeypatch: pytest.MonkeyPatch) -> None:
    seen = Softness(follows=-3e-4, std=1e-5, left=0.8, moved=MOVED)
    np.testing.assert_allclose(widened(estimate, seen, monkeypatch), MOVED**2, rtol=1e-9, atol=1e-20)
    assert "first mode near 9 Hz" in allow_softness(None, estimate).notes[-1]  # type: ignore[arg-type]


def test_a_log_that_shows_nothing_keeps_its_bars(estimate: Estimate, monkeypatch: pytest.MonkeyPatch) -> None:
    none = Softness(follows=0.0, std=0.0, left=1.0, moved=0 * MOVED)
    assert not widened(estimate, none, monkeypatch).any()
