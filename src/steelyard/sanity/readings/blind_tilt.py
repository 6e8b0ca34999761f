"""Blind tilt: where S turns about one axis only, the accelerometer still tells how much of gravity lies across it.

A tilt along the turning axis adds a constant to the force, which a free bias takes up. It also makes gravity sweep less
than its full size; an accelerometer of known gain shows that, and a few per cent of gain error look the same.
"""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding
from steelyard.sanity.axis_words import axis_words
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.static_fit import beside, solve
from steelyard.spatial import Rotation

# Gains of accelerometers are good to 3 %; a sweep further off, beyond five standard deviations, is a tilt (16 degrees).
GAIN, SURE, LEFT = 0.04, 5.0, 0.01


def blind_tilt(view: Glance, gravity: Array, blind: Array) -> tuple[Finding, ...]:
    """Return `base-tilted` where an accelerometer sees gravity sweep more or less than its direction (3,) in W says.

    blind  (3,) unit vector of W along which a tilt does not show in the force
    """
    if view.accelerometer is None or view.rotation is None:
        return ()
    seen = view.seen(gravity, view.rotation)
    felt, up = view.smooth(view.accelerometer), -(seen.pull - seen.pull.mean(0))
    turn = Rotation.aligning(up.T @ (felt - felt.mean(0)))
    gain, spread, left = solve(beside(up[:, :, None], seen.lever), felt @ turn.matrix.T, view.block)
    if abs(gain[0] - 1) < max(GAIN, SURE * spread[0]) or abs(gain[0] - 1) > 0.5 or left > LEFT:
        return ()
    size = float(np.linalg.norm(gravity))
    across = float(np.linalg.norm(gravity - blind * (blind @ gravity))) / size
    tilt = abs(np.arccos(min(across, 1.0)) - np.arccos(min(across * float(gain[0]), 1.0)))
    message = (
        f"Gravity sweeps {abs(gain[0] - 1) * 100:.1f} ± {spread[0] * 100:.1g} % {'more' if gain[0] > 1 else 'less'} in "
        f"the accelerometer than its direction in W says: a tilt of about {np.degrees(tilt):.0f} degrees toward or "
        f"from ({axis_words(blind)}) of W, unless the accelerometer's gain is off; the answer does not assume this."
    )
    return (Finding.of("base-tilted", message),)
