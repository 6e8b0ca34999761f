"""Silent: a wrench channel that carries noise but does not follow the body that all others feel, or forces that do not
follow gravity at all: nothing is held, its weight is taken away, or the sensor is dead.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array
from steelyard.errors import CannotAnswer
from steelyard.findings import Finding
from steelyard.logs.recording import Recording
from steelyard.sanity.coverage import FEWEST, directions
from steelyard.sanity.readings.glance import Glance, glance
from steelyard.sanity.readings.static_fit import StaticFit, columns, solve

# A channel is silent where it varies less than this share (in rms) of what the body that the two axes beside it feel
# would give, and where no body explains all three: one leaves MISFIT of their variance, and without the channel less
# than LEFT of that. (Two axes alone may leave a body open, and then say nothing of the third.)
QUIET, MISFIT, LEFT = 0.1, 0.1, 0.1
# A smaller wrench [N m, N] is for no sensor to tell from none.
LEAST = (0.02, 0.5)

# Gravity explains less than this share of the force's variance, by a mass surely below this [kg].
EXPLAINED, LIGHTEST, SURE = 0.05, 0.005, 5.0
# No sensor's noise is below this [N].
FROZEN = 1e-9


def without_silent(recording: Recording) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with channels that follow nothing as dead ones, and a `channel-stuck` for each."""
    view = glance(recording)
    if view is None or view.rate is None or view.world or any(recording.dead):
        return recording, ()
    stream = next(s for s in recording.streams if {"force", "torque"} <= set(s.channels))
    turned = stream.turn is not None or stream.arm is not None
    rows = [] if turned else [(*_worst(view, recording.gravity, part), part) for part in (0, 1)]
    silent = [(axis, part, seen, due) for axis, seen, due, part in rows if seen < QUIET * due and due > LEAST[part]]
    dead, found = list(recording.dead), []
    for axis, part, seen, due in silent:
        dead[3 * part + axis] = True
        quantity, unit = (("Torque", "N m"), ("Force", "N"))[part]
        message = (
            f"{quantity} {'xyz'[axis]} of '{stream.name}' varies by {seen:.2g} {unit} rms where the body that the axes "
            f"beside it feel would give {due:.2g} {unit}; it was not used."
        )
        found.append(Finding.of("channel-stuck", message))
    return replace(recording, dead=tuple(dead)), tuple(found)


def _worst(view: Glance, gravity: Array, part: int) -> tuple[int, float, float]:
    """Return the axis of the torque (0) or the force (1) that varies least for its due, its rms and the rms due."""
    seen = view.seen(gravity, view.rotation)
    values, shown = seen.wrench[:, 3 * part : 3 * part + 3], columns(seen)[part]
    found: list[tuple[int, float, float]] = [(0, 1.0, 0.0)]
    together = solve(shown, values, view.block)[2]
    if together < MISFIT:
        return found[0]
    for axis in range(3):
        others = np.ones((3, 1))
        others[axis] = 0.0
        body, _, left = solve(shown * others, values * others[:, 0], view.block)
        if left < LEFT * together:
            found.append((axis, float(values[:, axis].std()), float((shown[:, axis] @ body).std())))
    return min(found, key=lambda f: f[1] / max(f[2], 1e-9))


def require_weight(view: Glance, gravity: Array, rotation: Array | None, found: StaticFit) -> None:
    """Raise CannotAnswer where gravity (3,) takes enough directions of S, and the force shows no weight."""
    most = abs(found.mass) + SURE * found.mass_std
    if any(view.dead) or found.force_share < 1 - EXPLAINED or most > LIGHTEST:
        return
    pull = view.seen(gravity, rotation).pull
    if not np.linalg.norm(pull, axis=1).any() or len(directions(pull)) < FEWEST:
        return
    spread = float(view.wrench[:, 3:].std(0).max())
    weight = f"varies by {spread:.2g} N rms, a weight of {1e3 * abs(found.mass):.2g} ± {1e3 * found.mass_std:.1g} g"
    raise CannotAnswer(
        f"The force shows no weight: gravity takes {len(directions(pull))} directions of S, and the force "
        f"{'stands still' if spread < FROZEN else weight}. Nothing is held, a controller takes the weight away (set "
        "its payload to zero), or the sensor or its driver is dead."
    )
