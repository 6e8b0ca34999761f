"""After the fit: what the rows, beside the answer, say of drift, units, sensor and motion."""

from __future__ import annotations

import numpy as np

from steelyard.check import Array
from steelyard.findings import Finding, codes, other_than
from steelyard.identify.estimate import Estimate
from steelyard.identify.room_bias import without
from steelyard.identify.scale import allow_scale
from steelyard.identify.tool import shares_bias
from steelyard.logs.alignment import Aligned
from steelyard.logs.log import MotionLog
from steelyard.logs.recording import Recording
from steelyard.pipelines.load import Load
from steelyard.pipelines.options import DRIFT_ALLOWED
from steelyard.pipelines.rows import FitRows
from steelyard.sanity.after import of_answer, of_rows, rotation_of, row_noise
from steelyard.sanity.aside import stands_aside
from steelyard.sanity.fitted.biases import drift_of, room_fit
from steelyard.sanity.fitted.gravity import levelled
from steelyard.sanity.fitted.load_motion import examine_masses, examine_motion
from steelyard.sanity.fitted.no_body import examine_body, examine_wrench_unit
from steelyard.sanity.fitted.sensor_matrix import examine_sensor
from steelyard.sanity.fitted.tether import MAYBE, Tether, examine_tether
from steelyard.sanity.fitted.yielding import allow_filter, allow_sag, allow_softness

# A sensor that is said to be tared is not where chance gives such a bias less often than this.
UNTARED = 1e-6
# Where an acceleration comes from that does not see the arm's structure bend.
ENCODERS = ("position", "linear_velocity")
# A share of the weight that changes the answer in proportion.
SMALL = 0.05
MAYBE_PLAY = "the sensor may have play where a delay was found: the bars hold the difference"


def looked_back(
    load: Load, estimate: Estimate, rows: FitRows, recording: Recording, before: tuple[Finding, ...]
) -> tuple[Load, Estimate, tuple[Finding, ...]]:
    """Return load and estimate, fitted anew with a bias that drifts where the rows surely show one, and what they show.

    before  what was found before the fit
    """
    drift = drift_of(load.log)
    late = of_rows(load.log, rows.aligned, recording.gravity, drift)
    steady = load.bias.free and not load.bias.drift
    if steady and drift and drift.sure and "base-tilted" not in codes(late):
        load, estimate = load.drifting(drift.settling).followed()
        estimate = estimate.noted(f"{DRIFT_ALLOWED}, {drift.way}, as the log shows (most surely {drift.surest_words})")
    late = (*late, *of_answer(load.log, estimate, recording))
    # What pulls along gravity is weight that is not accelerated.
    if not rows.unmeasured and rows.tether is None:
        late = (*late, *examine_masses(load.log, (*before, *late)))
    if load.shape is None:
        late = examine_wrench_unit(load.log, estimate, load.of, before, late)
    if untared := not_tared(load, estimate):
        late = (*untared, *other_than(late, "wrench-unexplained"))
    if any(f.left_in for f in before):
        # With a cause left in, rows only seem to lie in one plane.
        late = other_than(late, "nearly-planar")
    return load, estimate, late


def corrections_allowed(load: Load, estimate: Estimate, rows: FitRows) -> Estimate:
    """Return the estimate with bars that hold how well that is known which the rows are without: a bias that keeps its
    direction in the room, play of the sensor, and gravity's own direction where that was estimated.

    How a sensor's loop runs between its turns no log tells, nor what those who calibrated it took for its gain: bars
    hold all that its play moves the answer by, and that of each channel alone. Where it may be a delay as well they
    hold the difference.
    """
    log, rotation = load.log, rotation_of(load.log, rows.aligned)
    others: list[MotionLog] = []
    if rows.play is not None:
        others += [play.back(log) for play in (rows.play, *rows.play.by_channel)]
    if rows.unplayed is not None:
        others.append(rows.unplayed)
    if rotation is not None:
        biases = () if rows.room is None else rows.room.bias.errors()
        pulls = () if rows.level is None else rows.level.within
        others += [without(error, log, rotation) for error in biases]
        others += [levelled(log, rotation, gravity, rows.aligned.acceleration_from) for gravity in pulls]
    if rows.unplayed is not None:
        estimate = estimate.noted(MAYBE_PLAY)
    if rows.tether is not None and rotation is not None:
        estimate = estimate.allowing(*_moved_by_doubt(load, estimate, rows.tether, rotation))
    return estimate.allowing(*(load.of(other).parameters.vector - estimate.parameters.vector for other in others))


def _moved_by_doubt(load: Load, estimate: Estimate, tether: Tether, rotation: Array) -> tuple[Array, ...]:
    """Return by how much (10,) each that is not known of the pull of a hose may move the parameters of the load.

    What it may pull along gravity may be more than the load weighs: a small share of it tells what the whole does.
    """
    weight = estimate.mass * float(np.linalg.norm(load.log.gravity, axis=1).mean())
    share = min(1.0, SMALL * weight / tether.doubt)
    other = load.of(tether.doubted(load.log, rotation, share)).parameters.vector
    return ((other - estimate.parameters.vector) / share, *tether.moved.T)


def pull_allowed(
    load: Load, estimate: Estimate, rows: FitRows, recording: Recording, known: tuple[Finding, ...]
) -> Estimate:
    """Return the estimate with a note on what is likely to pull in the room, and bars that hold what a hose would do.

    One that is not beyond doubt is left in: bars hold the answer without it, and what is not known of its pull.

    known  all that was found so far
    """
    log, rotation, gravity = load.log, rotation_of(load.log, rows.aligned), recording.gravity
    aside = stands_aside("room bias", known) or any(f.left_in for f in known)
    if aside or rows.room is not None or rows.tether is not None or rotation is None or load.options.gravity != "given":
        return estimate
    seen, size = room_fit(log, rotation, gravity, load.bias.drift), float(np.linalg.norm(gravity))
    said = seen is not None and seen.pulls and np.linalg.norm(seen.force) >= size * estimate.std[0]
    notes = (seen.note(size),) if seen is not None and said else ()
    tether = None if rows.unmeasured else examine_tether(log, rows.aligned, gravity, False, load.bias.drift, MAYBE)
    if tether is None:
        return estimate.noted(*notes)
    plain, bare = load.estimate(), load.of(tether.put_right(log, rows.aligned))
    moved = _moved_by_doubt(load, plain, tether, rotation)
    estimate = estimate.allowing(bare.parameters.vector - plain.parameters.vector, *moved)
    return estimate.noted(*(notes or (tether.note,)))


def not_tared(load: Load, estimate: Estimate) -> tuple[Finding, ...]:
    """Return the finding that a sensor which is said to be tared reads something without a load, if it does."""
    freed = load.freed()
    if freed is None or shares_bias(estimate, freed)[1] > UNTARED:
        return ()
    torque, force = (float(np.abs(part).max()) for part in np.split(freed.wrench_bias, 2))
    left = f"from {estimate.evidence.residual_force_N:.2g} to {freed.evidence.residual_force_N:.2g} N rms"
    message = (
        f"The sensor is not tared: it reads up to {force:.2g} N and {torque:.2g} N m without a load. Where this bias "
        f"is estimated, what no body explains falls {left}, and the mass borne goes from {estimate.mass:.4g} to "
        f"{freed.mass:.4g} kg."
    )
    return (Finding("wrench-unexplained", message, "Leave out --bias none, or tare the sensor without a load before."),)


def of_sensor_and_body(
    load: Load, estimate: Estimate, rows: FitRows, recording: Recording, known: tuple[Finding, ...]
) -> tuple[Estimate, tuple[Finding, ...]]:
    """Return the estimate, its bars wide enough for what sensor and arm do to it, and findings about them.

    known  all that was found so far
    """
    estimate, found = examine_sensor(load.log, recording, estimate, known, load.bias.drift)
    # What a hose leaves beside its stiffness goes with the place, and so with accelerations.
    if not rows.unmeasured and rows.tether is None:
        found = (*found, *examine_motion(load.log, (*known, *found)))
    if load.shape is None:
        size, noise = float(np.linalg.norm(recording.gravity)), row_noise(load.log, recording, "torque")
        found = (*found, *examine_body(estimate, (*known, *found), size, noise))
        estimate = allow_sag(load.log, estimate, (*known, *found))
        if rows.aligned.acceleration_from in ENCODERS:
            estimate = allow_softness(load.log, estimate)
            estimate = allow_filter(load.log, estimate, rows.aligned.wrench_late_s)
    return allow_scale(estimate, _scale_std(recording, rows.aligned), load.shape is not None), found


def _scale_std(recording: Recording, aligned: Aligned) -> float:
    """Return the relative standard deviation of a - g: of gravity, and of an accelerometer that alone tells it."""
    alone = aligned.acceleration_from == "specific_force"
    gain = max((m.scale_std for m in aligned.mounts.values()), default=0.0) if alone else 0.0
    return float(np.hypot(recording.gravity_std, gain))
