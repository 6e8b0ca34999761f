"""What each rule about a fit stands aside for: findings whose cause it would only see once more."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Literal

from steelyard.findings import Finding, codes

Rule = Literal["two masses", "place", "sag", "room bias", "motion", "sensor", "unit", "body"]

# Findings after which motion or wrench are no body's.
NO_BODY = frozenset({"weight-compensated", "motion-mismatch", "wrench-unexplained", "base-tilted", "force-unit"})
OF_SENSOR = frozenset({"sensor-turned", "gains-differ"})
ASIDE: dict[Rule, frozenset[str]] = {
    "two masses": NO_BODY,
    "place": NO_BODY,
    "sag": NO_BODY,
    "room bias": NO_BODY,
    "motion": NO_BODY | OF_SENSOR | {"bias-drift"},
    "sensor": NO_BODY - {"motion-mismatch", "force-unit"},
    "unit": NO_BODY - {"wrench-unexplained"},
    "body": NO_BODY | OF_SENSOR | {"noise-level-off"},
}


def stands_aside(rule: Rule, known: Iterable[Finding]) -> bool:
    """Tell whether what is known already says what the rule would look for."""
    return bool(codes(known) & ASIDE[rule])
