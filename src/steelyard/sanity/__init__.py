"""Sanity: is the log what its description says, and does the answer look like one?"""

from steelyard.sanity.after import after, drift_of, row_noise
from steelyard.sanity.before import examine
from steelyard.sanity.density import impossible_density, maybe_hollow
from steelyard.sanity.frozen_rows import dead_channels
from steelyard.sanity.gravity import fitted_gravity, levelled
from steelyard.sanity.misplaced import examine_place
from steelyard.sanity.no_body import examine_body, examine_wrench_unit
from steelyard.sanity.one_body import one_body
from steelyard.sanity.sensor_matrix import examine_sensor
from steelyard.sanity.slow_sensor import allow_filter
from steelyard.sanity.soft_arm import allow_softness
from steelyard.sanity.two_masses import examine_masses

__all__ = [
    "after",
    "allow_filter",
    "allow_softness",
    "dead_channels",
    "drift_of",
    "examine",
    "examine_body",
    "examine_masses",
    "examine_place",
    "examine_sensor",
    "examine_wrench_unit",
    "fitted_gravity",
    "impossible_density",
    "levelled",
    "maybe_hollow",
    "one_body",
    "row_noise",
]
