"""An answer as text: str() and repr() of estimates."""

from __future__ import annotations

from steelyard.tables.estimate import estimate_table
from steelyard.tables.numbers import plus_minus
from steelyard.tables.shown import Carried, Weighed
from steelyard.tables.team import team_table


def in_words(estimate: Weighed) -> str:
    """Return the table of an answer, in plain text."""
    if isinstance(estimate, Carried):
        return team_table(estimate, f"What the team carries, in the grasp frame of {estimate.reference}")
    return estimate_table(estimate, f"What the robot holds, in the frame {estimate.frame}")


def in_a_line(estimate: Weighed) -> str:
    """Return mass, centre of mass, method and codes in one line."""
    mass, *com = (plus_minus(*each) for each in zip(
        estimate.parameters.people[:4] * (1, 1e3, 1e3, 1e3), estimate.std[:4] * (1, 1e3, 1e3, 1e3), ("kg", *3 * ["mm"]),
        strict=True,
    ))  # fmt: skip
    codes = ", ".join(dict.fromkeys(finding.code for finding in estimate.findings)) or "no findings"
    said = f"{mass}, com {', '.join(com)} in {estimate.frame}, {estimate.method}: {codes}"
    return f"<{type(estimate).__name__} {said}>"
