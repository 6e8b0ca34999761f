"""What every test shares: one fixed Hypothesis profile, so that the same tree gives the same verdict."""

from __future__ import annotations

from hypothesis import settings

settings.register_profile("steelyard", derandomize=True, max_examples=25, deadline=None, database=None)
settings.load_profile("steelyard")
