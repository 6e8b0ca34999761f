"""Torques that do not belong to the forces: other axes, another point, columns of another order or sign or the forces'
own, another unit.

At rest a torque is h x g for some first moment h of mass, so that axes, the point that torques are about, and most
orders of columns show. In motion the force shows h, too: how it follows the turning, beside the h of the torque, tells
sign and unit.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from steelyard.check import Array, frozen
from steelyard.findings import Finding
from steelyard.logs.recording import Recording, Stream
from steelyard.sanity.readings.glance import Glance, Seen, glance, in_axes
from steelyard.sanity.readings.levers import by_motion
from steelyard.sanity.readings.orders import Order, likeliest, orders
from steelyard.sanity.readings.rivals import BESIDE, Reading, best_rival, misread_rotations, outdone, reading_of
from steelyard.sanity.readings.rivals import MUCH_BETTER as RIVAL_BETTER
from steelyard.sanity.readings.static_fit import columns, fit, solve
from steelyard.sanity.words import unexplained

# Forces must fit so well before torques are judged; torques may be in another order where they leave more than the
# second share, and fit well where they leave less than the third.
FORCE, BAD, WELL = 0.1, 0.02, 0.1
# Where force and torque both were said to be in W, a reading that leaves more than this share is told from no other.
TOLD = 0.01
# Another order must leave this share of what the order as given leaves.
MUCH_BETTER = 0.1
# The force tells the sign of torques beyond so many standard deviations.
SURELY = 5.0
_FEWEST_ROWS = 6
# The ratio of both first moments must be known so well, and they lie so nearly along one line.
SURE, ALONG = 0.05, 0.2
OPPOSED = Finding(
    "force-unit",
    "The torques have the sign opposite to that of the forces: what turns shows the centre of mass on the other side "
    "of S. The answer assumes the sign of the forces.",
    "Turn the sign of the torques round where they are logged.",
)
WHICH = "Check order, form, unit and sense of the rotation, and the frame of the torque."
ABOUT_S = "Take position x force away from the torques, all in the axes of W, or log the wrench at the sensor."

# As given, the force leaves more than the first share of its variance; exchanged, less than the second, and the torque
# less than the third.
UNEXPLAINED, SWAPPED_WELL, SWAPPED_TORQUES = 0.5, 0.05, 0.3
_OTHER = {"force": "torque", "torque": "force"}


def examine_torques(recording: Recording, view: Glance, reading: Reading) -> tuple[Recording, tuple[Finding, ...]]:
    """Return a finding where torques, read otherwise, belong to the forces, and as given do not.

    Torques in other axes than they are said to be in, or a thousand times too small, leave no doubt: the recording is
    returned with them put right.
    """
    if any(view.dead) or len(view) < _FEWEST_ROWS:
        return recording, ()
    seen = view.seen(reading.gravity, reading.rotation)
    turned, forced = columns(seen)
    force, force_std, force_share = solve(forced, seen.wrench[:, 3:], view.block)
    moment, _, share = solve(turned, seen.wrench[:, :3], view.block)
    if force_share > FORCE:
        return recording, ()
    felt, felt_std = (force[1:4], force_std[1:4]) if seen.lever is not None else (np.zeros(3), np.zeros(3))
    if share > BAD:
        otherwise, findings = _elsewhere(recording, view, seen, turned, share, reading)
        if not findings:
            otherwise, findings = _ordered(recording, view, reading, share, felt, felt_std)
        if findings:
            return otherwise, findings
    if share >= WELL or seen.lever is None:
        return recording, ()
    ratio = _ratio(felt, float(np.linalg.norm(felt_std)), moment[:3])
    if ratio is None:
        return recording, ()
    # The other sign looks like positions of a tip as far behind the centre of mass: all rows tell them apart later.
    return by_motion(recording, view, reading.fit, *ratio)


def _elsewhere(
    recording: Recording, view: Glance, seen: Seen, turned: Array, share: float, reading: Reading
) -> tuple[Recording, tuple[Finding, ...]]:
    """Return what is said of torques in other axes, or about the origin of W, with the axes put right."""
    rotation = reading.rotation
    if rotation is None:
        return recording, ()
    axes = _in_other_axes(view, turned, reading)
    rivals = [axes, *((r.left, r.words) for r in misread_rotations(recording, view, reading))]
    fitting = sorted(rival for rival in rivals if rival[0] <= MUCH_BETTER * share)
    least = fitting[0][0] if fitting else 0.0
    doubtful = least > TOLD and view.world == {"torque", "force"}
    alike = [words for left, words in fitting if BESIDE * left < least or doubtful]
    if len(alike) > 1 or doubtful:
        text = (
            f"The torques fit one body where {'; or where '.join(alike)}: so read, "
            f"{unexplained(least, share)}. The answer does not assume this."
        )
        return recording, (Finding("wrench-unexplained", text, WHICH, left_in=True),)
    if fitting and fitting[0] == axes:
        text = f"T{axes[1][1:]}: so read, {unexplained(axes[0], share)}. The answer assumes this."
        remedy = f'Set frame = "{"S" if "torque" in view.world else "W"}" in the torque of this stream.'
        return in_axes(recording, view.world ^ {"torque"}), (Finding("gravity-frame", text, remedy),)
    if view.position is None:
        return recording, ()
    arm = view.smooth(np.einsum("nji,nj->ni", rotation, view.position))
    left = solve(turned, seen.wrench[:, :3] - np.cross(arm, seen.wrench[:, 3:]), view.block)[2]
    if left > MUCH_BETTER * share:
        return recording, ()
    text = (
        f"The torques are about the origin of W, not of S: so read, {unexplained(left, share)}; the answer does not "
        "assume this."
    )
    return recording, (Finding("wrench-unexplained", text, ABOUT_S, left_in=True),)


def _in_other_axes(view: Glance, turned: Array, reading: Reading) -> tuple[float, str]:
    """Return what torques in the other axes leave, S for W or W for S, and the words for it."""
    other = replace(view, world=view.world ^ {"torque"})
    left = solve(turned, other.seen(np.zeros(3), reading.rotation).wrench[:, :3], view.block)[2]
    return left, f"the torques are in the axes of {'W (the base)' if 'torque' in other.world else 'S'}"


def _ordered(
    recording: Recording, view: Glance, reading: Reading, share: float, felt: Array, std: Array
) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with torque columns in the order and sign that fit, and what is said of them.

    felt, std  (3,) first moment by the force, with its standard deviation
    """

    def along(order: Order) -> float:
        moment = order.solution[:3]
        side = float(moment @ felt)
        return side if abs(side) > SURELY * float(np.linalg.norm(moment * std)) else 0.0

    # Either sign fits as well: the force decides, or else fewer changes are likelier.
    ways = orders(recording, view, "torque", reading.gravity, reading.rotation)
    found = likeliest([way.times(float(np.sign(along(way) or way.axes.sum()))) for way in ways])
    if found.left > MUCH_BETTER * share:
        return recording, ()
    # Of a wrench in W a turn about gravity may be one of W itself: forces at rest do not show it.
    found = replace(found, sure=found.sure and not ("torque" in view.world and np.linalg.det(found.axes) > 0))
    doubt = ""
    if not along(found):
        doubt = "; the other sign of all three fits as well, with the centre of mass beyond the origin of S"
    return found.put_right(recording) if found.sure else recording, (found.finding(share, doubt),)


def _ratio(felt: Array, spread: float, moment: Array) -> tuple[float, float] | None:
    """Return how many times a first moment by force (3,) is that by torque, with its standard deviation.

    None where it is not known well, or where they do not lie along one line.
    """
    size = float(np.linalg.norm(moment))
    if spread > SURE * float(np.linalg.norm(felt)) or size == 0:
        return None
    ratio = float(felt @ moment) / size**2
    along = np.linalg.norm(felt - ratio * moment) <= ALONG * np.linalg.norm(felt)
    return (ratio, spread / size) if along else None


def opposed(ratio: float, std: float) -> tuple[Finding, ...]:
    """Return what is said where first moments by force and by torque, in this ratio, have opposite signs."""
    return (OPPOSED,) if abs(ratio + 1) < 0.1 + 3 * std else ()


def turned_round(recording: Recording) -> Recording:
    """Return the recording with torques of the other sign."""
    return recording.changed(
        lambda s: s.with_channels(torque=frozen(-s.channels["torque"])) if "torque" in s.channels else s
    )


def examine_swapped(recording: Recording, view: Glance) -> tuple[Recording, tuple[Finding, ...]]:
    """Return the recording with forces and torques exchanged where that explains both, and a finding."""
    if any(recording.dead) or view.mirrored is not None:
        return recording, ()
    given = fit(view.seen(recording.gravity, view.rotation), view.block)
    if given.force_share < UNEXPLAINED:
        return recording, ()
    other = recording.changed(_exchanged)
    seen = glance(other)
    if seen is None:
        return recording, ()
    found = fit(seen.seen(recording.gravity, seen.rotation), seen.block)
    if found.sign == 0 or found.force_share > SWAPPED_WELL or found.torque_share > SWAPPED_TORQUES:
        return recording, ()
    if _explained(recording, view, Reading("", recording.gravity, seen.rotation, found, view=seen)):
        return recording, ()
    text = (
        "Forces and torques are in each other's columns: exchanged, "
        f"{unexplained(found.force_share, given.force_share, 'the force')}. The answer assumes this."
    )
    remedy = "Exchange the columns of force and torque in the description."
    return other, (Finding("force-unit", text, remedy),)


def _explained(recording: Recording, view: Glance, exchanged: Reading) -> bool:
    """Tell whether the columns as they stand explain much more, with a turned sensor or rotations read otherwise.

    In turns about few axes a force in other axes leaves torques that follow gravity, too.
    """
    rival = best_rival(recording, view, reading_of(view, "", recording.gravity, view.rotation))
    better = rival is not None and rival.fit.force_share < RIVAL_BETTER * exchanged.fit.force_share
    return better or outdone(exchanged, view, recording.gravity)


def _exchanged(stream: Stream) -> Stream:
    """Return the stream with what is called force called torque, and the other way round."""
    if not _OTHER.keys() <= stream.channels.keys():
        return stream
    channels = {_OTHER.get(quantity, quantity): values for quantity, values in stream.channels.items()}
    frames = {_OTHER.get(quantity, quantity): frame for quantity, frame in stream.frames.items()}
    return replace(stream, channels=channels, frames=frames)
