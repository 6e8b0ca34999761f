"""What chance makes of white noise is no cause that a fit explains."""

from __future__ import annotations

import numpy as np

from steelyard.sanity.lasting import clear

SECONDS, RATE = 140, 20
AT = np.repeat(np.arange(SECONDS), RATE)


def explained(size: float, seed: int) -> float:
    """How clearly a column of random signs, of this size beside white noise of one, is explained by fitting it."""
    rng = np.random.default_rng(seed)
    column = rng.choice([-1.0, 1.0], SECONDS)[AT, None] * np.ones(6)
    plain = rng.normal(size=(len(AT), 6)) + size * column
    share = float((plain * column).sum() / (column**2).sum())
    return clear(plain, plain - share * column, AT)


def test_a_fit_to_white_noise_explains_nothing_clearly() -> None:
    assert max(explained(0.0, seed) for seed in range(40)) < 0.4


def test_a_small_cause_is_clear_though_nothing_but_white_noise_is_left() -> None:
    assert min(explained(0.08, seed) for seed in range(40)) > 0.5
