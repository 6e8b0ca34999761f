"""Sanity: is the log what its description says, and does the answer look like one?"""

from steelyard.sanity.after import of_answer, of_rows, row_noise
from steelyard.sanity.before import examine
from steelyard.sanity.fitted.biases import drift_of, examine_room_bias
from steelyard.sanity.fitted.density import impossible_density, maybe_hollow
from steelyard.sanity.fitted.gravity import fitted_gravity, levelled
from steelyard.sanity.fitted.load_motion import examine_masses, examine_motion
from steelyard.sanity.fitted.misplaced import examine_place
from steelyard.sanity.fitted.no_body import examine_body, examine_wrench_unit
from steelyard.sanity.fitted.sensor_matrix import examine_sensor
from steelyard.sanity.fitted.yielding import allow_filter, allow_sag, allow_softness
from steelyard.sanity.one_body import one_body
from steelyard.sanity.rows.frozen_rows import dead_channels

__all__ = [
    "allow_filter",
    "allow_sag",
    "allow_softness",
    "dead_channels",
    "drift_of",
    "examine",
    "examine_body",
    "examine_masses",
    "examine_motion",
    "examine_place",
    "examine_room_bias",
    "examine_sensor",
    "examine_wrench_unit",
    "fitted_gravity",
    "impossible_density",
    "levelled",
    "maybe_hollow",
    "of_answer",
    "of_rows",
    "one_body",
    "row_noise",
]
