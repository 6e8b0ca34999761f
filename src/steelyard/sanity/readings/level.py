"""Level: force columns in another order, gravity in W as forces show it, and a turned sensor beside it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.findings import Finding, percent
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import Glance
from steelyard.sanity.readings.orders import order_of_forces
from steelyard.sanity.readings.rivals import LEVEL, MUCH_BETTER, STEEP, Reading, sign_of
from steelyard.sanity.readings.static_fit import StaticFit
from steelyard.sanity.readings.tilt import GlanceTilt, Turn, tilt_at_a_glance, turn_at_a_glance
from steelyard.sanity.words import axis_words, direction_words, mount_remedy, mounted, unexplained

# With fewer poses or stretches than this, a direction of gravity fits by chance.
FEWEST_BLOCKS = 6
# Gravity found this far off is corrected at once [rad].
CERTAIN_TILT = np.radians(2.0)
# A sensor mounted this much askew is worth a word [rad].
SENSOR_TURN = np.radians(10.0)


def examine_level(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with gravity along the direction that the wrench shows, where that is plainly another.

    A sensor that is turned is told of where it explains more, and left in.
    """
    if not _may_be_off(view, reading):
        return recording, ()
    tilt = tilt_at_a_glance(view, reading.gravity, view.rotation, reading.fit.mass)
    turned = turn_at_a_glance(view, reading.gravity, sign_of(view, reading))
    if turned is not None and _sensor_turned(turned, tilt, reading.fit):
        stream = next(s for s in recording.streams if "force" in s.channels)
        return recording, (_turned_finding(turned, reading.fit, stream),)
    if tilt is None or not _plain(tilt, reading.fit):
        return recording, ()
    # Gravity that stands in another frame is no tilt, and says nothing of one.
    unseen = tilt.length_std if tilt.angle < STEEP else 0.0
    length_std = float(np.hypot(recording.gravity_std, unseen))
    return replace(recording, gravity=tilt.gravity, gravity_std=length_std), (_tilted_finding(tilt),)


def examine_order(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with force columns in the order and with the signs that explain it, and what is said of it.

    Where another order explains nearly as much it is told of, and left in.
    """
    mixed = None
    if _may_be_off(view, reading):
        mixed = order_of_forces(recording, view, reading.gravity, reading.rotation)
    # Forces in W point down however they are read: the little that misread rotations leave, another order may take up.
    better = MUCH_BETTER**2 if "force" in view.world else MUCH_BETTER
    if mixed is None or mixed.left > min(better * reading.fit.force_share, 0.3):
        return recording, ()
    tilt = tilt_at_a_glance(view, reading.gravity, view.rotation, reading.fit.mass)
    turned = turn_at_a_glance(view, reading.gravity, sign_of(view, reading))
    # A turn of the columns explains as much as one of S, which the torques rule out.
    rivals = (tilt, turned if np.linalg.det(mixed.axes) < 0 else None)
    if any(rival is not None and mixed.left > 0.5 * rival.force_share for rival in rivals):
        return recording, ()
    return mixed.put_right(recording) if mixed.sure else recording, (mixed.finding(reading.fit.force_share),)


def _may_be_off(view: Glance, reading: Reading) -> bool:
    """Tell whether enough is left of the force, in enough poses or stretches, to look for other directions."""
    enough = int(view.block.max()) + 1 >= FEWEST_BLOCKS
    return enough and reading.rotation is not None and reading.fit.force_share >= LEVEL


def _turned_finding(turned: Turn, given: StaticFit, stream: Stream) -> Finding:
    message = (
        f"The wrench is turned by {np.degrees(turned.rotation.angle()):.0f} degrees against the frame whose "
        f"rotation is given: {mounted(stream, turned.rotation)}. So read, "
        f"{unexplained(turned.force_share, given.force_share, 'the force')}; the answer does not assume this."
    )
    return Finding("sensor-turned", message, mount_remedy(stream, turned.rotation), left_in=True)


def _tilted_finding(tilt: GlanceTilt) -> Finding:
    unseen = ""
    if tilt.blind is not None:
        unseen = f"; a tilt toward ({axis_words(tilt.blind)}) of W cannot be seen in this motion"
    message = (
        f"Gravity fits {np.degrees(tilt.angle):.1f} ± {np.degrees(tilt.angle_std):.1g} degrees off the direction "
        f"given, along ({direction_words(tilt.gravity)}) of W; the answer uses the direction found{unseen}."
    )
    if tilt.angle >= STEEP:
        return Finding.of("gravity-frame", message)
    if tilt.blind is not None:
        message += f" One as large there would move the mass by {percent(tilt.length_std)}, which its bar holds."
    share = percent(float(np.sin(tilt.angle)))
    pull = f"On a level base a pull of {share} of the weight looks the same, and the mass is then off by about as much."
    return Finding.of("base-tilted", f"{message} {pull}")


def _sensor_turned(turned: Turn, tilt: GlanceTilt | None, given: StaticFit) -> bool:
    """Tell whether a constant turn of S explains what neither the given nor a tilted gravity does."""
    return (
        turned.rotation.angle() > SENSOR_TURN
        and turned.force_share < min(MUCH_BETTER * given.force_share, 0.3)
        and (tilt is None or turned.force_share < 0.5 * tilt.force_share)
    )


def _plain(tilt: GlanceTilt, given: StaticFit) -> bool:
    """Tell whether the tilt is large, sure, and explains most of what the given direction leaves."""
    return (
        tilt.angle > max(CERTAIN_TILT, 5 * tilt.angle_std)
        and tilt.force_share < 0.4 * given.force_share
        and tilt.force_share < 0.3
        and tilt.torque_share < 1.1 * given.torque_share + 1e-3
    )
