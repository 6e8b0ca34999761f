"""Axes and directions as findings tell them: no minus before a zero."""

from __future__ import annotations

import numpy as np

from steelyard.sanity.words import axis_words, direction_words


def test_what_rounds_to_zero_has_no_sign() -> None:
    assert axis_words(np.array([-0.004, 1.0, -0.0])) == "0.00, 1.00, 0.00"
    assert axis_words(np.array([0.004, -1.0, 0.006])) == "0.00, 1.00, -0.01"
    assert direction_words(np.array([-0.0004, 0.0, -2.0])) == "0.000, 0.000, -1.000"
