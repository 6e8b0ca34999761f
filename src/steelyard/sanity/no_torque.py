"""A torque that the description declares "zero": that of a passive gimbal, which no sensor measured.

Exact zeros would pass for a perfect sensor, which finds every centre of mass in the origin of S. One body beneath one
gimbal hangs as it likes; what its torques are worth is told by no noise. So they tell nothing, and the centre of mass
is what the force shows of it in motion.
"""

from __future__ import annotations

from dataclasses import replace

from steelyard.errors import CannotAnswer
from steelyard.logs.recording import Recording

_UNTOLD = 'torque = "zero" tells nothing of the centre of mass'


def without_zero_torque(recording: Recording) -> Recording:
    """Return the recording with torques of exactly zero as dead channels, and a note.

    Raises CannotAnswer for tables at rest, whose forces tell the mass alone.
    """
    torques = [stream.channels["torque"] for stream in recording.streams if "torque" in stream.channels]
    if not torques or any(values.any() for values in torques):
        return recording
    if all(stream.poses for stream in recording.streams):
        raise CannotAnswer(
            f"{_UNTOLD}, and forces of still poses tell the mass alone. Give the columns of the torque, or a log of "
            "quick moves, in which the force shows it."
        )
    note = f"{_UNTOLD}: it is told by how the force follows the moves"
    return replace(recording, dead=(True, True, True, *recording.dead[3:]), notes=(*recording.notes, note))
