"""What an answer leaves unexplained of its log, row by row: the rows as fitted, less what they should read."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.identify.estimate import Estimate
from steelyard.logs.drift import SETTLING, STEADILY, settled_course
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.pipelines.options import DRIFT_ALLOWED, Options
from steelyard.pipelines.rows import GRAVITY_FOUND, since_start
from steelyard.pipelines.told_by_rows import rows_as_given
from steelyard.sanity.before import examine

# Residuals this many times those of the answer are not what it was made from.
OTHER = 2.0
# A median of sizes is this share of the root mean square, for normal noise.
MEDIAN = 0.6745


def left_over(recording: Recording, estimate: Estimate, tool: Estimate | None = None) -> tuple[MotionLog, Array]:
    """Return the rows of the recording, put right as `identify` does, and what is left (N, 6) of their wrenches.

    Times are since the first row of the wrench, as findings tell them.

    Channels that do not measure leave nothing.

    tool  what was taken away from the answer, and is in the log
    """
    examined, before = examine(recording)
    found = any(note.startswith(GRAVITY_FOUND) for note in estimate.notes)
    options = Options(gravity="unknown" if found else "given")
    recording, _, rows = rows_as_given(recording, examined, before, options)
    log = rows.whole
    vector = estimate.parameters.vector + (0.0 if tool is None else tool.parameters.vector)
    left = log.wrench - log.predicted(vector) - recording.wrench_sign * estimate.wrench_bias
    if any(note.startswith(DRIFT_ALLOWED) for note in estimate.notes) and log.time is not None:
        left = left - _drift(log.time, left)
    return since_start(log, recording), np.where(log.dead, 0.0, left)


def of_another_fit(estimate: Estimate, left: Array) -> bool:
    """Tell whether residuals (N, 6) are so much larger than the answer's that it was made from something else.

    Rows that the fit left out, touched ones, do not count: the median does not see them.
    """
    seen = estimate.evidence
    typical = np.median(np.abs(left.reshape(-1, 2, 3)), axis=(0, 2)) / MEDIAN
    said = np.array([seen.residual_torque_Nm, seen.residual_force_N])
    return bool((typical > OTHER * said + 1e-6).any())


def _drift(time: Array, left: Array) -> Array:
    """Return the drift (N, 6) that fits residuals best: the one that the fit took out."""
    span, size = float(np.ptp(time)), np.std(left, axis=0) + 1e-300
    courses = [settled_course(time, settling) for settling in (STEADILY, *(span * share for share in SETTLING))]
    drifts = [np.outer(course, course @ left / max(float(course @ course), 1e-300)) for course in courses]
    return min(drifts, key=lambda drift: float((((left - drift) / size) ** 2).sum()))
